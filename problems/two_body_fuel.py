"""Change orbit around a point mass with a small engine, least fuel.

Canonical units: gravitational parameter 1, mass at the start 1. One and a half revolutions; the
engine burns four times at full thrust, 2.04 of the 11 units of time, and coasts in between.

Optimum at the defaults: 0.0767810993 kg, a final mass of 0.9232189 (indirect shooting over the
switching times, residual 1e-14). The published final mass 0.919694 is for ten segments of constant
thrust each, which is another problem: solved that way it is 0.91970, with twenty segments 0.92222
and with forty 0.92292.
"""

from dmoc import Engine, Fuel, PointGravity, State, TransferProblem


def problem(
    duration: float = 11.0, thrust: float = 0.037098971584147, exhaust_velocity: float = 0.98775405042502
):
    """The transfer.

    Parameters
    ----------
    duration : float [s]
        Time of the transfer.
    thrust : float [N]
        Largest thrust.
    exhaust_velocity : float [m/s]
        Exhaust velocity of the engine.
    """
    return TransferProblem(
        mass=1.0,
        start=State((1.2, 0, -0.01), (0.01, 1, -0.01)),
        goal=State((1, 0, 0), (0.01, 1.1, 0)),
        duration=duration,
        effects=[PointGravity(mu=1.0)],
        actuator=Engine(thrust, exhaust_velocity=exhaust_velocity, smoothing=2e-6),
        objective=Fuel(),
    )
