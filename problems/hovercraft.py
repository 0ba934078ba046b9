"""Drive a hovercraft through four gates and stop behind them, in the least time.

A hovercraft of 10 kg with a thruster it can turn, on a floor 7 m wide. Each gate is the gap between
two round pillars; the straight line runs through two of the pillars. Full thrust all the way: it
swings around the pillars, touching four of them.

Optimum at the defaults: 10.97479 s (3200 steps of order 2, from below with forces at the nodes and
from above with held ones).
"""

from dmoc import BallForce, KeepIn, KeepOut, LinearDrag, State, Time, TransferProblem

GATES = ((5.0, 2.0), (11.0, -2.0), (17.0, 1.5), (22.0, -1.0))
PILLAR = 2.5


def problem(opening: float = 1.0, limit: float = 20.0, mass: float = 10.0, drag: float = 2.0):
    """The transfer.

    Parameters
    ----------
    opening : float [m]
        Width of the gates.
    limit : float [N]
        Largest thrust, in any direction.
    mass : float [kg]
        Mass of the hovercraft.
    drag : float [N s/m]
        Drag force per speed.
    """
    aside = 0.5 * opening + PILLAR
    return TransferProblem(
        mass=mass,
        start=State((0, 0), (0, 0)),
        goal=State((27, 0), (0, 0)),
        duration=(1.0, 100.0),
        effects=[LinearDrag(drag)],
        actuator=BallForce(limit),
        objective=Time(),
        constraints=[
            KeepIn((-1.0, -3.5), (28.0, 3.5)),
            *(KeepOut((x, y + side), PILLAR) for x, y in GATES for side in (-aside, aside)),
        ],
    )
