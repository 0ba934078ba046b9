"""The assembled NLP has CasADi's own derivatives, a name for every place, and a graph that does not grow."""

from dataclasses import dataclass, replace
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    ClohessyWiltshire,
    Constraint,
    Engine,
    FinalRadius,
    FreeForce,
    Fuel,
    KeepIn,
    KeepOut,
    LinearDrag,
    Nozzles,
    Objective,
    PointGravity,
    Pose,
    RotatingFrame,
    Row,
    SpeedLimit,
    Spring,
    State,
    Thrusters,
    Time,
    TransferProblem,
    UniformGravity,
    rotation,
    solve,
    transcribe,
    verify,
)
from dmoc.assembly import streamed
from dmoc.assembly.blocks import Scaling
from dmoc.assembly.symbolic import assemble
from dmoc.guess.starting import starting_guess
from dmoc.motion.lobatto import scheme
from dmoc.nlp import transcription
from dmoc.nlp.placement import Placement
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import units_of


class Lag(Objective):
    """A running cost that looks at the velocity, a terminal one at everything."""

    def running(self, t, q, v, u, m):
        return 0.5 * ca.dot(u, u) + (1 + t) * ca.dot(v, v) * ca.dot(q, q)

    def terminal(self, t, q, v, m):
        return t * ca.dot(q, v) + ca.dot(v, v) ** 2


def on_a_line(**changes):
    return TransferProblem(2.0, State(0.3, 0.1), State(1.4, -0.2), 1.7, **changes)


def in_the_plane(**changes):
    changes = {"duration": 1.7, **changes}
    return TransferProblem(2.0, State((1, 0.1), (0, 0.9)), State((-0.7, 1.1), (-0.8, -0.3)), **changes)


def in_space(**changes):
    start, goal = State((1, 0.1, 0.2), (0, 0.9, 0.1)), State((-0.7, 1.1, -0.3), (-0.8, -0.3, 0.2))
    return TransferProblem(2.0, start, goal, **{"duration": 1.7, **changes})


GRAVITY, FRAME, DRAG = PointGravity(1.2), RotatingFrame(0.4), LinearDrag(0.3)
ZONES = (KeepOut((0.2, 0.3), 0.1), SpeedLimit(3.0), KeepIn((-5, -5), (5, 5)))
SCENES = {
    "line": on_a_line(effects=UniformGravity(-1.5)),
    "line, drag, speed limit": on_a_line(effects=[DRAG, Spring(0.7, 0.2)], constraints=SpeedLimit(4.0)),
    "plane, nothing acts": in_the_plane(),
    "plane, gravity": in_the_plane(effects=[GRAVITY]),
    "plane, everything": in_the_plane(
        effects=[GRAVITY, FRAME, DRAG], actuator=BallForce(3.0), constraints=ZONES, duration=(0.5, 4.0)
    ),
    "plane, least time": in_the_plane(
        effects=[DRAG, FRAME], actuator=BallForce(3.0), objective=Time(), duration=(0.5, 4.0)
    ),
    "plane, cost of speed": in_the_plane(effects=[GRAVITY, FRAME], objective=Lag(), duration=(0.5, 4.0)),
    "plane, burning": in_the_plane(
        effects=[GRAVITY, DRAG], actuator=Engine(3.0, exhaust_velocity=9.0), objective=Fuel()
    ),
    "space": in_space(effects=[GRAVITY, ClohessyWiltshire(0.3)]),
    "space, everything": in_space(
        effects=[GRAVITY, RotatingFrame((0.1, -0.2, 0.3)), DRAG],
        actuator=BallForce(3.0),
        constraints=[KeepOut((0.2, 0.3, 0), 0.1), SpeedLimit(3.0)],
        duration=(0.5, 4.0),
    ),
    "space, burning, free time": in_space(
        effects=[GRAVITY, FRAME],
        actuator=Engine(3.0, exhaust_velocity=9.0),
        objective=Fuel(),
        duration=(0.5, 4.0),
    ),
    "a body, burning, free time": TransferProblem(
        2.0,
        Pose((0, 0, 0)),
        Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), 80)),
        (3.0, 9.0),
        inertia=(1.0, 2.0, 2.8),
        actuator=Thrusters([(0, 1, 0), (0, 0, 1)], [(1, 0, 0), (0, 1, 0)], 1.0, exhaust_velocity=9.0),
    ),
}


def random_point(nlp, seed=3):
    """A random point near the guess, random multipliers, and the parameters."""
    random = np.random.default_rng(seed)
    x = nlp.pack(starting_guess(nlp.problem, nlp.mesh, nlp.scheme.order, nlp.hold))
    x = x + 0.05 * random.standard_normal(x.size)
    return x, nlp.parameters(nlp.problem), random.standard_normal(nlp.rows.size)


def assert_same(seen, expected):
    """The same numbers to 1e-12 of the largest, and no structural nonzero missing."""
    expected = np.array(ca.DM(expected))
    np.testing.assert_allclose(np.array(ca.DM(seen)), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("order", [2, 4, 6, 8])
@pytest.mark.parametrize("scene", SCENES)
def test_derivatives_are_casadis_own(scene, order, hold):
    assert_derivatives_are_casadis_own(transcribe(SCENES[scene], order=order, hold=hold, mesh=(0, 0.2, 0.3, 1)))


def assert_derivatives_are_casadis_own(nlp):
    parts, (x, p, multipliers) = nlp.assembly, random_point(nlp)
    sigma, lam = ca.MX.sym("sigma"), ca.MX.sym("lam", nlp.rows.size)
    hessian = ca.triu(ca.hessian(sigma * parts.f + ca.dot(lam, parts.g), parts.x)[0])
    own = ca.Function(
        "own",
        [parts.x, parts.p, sigma, lam],
        [ca.gradient(parts.f, parts.x), ca.jacobian(parts.g, parts.x), hessian],
    )
    gradient, jacobian, hessian = own(x, p, 0.7, multipliers)
    assert_same(parts.gradient(x, p)[1], gradient)
    assert_same(parts.jacobian(x, p)[1], jacobian)
    assert_same(parts.hessian(x, p, 0.7, multipliers), hessian)


@pytest.mark.parametrize("scene", SCENES)
def test_jacobian_is_the_slope_of_the_constraints(scene):
    """Against differences, so that an error shared with CasADi's own would show too."""
    nlp = transcribe(SCENES[scene], order=4, steps=3)
    x, p, _ = random_point(nlp)
    way = np.random.default_rng(8).standard_normal(x.size)
    parts, step = nlp.assembly, 1e-5
    for function, slope in (
        (parts.constraints, parts.jacobian(x, p)[1] @ way),
        (parts.objective, parts.gradient(x, p)[1].T @ way),
    ):
        ends = [np.array(function(x + side * step * way, p)) for side in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(difference, slope, rtol=0, atol=1e-6 * (1 + np.abs(difference).max()))


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("name", ["plane, everything", "plane, burning"])
def test_units_and_mesh_may_be_parameters(name, hold):
    """With the numbers of another scaling the functions are those that have it built in."""
    problem = SCENES[name]
    guess = starting_guess(problem, np.array([0.0, 0.1, 0.3, 0.6, 1.0]), 4, hold)
    other = replace(guess, mesh=np.array([0.0, 0.3, 0.5, 0.9, 1.0]))
    stencils = stencils_of(problem, 4, hold)
    placed = [
        Placement(problem, stencils, scheme(4), hold, path.mesh, replace(units_of(problem, path), force=unit))
        for path, unit in ((guess, 1.0), (other, 0.3))
    ]
    scalings = [
        Scaling.of(place.blocks, place.columns.scales(), place.rows.scales(), cost)
        for place, cost in zip(placed, (1.0, 0.7), strict=True)
    ]
    assembled = assemble(placed[0].blocks, scalings[0], stencils.parameter_count, parametric=True)
    built_in = assemble(placed[1].blocks, scalings[1], stencils.parameter_count)
    numbers = np.random.default_rng(5)
    x, lam = (numbers.uniform(0.4, 0.6, size) for size in (built_in.x.numel(), built_in.g.numel()))
    p = numbers.uniform(0.5, 1.0, stencils.parameter_count)
    both = (assembled, np.append(p, assembled.numbers(scalings[1]))), (built_in, p)
    assert built_in.numbers(scalings[1]).size == 0
    for given in ("objective", "constraints", "gradient", "jacobian", "hessian"):
        dual = (0.8, lam) if given == "hessian" else ()
        ours, theirs = (getattr(parts, given)(x, q, *dual) for parts, q in both)
        pair = (ours[1], theirs[1]) if given in ("gradient", "jacobian") else (ours, theirs)
        np.testing.assert_allclose(pair[0].full(), pair[1].full(), rtol=1e-13, atol=1e-13)


RESULTS = ("objective", "constraints", "gradient", "jacobian", "hessian")


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("scene", SCENES)
def test_functions_without_a_graph_are_the_same(scene, hold, monkeypatch):
    """Values, patterns and names; in the last columns that are evaluated at a time there are fewer."""
    monkeypatch.setattr(streamed, "MOST_COLUMNS", 3)
    problem, mesh = SCENES[scene], np.array([0, 0.1, 0.3, 0.6, 0.8, 1.0])
    guess = starting_guess(problem, mesh, 4, hold)
    stencils, units = stencils_of(problem, 4, hold), units_of(problem, guess)
    placed = Placement(problem, stencils, scheme(4), hold, mesh, units)
    scaling = Scaling.of(placed.blocks, placed.columns.scales(), placed.rows.scales(), 0.7)
    drawn, plain = (
        make(placed.blocks, scaling, stencils.parameter_count)
        for make in (assemble, streamed.assemble_streamed)
    )
    numbers = np.random.default_rng(5)
    x, lam = (numbers.uniform(0.4, 0.6, size) for size in (drawn.x.numel(), drawn.g.numel()))
    p = numbers.uniform(0.5, 1.0, stencils.parameter_count)
    for kind in RESULTS:
        given = (x, p, 0.8, lam) if kind == "hessian" else (x, p)
        functions = [getattr(parts, kind) for parts in (plain, drawn)]
        seen, expected = (function.call([ca.DM(one) for one in given])[-1] for function in functions)
        assert seen.sparsity() == expected.sparsity()
        assert_same(seen, expected)
        names = [(one.name(), one.name_in(), one.name_out()) for one in functions]
        assert kind in ("objective", "constraints") or names[0] == names[1]


def test_a_large_solve_has_no_graph(monkeypatch):
    """It makes the iterates of one with a graph; options of CasADi get the graph that they may ask for."""
    problem = SCENES["plane, gravity"]
    drawn = solve(problem, steps=2001)
    monkeypatch.setattr(transcription, "LEAST_STREAMED", 2001)
    monkeypatch.setattr(transcription, "assemble", None)
    plain = solve(problem, steps=2001)
    assert [level.iterations for level in plain.ladder] == [level.iterations for level in drawn.ladder]
    np.testing.assert_allclose(plain.position, drawn.position, rtol=0, atol=1e-12)
    with pytest.raises(TypeError):
        solve(problem, steps=2001, options={"verbose_init": False})


def instructions(function):
    """Of a function and of all those it calls; a map counts once, whatever it is mapped over."""
    inner = [part for part in function.find_functions() if part.class_name() in ("SXFunction", "MXFunction")]
    return function.n_instructions() + sum(part.n_instructions() for part in inner)


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("order", [2, 8])
def test_the_graph_does_not_grow_with_the_number_of_steps(order, hold):
    scene = SCENES["plane, everything"]

    def sizes(steps):
        parts = transcribe(scene, steps, order, hold).assembly
        functions = (parts.objective, parts.constraints, parts.gradient, parts.jacobian, parts.hessian)
        return [instructions(function) for function in functions]

    # On small meshes units and mesh are parameters, on large ones they are constants.
    assert sizes(100) == sizes(400)
    assert sizes(2100) == sizes(4200)


def test_every_row_and_unknown_has_a_name():
    nlp = transcribe(SCENES["space, everything"], 30)
    rows = [nlp.rows.name_of(place) for place in range(nlp.rows.size)]
    columns = [nlp.columns.name_of(place) for place in range(nlp.columns.size)]
    assert len(set(rows)) == len(rows) and len(set(columns)) == len(columns)
    assert rows[3 * 17 + 1] == "dynamics[17].y"
    assert columns[0] == "start.position.x" and columns[3] == "position[1].x"
    expected_columns = {"goal.position.z", "force[30].y", "start.velocity.x", "goal.velocity.z", "duration"}
    assert expected_columns <= set(columns)
    assert {"keep_out_1[4].clearance", "speed_limit_2[29].0", "actuator[0].magnitude"} <= set(rows)
    burning = transcribe(SCENES["plane, burning"], 30)
    assert "mass[30]" in [burning.columns.name_of(place) for place in range(burning.columns.size)]


def test_names_stand_where_their_row_acts():
    """Moving one node violates the rows of that node and of its neighbours, and of no other."""
    nlp = transcribe(in_space(effects=[GRAVITY]), 30)
    x, p, _ = random_point(nlp)
    columns = [nlp.columns.name_of(place) for place in range(nlp.columns.size)]
    jacobian = np.array(nlp.assembly.jacobian(x, p)[1])
    touched = {
        nlp.rows.name_of(int(row)) for row in np.flatnonzero(jacobian[:, columns.index("position[17].y")])
    }
    near = {f"dynamics[{node}].y" for node in (16, 17, 18)} | {"dynamics[17].x", "dynamics[17].z"}
    assert touched == near
    force = jacobian[:, columns.index("force[30].z")]
    assert [nlp.rows.name_of(int(row)) for row in np.flatnonzero(force)] == ["dynamics[30].z"]


CHANGES = {
    "dimension": in_space(effects=[GRAVITY], actuator=BallForce(3.0)),
    "effects": in_the_plane(effects=[PointGravity(1.3)], actuator=BallForce(3.0)),
    "actuator": in_the_plane(effects=[GRAVITY], actuator=BoxForce(3.0)),
    "objective": in_the_plane(effects=[GRAVITY], actuator=BallForce(3.0), objective=Lag()),
    "constraints": in_the_plane(effects=[GRAVITY], actuator=BallForce(3.0), constraints=SpeedLimit(9.0)),
    "free duration": in_the_plane(effects=[GRAVITY], actuator=BallForce(3.0), duration=(1.0, 2.0)),
}


@pytest.mark.parametrize("what", CHANGES)
def test_another_problem_is_refused_by_the_name_of_the_change(what):
    nlp = transcribe(in_the_plane(effects=[GRAVITY], actuator=BallForce(3.0)), 5)
    with pytest.raises(ValueError, match=rf"another {what}.*transcribe the new problem"):
        nlp.accepts(CHANGES[what])


@pytest.mark.parametrize(
    "old, new",
    [
        (Nozzles([(1, 0), (-1, 0), (0, 1), (0, -1)], 3.0), Nozzles([(1, 1), (-1, -1), (-1, 1), (1, -1)], 3.0)),
        (Nozzles([(1, 0), (-1, 0), (0, 1), (0, -1)], 3.0), Nozzles([(1, 0), (-1, 1), (-1, -1)], 3.0)),
        (Engine(3.0), Engine(3.0, exhaust_velocity=9.0)),
    ],
    ids=["directions", "number of nozzles", "burning"],
)
def test_another_actuator_of_the_same_kind_is_refused(old, new):
    nlp = transcribe(in_the_plane(actuator=old), 5)
    with pytest.raises(ValueError, match="another actuator"):
        nlp.accepts(in_the_plane(actuator=new))


@dataclass(frozen=True)
class Ceiling(Constraint):
    """A user's own: its height is built into its row."""

    height: float

    def rows(self, t, q, u, m):
        return [Row("height", q[1] / self.height, -np.inf, 1.0)]

    def excess(self, q, v):
        return np.maximum(0.0, q[:, 1] - self.height)

    def words(self):
        return f"stays below {self.height} m"


@dataclass(frozen=True)
class Roof(Ceiling):
    """A ceiling that may be raised, but whose slope is built in."""

    slope: float = 0.0
    adjustable: ClassVar[tuple[str, ...]] = ("height",)

    def rows(self, t, q, u, m):
        return [Row("height", (q[1] - self.slope * q[0]) / self.height, -np.inf, 1.0)]


class Slanted(FreeForce):
    """A user's own, with a number that is no field."""

    def __init__(self, angle):
        self.angle = angle

    def force(self, u):
        return ca.vertcat(u[0], u[1] + self.angle * u[0])


class Weighed(PointGravity):
    """The same for an effect."""

    def __init__(self, factor):
        super().__init__(1.2)
        self.factor = factor

    def lagrangian(self, t, q, v, m):
        return self.factor * super().lagrangian(t, q, v, m)


def test_what_parts_of_the_users_own_build_in_is_not_taken_for_adjustable():
    nlp = transcribe(in_the_plane(constraints=Ceiling(2.0)), 5)
    nlp.accepts(in_the_plane(constraints=Ceiling(2.0), duration=1.8))
    with pytest.raises(ValueError, match="another constraints"):
        nlp.accepts(in_the_plane(constraints=Ceiling(1.5)))
    nlp = transcribe(in_the_plane(constraints=Roof(2.0, 0.1)), 5)
    nlp.accepts(in_the_plane(constraints=Roof(1.5, 0.1)))
    with pytest.raises(ValueError, match="another constraints"):
        nlp.accepts(in_the_plane(constraints=Roof(2.0, 0.2)))
    nlp = transcribe(in_the_plane(actuator=Slanted(0.1), effects=[Weighed(2.0)]), 5)
    nlp.accepts(in_the_plane(actuator=Slanted(0.1), effects=[Weighed(2.0)], duration=1.8))
    with pytest.raises(ValueError, match="another effects, actuator"):
        nlp.accepts(in_the_plane(actuator=Slanted(0.2), effects=[Weighed(3.0)]))


def test_new_numbers_are_accepted():
    problem = in_the_plane(effects=[GRAVITY], actuator=BallForce(3.0), constraints=ZONES[:2])
    nlp = transcribe(problem, 5)
    nlp.accepts(
        replace(
            problem,
            mass=3.0,
            start=State((1.1, 0), (0, None)),
            duration=2.5,
            actuator=BallForce(4.0),
            constraints=[KeepOut((0.1, 0.4), 0.2), SpeedLimit(2.5)],
            start_time=7.0,
        )
    )


RESOLVED = {
    "start": {"start": State((1.02, 0.05), (0, 0.95))},
    "goal": {"goal": State((-0.8, 1.1), (-0.7, None))},
    "mass": {"mass": 2.6},
    "force limit": {"actuator": BallForce(2.65)},
    "duration": {"duration": 2.3},
    "start time": {"start_time": 5.0},
    "zone and speed": {"constraints": (KeepOut((0.01, 0), 0.95), SpeedLimit(1.12))},
}


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
@pytest.mark.parametrize("what", RESOLVED)
def test_solving_again_with_new_numbers_equals_a_fresh_solve(what, hold):
    old = in_the_plane(
        effects=[GRAVITY, FRAME, DRAG],
        actuator=BallForce(2.75),
        constraints=[KeepOut((0, 0), 0.94), SpeedLimit(1.13)],
        duration=2.2,
    )
    new = replace(old, **RESOLVED[what])

    def objective(nlp, problem):
        guess = starting_guess(problem, nlp.mesh, nlp.scheme.order, hold)
        answer = nlp.run(nlp.solver(), problem, guess)
        assert answer.status == "solved"
        return answer.objective * nlp.units.cost

    nlp = transcribe(old, 12, order=4, hold=hold)
    nlp.accepts(new)
    fresh = objective(transcribe(new, 12, order=4, hold=hold), new)
    assert objective(nlp, new) == pytest.approx(fresh, rel=1e-9)
    # nothing in this scene looks at the clock: another start time is the same problem
    moved = abs(objective(nlp, old) / fresh - 1)
    assert moved < 1e-9 if what == "start time" else moved > 1e-4


@pytest.mark.parametrize("hold", [False, True])
def test_a_curvature_of_nothing_has_no_place_in_the_hessian(hold):
    """In one dimension the distance at the goal has none: its number had no place, and the solve crashed."""
    start, goal = State((1.1,), (-0.3,)), State((None,), (-0.5,))
    problem = TransferProblem(
        1.0,
        start,
        goal,
        2.0,
        effects=[UniformGravity((-0.3,))],
        actuator=BoxForce(1.0),
        objective=FinalRadius(),
    )
    assert verify(solve(problem, hold=hold).raise_for_status()).ok
