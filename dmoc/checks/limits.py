"""By how much a path breaks its limits: force, duration, mass, boundary, zones and speed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dmoc.checks.evidence import Evidence
from dmoc.motion.dynamics import state_symbols
from dmoc.motion.flown import BREAKS

# A limit may be exceeded by this part of its scale [-]: the optimiser meets rows to a tolerance, not exactly.
BOUND = 1e-6
# A boundary entry that is fixed may be off by this part of the extent or speed [-]: it is a bound, not a row,
# so only round-off moves it.
FIXED = 1e-9
# Between nodes a path may cut into a zone by at most this part of the zone's size [-], however coarse its mesh.
DEEPEST = 1e-2
# A gap between two nodes is looked at in at least this many places.
FEWEST = 8
# All gaps together are looked at in no more places than this, unless the fewest of each gap are more: that
# bounds the memory.
MOST_PLACES = 1_000_000


# The control is looked at in this many places of each piece of it, which is a step as a rule.
FLOWN_AT = 17


@dataclass(frozen=True)
class Excess:
    """One limit: by how much it is broken, and by how much it may be."""

    name: str
    value: float
    allowed: float
    unit: str

    @property
    def ok(self) -> bool:
        return self.value <= self.allowed

    @property
    def share(self) -> float:
        """The excess over the excess that is allowed [-]; infinite where it is not a number."""
        return float(np.nan_to_num(self.value / self.allowed, nan=np.inf))


def excesses(evidence: Evidence) -> list[Excess]:
    """Every limit of the problem, as the path keeps it."""
    return [*_controls(evidence), *_duration_excess(evidence), *_boundary(evidence), *_zone_excess(evidence)]


def _controls(evidence: Evidence) -> Iterable[Excess]:
    """Limits of the actuator, at the nodes or, with hold, in the steps, and between the nodes as flown."""
    actuator, control = evidence.problem.actuator, evidence.path.control
    scale = actuator.force_limit() or evidence.largest or 1.0
    yield Excess("force", _most(actuator.excess(control)), BOUND * scale, "N")
    u = ca.SX.sym("u", control.shape[1])
    yield from _row_excess("actuator", actuator.rows(u), [u], [control.T])
    if actuator.force_limit() is not None and not evidence.path.hold:
        _, between = evidence.flown.sampled(FLOWN_AT)
        yield Excess("force between nodes", _most(actuator.beyond(between)), (BREAKS + BOUND) * scale, "N")
    if actuator.dry_mass > 0:
        missing = _most(actuator.dry_mass - evidence.mass)
        yield Excess("dry mass", missing, BOUND * evidence.problem.mass, "kg")


def _duration_excess(evidence: Evidence) -> Iterable[Excess]:
    shortest, longest = evidence.problem.duration_bounds
    beyond = _most(np.array([shortest - evidence.path.duration, evidence.path.duration - longest]))
    yield Excess("duration", beyond, BOUND * longest, "s")


def _boundary(evidence: Evidence) -> Iterable[Excess]:
    """Entries that are fixed must be met to round-off, conditions to the optimiser's tolerance."""
    problem, path = evidence.problem, evidence.path
    t, q, v, m = state_symbols(problem.dimension)
    for name, place, velocity in (("start", 0, path.start_velocity), ("goal", -1, path.goal_velocity)):
        end = getattr(problem, name)
        for kind, wanted, have, allowed, unit in (
            (
                "position",
                end.fixed()[0],
                evidence.position[place],
                FIXED * evidence.extent + evidence.rounding,
                "m",
            ),
            ("velocity", end.fixed()[1], velocity, FIXED * evidence.speed, "m/s"),
        ):
            yield Excess(f"{name} {kind}", _most(np.abs(have - wanted)[~np.isnan(wanted)]), allowed, unit)
        state = [evidence.time[place], evidence.position[place], velocity, evidence.mass[place]]
        yield from _row_excess(
            name, end.rows(t, q, v, m), [t, q, v, m], state, {"m": evidence.extent, "m/s": evidence.speed}
        )


def _row_excess(
    owner: str, rows: list, symbols: list, values: list, sizes: dict[str, float] | None = None
) -> Iterable[Excess]:
    """Rows as a part of the problem states them, in their own unit."""
    for row in rows:
        have = ca.Function("row", symbols, [ca.densify(row.expression)])(*values).full()
        unit = getattr(row, "unit", "")
        allowed = BOUND * (sizes or {}).get(unit, 1.0)
        beyond = _most(np.maximum(row.lower - have, have - row.upper))
        yield Excess(f"{owner} {row.name}", beyond, allowed, unit or "-")


def _zone_excess(evidence: Evidence) -> Iterable[Excess]:
    """Zones at the nodes and between them; a speed limit everywhere.

    Rows act at nodes alone, so between two of them a path may cut into a zone. The allowance is the depth of
    the chord, d^2 / 8r for nodes a distance d apart at a sphere of radius r, plus the distance of the path
    from its chord. A speed limit acts on mean velocities inside the steps. A velocity at a node may differ
    from them by half of its distance from the line between its neighbours. These allowances are of order
    h^2, and none exceeds a hundredth of the size or the speed.
    """
    if not evidence.problem.constraints:
        return
    longest = float(np.linalg.norm(np.diff(evidence.position, axis=0), axis=1).max())
    path, chord, velocity, straight = _inside_gaps(evidence, longest)
    bend = _most(np.linalg.norm(path - chord, axis=1))
    sway = _most(np.linalg.norm(velocity - straight, axis=1)) + 0.5 * _bump(evidence)
    still = np.zeros_like(path)
    for i, constraint in enumerate(evidence.problem.constraints):
        name = f"{type(constraint).__name__} {i + 1}"
        if constraint.limits_speed:
            allowed = BOUND * evidence.speed + min(sway, DEEPEST * evidence.speed)
            yield Excess(name, _most(constraint.excess(path, velocity)), allowed, "m/s")
            continue
        at_nodes = _most(constraint.excess(evidence.position, evidence.node_velocity))
        yield Excess(f"{name} at nodes", at_nodes, BOUND * evidence.extent, constraint.unit)
        size = constraint.feature()
        # A zone that tells no size is judged by how deep the chords themselves cut into it.
        cut = longest**2 / (8 * size) if np.isfinite(size) else _most(constraint.excess(chord, still))
        cut = min(cut + bend, DEEPEST * min(size, evidence.extent))
        between = _most(constraint.excess(path, still))
        yield Excess(f"{name} between nodes", between, BOUND * evidence.extent + cut, constraint.unit)


def _inside_gaps(evidence: Evidence, longest: float) -> tuple[np.ndarray, ...]:
    """Path, chord, velocity and its linear interpolation at the nodes and inside every gap between two.

    The path is the cubic that has the positions and velocities of both nodes; it is looked at often
    enough not to step over a zone that is smaller than the longest gap [m].
    """
    q, v = evidence.position, evidence.node_velocity
    tau = evidence.path.duration * np.diff(evidence.path.fractions)[:, None, None]
    smallest = min(constraint.feature() for constraint in evidence.problem.constraints)
    parts = int(np.clip(4 * longest / smallest, FEWEST, max(FEWEST, MOST_PLACES // len(q))))
    u = (np.arange(parts) / parts)[:, None]
    # The cubic is the chord plus a bend that vanishes at both nodes, from the end velocities less the mean one.
    mean = np.diff(q, axis=0)[:, None] / tau
    first, second = v[:-1, None] - mean, v[1:, None] - mean
    chord = q[:-1, None] + u * tau * mean
    path = chord + tau * (u * (1 - u) ** 2 * first - u**2 * (1 - u) * second)
    velocity = mean + (1 - 4 * u + 3 * u**2) * first + (3 * u**2 - 2 * u) * second
    straight = (1 - u) * v[:-1, None] + u * v[1:, None]
    inside = (values.reshape(-1, q.shape[1]) for values in (path, chord, velocity, straight))
    return tuple(np.concatenate([values, end[-1:]]) for values, end in zip(inside, (q, q, v, v), strict=True))


def _bump(evidence: Evidence) -> float:
    """How far the velocity at a node is at most off the line between its neighbours in time [m/s]."""
    time, velocity = evidence.path.fractions, evidence.node_velocity
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    line = (1 - share) * velocity[:-2] + share * velocity[2:]
    return _most(np.linalg.norm(velocity[1:-1] - line, axis=1))


def _most(values: Any) -> float:
    """The largest of some numbers, at least 0; NaN if one is."""
    return float(np.max(values, initial=0.0))
