"""Lambert's problem: the coasts around a point mass that lead from one place to another in a given time.

References
----------
E. R. Lancaster, R. C. Blanchard, A unified form of Lambert's theorem, NASA TN D-5368 (1969).
D. Izzo, Revisiting Lambert's problem, Celest. Mech. Dyn. Astron. 121 (2015).
"""

from __future__ import annotations

import numpy as np

# Householder's iterations for x: three to five reach rounding.
ITERATIONS = 8
# An x is a root if the time of flight is met to this part of it [-].
MET = 1e-9
# So near x = 1 the series for the parabola is taken.
NEARLY = 1e-2


def lambert(
    mu: float,
    start: np.ndarray,
    goal: np.ndarray,
    duration: np.ndarray,
    normal: np.ndarray,
    turns: int = 0,
    slow: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """Velocities at both ends of coasts around a point mass at the origin, many at once.

    Parameters
    ----------
    mu : float
        Gravitational parameter [m^3/s^2].
    start, goal : arrays, shape (count, 3)
        Places [m].
    duration : array, shape (count,)
        [s].
    normal : array, shape (count, 3) or (3,)
        The sense of the motion: about this direction the angular momentum is positive.
    turns : int
        Whole revolutions.
    slow : bool
        Of the two coasts with whole revolutions the one whose x is smaller, which goes out further.

    Returns
    -------
    v0, v1 : arrays, shape (count, 3)
        [m/s]; NaN where there is no such coast.
    """
    start, goal, normal = np.broadcast_arrays(
        *(np.atleast_2d(each).astype(float) for each in (start, goal, normal))
    )
    near, far = np.linalg.norm(start, axis=1), np.linalg.norm(goal, axis=1)
    chord = np.linalg.norm(goal - start, axis=1)
    half = 0.5 * (near + far + chord)
    up = np.cross(start, goal)
    sense = np.where(np.sum(up * normal, axis=1) >= 0, 1.0, -1.0)
    with np.errstate(all="ignore"):
        lam = sense * np.sqrt(np.maximum(1 - chord / half, 0.0))
        time = np.sqrt(2 * mu / half**3) * duration
        x = _root(lam, time, turns, slow)
        y = np.sqrt(1 - lam**2 * (1 - x**2))
        gamma, rho = np.sqrt(0.5 * mu * half), (near - far) / chord
        across = gamma * np.sqrt(1 - rho**2) * (y + lam * x)
        out = gamma * ((lam * y - x) - rho * (lam * y + x)) / near
        back = -gamma * ((lam * y - x) + rho * (lam * y + x)) / far
        axis = sense[:, None] * up / np.linalg.norm(up, axis=1, keepdims=True)
        first, last = start / near[:, None], goal / far[:, None]
        v0 = out[:, None] * first + (across / near)[:, None] * np.cross(axis, first)
        v1 = back[:, None] * last + (across / far)[:, None] * np.cross(axis, last)
    return v0, v1


def _flight_time(x: np.ndarray, lam: np.ndarray, turns: int) -> np.ndarray:
    """The time of flight as a function of x, dimensionless; x = 1 is the parabola (Izzo 2015, eq. 18)."""
    inside = 1 - x**2
    y = np.sqrt(1 - lam**2 * inside)
    ellipse = np.arccos(np.clip(x * y + lam * inside, -1.0, 1.0))
    hyperbola = np.arcsinh((y - x * lam) * np.sqrt(np.maximum(-inside, 0.0)))
    root = np.sqrt(np.abs(inside))
    angle = np.where(inside > 0, (ellipse + turns * np.pi) / root, hyperbola / root)
    plain = (angle - x + lam * y) / inside
    # Near the parabola both terms cancel: Battin's series takes over.
    eta = y - lam * x
    z = 0.5 * (1 - lam - x * eta)
    series = np.ones_like(z)
    term = np.ones_like(z)
    for n in range(12):
        term = term * (3 + n) * (1 + n) / ((2.5 + n) * (n + 1)) * z
        series = series + term
    parabola = 0.5 * (eta**3 * 4 / 3 * series + 4 * lam * eta)
    return np.where((np.abs(x - 1) < NEARLY) & (turns == 0), parabola, plain)


def _slopes(x: np.ndarray, lam: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three derivatives of the time of flight by x (Izzo 2015, eq. 22)."""
    inside = 1 - x**2
    y = np.sqrt(1 - lam**2 * inside)
    first = (3 * time * x - 2 + 2 * lam**3 * x / y) / inside
    second = (3 * time + 5 * x * first + 2 * (1 - lam**2) * lam**3 / y**3) / inside
    third = (7 * x * second + 8 * first - 6 * (1 - lam**2) * lam**5 * x / y**5) / inside
    return first, second, third


def _root(lam: np.ndarray, time: np.ndarray, turns: int, slow: bool) -> np.ndarray:
    """x at which the time of flight is as given; NaN where there is none."""
    x = _first_guess(lam, time, turns, slow)
    for _ in range(ITERATIONS):
        flown = _flight_time(x, lam, turns)
        first, second, third = _slopes(x, lam, flown)
        gap = flown - time
        step = gap * (first**2 - 0.5 * gap * second)
        step = step / (first * (first**2 - gap * second) + third * gap**2 / 6)
        x = x - np.where(np.isfinite(step), step, 0.0)
        x = np.maximum(x, 1e-12 - 1) if turns == 0 else np.clip(x, 1e-12 - 1, 1 - 1e-12)
    met = np.abs(_flight_time(x, lam, turns) - time) <= MET * time
    return np.where(met, x, np.nan)


def _first_guess(lam: np.ndarray, time: np.ndarray, turns: int, slow: bool) -> np.ndarray:
    """x to start from (Izzo 2015, eqs. 30 and 31)."""
    if turns:
        ratio = (np.pi * (turns + 1) / (8 * time) if slow else 8 * time / (np.pi * turns)) ** (2 / 3)
        return (ratio - 1) / (ratio + 1)
    straight = np.arccos(np.clip(lam, -1.0, 1.0)) + lam * np.sqrt(1 - lam**2)
    parabola = 2 / 3 * (1 - lam**3)
    low = (straight / time) ** (2 / 3) - 1
    high = 2.5 * parabola * (parabola - time) / (time * (1 - lam**5)) + 1
    between = (straight / time) ** (np.log(2) / np.log(straight / parabola)) - 1
    return np.where(time >= straight, low, np.where(time < parabola, high, between))
