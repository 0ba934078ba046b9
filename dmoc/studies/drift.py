"""What simulation costs over many revolutions: drift of energy and angular momentum against time."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import field

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, number, of_kind, whole
from dmoc.basics.numerics import coefficients, columns
from dmoc.basics.records import dataclass
from dmoc.effects.gravity import PointGravity
from dmoc.ends.base import State
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.step import step_map, weighted
from dmoc.scene.problem import TransferProblem

# The name of the integrator that chooses its steps itself.
ADAPTIVE = "DOP853, adaptive"
# By method, how many fixed steps a revolution takes on an orbit of eccentricity 0.3; for `ADAPTIVE` relative
# tolerances instead. The counts are such that errors and times of all methods overlap.
PER_REVOLUTION: dict[str, Sequence[float]] = {
    "order 2": (100, 300, 900),
    "order 4": (30, 60, 120),
    "order 6": (20, 40, 80),
    "order 8": (10, 20, 40),
    "RK4": (100, 300, 900),
    "DOP853": (10, 20, 40),
    ADAPTIVE: (1e-9,),
}
# A history has this many points at most: a curve in a picture needs no more. No error is lost between two
# points, since each holds the largest error so far.
HISTORY_POINTS = 200


@dataclass(frozen=True)
class Drift:
    """One integrator, coasting: how well it keeps what the motion conserves, and what it takes.

    Attributes
    ----------
    method : str
    steps : float
        Steps a revolution.
    revolutions : float
    energy_error, momentum_error : float
        Largest change of energy and of angular momentum, relative to their size [-]; NaN where there
        is no angular momentum to keep.
    growth : float
        Largest energy error of the last tenth of the revolutions over that of the first: near 1 where
        the energy only oscillates, near 10 where it drifts [-].
    seconds : float
        Seconds a revolution, without building the step.
    history : array, shape (3, count)
        Revolutions so far, from the first on, and the largest energy and angular momentum errors until then.
    """

    method: str
    steps: float
    revolutions: float
    energy_error: float
    momentum_error: float
    growth: float
    seconds: float
    history: np.ndarray = field(repr=False, compare=False)


def kepler(eccentricity: float) -> TransferProblem:
    """One revolution of an orbit of semi-major axis 1 around a point mass of mu = 1, from its periapsis."""
    e = number("eccentricity", eccentricity, "-", nonnegative=True)
    if e >= 1:
        raise ValueError(f"eccentricity must be less than 1 for an orbit that closes; got {e:g}")
    here = State((1 - e, 0), (0, np.sqrt((1 + e) / (1 - e))))
    return TransferProblem(1.0, here, here, 2 * np.pi, effects=(PointGravity(1.0),), name=f"e = {e:g}")


def per_revolution(eccentricity: float) -> dict[str, Sequence[float]]:
    """`PER_REVOLUTION` for an orbit of another eccentricity: the periapsis is passed as finely as at e = 0.3.

    Orbits rounder than that take the same counts.
    """
    # a passage at radius r takes a time in proportion to r^1.5, and r is 1 - e: at e = 0.3 it is 0.7
    finer = max(1.0, (0.7 / (1 - eccentricity)) ** 1.5)
    return {
        name: counts if name == ADAPTIVE else tuple(round(count * finer) for count in counts)
        for name, counts in PER_REVOLUTION.items()
    }


def drift(
    problem: TransferProblem,
    revolutions: float = 1000,
    methods: Mapping[str, Sequence[float]] | None = None,
    period: float | None = None,
) -> list[Drift]:
    """Coast from the start of a problem by several integrators, each with several numbers of steps.

    The schemes and the explicit Runge-Kutta methods march with fixed steps, each in one loop inside
    CasADi. "DOP853, adaptive" is SciPy's own loop in Python around the same equations of motion.

    Parameters
    ----------
    problem : TransferProblem
        Its start, a state without free entries, and its effects are used; for example `kepler(0.3)`.
    revolutions : float
    methods : mapping, optional
        Steps a revolution by name: "order 2" to "order 8", "RK4", "DOP853"; for "DOP853, adaptive"
        relative tolerances. `PER_REVOLUTION` if not given.
    period : float, optional
        Of one revolution [s]; that of the orbit around the first PointGravity if not given.

    Raises
    ------
    ValueError
        If the start has free entries, the period is not known, or there is no such method.
    """
    of_kind("problem", problem, TransferProblem)
    revolutions = number("revolutions", revolutions, "-", positive=True)
    if np.isnan(problem.start.fixed()).any():
        raise ValueError(f"drift needs a start without free entries; got {problem.start.words()}")
    chosen = PER_REVOLUTION if methods is None else methods
    for name, choices in of_kind("methods", chosen, Mapping).items():
        if name not in PER_REVOLUTION:
            raise ValueError(f"there is no method {name!r}; choose from {', '.join(PER_REVOLUTION)}")
        for choice in entries(choices) or (choices,):
            number(f"methods[{name!r}]", choice, "-", positive=True)
    period = _period(problem) if period is None else number("period", period, "s", positive=True)
    duration = revolutions * period
    dynamics, rows = Dynamics.of(problem), []
    for name, choices in chosen.items():
        for choice in choices:
            march = _adaptive if name == ADAPTIVE else _fixed
            marched = march(name, choice, dynamics, problem, period, duration)
            rows.append(_row_of(name, dynamics, problem, revolutions, period, marched))
    return rows


def _row_of(
    name: str, dynamics: Dynamics, problem: TransferProblem, revolutions: float, period: float, marched: tuple
) -> Drift:
    """The errors of one march, given as its times [s], positions [m], momenta [m/s] and seconds spent."""
    t, q, p, spent = marched
    energy, turning = _energy_error(dynamics, problem, t, q, p), _turning_error(problem, q, p)
    return Drift(
        name,
        (len(t) - 1) / revolutions,
        revolutions,
        float(energy.max()),
        float(turning.max()),
        _growth(t, energy),
        spent / revolutions,
        _history((t - t[0]) / period, energy, turning),
    )


def _fixed(
    name: str, count: float, dynamics: Dynamics, problem: TransferProblem, period: float, duration: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Times [s], positions [m] and momenta per mass [m/s] on the way, and the seconds it took."""
    n, steps = dynamics.positions, max(whole("steps", round(count * duration / period)), 2)
    times = problem.start_time + duration / steps * np.arange(steps + 1)
    position, velocity = problem.start.fixed()
    canonical = name.startswith("order ")
    step = step_function(name, dynamics, problem)
    if canonical:
        velocity = _momenta(dynamics, times[:1], position[None], velocity[None], problem.mass)[0]
    begin = np.concatenate([position, velocity])
    march = step.mapaccum("march", steps, {"base": 4})
    begun = time.perf_counter()
    found = march(begin, times[None, :-1], duration / steps)
    spent = time.perf_counter() - begun
    states = np.vstack([begin, found.full().T])
    q, p = states[:, :n], states[:, n:]
    return times, q, p if canonical else _momenta(dynamics, times, q, p, problem.mass), spent


def step_function(name: str, dynamics: Dynamics, problem: TransferProblem) -> ca.Function:
    """(state, t, h) -> the state one step later: position and momentum of a scheme, else velocity [m, m/s]."""
    canonical = name.startswith("order ")
    return _variational(int(name[6:]), dynamics, problem) if canonical else _explicit(name, dynamics, problem)


def _variational(order: int, dynamics: Dynamics, problem: TransferProblem) -> ca.Function:
    """(position and momentum, t, h) -> position and momentum one step later."""
    n, rule = dynamics.positions, scheme(order)
    state, t, h = ca.MX.sym("state", n + dynamics.freedom), ca.MX.sym("t"), ca.MX.sym("h")
    mass, still = problem.mass * ca.DM.ones(rule.degree + 1), ca.DM.zeros(dynamics.controls, rule.degree + 1)
    dq, dp, _ = step_map(dynamics, rule)(state[:n], state[n:], mass, still, t, h, ca.DM.zeros(n))
    step = ca.Function("step", [state, t, h], [state + ca.vertcat(dq, dp)])
    # where a step has no equation to solve, it is one plain expression, which is three times as fast
    return step.expand() if rule.degree == 1 and not dynamics.depends_on_velocity else step


def _explicit(name: str, dynamics: Dynamics, problem: TransferProblem) -> ca.Function:
    """(position and velocity, t, h) -> position and velocity one step later, by a Runge-Kutta method."""
    rk4 = np.array([0, 0.5, 0.5, 1]), np.diag([0.5, 0.5, 1.0], -1), np.array([1, 2, 2, 1]) / 6
    # a Runge-Kutta method is three tables: stage j is at places[j] of the step, where the slopes of the stages
    # before it, times row j of `below`, lead; the slopes of all stages, times `weights`, make the step
    places, below, weights = rk4 if name == "RK4" else coefficients()[:3]
    slopes = list[ca.SX]()
    state, t, h = ca.SX.sym("state", dynamics.positions + dynamics.freedom), ca.SX.sym("t"), ca.SX.sym("h")
    for place, row in zip(places, below, strict=True):
        at = state + h * weighted(row[: len(slopes)], slopes)
        slopes.append(_rate(dynamics, problem, t + float(place) * h, at))
    return ca.Function("step", [state, t, h], [state + h * weighted(weights, slopes)])


def _rate(dynamics: Dynamics, problem: TransferProblem, t: ca.SX, state: ca.SX) -> ca.SX:
    q, w = ca.vertsplit(state, [0, dynamics.positions, dynamics.positions + dynamics.freedom])
    change = dynamics.acceleration(t, q, w, problem.mass, ca.DM.zeros(dynamics.freedom))
    return ca.vertcat(dynamics.configuration.velocity(q, w), change)


def _adaptive(
    name: str, tolerance: float, dynamics: Dynamics, problem: TransferProblem, period: float, duration: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """What `_fixed` gives, by SciPy's DOP853, which chooses its steps to meet a relative tolerance."""
    from scipy.integrate import solve_ivp

    n = dynamics.positions
    at, now, rate = np.empty(1), np.empty(2 * n), np.empty(2 * n)
    t, state = ca.SX.sym("t"), ca.SX.sym("state", 2 * n)
    # CasADi reads and writes these arrays in place: converting them at every call would take longer than all
    # else in the integrator, and the comparison would be one of conversions
    buffer, trigger = ca.Function("rate", [t, state], [_rate(dynamics, problem, t, state)]).buffer()
    for place, argument in enumerate((at, now)):
        buffer.set_arg(place, argument.data)
    buffer.set_res(0, rate.data)

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        at[0], now[:] = t, y
        trigger()
        return rate.copy()

    span = problem.start_time, problem.start_time + duration
    begin = np.concatenate(problem.start.fixed())
    scale = np.repeat([np.linalg.norm(part) for part in problem.start.fixed()], n)
    begun = time.perf_counter()
    found = solve_ivp(slope, span, begin, "DOP853", rtol=tolerance, atol=tolerance * scale)
    spent = time.perf_counter() - begun
    q, v = found.y[:n].T, found.y[n:].T
    return found.t, q, _momenta(dynamics, found.t, q, v, problem.mass), spent


def _momenta(dynamics: Dynamics, t: np.ndarray, q: np.ndarray, v: np.ndarray, mass: float) -> np.ndarray:
    return columns(dynamics.momentum, t, q.T, v.T, mass)[0].T


def _energy_error(
    dynamics: Dynamics, problem: TransferProblem, t: np.ndarray, q: np.ndarray, p: np.ndarray
) -> np.ndarray:
    v = columns(dynamics.velocity, t, q.T, p.T, problem.mass)[0]
    energy = columns(dynamics.energy, t, q.T, v, problem.mass)[0].ravel()
    return np.abs(energy - energy[0]) / (abs(energy[0]) or 1.0)


def _growth(t: np.ndarray, error: np.ndarray) -> float:
    """Largest error of the last tenth of the time over that of the first tenth."""
    tenth = 0.1 * (t[-1] - t[0])
    early, late = error[t <= t[0] + tenth].max(), error[t >= t[-1] - tenth].max()
    return float(late / early) if early else np.nan


def _history(revolutions: np.ndarray, *errors: np.ndarray) -> np.ndarray:
    """The largest errors so far at revolutions that are evenly spaced on a logarithmic axis."""
    begin, end = min(1.0, revolutions[-1]), revolutions[-1]
    places = np.unique(np.searchsorted(revolutions, np.geomspace(begin, end, HISTORY_POINTS)))
    return np.stack([revolutions[places], *(np.maximum.accumulate(error)[places] for error in errors)])


def _turning_error(problem: TransferProblem, q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Relative change of the angular momentum about the first attractor, or the origin."""
    n = problem.dimension
    arm, push = (np.pad(x, ((0, 0), (0, 3 - n))) for x in (q - problem.attraction.center, p))
    spin = np.cross(arm, push)
    size = np.linalg.norm(spin[0])
    return np.linalg.norm(spin - spin[0], axis=1) / size if size else np.full(len(q), np.nan)


def _period(problem: TransferProblem) -> float:
    """Period of the orbit of the start around the first attractor [s], by the vis-viva equation."""
    (position, velocity), attraction = problem.start.fixed(), problem.attraction
    if attraction.first is not None:
        # 1/a; on a parabola or hyperbola, which never come back, it is not positive
        mu = attraction.first.mu
        inverse = 2 / np.linalg.norm(position - attraction.center) - velocity @ velocity / mu
        if inverse > 0:
            return float(2 * np.pi / np.sqrt(mu * inverse**3))
    raise ValueError("how long a revolution takes is not known here; give period=... [s]")
