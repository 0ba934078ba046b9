"""The solver of an NLP as one CasADi function in SI units: states, limits and a warm start in, a plan out."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.guess.starting import starting_guess
from dmoc.ipopt.run import Answer
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath, Key
from dmoc.motion.stability import refuse_unstable
from dmoc.nlp.solving import NLP
from dmoc.nlp.transcription import check_mesh, transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.planners.functions import Scene, rows_of
from dmoc.planners.numbers import Numbers
from dmoc.planners.residual import largest_turn, path_symbols, residual_of, velocities_of
from dmoc.planners.terms import ATTITUDE, PLACE, TERMS, Exported, Term, named
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Planner:
    """An NLP and what its solver needs to speak SI units."""

    scene: Scene
    nlp: NLP
    guess: DiscretePath

    @classmethod
    def of(cls, problem: TransferProblem, order: int, steps: int, hold: bool, guess: Any = None) -> Planner:
        """The planner of a problem on equal steps; ValueError beyond the scheme's stability limit."""
        start = starting_guess(problem, check_mesh(steps), order, hold, guess)
        scene = Scene(problem, scheme(order), steps, hold)
        refuse_unstable(Dynamics.of(problem), start, problem.start_time, problem.duration_bounds)
        return cls(scene, transcribe_onto(problem, start, units_of(problem, start)), start)

    @cached_property
    def numbers(self) -> Numbers:
        return Numbers.of(self.nlp)

    @cached_property
    def _ones(self) -> dict[Key, np.ndarray]:
        # the way from scaled to SI multipliers is linear: what it makes of ones are the factors themselves
        columns, rows = np.ones(self.nlp.columns.size), np.ones(self.nlp.rows.size)
        answer = Answer(columns, columns, rows, rows, 0.0, "", 0, 0, 0.0)
        return self.nlp.path(self.scene.problem, answer).multipliers

    @cached_property
    def groups(self) -> list[dict[str, int]]:
        """For every group of unknowns, then of rows, what its multipliers are called here: names and sizes."""
        keys = list(self._ones)
        return [
            multiplier_names(self.scene, key, keys, one.shape[1]) for key, one in self._ones.items() if one.size
        ]

    @cached_property
    def multipliers(self) -> dict[str, np.ndarray]:
        """SI value of a scaled multiplier of 1, of every group, shape (components, count)."""
        return self.by_name(self._ones)

    def by_name(self, multipliers: dict[Key, np.ndarray]) -> dict[str, np.ndarray]:
        """Multipliers of a path under the names they have here, one column an index."""
        found: dict[str, np.ndarray] = {}
        for key, value in multipliers.items():
            if value.size:
                names = multiplier_names(self.scene, key, list(multipliers), value.shape[1])
                pieces = np.split(value.T, np.cumsum(list(names.values()))[:-1])
                found |= dict(zip(names, pieces, strict=True))
        return found

    @property
    def plan_names(self) -> list[str]:
        """The arguments that make up a plan, without its multipliers."""
        scene = self.scene
        more = (
            ["reactions"] * scene.held + ["masses"] * scene.burns + ["duration"] * scene.problem.free_duration
        )
        return [*scene.names("places"), *scene.names("speeds"), "forces", *more]

    def scaled_multipliers(self, multipliers: dict[str, ca.MX]) -> list[ca.MX]:
        """Scaled multipliers of unknowns and of rows, from those in SI units by name."""
        scaled = {name: symbol / ca.DM(self.multipliers[name]) for name, symbol in multipliers.items()}
        lam = [ca.vec(ca.vertcat(*[scaled[name] for name in group])) for group in self.groups]
        ends = [0, self.nlp.columns.size, self.nlp.columns.size + self.nlp.rows.size]
        return ca.vertsplit(ca.vertcat(*lam), ends)

    def pack(self, plan: dict[str, Any]) -> ca.MX:
        """Scaled unknowns."""
        speeds = self.scene.joined(plan, "speeds")
        values = {
            "position": self.scene.joined(plan, "places") - ca.DM(self.nlp.units.origin),
            "force": plan["forces"],
            "mass": plan.get("masses"),
            "reaction": plan.get("reactions"),
            "start.velocity": speeds[:, 0],
            "goal.velocity": speeds[:, -1],
            "duration": plan.get("duration"),
        }
        return self.nlp.scaled(values, ca.vec, lambda parts: ca.vertcat(*parts))

    def unpack(self, x: ca.MX, numbers: dict[str, ca.MX]) -> dict[str, ca.MX]:
        """What the residual of a path is made of, from scaled unknowns."""
        groups = self.nlp.columns.groups
        pieces = ca.vertsplit(x * ca.DM(self.nlp.columns.scales()), [0, *(group.stop for group in groups)])
        found = {
            group.name: ca.reshape(piece, len(group.labels), group.count)
            for group, piece in zip(groups, pieces, strict=True)
        }
        scene = self.scene
        mass = {"masses": found["mass"]} if scene.burns else {"mass": numbers["mass"]}
        states = scene.parted(found["position"] + ca.DM(self.nlp.units.origin), "places")
        for end in ("start", "goal"):
            states |= scene.parted(found[f"{end}.velocity"], "speed", f"{end}_")
        reactions = {"reactions": found["reaction"]} if scene.held else {}
        return (
            mass
            | states
            | reactions
            | {name: numbers[name] for name in scene.constants}
            | {
                "forces": found["force"],
                "start_time": numbers["start_time"],
                "duration": found["duration"] if "duration" in found else numbers["duration"],
            }
        )


def multiplier_names(scene: Scene, key: Key, keys: list[Key], size: int) -> dict[str, int]:
    """multipliers_goal_speed for the group goal.speed; with its kind where two groups have one name.

    A group of coordinates or velocities has a name for each part of the body.
    """
    for end in ("start", "goal"):
        if key.group == f"{end}.velocity":
            return scene.names("speed", f"multipliers_{end}_")
    if key.group in (PLACE.place, PLACE.rows):
        return scene.names("place" if key.group == PLACE.place else "rows", "multipliers_")
    twins = [other for other in keys if other.group == key.group]
    return {f"multipliers_{key.group.replace('.', '_')}" + (f"_{key.kind}" if len(twins) > 1 else ""): size}


def cost(planner: Planner) -> Exported:
    """The objective of a path."""
    path, nlp, scene = path_symbols(planner.scene), planner.nlp, planner.scene
    # no cost looks at velocities but those of the ends, or at reactions
    ends = ca.horzcat(*[scene.joined(path, "speed", end) for end in ("start_", "goal_")])
    plan = path | scene.parted(ends, "speeds")
    if scene.held:
        plan["reactions"] = ca.MX.zeros(*scene.shape("reactions"))
    given = {name: symbol for name, symbol in planner.numbers.symbols().items() if name not in path} | path
    _, _, p = planner.numbers.bounds_and_parameters(given)
    f = nlp.objective(nlp.assembly.objective(planner.pack(plan), p))  # type: ignore[arg-type]
    whole = named("cost", given, {"cost": f})
    used = {
        name: symbol
        for i, (name, symbol) in enumerate(given.items())
        if name in path or whole.jac_sparsity(0, i).nnz()
    }
    values = [used[name] if name in used else planner.numbers.value(name) for name in given]
    terms = (
        scene.terms
        | planner.numbers.terms
        | {"cost": Term(_objective_unit(planner), "the objective, in its own sign")}
    )
    return Exported(named("cost", used, {"cost": whole(*values)}), "the objective of a path", terms)


def solver(planner: Planner, options: dict[str, Any] | None, warm: bool) -> Exported:
    """The parametric solver, for a cold or for a warm start."""
    nlp, scene = planner.nlp, planner.scene
    numbers, plan = planner.numbers.symbols(), scene.symbols(*planner.plan_names)
    multipliers = {name: ca.MX.sym(name, *one.shape) for name, one in planner.multipliers.items()}
    lower, upper, p = planner.numbers.bounds_and_parameters(_of_one_sign(numbers, plan))
    _, _, row_lower, row_upper = nlp.bounds(scene.problem)
    lam_x, lam_g = planner.scaled_multipliers(multipliers)
    bounds = {"lbx": lower, "ubx": upper, "lbg": row_lower, "ubg": row_upper}
    x0 = ca.fmin(ca.fmax(planner.pack(plan), lower), upper)
    found = nlp.solver(options, warm)(x0=x0, p=p, lam_x0=lam_x, lam_g0=lam_g, **bounds)
    # how far unknowns and rows are beyond their bounds, all scaled
    both = ca.vertcat(found["x"], found["g"])
    beyond = ca.fmax(ca.vertcat(lower, row_lower) - both, both - ca.vertcat(upper, row_upper))
    outputs = _plan_of(planner, numbers, found) | _by_group(planner, ca.fmax(beyond, 0), "violations")
    outputs["violation"] = most_of(beyond, both)
    guesses = {f"guess_{name}": symbol for name, symbol in (plan | multipliers).items()}
    places = " and ".join(scene.names("places"))
    name, words = ("warm_solver", "from a former plan") if warm else ("solver", f"from a guess of the {places}")
    function = named(name, numbers | guesses, outputs)
    return Exported(function, f"Ipopt's solution of the transfer, {words}", _solver_terms(planner))


def _plan_of(planner: Planner, numbers: dict[str, ca.MX], found: dict[str, ca.MX]) -> dict[str, ca.MX]:
    """The plan that a solve gave, in SI units; its residual is computed from the plan, not taken from Ipopt."""
    path = planner.unpack(found["x"], numbers)
    path |= planner.scene.parted(velocities_of(planner.scene, path), "speeds")
    residual = residual_of(planner.scene, path)
    largest = {
        f"largest_{name}": most_of(ca.fabs(ca.vec(part)), ca.vec(part)) for name, part in residual.items()
    }
    lam = _by_group(planner, ca.vertcat(found["lam_x"], found["lam_g"]), "multipliers")
    return {
        **{name: path[name] for name in planner.plan_names},
        **{name: value * ca.DM(planner.multipliers[name]) for name, value in lam.items()},
        "objective": planner.nlp.objective(found["f"]),  # type: ignore[arg-type, dict-item]
        **residual,
        **largest,
        **largest_turn(planner.scene, path),
    }


def _of_one_sign(numbers: dict[str, ca.MX], plan: dict[str, ca.MX]) -> dict[str, ca.MX]:
    """The numbers with the attitudes of both ends as unit quaternions of the sign that the guess has there.

    q and -q are one attitude, and whoever measures it may give either; between the two a path would make a
    whole turn more.
    """
    made = dict(numbers)
    for end, place in (("start", 0), ("goal", -1)):
        if (name := f"{end}_{ATTITUDE.place}") in numbers:
            q = numbers[name]
            along = ca.dot(q, plan[ATTITUDE.places][:, place])
            made[name] = q / ca.norm_2(q) * ca.if_else(along < 0, -1, 1)
    return made


def nominal(planner: Planner) -> Exported:
    """What the problem itself states, and its own guess: inputs of the solver to begin with."""
    guess, known, scene = planner.guess, planner.by_name(planner.guess.multipliers), planner.scene
    ends = np.linspace(guess.start_velocity, guess.goal_velocity, scene.steps + 1)
    plan: dict[str, Any] = scene.parted(ca.DM(guess.position.T), "places") | scene.parted(
        ca.DM(ends.T), "speeds"
    )
    plan |= {"forces": guess.control.T, "masses": guess.mass[None], "duration": guess.duration}
    plan["reactions"] = np.zeros(scene.shape("reactions")) if guess.reaction is None else guess.reaction.T
    values = {name: planner.numbers.value(name) for name in planner.numbers.names}
    values |= {f"guess_{name}": ca.DM(plan[name]) for name in planner.plan_names}
    values |= {f"guess_{name}": known.get(name, 0 * one) for name, one in planner.multipliers.items()}
    outputs = {name: ca.MX(ca.DM(value)) for name, value in values.items()}
    words = "the problem's own numbers and its guess, named like the inputs of the solver"
    return Exported(named("nominal", {}, outputs), words, _solver_terms(planner))


def _by_group(planner: Planner, values: ca.MX, prefix: str) -> dict[str, ca.MX]:
    """A number of every unknown and row as one matrix a group, named like its multipliers."""
    counts = [planner.multipliers[next(iter(group))].shape[1] for group in planner.groups]
    rows = [sum(group.values()) for group in planner.groups]
    pieces = ca.vertsplit(values, np.cumsum([0, *np.multiply(rows, counts)]).tolist())
    found: dict[str, ca.MX] = {}
    for group, piece, row, count in zip(planner.groups, pieces, rows, counts, strict=True):
        found |= rows_of(ca.reshape(piece, row, count), group)
    return {name.replace("multipliers", prefix, 1): value for name, value in found.items()}


def most_of(values: ca.MX, finite: ca.MX) -> ca.MX:
    """The largest value, at least 0; infinite if `finite` is not, for a maximum in CasADi passes over NaN."""
    return ca.if_else(ca.sumsqr(finite) < np.inf, ca.mmax(ca.fmax(values, 0)), np.inf)


def _objective_unit(planner: Planner) -> str:
    problem = planner.scene.problem
    return problem.objective.unit_with(problem.actuator)


def _solver_terms(planner: Planner) -> dict[str, Term]:
    unit = _objective_unit(planner)
    terms = {
        "objective": Term(unit, "the objective, in its own sign"),
        "largest_residual": Term("N", "largest defect of the discrete Euler-Lagrange equations"),
        "largest_residual_torque": Term("N m", "largest defect of the discrete equations of the turn"),
        "largest_residual_wheels": Term("N m", "largest defect of the discrete equations of wheels"),
        "largest_residual_norm": Term("-", "largest |q.q - 1| of the quaternions"),
        "largest_turn": Term("rad", "largest turn between neighbouring nodes; from pi/2 on the plan is wrong"),
        "violation": Term(
            "-", "largest violation of a row or bound, relative to its scale; infinite if undefined"
        ),
        "duration": Term("s", "duration of the transfer"),
    }
    for name in planner.multipliers:
        group = name.removeprefix("multipliers_")
        words = f"multipliers of {group}, per fraction of the duration where one a node"
        terms[name] = Term(f"{unit or '1'} per unit of the row", words)
        terms[f"violations_{group}"] = Term("-", f"how far {group} is beyond its bounds, relative to its scale")
    terms |= planner.scene.terms
    plan = {name: terms.get(name) or TERMS[name] for name in (*planner.plan_names, *planner.multipliers)}
    guesses = {f"guess_{name}": Term(term.unit, f"guess: {term.words}") for name, term in plan.items()}
    return planner.numbers.terms | terms | guesses
