"""Move a cart along a line from rest to rest in the least time.

Full force forward over the first half, full force back over the second (Pontryagin): the least time
is 2 sqrt(m d / limit), 2 s at the defaults. The duration is looked for between a tenth of
sqrt(m d / limit) and ten times it.
"""

import math

from dmoc import BoxForce, State, Time, TransferProblem


def problem(distance: float = 1.0, limit: float = 1.0, mass: float = 1.0):
    """The transfer.

    Parameters
    ----------
    distance : float [m]
        How far the cart goes.
    limit : float [N]
        Largest force, forward and back.
    mass : float [kg]
        Mass of the cart.
    """
    scale = math.sqrt(mass * abs(distance) / limit)
    return TransferProblem(
        mass=mass,
        start=State([0], [0]),
        goal=State([distance], [0]),
        duration=(0.1 * scale, 10 * scale),
        actuator=BoxForce(limit),
        objective=Time(),
    )
