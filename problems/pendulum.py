"""Swing a pendulum from hanging to upright in a given time, at the least effort of a force on its bob."""

from dmoc import Rod, State, TransferProblem, UniformGravity


def problem(duration=5.0, length=1.0, gravity=1.0):
    """A bob of 1 kg on a rod without mass, at rest at both ends.

    Parameters
    ----------
    duration : float
        Time of the swing [s].
    length : float
        Length of the rod [m].
    gravity : float
        Downwards [m/s^2].
    """
    return TransferProblem(
        mass=1.0,
        start=State((0, -length), (0, 0)),
        goal=State((0, length), (0, 0)),
        duration=duration,
        effects=[UniformGravity((0, -gravity))],
        links=[Rod((0, 0), length)],
    )
