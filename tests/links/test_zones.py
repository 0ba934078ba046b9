"""Zones, speed limits and pointing limits of bodies of a system, and of points on them."""

import re

import casadi as ca
import numpy as np
import pytest
from matplotlib.patches import Circle

from dmoc import (
    ApproachCone,
    BoxForce,
    JointState,
    JointTorque,
    KeepIn,
    KeepOut,
    Member,
    On,
    PointingKeepOut,
    Pose,
    RateLimit,
    Revolute,
    Rod,
    Slider,
    SpeedLimit,
    State,
    System,
    Torque,
    TransferProblem,
    UniformGravity,
    Wrench,
    export,
    rotation,
    solve,
    verify,
)
from dmoc.basics.quaternions import rotated
from dmoc.motion.path import DiscretePath
from dmoc.plots.page import figure
from dmoc.results.between import cuts
from dmoc.solver.starts import local_optima

INERTIA = (1.0, 2.0, 2.8)
TIP = (0.2, 0, 0)


def failed(solution):
    return [check for check in verify(solution).checks if not check.ok]


# One body by itself: its ends and its limit, with the kinds of its state and of its push.
FROM, TO = Pose((0, 0, 0)), Pose((2, 0, 0), attitude=rotation((0, 0, 1), 90))
ALONE = {
    "a ball": (State((0, 0), (0, 0)), State((2, 0), (0, 0)), KeepOut, {"center": (1, 0.1), "radius": 0.4}),
    "a box": (State((0, 0), (0, 1)), State((2, 0), (0, 0)), KeepIn, {"lower": (-9, -9), "upper": (9, 0.2)}),
    "a speed": (State((0, 0), (0, 0)), State((2, 0), (0, 0)), SpeedLimit, {"limit": 0.7}),
    "a cone": (
        State((0, 1), (0, 1)),
        State((2, 0), (0, 0)),
        ApproachCone,
        {"apex": (2, 0), "axis": (-1, 0.45), "half_angle": 0.1},
    ),
    "a point of a body": (FROM, TO, KeepOut, {"center": (1, 0.2, 0.1), "radius": 0.3, "point": (0.4, 0, 0)}),
    "walls for a point": (
        FROM,
        Pose((2, 0, 0), attitude=rotation((0, 0, 1), 170)),
        KeepIn,
        {"lower": (-9, -9, -9), "upper": (9, 0.2, 9), "point": (0.4, 0, 0)},
    ),
    "a pointing limit": (FROM, TO, PointingKeepOut, {"axis": (1, 0, 0), "direction": (1, 1, 0.4), "angle": 20}),
    "a rate": (FROM, TO, RateLimit, {"limit": 0.5}),
}


@pytest.mark.parametrize("name", ALONE)
def test_a_limit_of_one_of_two_free_bodies_costs_what_it_costs_alone(name):
    """Beside a body that goes its own way, 6 m^2 d^2 / T^3, a limit bends the path as that of an only body."""
    start, goal, kind, given = ALONE[name]
    turns = isinstance(start, Pose)
    push = Wrench() if turns else BoxForce(9.0)
    one = TransferProblem(
        3.0, start, goal, 4.0, inertia=INERTIA if turns else None, actuator=push, constraints=[kind(**given)]
    )
    still = ((0,) * start.dimension, (0,) * start.dimension)
    away = State((1,) * start.dimension, still[1])
    two = TransferProblem(
        System([Member("other", 2.0), Member("mine", 3.0, INERTIA if turns else None)]),
        {"mine": start, "other": State(*still)},
        {"mine": goal, "other": away},
        4.0,
        actuator=[On("mine", push), On("other", BoxForce(9.0))],
        constraints=[kind(**given, on="mine")],
    )
    alone, both = (solve(problem, order=4, steps=30) for problem in (one, two))
    free = solve(TransferProblem(**{**_fields(one), "constraints": ()}), order=4, steps=30)
    assert both.success and not failed(both)
    assert alone.objective > 1.003 * free.objective
    beside = 6 * 2.0**2 * start.dimension / 4.0**3
    assert both.objective - beside == pytest.approx(alone.objective, rel=2e-5)


def _fields(problem):
    names = ("mass", "start", "goal", "duration", "actuator", "inertia")
    return {name: getattr(problem, name) for name in names}


def reach(elbow=0.8, constraints=None, duration=2.0, order=(1, -1)):
    """An arm of two links that stands on the room, whose tip passes a ball."""
    upper = Revolute((0, 0, 1), at=(-0.2, 0, 0), on="upper")
    fore = Revolute((0, 0, 1), anchor=TIP, at=(-0.2, 0, 0), on="fore", to="upper")
    bar = (0.002, 0.014, 0.014)
    ball = [KeepOut((0.7, 0, 0), 0.08, point=TIP, on="fore")]
    return TransferProblem(
        System([Member("upper", 1.0, bar), Member("fore", 0.8, bar)], [upper, fore]),
        {upper: JointState(-0.8), fore: JointState(elbow)},
        {upper: JointState(0.8), fore: JointState(elbow)},
        duration,
        actuator=[JointTorque(upper, 2.0), JointTorque(fore, 2.0)],
        constraints=ball if constraints is None else constraints,
    )


def tip_of(solution):
    """Where the tip of the arm is at the nodes, from place and attitude of the forearm."""
    q = solution.path.position
    return q[:, 3:6] + rotated(q[:, 10:14], np.broadcast_to(TIP, (len(q), 3)))


@pytest.fixture(scope="module")
def passed():
    return solve(reach())


@pytest.mark.slow
def test_the_tip_of_an_arm_goes_past_a_ball(passed):
    assert passed.success and not failed(passed)
    clear = np.linalg.norm(tip_of(passed) - np.array([0.7, 0, 0]), axis=1)
    assert clear.min() == pytest.approx(0.08, abs=2e-4)
    free = solve(reach(constraints=[]))
    assert np.linalg.norm(tip_of(free) - np.array([0.7, 0, 0]), axis=1).min() > 0.15
    assert free.objective < 0.5 * passed.objective


@pytest.mark.slow
def test_starts_lead_past_the_ball_on_both_sides_with_the_arm_whole(passed):
    optima = local_optima(reach(), 3)
    sides = [one for one in optima if any("side of KeepOut 1 of fore" in start for start in one.starts)]
    assert optima[0] in sides and optima[0].objective < 0.5 * passed.objective
    answer = solve(reach(), guess=optima[0].path)
    assert answer.success and not failed(answer)


BALL = KeepOut((0.6, -0.5), 0.15, on="bob")


def hung(constraints=None):
    """A cart on a rail carries a bob past a ball."""
    links = [Slider((0, 0), (1, 0), on="cart"), Rod("cart", 0.5, on="bob")]
    return TransferProblem(
        System([Member("cart", 1.0), Member("bob", 0.3)], links),
        {"cart": State((0, 0), (0, 0)), "bob": State((0, -0.5), (0, 0))},
        {"cart": State((1.2, 0), (0, 0)), "bob": State((1.2, -0.5), (0, 0))},
        2.0,
        [UniformGravity((0, -9.81))],
        On("cart", BoxForce(20), axes=[0]),
        constraints=[BALL] if constraints is None else constraints,
    )


def test_a_leap_between_two_nodes_is_seen_by_the_body_that_leaps():
    """The bob goes through the ball while all of its nodes are outside, and the cart stays off it."""
    problem = hung()
    times = np.array([0, 0.4, 0.8, 1.2])
    path = np.stack([times, 0 * times, times, 0 * times - 0.5], axis=1)
    made = solve(hung(), steps=8, order=2).path.coordinates
    leaping = DiscretePath(
        np.linspace(0, 1, 4), 2, False, 3.0, path, np.zeros((4, 1)), np.ones(4), *np.zeros((2, 4)), made_of=made
    )
    slopes = np.tile([0.4, 0.0], (4, 2))
    found = {cut.name: cut for cut in cuts(problem.constraints, leaping, slopes, 1.0, 0.4)}
    assert not found["KeepOut 1 of bob between nodes"].ok and found["KeepOut 1 of bob at nodes"].ok
    assert found["KeepOut 1 of bob between nodes"].value == pytest.approx(0.15, rel=1e-6)
    other = hung([BALL, KeepOut((0.6, -0.5), 0.15, on="cart")])
    names = [cut.name for cut in cuts(other.constraints, leaping, slopes, 1.0, 0.4) if not cut.ok]
    assert names == ["KeepOut 1 of bob between nodes"]


@pytest.mark.slow
def test_what_is_too_tight_is_told_with_the_body():
    found = solve(hung([SpeedLimit(0.5, on="bob")]), order=4, steps=25)
    assert not found.success
    needed = float(re.search(r"a speed limit of bob of ([0-9.]+) m/s \(you gave 0.5 m/s\)", found.message)[1])
    assert any("speed_limit_1_of_bob" in name for name, _, _ in found.worst)
    enough = solve(hung([SpeedLimit(needed, on="bob")]), order=4, steps=25)
    assert enough.success
    assert 0.95 * needed < np.linalg.norm(enough.of("bob")[1], axis=1).max() < 1.01 * needed


@pytest.mark.slow
def test_words_pictures_and_files_have_the_limits(passed, tmp_path):
    from dmoc import load

    passed.save(tmp_path / "arm.nc")
    again = load(tmp_path / "arm.nc").attach(reach())
    report = verify(again)
    assert report.ok
    page = figure(again)
    labels = [text.get_text() for text in page.axes[0].get_legend().get_texts()]
    assert "keep-out zone" in labels and "path of point (0.2, 0, 0) m of fore" in labels
    flat = figure(solve(hung()))
    discs = [patch for patch in flat.axes[0].patches if isinstance(patch, Circle)]
    assert [(disc.center, disc.radius) for disc in discs] == [((0.6, -0.5), 0.15)]


def test_an_exported_solver_takes_other_limits(tmp_path):
    fastest = np.linalg.norm(solve(hung([]), order=4, steps=20).of("bob")[1], axis=1).max()
    limits = [share * fastest for share in (0.97, 0.94)]
    export(hung([SpeedLimit(limits[0], on="bob")]), tmp_path / "bob", order=4, steps=20, c=False)
    solver, nominal = (ca.Function.load(str(tmp_path / f"bob/{name}.casadi")) for name in ("solver", "nominal"))
    given = {name: value for name, value in nominal.call({}).items() if name in solver.name_in()}
    costs = []
    for speed in limits:
        given["speed_limit_1_limit"] = speed
        costs.append(float(solver.call(given)["objective"]))
        found = solve(hung([SpeedLimit(speed, on="bob")]), order=4, steps=20)
        assert costs[-1] == pytest.approx(found.objective, rel=1e-6)
    assert costs[1] > 1.001 * costs[0]


TWO = System([Member("a", 1.0, INERTIA), Member("p", 1.0)])


def of_two(limit):
    ends = {"a": Pose((0, 0, 0)), "p": State((0, 0, 0), (0, 0, 0))}
    return TransferProblem(TWO, ends, ends, 1.0, actuator=On("a", Torque()), constraints=[limit])


BAD = {
    "nobody": (lambda: of_two(KeepOut((9, 0, 0), 1.0)), "which of the bodies a, p it limits; give it on='a'"),
    "a stranger": (lambda: of_two(KeepOut((9, 0, 0), 1.0, on="b")), "limits 'b'; the bodies are a, p"),
    "a rate of a point": (lambda: of_two(RateLimit(1.0, on="p")), "p is a point mass"),
    "a point of a point": (lambda: of_two(SpeedLimit(1.0, (1, 0, 0), on="p")), "p is a point mass"),
    "no name": (lambda: KeepOut((9, 0, 0), 1.0, on=3), "KeepOut: on must be a str"),
    "one body": (
        lambda: TransferProblem(
            1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 1.0, constraints=[SpeedLimit(5, on="a")]
        ),
        "limits 'a'; there is one body, without a name",
    ),
    "a start inside": (
        lambda: of_two(KeepOut((0.5, 0, 0), 1.0, on="p")),
        "start breaks KeepOut (constraint 1) by 0.5 m: p stays 1 m away",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_limits_that_do_not_fit_are_refused_in_one_line(name):
    make, words = BAD[name]
    with pytest.raises(ValueError) as error:
        make()
    assert words in str(error.value) and "\n" not in str(error.value)
