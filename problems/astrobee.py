"""Fly a free-flying robot from its dock to a viewing pose, past a sphere, within its limits.

Mass, inertia, forces and limits of rate are those of Astrobee, a robot of NASA on the Space Station: its fans
push with at most (0.849, 0.406, 0.486) N and a tenth of that in N m. Its camera, along the body x axis, keeps
off a lamp.

M. Bualat, T. Smith, E. Smith, T. Fong, D. Wheeler, Astrobee: a new tool for ISS operations (2018).
"""

from dmoc import KeepOut, PointingKeepOut, Pose, RateLimit, SpeedLimit, TransferProblem, Wrench, rotation


def problem(
    goal: tuple = (2.0, 1.2, 0.6),
    degrees: float = 140.0,
    duration: float = 30.0,
    radius: float = 0.55,
    lamp: float = 20.0,
):
    """The transfer.

    Parameters
    ----------
    goal : tuple [m]
        Place of the viewing pose.
    degrees : float [degrees]
        Turn to it about the vertical.
    duration : float [s]
        Time of the transfer.
    radius : float [m]
        Of the sphere in the way, with the robot's own 0.25 m.
    lamp : float [degrees]
        Half angle of the cone about the lamp that the camera stays out of.
    """
    return TransferProblem(
        mass=9.583788668,
        inertia=(0.153427995, 0.14271405, 0.162302759),
        start=Pose((0, 0, 0)),
        goal=Pose(goal, attitude=rotation((0, 0, 1), degrees)),
        duration=duration,
        actuator=Wrench((0.849, 0.406, 0.486), (0.0849, 0.0406, 0.0486), lever=0.1),
        constraints=[
            KeepOut((1.0, 0.6, 0.3), radius),
            SpeedLimit(0.2),
            RateLimit(0.1745),
            PointingKeepOut((1, 0, 0), (0.3, 1.0, 0.1), lamp),
        ],
    )
