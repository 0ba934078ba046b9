"""Turn back with the least effort from a speed of 1 to a speed of -1 at the same place, below a ceiling.

Bryson and Denham's problem: the path stays below the ceiling, touches it, or follows it for a while.

Optimum: 4 / (9 ceiling) for a ceiling up to 1/6, 4 at the defaults. Steps do not end where the path meets the
ceiling; with `--structure` its three arcs become legs, and the answer is right to rounding.

A. E. Bryson, W. F. Denham, S. E. Dreyfus, AIAA Journal 1 (1963) 2544.
"""

from math import inf

from dmoc import KeepIn, State, TransferProblem


def problem(ceiling: float = 1 / 9, duration: float = 1.0):
    """The way there and back.

    Parameters
    ----------
    ceiling : float [m]
        Largest distance from the start.
    duration : float [s]
        Time to be back.
    """
    return TransferProblem(
        mass=1.0,
        start=State((0,), (1,)),
        goal=State((0,), (-1,)),
        duration=duration,
        constraints=[KeepIn((-inf,), (ceiling,))],
    )
