"""Fly from the Earth to the asteroid Dionysus with a small engine, least fuel.

A spacecraft of 4000 kg leaves the Earth's orbit, without excess speed, and is to meet Dionysus, on an orbit of
eccentricity 0.54 inclined by 14 degrees, 3534 days and five revolutions around the Sun later. Its engine
makes 0.32 N at most at a specific impulse of 3000 s; it burns six times, mostly around perihelia, and
coasts for three fifths of the time. SI units; only the Sun attracts. There are many local optima: 2718 kg is
the best one known, other guesses led others to 2555 and 1979 kg; see `dmoc solve dionysus --starts 5`.

No guess is given: the program lets the orbit change evenly from the one to the other, and keeps near that
path until the thrust is within its limit. Five revolutions take 104 steps of order 6.

Optimum at the defaults: 2718.36 kg of 4000 kg at the end; 2718.31 kg with 400 steps of order 6, 2718.32 kg
with 800 of order 4, less than 0.03 kg of which is what |F|, rounded at zero, burns while coasting.
Published: 2718.340 kg, with these elements, in the example of that name of ASSET (AlabamaASRL/asset_asrl).
"""

import numpy as np

from dmoc import Engine, FinalMass, PointGravity, State, TransferProblem

MU, AU, DAY = 1.32712440018e20, 1.495978707e11, 86400.0
# modified equinoctial elements p [AU], f, g, h, k, L [rad]
EARTH = (0.99969, -0.00376, 0.01628, -7.702e-6, 6.188e-7, 14.161)
DIONYSUS = (1.5536, 0.15303, -0.51994, 0.01618, 0.11814, 46.3302)


def state(p, f, g, h, k, L):
    """Position [m] and velocity [m/s]."""
    cos, sin, square = np.cos(L), np.sin(L), 1 + h * h + k * k
    first = np.array([1 + h * h - k * k, 2 * h * k, -2 * k]) / square
    second = np.array([2 * h * k, 1 - h * h + k * k, 2 * h]) / square
    position = p * AU / (1 + f * cos + g * sin) * (first * cos + second * sin)
    return position, np.sqrt(MU / (p * AU)) * (second * (f + cos) - first * (g + sin))


def problem(days: float = 3534.0, mass: float = 4000.0, thrust: float = 0.32, specific_impulse: float = 3000.0):
    """The transfer.

    Parameters
    ----------
    days : float [d]
        Time of the transfer.
    mass : float [kg]
        Mass at the start.
    thrust : float [N]
        Largest thrust.
    specific_impulse : float [s]
        Specific impulse of the engine.
    """
    return TransferProblem(
        mass=mass,
        start=State(*state(*EARTH)),
        goal=State(*state(*DIONYSUS)),
        duration=days * DAY,
        effects=[PointGravity(MU)],
        actuator=Engine(thrust, specific_impulse=specific_impulse),
        objective=FinalMass(),
    )
