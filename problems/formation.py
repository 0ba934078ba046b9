"""Close up on a partner in formation flight inside an approach cone, least effort.

The Clohessy-Wiltshire equations: x points away from the Earth, y along the track, z along the
orbit's normal. A chaser of 50 kg comes from behind and must stay in the cone that opens from the
port of its partner against the track; it meets the port at 5 cm/s. Without the cone it would swing
out to 37 degrees; with it, it touches the surface for two fifths of the time.

Optimum at the defaults: 4.0624844 N^2 s (orders 2, 4 and 8 agree); without the cone 3.4079 N^2 s.
"""

import math

from dmoc import ApproachCone, BallForce, ClohessyWiltshire, State, TransferProblem


def problem(
    start: tuple = (-90.0, -400.0, 40.0),
    duration: float = 900.0,
    half_angle: float = math.radians(15),
    mean_motion: float = 0.00113,
    mass: float = 50.0,
    limit: float = 1.0,
):
    """The transfer.

    Parameters
    ----------
    start : tuple [m]
        Where the chaser starts, at rest relative to its partner.
    duration : float [s]
        Time of the transfer.
    half_angle : float [rad]
        Between the axis of the cone and its surface.
    mean_motion : float [rad/s]
        Angular rate of the partner's orbit.
    mass : float [kg]
        Mass of the chaser.
    limit : float [N]
        Largest thrust, in any direction.
    """
    return TransferProblem(
        mass=mass,
        start=State(start, (0, 0, 0)),
        goal=State((0, 0, 0), (0, 0.05, 0)),
        duration=duration,
        effects=[ClohessyWiltshire(mean_motion)],
        actuator=BallForce(limit),
        constraints=[ApproachCone((0, 0, 0), (0, -1, 0), half_angle)],
    )
