"""Move a free body from rest to rest, least effort.

Nothing acts on the body but its own force. The optimum is a cubic in time with the force linear in
it: 6 m^2 d^2 / T^3 [N^2 s] for the distance d in the time T, 0.0577 N^2 s at the defaults.
"""

from dmoc import State, TransferProblem


def problem(goal: tuple = (3.0, 4.0, 12.0), duration: float = 26.0, mass: float = 1.0):
    """The transfer.

    Parameters
    ----------
    goal : tuple [m]
        Where the body comes to rest; it starts at rest in the origin.
    duration : float [s]
        Time of the transfer.
    mass : float [kg]
        Mass of the body.
    """
    still = (0.0,) * len(goal)
    return TransferProblem(
        mass=mass,
        start=State(still, still),
        goal=State(goal, still),
        duration=duration,
    )
