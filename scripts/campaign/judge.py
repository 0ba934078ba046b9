"""The judge of an answer: NumPy and SciPy alone, nothing of the package that found it.

What is flown between nodes is written here again from its documentation: the polynomial through the Lobatto
nodes of a step or, where that breaks the limit by more than 1e-4 of it, that of three controls of the same
impulse which keeps most of its first two moments: the polynomial drawn towards its mean, two constant pieces,
or the value of each node for as long as its weight. With held forces it is one constant a step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from campaign.physics import Flight, Push, World

# A control may exceed its limit between nodes by this part of it [-]: the documented 1e-4 and a rounding.
BETWEEN = 1.1e-4
# A path may miss an end or enter a zone by this part of itself [-] when no tolerance was asked for: that is the
# documented limit of the check called reference.
COARSE = 1e-2
# Steps of the judge's integrator are halved until two flights agree to this part of what may be missed [-].
AGREE = 0.1
# An answer is too dear if it costs so many times what a path does that is known to be possible [-]: local
# optima differ by factors of about two, and three leaves room.
DEAR = 3.0


@dataclass(frozen=True)
class Truth:
    """All that the judge knows of a scene.

    Attributes
    ----------
    start, goal : callable
        (t [s], q [m], v [m/s], m [kg]) -> numbers that are zero where the end is met.
    zones : tuple of callables
        Positions (count, axes) -> depth [m] of each inside what is forbidden.
    fastest : float
        Speed limit [m/s].
    cost : str
        Name of the objective: effort, fuel, time, mass, height or radius.
    least, known, dear : float
        A proven bound of the objective; what a path costs that is known to be possible, NaN if none is; and how
        many times that an answer may cost.
    """

    world: World
    push: Push
    mass: float
    start: Callable
    goal: Callable
    durations: tuple[float, float]
    cost: str
    zones: tuple[Callable, ...] = ()
    fastest: float = np.inf
    least: float = np.nan
    known: float = np.nan
    dear: float = DEAR


def faults(truth: Truth, solution: Any, tol: float | None) -> list[str]:
    """What is wrong with an answer, in words; empty if nothing is."""
    allowed = COARSE if tol is None else min(COARSE, 10 * tol)
    edges, powers = flown(truth.push, solution)
    flight = _converged(truth, solution, edges, powers, allowed)
    return [
        *_ends(truth, flight, allowed),
        *_limits(truth, solution, flight, powers, allowed),
        *_costs(truth, solution, flight, edges, powers, allowed),
    ]


def lobatto(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights on [0, 1]: the ends, and where the derivative of Legendre's polynomial vanishes."""
    series = np.zeros(degree + 1)
    series[degree] = 1.0
    inner = legendre.legroots(legendre.legder(series)) if degree > 1 else []
    points = np.concatenate([[-1.0], np.sort(inner), [1.0]])
    weights = 2 / (degree * (degree + 1) * legendre.legval(points, series) ** 2)
    return (points + 1) / 2, weights / 2


def flown(push: Push, solution: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times of the pieces [s], and the control in each as powers of its fraction: (pieces, degree+1, size)."""
    mesh, control = np.asarray(solution.path.mesh), np.asarray(solution.path.control)
    duration, begin = solution.path.duration, solution.provenance.start_time
    if solution.path.hold:
        return begin + duration * mesh, control[:, None]
    degree = solution.path.order // 2
    points, weights = lobatto(degree)
    nodes = control[degree * np.arange(len(mesh) - 1)[:, None] + np.arange(degree + 1)]
    to_powers = np.linalg.inv(np.vander(points, increasing=True))
    powers = np.einsum("pj,kjn->kpn", to_powers, nodes)
    looked = np.vander(np.linspace(0, 1, 33), degree + 1, increasing=True)
    worst = push.beyond(np.einsum("lp,kpn->kln", looked, powers)).max(axis=1)
    edges, found = [mesh[0]], []
    for k in range(len(mesh) - 1):
        if degree == 1 or worst[k] <= 1e-4:
            edges.append(mesh[k + 1])
            found.append(powers[k])
            continue
        ends, pieces = _within(push, points, weights, nodes[k], to_powers)
        edges += [mesh[k] + end * (mesh[k + 1] - mesh[k]) for end in ends[1:]]
        found += list(pieces)
    return begin + duration * np.array(edges), np.array(found)


def _within(
    push: Push, points: np.ndarray, weights: np.ndarray, nodes: np.ndarray, to_powers: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the pieces of a step, as fractions, and powers of each, where its polynomial breaks a limit."""
    mean, degree = weights @ nodes, len(points) - 1
    meeting, two = _two_pieces(push, mean, (weights * (points - 0.5)) @ nodes)
    looked = np.vander(np.linspace(0, 1, 129), degree + 1, increasing=True) @ to_powers
    drawn = mean + _share(push, mean, looked @ nodes - mean) * (nodes - mean)
    held = mean + _share(push, mean, nodes - mean) * (nodes - mean)
    ways = [
        (np.array([0.0, 1.0]), (to_powers @ drawn)[None]),
        (np.array([0.0, meeting, 1.0]), _constant(two, degree)),
        (np.append(0.0, np.cumsum(weights)), _constant(held, degree)),
    ]
    wanted = _moments(np.array([0.0, 1.0]), (to_powers @ nodes)[None], points, weights)
    gaps = [np.abs(_moments(*way, points, weights) - wanted).sum() for way in ways]
    ends, pieces = ways[int(np.argmin(gaps))]
    ends[-1] = 1.0
    return ends, pieces


def _constant(values: np.ndarray, degree: int) -> np.ndarray:
    """Constant pieces as powers, shape (pieces, degree+1, size)."""
    return np.concatenate([values[:, None], np.zeros((len(values), degree, values.shape[1]))], axis=1)


def _moments(ends: np.ndarray, pieces: np.ndarray, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """First and second moment of a control about the middle of its step, by the quadrature of the scheme."""
    lengths = np.diff(ends)
    places = ends[:-1, None] + lengths[:, None] * points - 0.5
    values = np.einsum("lp,kpn->kln", np.vander(points, pieces.shape[1], increasing=True), pieces)
    return np.stack([np.einsum("k,l,kl,kln->n", lengths, weights, places**p, values) for p in (1, 2)])


def _share(push: Push, mean: np.ndarray, apart: np.ndarray) -> float:
    """How far controls, one row each, can leave their mean together within the limit, at most wholly [-]."""
    shares = np.linspace(0, 1, 2001)
    inside = (push.beyond(mean + shares[:, None, None] * apart) <= 1e-4).all(axis=1)
    return float(shares[max(int(np.cumprod(inside).sum()) - 1, 0)])


def _two_pieces(push: Push, mean: np.ndarray, moment: np.ndarray) -> tuple[float, np.ndarray]:
    """Where two constant controls meet that have this mean and as much as may be of this first moment."""
    meetings = np.linspace(0.02, 0.98, 49)
    apart = np.stack([-2 * moment / meetings[:, None], 2 * moment / (1 - meetings[:, None])])
    shares = np.linspace(0, 1, 2001)[:, None, None, None]
    inside = (push.beyond(mean + shares * apart) <= 1e-4).all(axis=1)
    # The limits are convex: what is inside is an interval from no share on.
    share = np.cumprod(inside, axis=0).sum(axis=0) - 1
    best = int(np.argmax(share))
    return meetings[best], mean + max(share[best], 0) / 2000 * apart[:, best]


def _converged(truth: Truth, solution: Any, edges: np.ndarray, powers: np.ndarray, allowed: float) -> Flight:
    """The flight of the answer, with steps so short that shorter ones change nothing that matters."""
    path = solution.path
    start = path.position[0], path.start_velocity, truth.mass
    parts = max(1, 100 // len(powers))
    flight = Flight(truth.world, truth.push, start, edges, powers, parts)
    for _ in range(5):
        finer = Flight(truth.world, truth.push, start, edges, powers, parts := 2 * parts)
        extent, speed = _scales(finer)
        change = np.linalg.norm(finer.position[-1] - flight.position[-1]) / extent
        change += np.linalg.norm(finer.velocity[-1] - flight.velocity[-1]) / speed
        flight = finer
        if change <= AGREE * allowed:
            break
    return flight


def _scales(flight: Flight) -> tuple[float, float]:
    """Extent of a path [m] and its peak speed [m/s]."""
    extent = float(np.linalg.norm(np.ptp(flight.position, axis=0)))
    return extent or 1.0, float(np.linalg.norm(flight.velocity, axis=1).max()) or 1.0


def missed(rows: Callable, flight: Flight, place: int) -> float:
    """How far a state is from where conditions hold, as a part of the path's extent and peak speed [-].

    The least change of position and velocity, so scaled, that meets the conditions to first order.
    """
    t, m = flight.time[place], flight.mass[place]
    scale = np.repeat(_scales(flight), flight.position.shape[1])
    state = np.concatenate([flight.position[place], flight.velocity[place]])
    n = len(state) // 2

    def value(x: np.ndarray) -> np.ndarray:
        return np.atleast_1d(rows(t, x[:n], x[n:], m)).astype(float)

    moves = 1e-6 * np.diag(scale)
    slopes = np.array([(value(state + move) - value(state - move)) / 2e-6 for move in moves]).T
    return float(np.linalg.norm(np.linalg.lstsq(slopes, value(state), rcond=None)[0]))


def _ends(truth: Truth, flight: Flight, allowed: float) -> list[str]:
    found = []
    for name, rows, place, limit in (("start", truth.start, 0, 1e-6), ("goal", truth.goal, -1, allowed)):
        miss = missed(rows, flight, place)
        if not miss <= limit:
            found.append(f"misses the {name} by {miss:.1e} of the path, allowed {limit:.0e}")
    return found


def _limits(truth: Truth, solution: Any, flight: Flight, powers: np.ndarray, allowed: float) -> list[str]:
    """Durations, controls at nodes and between, dry mass, zones, speed."""
    shortest, longest = truth.durations
    extent, _ = _scales(flight)
    looked = np.vander(np.linspace(0, 1, 33), powers.shape[1], increasing=True)
    between = truth.push.beyond(np.einsum("lp,kpn->kln", looked, powers)).max()
    depths = [zone(flight.position).max() / extent for zone in truth.zones]
    rows = (
        ("duration", max(shortest - solution.duration, solution.duration - longest) / longest, 1e-6),
        ("control at nodes", truth.push.beyond(solution.path.control).max(), 2e-6),
        ("control between nodes", between, BETWEEN),
        ("dry mass", (truth.push.dry - flight.mass.min()) / truth.mass, 1e-6 + allowed / 10),
        ("zone", max(depths, default=0.0), allowed + COARSE),
        ("speed", np.linalg.norm(flight.velocity, axis=1).max() / truth.fastest - 1, COARSE),
    )
    return [f"{name} beyond its limit by {by:.1e}, allowed {most:.0e}" for name, by, most in rows if by > most]


def _costs(
    truth: Truth, solution: Any, flight: Flight, edges: np.ndarray, powers: np.ndarray, allowed: float
) -> list[str]:
    """The objective against its integral, mass against what was burnt, and both bounds of the optimum."""
    points, weights = np.polynomial.legendre.leggauss(8)
    raised = np.vander((points + 1) / 2, powers.shape[1], increasing=True)
    controls = np.einsum("gp,kpn->kgn", raised, powers)
    each = np.diff(edges)[:, None] * weights / 2
    impulse = float(np.sum(each * truth.push.throttle(controls)))
    force = truth.push.force(controls)
    burnt = impulse / truth.push.exhaust if truth.push.exhaust else 0.0
    value = {
        "effort": 0.5 * float(np.sum(each[..., None] * force**2)),
        "fuel": burnt or impulse,
        "time": solution.duration,
        "mass": truth.mass - burnt,
        "height": flight.position[-1][-1],
        "radius": np.linalg.norm(flight.position[-1]),
    }[truth.cost]
    found, size = [], max(abs(value), 1e-12 * abs(truth.known), 1e-300)
    # What is flown in place of a polynomial that breaks a limit has its own integral of a square.
    if not abs(solution.objective - value) <= max(allowed, 1e-3) * size:
        found.append(f"the objective is said to be {solution.objective:.6g} but its integral is {value:.6g}")
    if not abs(solution.final_mass - flight.mass[-1]) <= 1e-6 * truth.mass:
        found.append(f"the final mass is said to be {solution.final_mass:.9g}, flown {flight.mass[-1]:.9g} kg")
    if solution.objective < truth.least * (1 - allowed):
        found.append(f"costs {solution.objective:.6g}, less than the proven bound {truth.least:.6g}")
    if truth.cost in ("effort", "fuel", "time") and solution.objective > truth.dear * truth.known:
        found.append(f"costs {solution.objective:.6g}, but a known path {truth.known:.6g}")
    return found
