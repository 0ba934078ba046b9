"""What an answer is worth, and how errors spread along it, as CasADi functions of their own."""

from __future__ import annotations

from typing import Any

import casadi as ca

from dmoc.planners.functions import Scene, one_step
from dmoc.planners.planner import Planner
from dmoc.planners.terms import PLACE, TERMS, Exported, Term, named, number_terms


def worth(planner: Planner) -> Exported:
    """The derivatives of the objective by all numbers, at an answer of the solver.

    By the envelope theorem those of the Lagrangian with unknowns and multipliers as they are.
    """
    nlp, scene = planner.nlp, planner.scene
    numbers, plan = planner.numbers.symbols(), scene.symbols(*planner.plan_names)
    multipliers = {name: ca.MX.sym(name, *one.shape) for name, one in planner.multipliers.items()}
    lam_x, lam_g = planner.scaled_multipliers(multipliers)
    stacked = ca.MX.sym("numbers", sum(symbol.numel() for symbol in numbers.values()))
    pieces, at = {}, 0
    for name, symbol in numbers.items():
        pieces[name] = stacked[at : at + symbol.numel()]
        at += symbol.numel()
    lower, upper, p = planner.numbers.bounds_and_parameters(pieces)
    x = planner.pack(plan)
    total = nlp.assembly.objective(x, p) + ca.dot(lam_g, nlp.assembly.constraints(x, p))  # type: ignore[operator]
    # Bounds that are infinite have slopes of 0; their values must not enter, as 0 times infinity is undefined.
    below, above = (
        ca.jtimes(side, stacked, lam, True)
        for side, lam in ((lower, ca.fmin(lam_x, 0)), (upper, ca.fmax(lam_x, 0)))
    )
    slopes = (ca.gradient(total, stacked) - below - above) * nlp.units.cost * scene.problem.objective.sense
    slopes = ca.substitute([slopes], [stacked], [ca.vertcat(*numbers.values())])[0]
    outputs, at = {}, 0
    for name, symbol in numbers.items():
        outputs[f"worth_{name}"] = slopes[at : at + symbol.numel()]
        at += symbol.numel()
    unit = scene.problem.objective.unit_with(scene.problem.actuator) or "1"
    known = scene.terms | planner.numbers.terms
    terms = {one: known.get(one) or TERMS[one] for one in (*numbers, *plan)}
    terms |= {
        name: Term(f"{unit} per unit of the row", "multipliers of a plan, as the solver gives them")
        for name in multipliers
    }
    terms |= {
        f"worth_{name}": Term(
            f"{unit} per {terms[name].unit or '1'}", f"derivative of the objective by {name}, along optima"
        )
        for name in numbers
    }
    words = "what the numbers are worth: derivatives of the objective by them, at a plan and its multipliers"
    return Exported(named("worth", numbers | plan | multipliers, outputs), words, terms)


def covariance(scene: Scene) -> Exported:
    """The covariance of position and velocity along a plan, by the Jacobian of every step.

    P_(k+1) = A P_k A' + B Q B': A by the state at the begin of the step, B by its forces, whose errors are
    drawn anew each step and are the same at all its nodes.
    """
    n, freedom, columns = scene.dynamics.positions, scene.dynamics.freedom, scene.step_columns
    step = one_step(scene).function
    position, velocity = ca.MX.sym("q", n), ca.MX.sym("v", freedom)
    forces, shift = ca.MX.sym("u", scene.controls * columns), ca.MX.sym("e", scene.controls)
    rest = {
        name: ca.MX.sym(name, step.size_in(name))
        for name in step.name_in()
        if name not in ("position", "velocity", "forces")
    }
    pushed = ca.reshape(forces, scene.controls, columns) + ca.repmat(shift, 1, columns)
    after = step(position=position, velocity=velocity, forces=pushed, **rest)
    moved = ca.vertcat(after["next_position"], after["next_velocity"])
    by_state = ca.jacobian(moved, ca.vertcat(position, velocity))
    by_force = ca.substitute([ca.jacobian(moved, shift)], [shift], [ca.MX.zeros(scene.controls)])[0]
    by_state = ca.substitute([by_state], [shift], [ca.MX.zeros(scene.controls)])[0]
    slopes = ca.Function(
        "slopes", [position, velocity, forces, *rest.values()], [ca.densify(by_state), ca.densify(by_force)]
    )
    given = scene.symbols(*scene.names("places"), *scene.names("speeds"), "forces", "start_time", "duration")
    mass = "masses" if scene.burns else "mass"
    given |= scene.symbols(mass)
    numbers = {name: symbol for name, symbol in rest.items() if name not in ("mass", "time", "time_step")}
    given |= numbers
    size = n + freedom
    given["start_covariance"] = ca.MX.sym("start_covariance", size, size)
    given["force_covariance"] = ca.MX.sym("force_covariance", scene.controls, scene.controls)
    ends = slice(None, None, scene.rule.degree)
    places = given[PLACE.places][:, ends][:, : scene.steps]
    h = given["duration"] / scene.steps
    times = given["start_time"] + h * ca.DM(range(scene.steps)).T
    masses = (
        given["masses"][:, ends][:, : scene.steps] if scene.burns else ca.repmat(given["mass"], 1, scene.steps)
    )
    known: dict[str, Any] = {"mass": masses, "time": times, "time_step": ca.repmat(h, 1, scene.steps)}
    same = [known[name] if name in known else ca.repmat(rest[name], 1, scene.steps) for name in rest]
    a, b = slopes.map(scene.steps)(
        places, given[PLACE.speeds][:, : scene.steps], scene.split(given["forces"]), *same
    )
    P, A, B = ca.MX.sym("P", size, size), ca.MX.sym("A", size, size), ca.MX.sym("B", size, scene.controls)
    Q = ca.MX.sym("Q", scene.controls, scene.controls)
    spread = ca.Function("spread", [P, A, B, Q], [A @ P @ A.T + B @ Q @ B.T])
    many = spread.mapaccum(scene.steps)(
        given["start_covariance"], a, b, ca.repmat(given["force_covariance"], 1, scene.steps)
    )
    outputs = {"covariances": ca.horzcat(given["start_covariance"], many)}
    terms = scene.terms | {
        "start_covariance": Term("m, m/s", "covariance of position and velocity at the start"),
        "force_covariance": Term(
            "N^2", "covariance of the errors of the controls of a step, drawn anew each step"
        ),
        "covariances": Term("m, m/s", "covariances of position and velocity at the step ends, side by side"),
    }
    terms |= number_terms(numbers.keys() - scene.constants.keys())
    words = "covariance of position and velocity along a plan, by the Jacobians of its steps"
    return Exported(named("covariance", given, outputs), words, terms)
