"""By how much a path breaks its limits: force, duration, mass, boundary, zones and speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.checks.evidence import Evidence
from dmoc.configurations.acting import state_symbols
from dmoc.configurations.coordinates import ATTITUDE
from dmoc.motion.flown import BREAKS
from dmoc.motion.momenta import rates_along
from dmoc.results.between import BOUND, cuts, turn_cuts

# A boundary entry that is fixed may be off by this part of the extent or speed [-]: it is a bound, not a row,
# so only round-off moves it.
FIXED = 1e-9
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
    scale, unit = actuator.main_limit() or evidence.largest or 1.0, actuator.limit_unit
    name = "force" if unit == "N" else "torque"
    yield Excess(name, _most(actuator.excess(control)), BOUND * scale, unit)
    u = ca.SX.sym("u", control.shape[1])
    yield from _row_excess("actuator", actuator.rows(u), [u], [control.T])
    if actuator.limited and not evidence.path.hold:
        _, between = evidence.flown.sampled(FLOWN_AT)
        yield Excess(f"{name} between nodes", _most(actuator.beyond(between)), (BREAKS + BOUND) * scale, unit)
    if actuator.dry_mass > 0:
        missing = _most(actuator.dry_mass - evidence.mass)
        yield Excess("dry mass", missing, BOUND * evidence.problem.mass, "kg")


def _duration_excess(evidence: Evidence) -> Iterable[Excess]:
    shortest, longest = evidence.problem.duration_bounds
    beyond = _most(np.array([shortest - evidence.path.duration, evidence.path.duration - longest]))
    yield Excess("duration", beyond, BOUND * longest, "s")


def _boundary(evidence: Evidence) -> Iterable[Excess]:
    """Entries that are fixed must be met to round-off, conditions to the optimiser's tolerance."""
    problem, path, body = evidence.problem, evidence.path, evidence.dynamics.configuration
    t, q, _, m = state_symbols(body.size)
    v = ca.SX.sym("v", body.freedom)
    made = body.coordinates
    sizes = {"m": evidence.extent, "m/s": evidence.speed, "rad/s": evidence.rate}
    for name, place, velocity in (("start", 0, path.start_velocity), ("goal", -1, path.goal_velocity)):
        end = getattr(problem, name)
        position = evidence.position[place] - end.fixed()[0]
        slip = velocity - end.fixed()[1]
        for kind, off, allowed, unit in (
            ("position", position[made.places], FIXED * evidence.extent + evidence.rounding, "m"),
            ("velocity", slip[made.speeds], FIXED * evidence.speed, "m/s"),
            ("attitude", position[made.kinds == ATTITUDE], FIXED, "-"),
            ("rate", slip[made.rates], FIXED * evidence.rate, "rad/s"),
            ("wheel momentum", slip[made.spins], FIXED * evidence.scales.momentum, "N m s"),
        ):
            if off.size:
                yield Excess(f"{name} {kind}", _most(np.abs(off)[~np.isnan(off)]), allowed, unit)
        state = [evidence.time[place], evidence.position[place], velocity, evidence.mass[place]]
        yield from _row_excess(name, end.rows(t, q, v, m), [t, q, v, m], state, sizes)


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
    """Zones and speed limits at the nodes and between them."""
    scales = evidence.extent, evidence.speed, evidence.begin
    for cut in cuts(evidence.problem.constraints, evidence.path, evidence.node_velocity, *scales):
        yield Excess(cut.name, cut.value, cut.allowed, cut.unit)
    if evidence.path.attitudes:
        rates = rates_along(evidence.dynamics, evidence.position, evidence.node_velocity)
        for cut in turn_cuts(evidence.problem.constraints, evidence.path, evidence.begin, rates):
            yield Excess(cut.name, cut.value, cut.allowed, cut.unit)


def _most(values: Any) -> float:
    """The largest of some numbers, at least 0; NaN if one is."""
    return float(np.max(values, initial=0.0))
