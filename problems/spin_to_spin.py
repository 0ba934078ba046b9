"""Bring a body that spins to another attitude and another spin, at the least effort of a torque.

The ends turn at rates that are given in body axes. The least effort is 0.290469349785 N^2 m^2 s at the
defaults, found by indirect shooting on Euler's equations as well.
"""

from dmoc import Attitude, Torque, TransferProblem, rotation


def problem(
    start_rate: tuple = (0.5, -0.3, 0.4),
    goal_rate: tuple = (0.0, 0.2, -0.1),
    degrees: float = 120.0,
    duration: float = 5.0,
):
    """The transfer.

    Parameters
    ----------
    start_rate, goal_rate : tuple [rad/s]
        Angular rates in body axes.
    degrees : float [degrees]
        Angle of the turn about the diagonal.
    duration : float [s]
        Time of the turn.
    """
    return TransferProblem(
        mass=1.0,
        inertia=(1.0, 2.0, 2.8),
        start=Attitude((1, 0, 0, 0), start_rate),
        goal=Attitude(rotation((1, 1, 1), degrees), goal_rate),
        duration=duration,
        actuator=Torque(),
    )
