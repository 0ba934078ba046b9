"""Turn a body by 120 degrees about its diagonal, from rest to rest, at the least effort of a torque.

A body with three different principal moments does not turn about one axis: what it does on the way it must
undo. The least effort is 0.753733560549 N^2 m^2 s at the defaults, found by indirect shooting on Euler's
equations as well. The problem is the attitude alone; the position of the body is in none of its equations.

The integrator is that of Z. R. Manchester and M. A. Peck, Quaternion variational integrators for spacecraft
dynamics (2016), at order 2.
"""

from dmoc import Attitude, Torque, TransferProblem, rotation


def problem(
    degrees: float = 120.0,
    axis: tuple = (1.0, 1.0, 1.0),
    inertia: tuple = (1.0, 2.0, 2.8),
    duration: float = 5.0,
):
    """The transfer.

    Parameters
    ----------
    degrees : float [degrees]
        Angle of the turn.
    axis : tuple [-]
        Axis of the turn, in body axes and in space axes alike.
    inertia : tuple [kg m^2]
        Principal moments of the body.
    duration : float [s]
        Time of the turn.
    """
    return TransferProblem(
        mass=1.0,
        inertia=inertia,
        start=Attitude((1, 0, 0, 0), rate=(0, 0, 0)),
        goal=Attitude(rotation(axis, degrees), rate=(0, 0, 0)),
        duration=duration,
        actuator=Torque(),
    )
