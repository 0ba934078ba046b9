"""The discrete Euler-Lagrange equations of a path as CasADi functions of their own."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import QUATERNION
from dmoc.motion.mesh import node_fractions
from dmoc.motion.momenta import legendre_function
from dmoc.planners.functions import Scene
from dmoc.planners.terms import ATTITUDE, PLACE, TERMS, Exported, Term, named


def momenta(scene: Scene, path: dict[str, ca.MX]) -> list[ca.MX]:
    """P_0 .. P_s [m/s] of every step of a path, of a body that turns Z'P, one column a step."""
    # positions relative to the first one: far from the origin, their differences would lose digits
    places = scene.joined(path, "places")
    h, origin = path["duration"] / scene.steps, places[:, 0]
    q = ca.vertcat(*scene.at_nodes(places - ca.repmat(origin, 1, scene.nodes)))
    m = ca.vertcat(*scene.at_nodes(path["masses"])) if scene.burns else ca.MX(0, scene.steps)
    same = ca.vertcat(h, origin, *([] if scene.burns else [path["mass"]]), *scene.constants_in(path))
    times = step_times(scene.steps)(ca.vertcat(0, path["start_time"], h))[1]
    return list(_momenta_kernel(scene).map(scene.steps)(q, m, scene.split(path["forces"]), times, same))


def step_times(steps: int) -> ca.Function:
    """(0, start time, h) -> times at the start of all steps.

    Each is start time + count h: added up step by step, the times would collect rounding errors.
    """
    state = ca.MX.sym("state", 3)
    given = ca.vertcat(state[0] + 1, state[1:])
    return ca.Function("count", [state], [given, state[1] + state[0] * state[2]]).mapaccum("times", steps)


def _momenta_kernel(scene: Scene) -> ca.Function:
    """(q, m, u, t, (h, origin, the mass if it is constant)) -> P_0 .. P_s of one step, or Z'P."""
    n, s = scene.dynamics.positions, scene.rule.degree
    q, u, t = ca.MX.sym("q", n * (s + 1)), ca.MX.sym("u", scene.controls * scene.step_columns), ca.MX.sym("t")
    lengths = np.cumsum([0, 1, n, *([] if scene.burns else [1]), *scene.constants.values()]).tolist()
    m, same = ca.MX.sym("m", s + 1 if scene.burns else 0), ca.MX.sym("same", lengths[-1])
    h, origin, *others = ca.vertsplit(same, lengths)
    masses = m if scene.burns else ca.repmat(others[0], s + 1)
    function = scene.closed(legendre_function(scene.dynamics, scene.rule.order, scene.hold))
    parts = function(q, masses, u, t, h, origin, *others[0 if scene.burns else 1 :])
    if scene.turns:
        along = _along(scene)
        parts = [along(place + origin, part) for place, part in zip(ca.vertsplit(q, n), parts, strict=True)]
    return ca.Function("momenta", [q, m, u, t, same], parts).expand()


def _along(scene: Scene) -> ca.Function:
    """(q, a column of the size of q) -> Z(q)' times it."""
    body = scene.dynamics.configuration
    q, column = ca.SX.sym("q", body.size), ca.SX.sym("column", body.size)
    return ca.Function("along", [q, column], [ca.densify(body.along(q, column))])


def residual_of(scene: Scene, path: dict[str, ca.MX]) -> dict[str, ca.MX]:
    """Defect of the discrete Euler-Lagrange equations at every node, as a force [N] and a torque [N m].

    Where the body turns, what breaks q.q = 1 is beside it, where links hold it, their gaps are.
    """
    body, defect = scene.dynamics.configuration, _defect(scene, path)
    if body.joined:
        defect = _without_reactions(scene, path, defect)
    found = scene.parted(defect, "residual")
    if body.joined:
        q = ca.SX.sym("q", body.size)
        gaps = ca.Function("gaps", [q], [ca.densify(body.links_at(q))])
        found["residual_links"] = gaps.map(scene.nodes)(scene.joined(path, "places"))
    if scene.turns:
        norms = [ca.sum1(q * q) - 1 for q in _attitudes(path)]
        found["residual_norm"] = norms[0] if len(norms) == 1 else ca.vertcat(*norms)
    return found


def _defect(scene: Scene, path: dict[str, ca.MX]) -> ca.MX:
    """Each row is a momentum; over the time it acts for and times the mass it is a force."""
    rule, n = scene.rule, scene.dynamics.freedom
    q, start_time, duration = scene.joined(path, "places"), path["start_time"], path["duration"]
    masses = scene.at_nodes(path["masses"]) if scene.burns else [path["mass"]] * (rule.degree + 1)
    last_mass = path["masses"][-1] if scene.burns else path["mass"]
    h = duration / scene.steps
    parts = momenta(scene, path)
    v0, v1 = (scene.joined(path, "speed", prefix) for prefix in ("start_", "goal_"))
    constants = scene.constants_in(path)
    begin = scene.momentum(start_time, q[:, 0], v0, masses[0][0], constants)
    finish = scene.momentum(start_time + duration, q[:, -1], v1, last_mass, constants)
    arriving = ca.horzcat(begin, parts[-1][:, :-1])
    weight = [rule.weights[0] * h, *(w * h for w in rule.weights[1:-1])]
    # at a node between two steps the force acts for the end of one and the beginning of the other, so its row
    # is divided by twice the weight; at the start of the path it acts for one of them, hence the factor 2
    ends = _scaled_rows(parts[0] + arriving, masses[0] / (2 * weight[0]), n)
    ends = ca.horzcat(2 * ends[:, 0], ends[:, 1:])
    inner = [_scaled_rows(parts[j], masses[j] / weight[j], n) for j in range(1, rule.degree)]
    rows = ca.reshape(ca.vertcat(ends, *inner), n, scene.nodes - 1) if inner else ends
    rows = ca.horzcat(rows, (parts[-1][:, -1] - finish) * last_mass / weight[0])
    body = scene.dynamics.configuration
    share = body.turning_share(path["masses"]) if scene.burns else 1
    if isinstance(share, int):
        return rows
    # Where the inertia stays while propellant burns, turning is described per start mass.
    turning = ca.DM(body.coordinates.rates.astype(float))
    return rows / (ca.repmat(1 - turning, 1, scene.nodes) + turning @ share)


def _without_reactions(scene: Scene, path: dict[str, ca.MX], rows: ca.MX) -> ca.MX:
    """Rows at every node without what the reactions of links take up."""
    fractions = node_fractions(np.linspace(0.0, 1.0, scene.steps + 1), scene.rule)
    times = path["start_time"] + path["duration"] * ca.DM(fractions).T
    mass = path["masses"] if scene.burns else path["mass"]
    tangential = scene.dynamics.tangential.map(scene.nodes)
    return tangential(times, scene.joined(path, "places"), mass, rows)


def _scaled_rows(rows: ca.MX, factor: ca.MX, axes: int) -> ca.MX:
    """Rows times a number, or times one number a column."""
    return rows * (factor if factor.is_scalar() else ca.repmat(factor, axes, 1))


def path_symbols(scene: Scene) -> dict[str, ca.MX]:
    """Symbols for what the residual of a path is made of."""
    mass = "masses" if scene.burns else "mass"
    ends = *scene.names("speed", "start_"), *scene.names("speed", "goal_")
    return scene.symbols(
        *scene.names("places"), *ends, "forces", mass, "start_time", "duration", *scene.constants
    )


def residual(scene: Scene) -> Exported:
    """The discrete Euler-Lagrange equations of a path."""
    path = path_symbols(scene)
    words = "discrete Euler-Lagrange equations of a path; at both ends with the momentum of the boundary state"
    return Exported(named("residual", path, residual_of(scene, path)), words, scene.terms)


def residual_jacobian(scene: Scene) -> Exported:
    """Derivatives of the residual by every argument."""
    path, outputs, terms = path_symbols(scene), {}, dict(scene.terms)
    for part, rows in residual_of(scene, path).items():
        prefix = "" if part == PLACE.residual else f"{part.removeprefix('residual_')}_"
        for name, symbol in path.items():
            slope = ca.jacobian(ca.vec(rows), ca.vec(symbol))
            # the length of quaternions depends on nothing else
            if part not in ("residual_norm", "residual_links") or slope.nnz():
                outputs[f"{prefix}by_{name}"] = slope
                terms[f"{prefix}by_{name}"] = _slope_term(scene, part, name)
    return Exported(named("residual_jacobian", path, outputs), "sparse derivatives of the residual", terms)


def _slope_term(scene: Scene, part: str, name: str) -> Term:
    above, below = TERMS[part].unit, (scene.terms.get(name) or TERMS[name]).unit
    unit = f"{above}/({below})" if {"/", " "} & set(below) else f"{above}/{below}"
    words = f"derivative of the {part.replace('_', ' ')} by {name}, both stacked column after column"
    return Term(above if below == "-" else unit, words)


def velocities_of(scene: Scene, path: dict[str, ca.MX]) -> ca.MX:
    """Velocities at the step ends [m/s], then rates [rad/s], from the discrete Legendre transforms."""
    parts = momenta(scene, path)
    p = ca.horzcat(-parts[0], parts[-1][:, -1])
    times = path["start_time"] + path["duration"] * ca.DM(np.linspace(0, 1, scene.steps + 1)).T
    ends = slice(None, None, scene.rule.degree)
    mass = path["masses"][:, ends] if scene.burns else path["mass"]
    velocity = scene.closed(scene.dynamics.velocity).map(scene.steps + 1)
    constants = [ca.repmat(one, 1, scene.steps + 1) for one in scene.constants_in(path)]
    return velocity(times, scene.joined(path, "places")[:, ends], p, mass, *constants)


def largest_turn(scene: Scene, path: dict[str, ca.MX]) -> dict[str, ca.MX]:
    """The largest angle between neighbouring nodes of a body that turns, or of a link."""
    body, turns = scene.dynamics.configuration, []
    if body.joined:
        bars = scene.dynamics.bars.map(scene.nodes)(scene.joined(path, "places"))
        cosine: Any = 1
        for row in range(body.joined):
            ways = ca.reshape(bars[row, :].T, body.freedom, scene.nodes)
            ways = ways / ca.repmat(ca.sqrt(ca.sum1(ways * ways)), body.freedom, 1)
            cosine = ca.fmin(cosine, ca.mmin(ca.sum1(ways[:, 1:] * ways[:, :-1])))
        turns.append(ca.acos(ca.fmax(cosine, -1)))
    for q in _attitudes(path) if scene.turns else []:
        cosines = ca.sum1(q[:, 1:] * q[:, :-1])
        turns.append(2 * ca.acos(ca.fmax(ca.fmin(ca.mmin(cosines), 1), -1)))
    return {"largest_turn": turns[0] if len(turns) == 1 else ca.mmax(ca.vertcat(*turns))} if turns else {}


def _attitudes(path: dict[str, ca.MX]) -> list[ca.MX]:
    """The quaternions of each body that turns, one column a node."""
    return ca.vertsplit(path[ATTITUDE.places], QUATERNION)
