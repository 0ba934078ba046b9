"""The functions of a mission or team: step and rollout of each leg or body, the rest of all together."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.ipopt.run import make_solver
from dmoc.motion.mesh import node_weights
from dmoc.nlp.layout import Group
from dmoc.planners.functions import all_steps, one_step, rows_of
from dmoc.planners.mission import MissionPlanner, Part, identifier
from dmoc.planners.planner import most_of
from dmoc.planners.terms import Exported, Term, named
from dmoc.scene.mission import Mission

# What the rows of motion of the parts of a body are measured in where they are not forces.
UNITS = {"dynamics_attitude": "N m", "dynamics_wheels": "N m"}


def mission_functions(planner: MissionPlanner, options: dict[str, Any] | None = None) -> list[Exported]:
    """All functions of a mission or team; `coded` of them can become C code."""
    legs = []
    for name, words, scene in zip(planner.names, planner.mission.leg_names, planner.scenes, strict=True):
        for made in (one_step(scene, f"step_{name}"), all_steps(scene, f"rollout_{name}")):
            legs.append(Exported(made.function, f"{words}: {made.words}", made.terms))
    return [
        *legs,
        residual(planner),
        cost(planner),
        solver(planner, options, warm=False),
        solver(planner, options, warm=True),
        nominal(planner),
    ]


def coded(planner: MissionPlanner) -> int:
    """How many functions of a mission, the first ones, can become C code."""
    return 2 * len(planner.scenes) + 1


def residual(planner: MissionPlanner) -> Exported:
    """How far every row of a mission is beyond its bounds: 0 on a path that can be flown."""
    numbers, plan = planner.numbers.symbols(), planner.symbols()
    lower, upper, low, high, p = planner.numbers.bounds_and_parameters(numbers)
    x = planner.pack(plan)
    g = planner.program.assembly().constraints(x, p)
    found = _rows(planner, g, low, high, p, numbers | plan) | {
        "violation": _violation((x, lower, upper), (g, low, high))
    }
    words = f"rows of all {planner.parts} of a path, less what their bounds allow"
    terms = planner.numbers.terms | planner.terms | _row_terms(planner)
    return Exported(_pruned("residual", numbers, plan, found, planner), words, terms)


def cost(planner: MissionPlanner) -> Exported:
    """The objective of a path."""
    numbers, plan = planner.numbers.symbols(), planner.symbols()
    *_, p = planner.numbers.bounds_and_parameters(numbers)
    f = _objective(planner, planner.program.assembly().objective(planner.pack(plan), p))
    unit = planner.mission.objective.unit_with(planner.mission.actuator)
    terms = planner.numbers.terms | planner.terms | {"cost": Term(unit, "the objective, in its own sign")}
    return Exported(_pruned("cost", numbers, plan, {"cost": f}, planner), "the objective of a path", terms)


def solver(planner: MissionPlanner, options: dict[str, Any] | None, warm: bool) -> Exported:
    """The parametric solver, for a cold or for a warm start."""
    program, parts = planner.program, planner.multipliers
    numbers, plan = planner.numbers.symbols(), planner.symbols()
    lam = {
        name: ca.MX.sym(name, size, part.unit.shape[1])
        for side in parts
        for part in side
        for name, size in part.sizes.items()
    }
    lower, upper, low, high, p = planner.numbers.bounds_and_parameters(numbers)
    ipopt = make_solver(program.assembly(), program.settings(warm, False, planner.path.near), options)
    columns = ca.vertcat(_scaled(parts[0], lam), ca.MX.zeros(_own_size(planner)))
    found = ipopt(
        x0=ca.fmin(ca.fmax(planner.pack(plan), lower), upper),
        p=p,
        lam_x0=columns,
        lam_g0=_scaled(parts[1], lam),
        lbx=lower,
        ubx=upper,
        lbg=low,
        ubg=high,
    )
    flown = planner.unpack(found["x"])
    rows = _rows(planner, found["g"], low, high, p, numbers | flown)
    forces = [ca.vec(value) for name, value in rows.items() if _row_terms(planner)[name].unit == "N"]
    outputs = {
        **flown,
        **_given_back(parts[0], found["lam_x"]),
        **_given_back(parts[1], found["lam_g"]),
        "objective": _objective(planner, found["f"]),
        **rows,
        "largest_residual": most_of(ca.fabs(ca.vertcat(*forces)), ca.vertcat(*forces)),
        "violation": _violation((found["x"], lower, upper), (found["g"], low, high)),
    }
    given = numbers | {f"guess_{name}": symbol for name, symbol in (plan | lam).items()}
    name, words = ("warm_solver", "from a former plan") if warm else ("solver", "from a guess of all of it")
    function = named(name, given, outputs)
    return Exported(function, f"Ipopt's solution of the {planner.kind}, {words}", _solver_terms(planner))


def nominal(planner: MissionPlanner) -> Exported:
    """What the mission itself states, and its own guess: inputs of the solver to begin with."""
    program, path = planner.program, planner.path
    plan = ca.Function("plan", [], list(planner.unpack(ca.MX(ca.DM(program.pack(path)))).values()))()
    values = {name: ca.DM(planner.numbers.value(name)) for name in planner.numbers.names}
    values |= {f"guess_{name}": plan[f"o{i}"] for i, name in enumerate(planner.symbols())}
    for part, lam in zip(planner.multipliers, program.multipliers(path), strict=True):
        known = _given_back(part, ca.MX(ca.DM(lam)))
        values |= {f"guess_{name}": ca.evalf(value) for name, value in known.items()}
    outputs = {name: ca.MX(value) for name, value in values.items()}
    words = f"the {planner.kind}'s own numbers and its guess, named like the inputs of the solver"
    return Exported(named("nominal", {}, outputs), words, _solver_terms(planner))


def _pruned(name: str, numbers: dict, plan: dict, outputs: dict, planner: MissionPlanner) -> ca.Function:
    """A function of the unknowns, and of those numbers alone that it depends on."""
    whole = named(name, numbers | plan, outputs)
    used = {
        one: symbol
        for i, (one, symbol) in enumerate(numbers.items())
        if any(whole.jac_sparsity(k, i).nnz() for k in range(whole.n_out()))
    }
    values = [used.get(one, planner.numbers.value(one)) for one in numbers]
    found = whole(*values, *plan.values())
    found = found if isinstance(found, tuple) else (found,)
    return named(name, used | plan, dict(zip(outputs, found, strict=True)))


def _rows(
    planner: MissionPlanner, g: ca.MX, low: ca.MX, high: ca.MX, p: ca.MX, plan: dict[str, ca.MX]
) -> dict[str, ca.MX]:
    """What is left of every row [SI]: of motion a force or a torque, one column a node."""
    left = (g - ca.fmin(ca.fmax(g, low), high)) / ca.DM(planner.program.row_scales())
    found: dict[str, ca.MX] = {}
    for name, scene, placed in zip(planner.names, planner.scenes, planner.program.legs, strict=True):
        program = placed.program
        for group in _groups(program.rows.groups):
            value = _matrix(left, group, placed.rows)
            if group.name == "dynamics":
                mass = plan[f"{name}_masses"] if scene.burns else plan[f"{name}_mass"]
                lasts = p[placed.parameters + len(program.units.origin) + 2]
                lasts = plan[f"{name}_duration"] if scene.problem.free_duration else lasts
                factor = mass / (lasts * ca.DM(node_weights(program.mesh, program.scheme)).T)
                parted = scene.parted(value * ca.repmat(factor, value.rows(), 1), "rows")
                found |= {f"{name}_{part}": rows for part, rows in parted.items()}
            else:
                found[f"{name}_{identifier(group.name)}_rows"] = value
    return found | {
        f"{identifier(group.name)}_rows": _matrix(left, group, planner.program.first_row)
        for group in _groups(planner.program.rows.groups)
    }


def _groups(groups: tuple[Group, ...]) -> list[Group]:
    return [group for group in groups if group.stop > group.start]


def _matrix(values: ca.MX, group: Group, first: int) -> ca.MX:
    return ca.reshape(values[first + group.start : first + group.stop], len(group.labels), group.count)


def _row_terms(planner: MissionPlanner) -> dict[str, Term]:
    """Unit and meaning of what is left of every row."""
    found: dict[str, Term] = {}
    for name, words, scene, placed in zip(
        planner.names, planner.mission.leg_names, planner.scenes, planner.program.legs, strict=True
    ):
        for part in scene.names("rows"):
            unit = UNITS.get(part, "N")
            about = f"{words}: {'torque' if unit == 'N m' else 'force'} minus what the motion needs"
            found[f"{name}_{part}"] = Term(unit, f"{about}, one column a node")
        for group in _groups(placed.program.rows.groups):
            if group.name != "dynamics":
                found[f"{name}_{identifier(group.name)}_rows"] = _told(group, f"{words}: rows of {group.name}")
    for group in _groups(planner.program.rows.groups):
        found[f"{identifier(group.name)}_rows"] = _told(group, f"rows of {group.name}")
    return found | {"violation": Term("-", "largest violation of a row or bound, relative to its scale")}


def _told(group: Group, words: str) -> Term:
    units = [unit or "-" for unit in group.units] or ["-"] * len(group.labels)
    names = ", ".join(label or group.name for label in group.labels)
    return Term(
        ", ".join(dict.fromkeys(units)), f"{words} beyond their bounds, in units {', '.join(units)}: {names}"
    )


def _solver_terms(planner: MissionPlanner) -> dict[str, Term]:
    mission: Mission = planner.mission
    unit = mission.objective.unit_with(mission.actuator)
    terms = planner.terms | _row_terms(planner)
    terms |= {
        "objective": Term(unit, "the objective, in its own sign"),
        "largest_residual": Term("N", "largest defect of the discrete Euler-Lagrange equations"),
    }
    for side in planner.multipliers:
        for name in [name for part in side for name in part.sizes]:
            about = name.removeprefix("multipliers_").replace("_", " ")
            words = f"multipliers of {about}, per fraction of the duration where one a node"
            terms[name] = Term(f"{unit or '1'} per unit of the row", words)
    guesses = {f"guess_{name}": Term(term.unit, f"guess: {term.words}") for name, term in terms.items()}
    return planner.numbers.terms | terms | guesses


def _violation(*sides: tuple[ca.MX, ca.MX, ca.MX]) -> ca.MX:
    """How far unknowns and rows are beyond their bounds at most, all scaled."""
    values, low, high = (ca.vertcat(*part) for part in zip(*sides, strict=True))
    return most_of(ca.fmax(low - values, values - high), values)


def _objective(planner: MissionPlanner, scaled: Any) -> Any:
    return planner.mission.objective.sense * planner.program.cost * scaled


def _own_size(planner: MissionPlanner) -> int:
    return sum(layout.size for layout, _ in planner.program.own.values())


def _scaled(parts: list[Part], given: dict[str, ca.MX]) -> ca.MX:
    """Scaled multipliers, stacked, from those of each group by name."""
    return ca.vertcat(
        *[ca.vec(ca.vertcat(*[given[name] for name in part.sizes]) / ca.DM(part.unit)) for part in parts]
    )


def _given_back(parts: list[Part], scaled: ca.MX) -> dict[str, ca.MX]:
    """Multipliers of each group by name, from stacked ones."""
    found: dict[str, ca.MX] = {}
    ends = np.cumsum([0, *[part.unit.size for part in parts]])
    for part, first, stop in zip(parts, ends[:-1], ends[1:], strict=True):
        value = ca.reshape(scaled[int(first) : int(stop)], *part.unit.shape) * ca.DM(part.unit)
        found |= rows_of(value, part.sizes)
    return found
