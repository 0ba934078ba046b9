"""Fly a small quadrotor from the ground to a roof, least effort.

A drone of about one kilogram under gravity and a drag in proportion to its speed (rotor drag; the
body's own is small below 10 m/s). Its thrust, in any direction, is at most one and a half times its
weight; it is at that limit for the first half second. Optimum at the defaults: 211.4604947 N^2 s
(indirect shooting: the costate of the velocity is a constant plus an exponential, the thrust is that
costate over the mass, reversed and cut off at the limit).
"""

from dmoc import BallForce, LinearDrag, State, TransferProblem, UniformGravity


def problem(
    goal: tuple = (12.0, 5.0, 6.0),
    duration: float = 3.0,
    mass: float = 1.0,
    limit: float = 15.0,
    drag: float = 0.3,
):
    """The transfer.

    Parameters
    ----------
    goal : tuple [m]
        The roof, with z up; the drone starts at rest in the origin.
    duration : float [s]
        Time of the flight.
    mass : float [kg]
        Mass of the drone.
    limit : float [N]
        Largest thrust.
    drag : float [N s/m]
        Drag force per speed.
    """
    return TransferProblem(
        mass=mass,
        start=State((0, 0, 0), (0, 0, 0)),
        goal=State(goal, (0, 0, 0)),
        duration=duration,
        effects=[UniformGravity((0, 0, -9.81)), LinearDrag(drag)],
        actuator=BallForce(limit),
    )
