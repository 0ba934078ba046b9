"""Whatever is given, to whatever takes it: used, or refused in one line that says what it should be.

Pass criterion: no exception but ValueError, its message one line; on the command line no traceback, exit
code 2 with one line on stderr and nothing on stdout, and nothing written.
"""

import contextlib
import decimal
import io
import math
import shutil
import warnings
from dataclasses import replace
from functools import partial

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import dmoc
from dmoc import (
    Actuator,
    Atmosphere,
    Attitude,
    BallForce,
    Boundary,
    Constraint,
    Drag,
    Effect,
    Effort,
    Free,
    FreeForce,
    Holonomic,
    Joint,
    JointDamper,
    JointForce,
    JointLimit,
    JointSpring,
    JointState,
    JointTorque,
    KeepOut,
    Leg,
    LinearDrag,
    Member,
    Mission,
    MomentumLimit,
    Objective,
    On,
    PlateRadiation,
    Plates,
    PointGravity,
    Pose,
    Prismatic,
    RadiationPressure,
    Revolute,
    Rod,
    Several,
    Shadow,
    State,
    System,
    Team,
    ThirdBody,
    Time,
    Together,
    Torque,
    TransferProblem,
    UniformAtmosphere,
    Wind,
    simulate,
    solve,
    transcribe,
    verify,
)
from dmoc.chains.program import MissionProgram
from dmoc.cli.app import main
from dmoc.legs.events import Event
from dmoc.missions.guess import guessed
from dmoc.plots.page import save_figure
from dmoc.studies.drift import kepler
from dmoc.teams.guess import guessed as team_guess
from dmoc.teams.program import TeamProgram


def scene(**parts):
    return dict(mass=1.0, start=State((0, 0), (0, 0)), goal=State((4, 0), (0, 0)), duration=4.0) | parts


HERE = TransferProblem(**scene())
FIRST, SECOND = (TransferProblem(1.0, State((-x, 0), (0, 0)), State((x, 0), (0, 0)), 4.0) for x in (1.0, -1.0))
ELLIPSE = {"mu": 1.0, "a": 9.0, "e": 0.1, "i": 0.0, "node": 0.0, "argument": 0.0, "mean_anomaly": 0.0}
PLATES = Plates((1.0,), ((1, 0, 0),), ((0, 1, 0),))
# arguments that are good, one of which is then replaced
HINGE = Revolute((0, 0, 1))
JOINT = {"anchor": (0, 0, 0), "at": (0, 0, 0), "on": "", "to": "", "attitude": (1, 0, 0, 0)}
MAKES = {
    "ApproachCone": {"apex": (9, 0), "axis": (-1, 0), "half_angle": 1.0, "rounding": 1e-6, "point": None},
    "Attitude": {"quaternion": (1, 0, 0, 0), "rate": (0, 0, 0), "other_way": False},
    "BallForce": {"limit": 2.0},
    "BallTorque": {"limit": 2.0},
    "Bounce": {"surface": lambda q: q[1], "restitution": 0.5},
    "BoxForce": {"limit": 2.0},
    "CircularOrbit": {"radius": 2.0, "mu": 1.0, "center": (0, 0), "normal": None, "clockwise": False},
    "Coast": {"duration": (1.0, 2.0), "effects": None, "constraints": None, "order": 4, "steps": 3, "name": ""},
    "ClohessyWiltshire": {"mean_motion": 0.1},
    "Condition": {
        "function": lambda t, q, v, m: q[0] - 4,
        "name": "there",
        "scale": 1.0,
        "state": State((None, 0), (0, 0)),
    },
    "ConicalShadow": {"radius": 1.0, "sun_radius": 7e8},
    "CylindricalShadow": {"radius": 1.0, "sharpness": 10.0},
    "Drag": {"area": 1.0, "drag_coefficient": 1.0, "atmosphere": UniformAtmosphere(1.0)},
    "Drop": {"mass": 0.1},
    "Flight": {
        "times": [0.0, 1.0, 2.0],
        "positions": [[0.0], [1.0], [2.0]],
        "forces": [[0.0], [0.0], [0.0]],
        "velocities": None,
        "attitudes": None,
        "rates": None,
    },
    "Unknown": {"value": 1.0, "sigma": 0.5},
    "Engine": {
        "max_thrust": 2.0,
        "specific_impulse": 300.0,
        "dry_mass": 0.1,
        "min_thrust": 0.0,
        "box": 1.0,
        "smoothing": 1e-5,
    },
    "TabulatedAtmosphere": {
        "heights": (1.0, 2.0, 3.0, 4.0),
        "densities": (4.0, 3.0, 2.0, 1.0),
        "radius": 3.0,
        "rate": 0.1,
        "wind": None,
        "source": "a table",
    },
    "ExponentialAtmosphere": {
        "density": 1.0,
        "height": 0.0,
        "scale_height": 1.0,
        "radius": 3.0,
        "rate": 0.1,
        "wind": None,
    },
    "FinalHeight": {"axis": 1},
    "FinalRadius": {"center": (0, 0)},
    "Flyby": {"position": lambda t: (2 + 0 * t, 0 * t), "radius": 1.0, "mu": 1.0},
    "Frame": {"position": lambda t, q: q, "name": "another"},
    "Free": {"axes": 2},
    "GravityGradient": {"mu": 1.0, "center": (9, 0, 0), "place": None},
    "J2": {"mu": 1.0, "radius": 1.0, "j2": 1e-3},
    "Fixed": JOINT,
    "Information": {"unknown": "mass", "noise": 0.001, "every": 0.1},
    "Impulse": {"limit": 2.0, "exhaust_velocity": 9.0},
    "JointDamper": {"joint": HINGE, "damping": 1.0},
    "JointForce": {"joint": Prismatic((1, 0, 0)), "limit": 2.0},
    "JointLimit": {"joint": HINGE, "low": -1.0, "high": 1.0},
    "JointSpring": {"joint": HINGE, "stiffness": 1.0, "rest": 0.0},
    "JointState": {"value": 1.0, "rate": 0.0},
    "JointTorque": {"joint": Rod((0, 1), 1.0), "limit": 2.0, "against": None},
    "Prismatic": {"axis": (1, 0, 0), **JOINT},
    "Revolute": {"axis": (0, 0, 1), **JOINT},
    "Spherical": JOINT,
    "KeepIn": {"lower": (-9, -9), "upper": (9, 9), "point": None},
    "KeepOut": {"center": (2, 2), "radius": 0.5, "point": None},
    "Leg": {
        "duration": (1.0, 2.0),
        "effects": None,
        "actuator": FreeForce(),
        "constraints": None,
        "order": 4,
        "steps": 3,
        "name": "",
    },
    "LinearDrag": {"coefficient": 0.1, "wind": None},
    "Member": {"name": "a", "mass": 1.0, "inertia": None},
    "Apart": {"distance": 0.5, "between": ()},
    "Meet": {"velocity": True, "between": ()},
    "Team": {"members": (FIRST, SECOND), "together": (), "names": (), "guess": None},
    "Mission": scene(
        legs=(Leg(), Leg()),
        sums=((0, 1, 4.0),),
        effects=(),
        actuator=FreeForce(),
        objective=Effort(),
        constraints=(),
        guess=None,
        start_time=0.0,
    ),
    "MomentumLimit": {"limit": (1.0, 1.0, 1.0)},
    "Moving": {"position": lambda t: (t, 0 * t), "velocity": "matched", "attitude": None, "rate": "matched"},
    "Nozzles": {
        "directions": ((1, 0), (-1, 0), (0, 1), (0, -1)),
        "max_thrust": 2.0,
        "exhaust_velocity": 100.0,
        "dry_mass": 0.1,
    },
    "Orbit": dict.fromkeys(("i", "raan", "argp", "nu")) | {"mu": 1.0, "a": 2.0, "e": 0.1, "center": (0, 0)},
    "Periodic": {"axes": 2},
    "PivotGravity": {"acceleration": (0, 0, -1), "arm": (0, 0, 1)},
    "PlateDrag": {"plates": PLATES, "density": 1.0, "coefficient": 1.1},
    "PlateRadiation": {"plates": PLATES, "direction": (1, 0, 0), "flux": 1361.0, "reflectivity": 0.3},
    "Plates": {"areas": (1.0,), "normals": ((1, 0, 0),), "offsets": ((0, 1, 0),)},
    "PointGravity": {"mu": 1.0, "center": (0, 9)},
    "PointingKeepIn": {"axis": (1, 0, 0), "direction": (1, 0, 0), "angle": 179.0},
    "On": {"body": "a", "push": FreeForce(), "axes": (0,)},
    "PointingKeepOut": {"axis": (1, 0, 0), "direction": (-1, 0, 0), "angle": 20.0},
    "Pose": {"position": (4, 0, 0), "velocity": (0, 0, 0), "attitude": (1, 0, 0, 0), "rate": (0, 0, 0)},
    "RadiationPressure": {"area": 1.0, "reflectivity": 0.5, "sun": (1.5e11, 0), "shadow": None},
    "RateLimit": {"limit": 9.0},
    "Rod": {"anchor": (0, 1), "length": 1.0, "on": ""},
    "RotatingFrame": {"rate": 0.1},
    "Slider": {"point": (0, 0), "direction": (1, 0), "on": ""},
    "SpeedLimit": {"limit": 9.0, "point": None},
    "Spring": {"stiffness": 1.0, "anchor": (0, 0)},
    "State": {"position": (0, 0), "velocity": (0, 0)},
    "ThirdBody": {"mu": 1.0, "position": (9, 9)},
    "Thrusters": {
        "positions": ((1, 0, 0), (-1, 0, 0)),
        "directions": ((0, 1, 0), (0, 1, 0)),
        "max_thrust": 2.0,
        "both_ways": False,
        "exhaust_velocity": 100.0,
        "dry_mass": 0.1,
        "inertia_law": "scaled",
    },
    "Several": {"parts": (FreeForce(),)},
    "System": {"bodies": (Member("a", 1.0), Member("b", 1.0)), "links": (Rod("a", 1.0, on="b"),)},
    "Torque": {"limit": 2.0},
    "Surface": {"function": lambda q: q[1], "on": ""},
    "TransferProblem": scene(
        effects=(), actuator=FreeForce(), objective=Effort(), constraints=(), guess=None, start_time=0.0
    ),
    "UniformAtmosphere": {"density": 1.0, "wind": (0, 1)},
    "UniformGravity": {"acceleration": (0, -1)},
    "Via": {"boundary": (1, 1)},
    "Wheels": {
        "axes": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        "max_torque": 1.0,
        "max_momentum": 2.0,
        "start_momentum": (0, 0, 0),
        "goal_momentum": None,
    },
    "WeightedSum": {"parts": ((1.0, Effort()), (2.0, Time()))},
    "Wind": {"field": (0, 1)},
    "Wrench": {"force_limit": 2.0, "torque_limit": 2.0, "frame": "body", "lever": 1.0},
    "circular_motion": {"radius": 9.0, "rate": 0.1, "phase": 0.0, "inclination": 0.0},
    "kepler_motion": ELLIPSE,
    "planet": {
        "name": "mars",
        "epoch": "2028-11-20",
        "frame": "ecliptic",
        "center": "sun",
        "start": 0.0,
        "duration": 1e6,
        "ephemeris": "mean elements",
    },
    "tabulated_motion": {"times": (0, 1, 2, 3), "positions": ((9, 0), (9, 1), (9, 2), (9, 3))},
    "three_body": {"mass_ratio": 0.1},
}


def fails(*given):
    raise RuntimeError("of its own")


ODD = [
    *(
        True,
        10**400,
        2**63,
        -0.0,
        1e308,
        1e-308,
        1j,
        b"1",
        "1.0",
        "matched",
        "abc" * 1000,
        decimal.Decimal("2.5"),
    ),
    *(
        (),
        {},
        set(),
        range(2),
        slice(1, 2),
        Ellipsis,
        object(),
        object,
        math,
        print,
        np.float32(1),
        np.int64(3),
    ),
    *(np.array(1.0), np.array([1.0, 2.0]), np.array([[1.0, 2.0]]), np.ones((2, 2, 2)), np.array(["a"])),
    *(np.zeros(0), np.zeros((2, 0)), np.ones(10**5), np.array([1, None]), ((1, 2), (3,)), [[[[1]]]]),
    *(ca.SX.sym("z"), ca.MX.sym("z"), ca.DM([1, 2]), ca.SX.sym("z", 2), ca.SX(1)),
    *(fails, lambda: 1, lambda *a: None, lambda *a: "x", lambda *a: (), lambda *a: [1, 2, 3, 4]),
    *(lambda *a: math.nan, lambda t, *a: math.cos(t), lambda *a: (1.0, 2.0)),
    *(Effort(), Effort, Time(), HERE, HERE.start, KeepOut((2, 2), 0.5), [KeepOut((2, 2), 0.5), 3]),
    *(
        BallForce(1.0),
        BallForce,
        PointGravity(1.0),
        [PointGravity(1.0)],
        [("a", Effort())],
        [(math.nan, Effort())],
    ),
    *((1, 4), (4, 1), (0, 4), (4, 4), (1, math.inf), (math.nan, 0), (None, None), (1e200, 1e200), (1e-200, 0)),
]
# by number: Hypothesis writes out what it picks from
PICKED = st.integers(0, len(ODD) - 1).map(lambda i: ODD[i])
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | PICKED
ANYTHING = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.lists(inner, max_size=4).map(tuple), max_leaves=6
)
QUICK = settings(
    max_examples=30,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
THOROUGH = settings(QUICK, max_examples=2000, derandomize=False)


def answered(call):
    """What a call gives, or None where it refuses in one line; any other exception is a failure."""
    # what a function in ODD prints is of no interest
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("error")
        try:
            return call()
        except ValueError as error:
            text = str(error)
            assert text.strip() and "\n" not in text and len(text) < 500, text
            return None


def put_on_a_body(part):
    """A problem of a body that turns with this part in it."""
    alone = not part.moves_body if hasattr(part, "moves_body") else not part.has_position
    ends = (Attitude((1, 0, 0, 0)),) * 2 if alone else (Pose((0, 0, 0)), Pose((4, 0, 0)))
    parts = {"start": ends[0], "goal": ends[1], "actuator": Torque(), "inertia": (1, 1, 1)}
    kinds = {Boundary: "goal", Actuator: "actuator", Effect: "effects", Constraint: "constraints"}
    name = next(name for kind, name in kinds.items() if isinstance(part, kind))
    return TransferProblem(**scene(**(parts | {name: [part] if name.endswith("s") else part})))


def put_to_use(part):
    """A problem with this part in it."""
    if isinstance(part, TransferProblem):
        return part
    if isinstance(part, (Member, System, On, JointTorque, Several, MomentumLimit)):
        # They mean something in a system, or with their wheels, alone.
        return None
    if isinstance(part, (JointState, JointForce)):
        return None
    if isinstance(part, (Joint, JointLimit, JointSpring, JointDamper)):
        ends = (Pose((0, 0, 0)), Pose((0, 0, 0)))
        parts = {"start": ends[0], "goal": ends[1], "actuator": Torque(), "inertia": (1, 1, 1)}
        kind = "constraints" if isinstance(part, JointLimit) else "effects"
        more = {"links": [part]} if isinstance(part, Joint) else {"links": [part.joint], kind: [part]}
        return TransferProblem(**scene(**(parts | more)))
    if isinstance(part, Holonomic):
        ends = State((0, 0), (0, 0)), State((0, 0), (0, 0))
        return TransferProblem(**scene(start=ends[0], goal=ends[1], links=[part]))
    if isinstance(part, Plates):
        part = PlateRadiation(part, (1, 0, 0))
    if getattr(part, "turns_body", False):
        return put_on_a_body(part)
    if isinstance(part, tuple):
        return TransferProblem(1.0, State((0, 0, 0), (0, 0, 0)), State((4, 0, 0), (0, 0, 0)), 4.0, part)
    if isinstance(part, Atmosphere):
        part = Drag(1.0, 1.0, part)
    elif isinstance(part, Wind):
        part = LinearDrag(1.0, part)
    elif isinstance(part, Shadow):
        part = RadiationPressure(1.0, 0.5, (1.5e11, 0), part)
    kinds = {Boundary: "goal", Actuator: "actuator", Effect: "effects", Objective: "objective"}
    name = next((name for kind, name in kinds.items() if isinstance(part, kind)), "")
    if name == "effects":
        return TransferProblem(**scene(effects=[part]))
    if name == "objective":
        return TransferProblem(**scene(objective=part, actuator=BallForce(3.0), duration=(1.0, 9.0)))
    if name:
        return TransferProblem(**scene(**{name: part}))
    if isinstance(part, Constraint):
        return TransferProblem(**scene(constraints=[part]))
    return TransferProblem(**scene(effects=[ThirdBody(1.0, part)]))


def as_mission(part):
    """A mission with this part in it, as it would be solved; None for a part of a transfer."""
    if isinstance(part, (Leg, Event)):
        legs = [part] if isinstance(part, Leg) else [Leg(1.0), part, Leg(1.0)]
        part = Mission(1.0, HERE.start, HERE.goal, legs)
    if isinstance(part, Free):
        part = Mission(1.0, HERE.start, part, [Leg(1.0), Leg(1.0)])
    if isinstance(part, Mission):
        path = guessed(part, [(np.linspace(0, 1, 4), 4)] * len(part.plan), given=part.guess)
        MissionProgram.of(part, part.stretches, path)
    return part if isinstance(part, Mission) else None


def as_team(part):
    """A team with this part in it, as it would be solved; None for a part of a transfer or a mission."""
    if isinstance(part, Together):
        ends = FIRST, SECOND
        if not part.distance_kept:
            ends = tuple(replace(end, goal=Free()) for end in ends)
        part = Team(ends, part)
    if isinstance(part, Team):
        TeamProgram.of(part, part.stretches, team_guess(part, (np.linspace(0, 1, 4), 4, False), part.guess))
        assert all(words.words() for words in part.together)
    return part if isinstance(part, Team) else None


def try_making(name, argument, value):
    part = answered(lambda: getattr(dmoc, name)(**(MAKES[name] | {argument: value})))
    if part is None or answered(lambda: as_mission(part) or as_team(part)) is not None:
        return
    if isinstance(part, (Mission, Leg, Event, Free, Team, Together, dmoc.Flight, dmoc.Unknown)):
        return
    problem = answered(lambda: put_to_use(part))
    if problem is not None:
        assert all(effect.words() for effect in problem.effects) and problem.goal.words()
        answered(lambda: transcribe(problem, 4))


def test_every_constructor_is_tried():
    made = {name for name in dmoc.__all__ if name[0].isupper() or name in ("three_body",)}
    made |= {name for name in dmoc.__all__ if name.endswith("_motion") or name == "planet"}
    abstract = {
        "Actuator",
        "Atmosphere",
        "BodyConservative",
        "BodyForce",
        "Boundary",
        "Conservative",
        "Constraint",
        "Effect",
        "Force",
        "Holonomic",
        "Joint",
        "Objective",
        "Together",
    }
    without_arguments = {"DeltaV", "Effort", "FinalMass", "FreeForce", "Fuel", "Time", "Shadow", "Unpowered"}
    results = {
        "Body",
        "Check",
        "Dispersion",
        "Estimate",
        "Evidence",
        "Formulation",
        "MissionSolution",
        "NLP",
        "Report",
        "Row",
        "Solution",
        "SolveError",
        "TeamSolution",
        "Symmetry",
        "Trajectory",
        "Worth",
    }
    assert made - abstract - without_arguments - results == set(MAKES)


@pytest.mark.parametrize("name", MAKES)
def test_constructors_and_odd_values(name):
    for argument in MAKES[name]:
        for value in ODD:
            try_making(name, argument, value)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAKES)
@THOROUGH
@given(data=st.data())
def test_constructors_and_any_value_at_length(name, data):
    try_making(name, data.draw(st.sampled_from(list(MAKES[name]))), data.draw(ANYTHING))


@pytest.mark.parametrize("name", MAKES)
@QUICK
@given(data=st.data())
def test_constructors_and_any_value(name, data):
    try_making(name, data.draw(st.sampled_from(list(MAKES[name]))), data.draw(ANYTHING))


# A flight of which the mass is asked.
SEEN = dmoc.Flight(
    [0.0, 1.0, 2.0, 3.0, 4.0], [[0.0], [0.5], [2.0], [3.5], [4.0]], [[1.0], [1.0], [-1.0], [-1.0], [0.0]]
)
# Solutions of 4 steps are quick, whatever else is asked for.
CALLS = {
    "convert": (
        partial(dmoc.convert, path="x.svg"),
        {"to": "csv", "epoch": "2028-11-20", "frame": "ICRF", "center": "EARTH", "time_system": "UTC"},
    ),
    "disperse": (
        dmoc.disperse,
        {"start": (0.1, 0.1), "force": 0.1, "pointing": 0.0, "mass": 0.1, "samples": 3, "seed": 1},
    ),
    "drift": (
        dmoc.drift,
        {"problem": kepler(0.1), "revolutions": 2, "methods": {"order 2": (30,)}, "period": 6.0},
    ),
    "fly": (
        dmoc.fly,
        {
            "times": [0.0, 1.0, 2.0],
            "forces": [[0.0], [1.0], [0.0]],
            "start": dmoc.State((0,), (0,)),
            "mass": 2.0,
            "effects": [],
            "actuator": None,
            "offset": (0.1,),
            "strength": 1.0,
            "delay": 0.1,
            "noise": 0.1,
            "force_noise": 0.1,
            "velocity_noise": 0.1,
            "dropped": 0.1,
            "seed": 1,
        },
    ),
    "feedback": (dmoc.feedback, {}),
    "foresee": (dmoc.foresee, {"unknown": "mass", "noise": 0.1, "every": 0.1}),
    "identify": (
        dmoc.identify,
        {
            "flight": SEEN,
            "mass": dmoc.Unknown(2.0),
            "effects": [],
            "actuator": None,
            "inertia": None,
            "offset": None,
            "center": None,
            "strength": 1.0,
            "turn": None,
            "delay": 0.0,
            "noise": 0.1,
            "force_noise": 0.1,
            "order": 4,
        },
    ),
    "load": (dmoc.load, {"path": "nothing.nc"}),
    "predict": (dmoc.predict, {"mass": 2.0, "goal_position": (1.0, 1.0)}),
    "save_figure": (save_figure, {"path": "x.svg"}),
    "simulate": (
        simulate,
        {
            "problem": HERE,
            "controls": None,
            "steps": 4,
            "order": 2,
            "hold": False,
            "duration": 4.0,
            "compensated": False,
        },
    ),
    "solve": (
        solve,
        {
            "problem": HERE,
            "order": 2,
            "steps": 4,
            "hold": False,
            "mesh": None,
            "guess": None,
            "options": {"ipopt.max_iter": 9},
            "progress": None,
        },
    ),
    "solve to a tolerance": (solve, {"problem": HERE, "tol": 1e-2, "order": 4, "steps": 4}),
    "transcribe": (transcribe, {"problem": HERE, "steps": 4, "order": 2, "mesh": None, "guess": None}),
    "verify": (verify, {"problem": HERE}),
    "symmetries": (dmoc.symmetries, {}),
    "worth": (dmoc.worth, {}),
}
# None means "not given"; what such a function raises in the middle of a solve is what solve raises
LEFT_OUT = {("solve", "progress"): lambda value: callable(value)}


@pytest.mark.parametrize("name", CALLS)
def test_functions_and_odd_values(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function, good = CALLS[name]
    if name in ("convert", "verify", "save_figure", "symmetries", "worth", "predict", "disperse", "foresee"):
        good = good | {"solution": solve(HERE, steps=4)}
    for argument in good:
        for value in ODD:
            if not LEFT_OUT.get((name, argument), lambda value: False)(value):
                answered(lambda value=value, argument=argument: function(**(good | {argument: value})))
    # text names a file, and nothing else does
    assert {path.name for path in tmp_path.iterdir()} <= {"x.svg"}


# The verbs, with arguments that are good, and the options each takes; the problem is solved in a moment.
STEPS = ["--steps", "4"]
VERBS = {
    "solve": (
        ["point_to_point", *STEPS],
        ["--order", "--steps", "--tol", "--set", "--out", "--plot", "--guess"],
    ),
    "show": (["point_to_point"], ["--set"]),
    "simulate": (["point_to_point", *STEPS], ["--order", "--steps", "--set", "--controls", "--plot"]),
    "convert": (
        ["nothing.nc", "--to", "csv"],
        ["--to", "--out", "--epoch", "--frame", "--center", "--time-system"],
    ),
    "disperse": (["nothing.nc"], ["--start", "--force", "--pointing", "--samples", "--seed", "--plot"]),
    "effects": (["point_to_point", *STEPS], ["--order", "--steps", "--set"]),
    "identify": (
        ["free_flyer", "--noise", "0.001"],
        ["--unknown", "--mass", "--noise", "--force-noise", "--order", "--out", "--plot"],
    ),
    "check": (["nothing.nc"], ["--problem"]),
    "plot": (["nothing.nc"], ["--out", "--problem"]),
    "export": (["point_to_point", "out", *STEPS, "--no-c"], ["--order", "--steps", "--set"]),
    "stability": (["--revolutions", "1", "--steps", "1000"], ["--revolutions", "--eccentricity", "--plot"]),
    "study": (
        ["rendezvous", "--orders", "8", "--steps", "8", "--repeats", "1"],
        ["--orders", "--steps", "--against", "--repeats", "--reference", "--set", "--plot", "--csv"],
    ),
    "sweep": (
        ["point_to_point", "--vary", "duration=4:5:2", "--out", "no/such.nc"],
        ["--vary", "--sample", "--seed", "--order", "--steps", "--tol", "--set", "--out", "--workers"],
    ),
}
WRONG = [
    *(
        "",
        " ",
        "x",
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "-0.0",
        "1e400",
        "1e-400",
        "9" * 30,
        "1.5",
        "True",
        "None",
    ),
    *(
        "(",
        "(1,",
        "[]",
        "{}",
        "1,2",
        ",",
        "=",
        "a=",
        "=1",
        "a=b=c",
        "mass=nan",
        "mass=1e400",
        "mass=-1",
        "mass=''",
    ),
    *(
        "goal=(1,)",
        "goal=()",
        "goal=(1,2,3,4)",
        "goal=('a','b')",
        "goal=(1e300,0)",
        "duration=None",
        "duration=(4,1)",
    ),
    *(
        "mass=__import__('os')",
        "mass=" + "(" * 200,
        "\u00e9",
        "\u2028",
        "a\nb",
        "--",
        "-",
        "/",
        ".",
        "..",
        "~",
        "a" * 300,
    ),
    *(
        "no/such/file.nc",
        "x.gif",
        "/dev/null",
        "pyproject.toml",
        "duration=1:2:0",
        "duration=1:2:x",
        "duration=2:1:-3",
    ),
]


def command_line(capfd, arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capfd.readouterr()
    return end.value.code or 0, out, err


def try_command(capfd, folder, verb, option, text):
    good, _ = VERBS[verb]
    code, out, err = command_line(capfd, [verb, *good, option, text])
    words = f"dmoc {verb} {option} {text!r} exits with {code}: {err}"
    assert code in (0, 2, 3, 4) and "Traceback" not in err, words
    if code == 2:
        assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and len(err) < 600, words
        assert [path.name for path in folder.iterdir()] == [], words
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.fixture
def empty(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


OPTIONS = [(verb, option) for verb, (_, options) in VERBS.items() for option in options]
# where a file is written every other text is a good name
NO_FILES = ["", " ", ".", "..", "/", "a" * 300, "no/such/file.nc", "x.gif", "/dev/null"]
SHARES = [16, pytest.param(1, marks=pytest.mark.slow)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize(("verb", "option"), OPTIONS)
def test_options_and_odd_texts(capfd, empty, verb, option, share):
    texts = NO_FILES if option in ("--out", "--plot", "--csv") else WRONG
    for text in texts[OPTIONS.index((verb, option)) % share :: share]:
        try_command(capfd, empty, verb, option, text)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("verb", VERBS)
def test_arguments_and_odd_texts(capfd, empty, verb, share):
    texts = [text for text in WRONG if text != "--"]
    for text in texts[len(verb) % share :: share]:
        code, out, err = command_line(capfd, [verb, text])
        assert (code, out, err.count("\n")) == (2, "", 1), f"dmoc {verb} {text!r}: {code} {err}"
        assert "Traceback" not in err and not list(empty.iterdir())
