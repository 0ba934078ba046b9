"""Fly a free-flyer through two gates at times of its own choice, at the least effort.

Without limits every leg is a cubic, so that one step of order 4 a leg is exact.
"""

from dmoc import Leg, Mission, State, Via


def problem(mass: float = 10.0, duration: float = 30.0, first: tuple = (2.0, 1.5), second: tuple = (4.5, -0.5)):
    """The flight.

    Parameters
    ----------
    mass : float [kg]
        Mass of the body.
    duration : float [s]
        Time of the flight.
    first : tuple [m]
        Place of the first gate.
    second : tuple [m]
        Place of the second gate.
    """
    leg = Leg((0.05 * duration, 0.9 * duration), order=4, steps=4)
    return Mission(
        mass=mass,
        start=State((0, 0), (0, 0)),
        goal=State((6, 1), (0, 0)),
        legs=[leg, Via(first), leg, Via(second), leg],
        duration=duration,
    )
