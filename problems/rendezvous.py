"""Approach a station on a low circular orbit from one kilometre behind, least effort.

The Clohessy-Wiltshire equations: x points away from the Earth, y along the track, z along the
orbit's normal. Linear dynamics with a quadratic cost, so the optimum is known from the
controllability Gramian: 1.048842323e-3 N^2 s at the defaults. It grows with the square of the mass;
with 1 kg it is half the integral of the squared acceleration.

W. H. Clohessy, R. S. Wiltshire, Terminal guidance system for satellite rendezvous (1960).
"""

from dmoc import ClohessyWiltshire, State, TransferProblem


def problem(
    start: tuple = (200.0, -1000.0, 100.0),
    duration: float = 2400.0,
    mean_motion: float = 0.00113,
    mass: float = 1.0,
):
    """The transfer.

    Parameters
    ----------
    start : tuple [m]
        Where the chaser starts, at rest relative to the station.
    duration : float [s]
        Time of the transfer.
    mean_motion : float [rad/s]
        Angular rate of the station's orbit.
    mass : float [kg]
        Mass of the chaser.
    """
    return TransferProblem(
        mass=mass,
        start=State(start, (0, 0, 0)),
        goal=State((0, 0, 0), (0, 0, 0)),
        duration=duration,
        effects=[ClohessyWiltshire(mean_motion)],
    )
