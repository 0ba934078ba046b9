"""Rendezvous with a target 0.35 rad ahead on the same orbit, at any time between 10,000 s and 26,000 s."""

from dmoc import BallForce, Fuel, Moving, PointGravity, TransferProblem, kepler_motion

MU = 3.986004418e14


def problem(shortest: float = 10000.0, longest: float = 26000.0, eccentricity: float = 0.0) -> TransferProblem:
    """Least fuel.

    shortest, longest : float [s]
    eccentricity : float [-]
    """
    start, target = (kepler_motion(MU, 12e6, eccentricity, 0.5, 0.3, 0.2, at) for at in (0.0, 0.35))
    return TransferProblem(
        mass=100.0,
        start=Moving(start),
        goal=Moving(target),
        duration=(shortest, longest),
        effects=[PointGravity(MU)],
        actuator=BallForce(50.0),
        objective=Fuel(),
    )
