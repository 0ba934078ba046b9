"""Dock with a target that tumbles: meet its port with its velocity, its attitude and its rate.

The target turns about a fixed axis of space, as a round body does; its port is a metre from its centre. The
chaser comes in through a cone about the axis of the port, which turns with the target, and goes round the body
of the target.
"""

import casadi as ca

from dmoc import ApproachCone, KeepOut, Moving, Pose, TransferProblem, Wrench


def problem(
    rate: float = 0.05,
    start: tuple = (-6.0, -2.0, 1.0),
    duration: float = 40.0,
    half_angle: float = 0.6,
):
    """The transfer.

    Parameters
    ----------
    rate : float [rad/s]
        Angular rate of the target about the z axis.
    start : tuple [m]
        Where the chaser rests at the start, from the centre of the target.
    duration : float [s]
        Time of the transfer.
    half_angle : float [rad]
        Of the cone about the axis of the port.
    """

    def outward(t):
        return ca.vertcat(-ca.cos(rate * t), -ca.sin(rate * t), 0)

    def port(t):
        return 1.0 * outward(t)

    def turned(t):
        return ca.vertcat(ca.cos(rate * t / 2), 0, 0, ca.sin(rate * t / 2))

    return TransferProblem(
        mass=10.0,
        inertia=(0.5, 0.6, 0.7),
        start=Pose(start),
        goal=Moving(port, attitude=turned),
        duration=duration,
        actuator=Wrench(0.3, 0.05),
        constraints=[ApproachCone(lambda t: 0.5 * outward(t), outward, half_angle), KeepOut((0, 0, 0), 0.9)],
    )
