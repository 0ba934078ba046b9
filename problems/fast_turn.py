"""Turn a ball by half a turn in the least time, with a torque that is limited about each axis.

The fastest turn is not the one about the axis of the turn, which takes 2 sqrt(pi) = 3.5449 s: the body nods on
the way, and takes 3.243083 s (published to four digits; here from its switching times).

K. D. Bilimoria, B. Wie, Time-optimal three-axis reorientation of a rigid spacecraft, J. Guid. Control Dyn. 16
(1993).
"""

from dmoc import Attitude, Time, Torque, TransferProblem, rotation


def problem(degrees: float = 180.0, torque: float = 1.0, inertia: float = 1.0):
    """The transfer.

    Parameters
    ----------
    degrees : float [degrees]
        Angle of the turn about the z axis.
    torque : float [N m]
        Largest torque about each body axis.
    inertia : float [kg m^2]
        Moment of the ball.
    """
    scale = (inertia / torque) ** 0.5
    return TransferProblem(
        mass=1.0,
        inertia=(inertia, inertia, inertia),
        start=Attitude((1, 0, 0, 0)),
        goal=Attitude(rotation((0, 0, 1), degrees)),
        duration=(0.1 * scale, 20.0 * scale),
        actuator=Torque(torque),
        objective=Time(),
    )
