"""Fly a free-flying robot past three obstacles inside a space station, least effort.

A body of 10 kg with a cold-gas thruster pair on each axis goes from rest to rest past three spheres.
The straight line runs through all of them, so there are several local optima: 0.86242 N^2 s is the
one next to the straight line, from which the solve starts; 0.83690 N^2 s passes on the other side.
Both are from 1600 steps of order 2; without the obstacles the optimum is 0.61875 N^2 s.
"""

from dmoc import BoxForce, KeepOut, State, TransferProblem

OBSTACLES = ((2.0, 0.2, 0.2), (4.2, 0.9, 0.4), (6.0, 0.4, 1.0))


def problem(duration: float = 40.0, mass: float = 10.0, limit: float = 0.6, radius: float = 1.0):
    """The transfer.

    Parameters
    ----------
    duration : float [s]
        Time of the transfer.
    mass : float [kg]
        Mass of the robot.
    limit : float [N]
        Largest force along each axis.
    radius : float [m]
        Radius of the three obstacles, the robot's own size included.
    """
    return TransferProblem(
        mass=mass,
        start=State((0, 0, 0), (0, 0, 0)),
        goal=State((8, 1, 1), (0, 0, 0)),
        duration=duration,
        actuator=BoxForce(limit),
        constraints=[KeepOut(center, radius) for center in OBSTACLES],
    )
