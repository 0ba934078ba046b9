"""A path between its nodes, and by how much it breaks zones and speed limits there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dmoc.basics.quaternions import QUATERNION, conjugate, normalised
from dmoc.basics.quaternions import times as product
from dmoc.basics.records import dataclass
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.parts.constraint import Constraint

# A limit may be exceeded by this part of its scale [-]: the optimiser meets rows to a tolerance, not exactly.
BOUND = 1e-6
# Between nodes a path may cut into a zone by at most this part of the zone's size [-], however coarse its mesh.
DEEPEST = 1e-2
# A gap between two nodes is looked at in at least this many places.
FEWEST = 8
# All gaps together are looked at in no more places than this, unless the fewest of each gap are more: that
# bounds the memory.
MOST_PLACES = 1_000_000


@dataclass(frozen=True)
class Cut:
    """How far a path breaks one constraint, and how far it may.

    Attributes
    ----------
    name : str
        The constraint and where it is broken, such as "KeepOut 2 between nodes".
    index : int
        Place of the constraint in the problem.
    value, allowed : float
        The largest excess and the excess that is allowed [unit].
    unit : str
    steps : array of int
        The steps of the path in which more is broken than is allowed; empty for what is broken at nodes.
    """

    name: str
    index: int
    value: float
    allowed: float
    unit: str
    steps: np.ndarray

    @property
    def ok(self) -> bool:
        return self.value <= self.allowed


def cuts(
    constraints: Sequence[Constraint],
    path: DiscretePath,
    velocity: np.ndarray,
    extent: float,
    speed: float,
    start_time: float = 0.0,
) -> Iterator[Cut]:
    """Zones at the nodes and between them; a speed limit everywhere.

    Rows act at nodes alone, so between two of them a path may cut into a zone. The allowance is the depth of
    the chord, d^2 / 8r for nodes a distance d apart at a sphere of radius r, plus the distance of the path
    from its chord. A speed limit acts on mean velocities inside the steps. A velocity at a node may differ
    from them by half of its distance from the line between its neighbours. These allowances are of order
    h^2, and none exceeds a hundredth of the size or the speed.

    Parameters
    ----------
    constraints : sequence of Constraint
    path : DiscretePath
    velocity : array, shape (nodes, coordinates)
        dq/dt at every node, that of places in [m/s]; that of a quaternion gives the rate.
    extent, speed : float
        The scales of the path of the centre of mass [m], [m/s]; those of a point are at least its own.
    start_time : float
        [s], for zones that move.
    """
    if not path.place.size:
        return
    ours = [(i, constraint) for i, constraint in enumerate(constraints) if not constraint.turns_body]
    for point in dict.fromkeys(_key(constraint) for _, constraint in ours):
        these = [(i, constraint) for i, constraint in ours if _key(constraint) == point]
        yield from _cuts_of(these, path, *_motion(these[0][1], path, velocity), (extent, speed, start_time))


def _key(constraint: Constraint) -> tuple[str, tuple | None]:
    return constraint.on, None if constraint.point is None else tuple(constraint.point)


def _motion(constraint: Constraint, path: DiscretePath, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and velocities [m/s] at the nodes of what a constraint limits: the centre or a point."""
    made = path.coordinates
    mine = made.places & made.of_body(constraint.on)[0]
    if constraint.point is None:
        return path.position[:, mine], slopes[:, mine]
    at = made.quaternion_of(constraint.on)
    rate = 2 * product(conjugate(path.position[:, at]), slopes[:, at])[:, 1:]
    return constraint.seen(path.position[:, made.of_body(constraint.on)[0]], np.hstack([slopes[:, mine], rate]))


def _cuts_of(
    ours: list[tuple[int, Constraint]],
    path: DiscretePath,
    place: np.ndarray,
    velocity: np.ndarray,
    scales: tuple[float, float, float],
) -> Iterator[Cut]:
    """`cuts` of constraints that limit the same point of the body, of which these are the motion at nodes."""
    extent, speed, start_time = scales
    if ours[0][1].point is not None or ours[0][1].on:
        # A point far off the centre of a body that turns, or one of several bodies, goes further and faster.
        extent = max(extent, float(np.linalg.norm(np.ptp(place, axis=0))))
        speed = max(speed, float(np.linalg.norm(velocity, axis=1).max()))
    longest = float(np.linalg.norm(np.diff(place, axis=0), axis=1).max())
    smallest = min(constraint.feature() for _, constraint in ours)
    inside, chord, moving, straight = inside_gaps(smallest, path, place, velocity, longest)
    parts = (len(inside) - 1) // (len(path.position) - 1)
    fractions = np.interp(np.arange(len(inside)) / parts, np.arange(len(path.position)), path.fractions)
    times = start_time + path.duration * fractions
    bend = _most(np.linalg.norm(inside - chord, axis=1))
    sway = _most(np.linalg.norm(moving - straight, axis=1)) + 0.5 * _bump(path, velocity)
    still, none = np.zeros_like(inside), np.empty(0, int)
    for i, constraint in ours:
        name, unit = constraint.named(i), constraint.unit
        if constraint.limits_speed:
            allowed = BOUND * speed + min(sway, DEEPEST * speed)
            yield Cut(name, i, _most(constraint.excess_at(times, inside, moving)), allowed, "m/s", none)
            continue
        at_nodes = _most(constraint.excess_at(times[::parts], place, velocity))
        yield Cut(f"{name} at nodes", i, at_nodes, BOUND * extent, unit, none)
        size = constraint.feature()
        # A zone that tells no size is judged by how deep the chords themselves cut into it.
        depth = (
            longest**2 / (8 * size) if np.isfinite(size) else _most(constraint.excess_at(times, chord, still))
        )
        allowed = BOUND * extent + min(depth + bend, DEEPEST * min(size, extent))
        between = constraint.excess_at(times, inside, still)
        yield Cut(f"{name} between nodes", i, _most(between), allowed, unit, _steps(path, between > allowed))


def turn_cuts(
    constraints: Sequence[Constraint], path: DiscretePath, start_time: float, velocity: np.ndarray
) -> Iterator[Cut]:
    """Limits on attitude and rate of a body, at the nodes and between them.

    Rows for cones act at nodes alone, so between two of them an axis may cut into a cone: by d^2 / 8 over the
    tangent of the cone's angle for nodes a turn d apart, and by no more than a hundredth of the angle.

    Parameters
    ----------
    constraints : sequence of Constraint
    path : DiscretePath
    start_time : float
        [s].
    velocity : array, shape (nodes, freedom)
        Independent velocities at every node.
    """
    yield from _joint_cuts(constraints, path)
    ours = [(i, one) for i, one in enumerate(constraints) if one.turns_body and not one.limits_joint]
    if not ours:
        return
    rule, steps = scheme(path.order), len(path.mesh) - 1
    made, at = path.coordinates, step_nodes(steps, rule)
    places = np.linspace(0.0, 1.0, FEWEST * rule.degree + 1)[:-1]
    fractions = (path.mesh[:-1, None] + np.diff(path.mesh)[:, None] * places).ravel()
    times = start_time + path.duration * path.fractions
    apart, none = path.largest_turn, np.empty(0, int)
    for i, constraint in ours:
        name, unit = constraint.named(i), constraint.unit
        turned, moving = constraint.seen_of(made, path.position, velocity)
        at_nodes = _most(constraint.excess_at(times, turned, moving))
        if constraint.limits_speed:
            limit = constraint.largest_speed() or 0.0
            sway = min(0.5 * _bump(path, moving), DEEPEST * limit)
            yield Cut(name, i, at_nodes, BOUND * limit + sway, unit, none)
            continue
        yield Cut(f"{name} at nodes", i, at_nodes, np.degrees(BOUND), unit, none)
        attitude = path.position[:, made.quaternion_of(constraint.on)]
        found = np.einsum("pj,jkn->kpn", rule.values_at(places), attitude[at])
        inside = normalised(found).reshape(-1, QUATERNION)
        angle = np.radians(constraint.feature_angle())
        depth = apart**2 / (8 * np.tan(min(angle, np.pi - angle)) or 1.0)
        allowed = float(np.degrees(BOUND + min(depth, DEEPEST * angle)))
        between = constraint.excess_at(
            start_time + path.duration * fractions, inside, np.zeros((len(inside), 3))
        )
        broken = np.flatnonzero(between.reshape(steps, -1).max(axis=1) > allowed)
        yield Cut(f"{name} between nodes", i, _most(between), allowed, unit, broken)


def _joint_cuts(constraints: Sequence[Constraint], path: DiscretePath) -> Iterator[Cut]:
    """Limits of joints at the nodes and between them.

    Between two nodes a joint may pass its stop by an eighth of the second difference of its coordinate there,
    and by no more than a hundredth of its way.
    """
    ours = [(i, constraint) for i, constraint in enumerate(constraints) if constraint.limits_joint]
    if not ours:
        return
    rule, steps = scheme(path.order), len(path.mesh) - 1
    places = np.linspace(0.0, 1.0, FEWEST * rule.degree + 1)[:-1]
    found = np.einsum("pj,jkn->kpn", rule.values_at(places), path.position[step_nodes(steps, rule)])
    inside = found.reshape(-1, found.shape[2])
    made = path.coordinates
    for at in made.quaternions:
        inside[:, at] = normalised(inside[:, at])
    for i, constraint in ours:
        name, unit = constraint.named(i), constraint.unit
        nodes, between = (constraint.seen_of(made, q, np.zeros_like(q))[0] for q in (path.position, inside))
        way = float(np.ptp(nodes)) or 1.0
        at_nodes = constraint.excess(nodes, nodes)
        size = 1.0 if unit == "rad" else way
        yield Cut(f"{name} at nodes", i, _most(at_nodes), BOUND * size, unit, np.empty(0, int))
        bump = _most(np.abs(np.diff(nodes[:, 0], 2))) / 8
        allowed = BOUND * size + min(bump, DEEPEST * way)
        beyond = constraint.excess(between, between)
        broken = np.flatnonzero(beyond.reshape(steps, -1).max(axis=1) > allowed)
        yield Cut(f"{name} between nodes", i, _most(beyond), allowed, unit, broken)


def _steps(path: DiscretePath, broken: np.ndarray) -> np.ndarray:
    """The steps in which one of the places inside is broken."""
    gaps = len(path.position) - 1
    gap = np.flatnonzero(broken[:-1].reshape(gaps, -1).any(axis=1))
    return np.unique(gap // scheme(path.order).degree)


def inside_gaps(
    smallest: float, path: DiscretePath, q: np.ndarray, v: np.ndarray, longest: float
) -> tuple[np.ndarray, ...]:
    """Path, chord, velocity and its linear interpolation at the nodes and inside every gap between two.

    The path is the cubic that has the positions q and velocities v of both nodes; it is looked at often
    enough not to step over a zone of the smallest size if that is smaller than the longest gap [m].
    """
    tau = path.duration * np.diff(path.fractions)[:, None, None]
    parts = int(np.clip(4 * longest / smallest, FEWEST, max(FEWEST, MOST_PLACES // len(q))))
    u = (np.arange(parts) / parts)[:, None]
    # The cubic is the chord plus a bend that vanishes at both nodes, from the end velocities less the mean one.
    mean = np.diff(q, axis=0)[:, None] / tau
    first, second = v[:-1, None] - mean, v[1:, None] - mean
    chord = q[:-1, None] + u * tau * mean
    cubic = chord + tau * (u * (1 - u) ** 2 * first - u**2 * (1 - u) * second)
    velocity = mean + (1 - 4 * u + 3 * u**2) * first + (3 * u**2 - 2 * u) * second
    straight = (1 - u) * v[:-1, None] + u * v[1:, None]
    inside = (values.reshape(-1, q.shape[1]) for values in (cubic, chord, velocity, straight))
    return tuple(np.concatenate([values, end[-1:]]) for values, end in zip(inside, (q, q, v, v), strict=True))


def _bump(path: DiscretePath, velocity: np.ndarray) -> float:
    """How far the velocity at a node is at most off the line between its neighbours in time [m/s]."""
    time = path.fractions
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    line = (1 - share) * velocity[:-2] + share * velocity[2:]
    return _most(np.linalg.norm(velocity[1:-1] - line, axis=1))


def _most(values: np.ndarray) -> float:
    """The largest of some numbers, at least 0; NaN if one is."""
    return float(np.max(values, initial=0.0))
