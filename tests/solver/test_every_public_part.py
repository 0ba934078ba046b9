"""Every public actuator, constraint, objective, end and event solves on a mesh and to a tolerance, held or not.

What is carried from mesh to mesh must fit each of them. The table has to have every part that is public: one
that is new and has no scene here fails a test.
"""

import inspect

import casadi as ca
import numpy as np
import pytest

import dmoc
from dmoc import (
    Apart,
    ApproachCone,
    Attitude,
    BallForce,
    BallTorque,
    Bounce,
    BoxForce,
    CircularOrbit,
    Coast,
    Condition,
    DeltaV,
    Drop,
    Effort,
    Engine,
    FinalHeight,
    FinalMass,
    FinalRadius,
    Flyby,
    Frame,
    Free,
    FreeForce,
    Fuel,
    Impulse,
    Information,
    JointForce,
    JointLimit,
    JointState,
    JointTorque,
    KeepIn,
    KeepOut,
    Leg,
    Meet,
    Member,
    Mission,
    MomentumLimit,
    Moving,
    Nozzles,
    On,
    Orbit,
    Periodic,
    PointGravity,
    PointingKeepIn,
    PointingKeepOut,
    Pose,
    Prismatic,
    RateLimit,
    Revolute,
    Rod,
    Several,
    SpeedLimit,
    Spring,
    State,
    System,
    Team,
    Thrusters,
    Time,
    Torque,
    TransferProblem,
    UniformGravity,
    Unpowered,
    Via,
    Wheels,
    Wrench,
    rotation,
    solve,
    verify,
)

J = (1.0, 2.0, 2.8)
CROSS = ((1, 0), (-1, 0), (0, 1), (0, -1))
REST, THERE = State((0, 0), (0, 0)), State((2, 0), (0, 0))
PUSH, WEAK = BallForce(3.0), BallForce(0.5)
TORQUE, WRENCH, EFFORT = Torque(2.0), Wrench(2.0, 2.0), Effort()
BURNS = Engine(3.0, exhaust_velocity=20.0)
PLACES = [(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0), (0, 1, 1), (0, 1, -1)]
PLACES += [(0, -1, 1), (0, -1, -1), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1)]
WAYS_OF = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0), (0, -1, 0), (0, -1, 0)]
WAYS_OF += [(0, 1, 0), (0, 1, 0), (0, 0, -1), (0, 0, -1), (0, 0, 1), (0, 0, 1)]


def hop(actuator=PUSH, objective=EFFORT, goal=THERE, duration=4.0, start=REST, **more):
    return TransferProblem(1.0, start, goal, duration, actuator=actuator, objective=objective, **more)


def turn(actuator=TORQUE, objective=EFFORT, goal=None, duration=4.0, **more):
    goal = goal or Attitude(rotation((0, 0, 1), 60))
    ends = Attitude((1, 0, 0, 0)), goal
    return TransferProblem(1.0, *ends, duration, inertia=J, actuator=actuator, objective=objective, **more)


def carried(actuator=WRENCH, **more):
    goal = Pose((1, 0.5, 0), attitude=rotation((0, 0, 1), 30))
    return TransferProblem(3.0, Pose((0, 0, 0)), goal, 6.0, inertia=J, actuator=actuator, **more)


def orbit(goal, objective=EFFORT, duration=4.0, actuator=WEAK):
    size = goal.dimension or 2
    start = State((1, 0, 0)[:size], (0, 1, 0)[:size])
    parts = {"effects": [PointGravity(1.0)], "actuator": actuator, "objective": objective}
    return TransferProblem(1.0, start, goal, duration, **parts)


def legs(*parts, goal=THERE, start=REST, actuator=PUSH, **more):
    return Mission(1.0, start, goal, parts, actuator=actuator, **more)


def wheels(**more):
    return Wheels(np.eye(3).tolist(), 2.0, **more)


def moving(**more):
    return Moving(lambda t: ca.vertcat(1 + 0.3 * t, 0.1 * t), **more)


def swung(actuator):
    """A pendulum that is lifted to the side."""
    ends = State((0, -1), (0, 0)), State((1, 0), (0, 0))
    return TransferProblem(1.0, *ends, 2.0, effects=[UniformGravity((0, -1.0))], links=[ROD], actuator=actuator)


def pair(joint, actuator, **more):
    ends = {"a": Pose((0, 0, 0)), joint: JointState(0.0)}, {joint: JointState(0.5)}
    members = [Member("a", 3.0, J), Member("b", 2.0, (0.4, 0.5, 0.6))]
    return TransferProblem(System(members, [joint]), *ends, 3.0, actuator=actuator, **more)


ROD = Rod((0, 0), 1.0)
HINGE = Revolute((0, 0, 1), on="b", to="a")
SLIDE = Prismatic((1, 0, 0), on="b", to="a")
OPEN = State((None, None), (None, None))
BACK = State((0, 0.1), (0, 0))

# Name of a part, or with what else it is tried: a scene that has it.
PARTS = {
    "FreeForce": lambda: hop(FreeForce()),
    "BoxForce": lambda: hop(BoxForce(3.0)),
    "BallForce": lambda: hop(PUSH),
    "Engine": lambda: hop(BURNS),
    "Nozzles": lambda: hop(Nozzles(CROSS, 3.0)),
    "Nozzles, SpeedLimit": lambda: hop(Nozzles(CROSS, 3.0), constraints=[SpeedLimit(0.9)]),
    "Nozzles, KeepOut": lambda: hop(Nozzles(CROSS, 3.0), constraints=[KeepOut((1.0, 0.1), 0.3)]),
    "Torque": turn,
    "BallTorque": lambda: turn(BallTorque(2.0)),
    "Wheels": lambda: turn(wheels(max_momentum=3.0)),
    "Wrench": carried,
    "Thrusters": lambda: carried(Thrusters(PLACES, WAYS_OF, 3.0)),
    "Unpowered": lambda: TransferProblem(
        *(1.0, State((0, 0), (None, None)), State((2, 0), (None, None)), 1.0),
        effects=[UniformGravity((0, -9.81))],
        actuator=Unpowered(),
    ),
    "JointTorque": lambda: pair(HINGE, JointTorque(HINGE, 5.0)),
    "JointTorque, Rod": lambda: swung(JointTorque(ROD, 5.0)),
    "JointForce": lambda: pair(SLIDE, JointForce(SLIDE, 9.0)),
    "On": lambda: pair(HINGE, On("a", Wrench(9.0, 9.0))),
    "Several": lambda: pair(HINGE, Several((On("a", Wrench(9.0, 9.0)), JointTorque(HINGE, 5.0)))),
    "SpeedLimit": lambda: hop(constraints=[SpeedLimit(0.9)]),
    "KeepOut": lambda: hop(constraints=[KeepOut((1.0, 0.1), 0.3)]),
    "KeepIn": lambda: hop(constraints=[KeepIn((-1, -0.5), (3, 0.5))]),
    "ApproachCone": lambda: hop(constraints=[ApproachCone((2.2, 0), (-1, 0), 1.2)]),
    "PointingKeepOut": lambda: turn(
        constraints=[PointingKeepOut((1, 0, 0), (np.cos(0.5), np.sin(0.5), 0.2), 12.0)]
    ),
    "PointingKeepIn": lambda: turn(constraints=[PointingKeepIn((0, 0, 1), (0, 0, 1), 20.0)]),
    "RateLimit": lambda: turn(constraints=[RateLimit(0.35)]),
    "Wheels, RateLimit": lambda: turn(wheels(), constraints=[RateLimit(0.35)]),
    "MomentumLimit": lambda: turn(wheels(), constraints=[MomentumLimit((1.0, 1.0, 1.0))]),
    "JointLimit": lambda: pair(HINGE, JointTorque(HINGE, 5.0), constraints=[JointLimit(HINGE, -0.1, 0.6)]),
    "Effort": lambda: hop(),
    "Fuel": lambda: hop(objective=Fuel()),
    "Fuel, Engine": lambda: hop(BURNS, Fuel()),
    "FinalMass": lambda: hop(BURNS, FinalMass()),
    "Time": lambda: hop(objective=Time(), duration=(1.0, 6.0)),
    "Time, Torque": lambda: turn(objective=Time(), duration=(0.5, 8.0)),
    "Time, Engine": lambda: hop(BURNS, Time(), duration=(1.0, 6.0)),
    "WeightedSum": lambda: hop(objective=Effort() + 0.1 * Time(), duration=(1.0, 6.0)),
    "FinalRadius": lambda: orbit(OPEN, FinalRadius()),
    "FinalHeight": lambda: hop(objective=FinalHeight(axis=0), goal=State((None, 0), (0, 0))),
    "Information": lambda: hop(objective=Effort() - 0.1 * Information("mass", 0.01, 0.1)),
    "DeltaV": lambda: legs(Impulse(), Coast(4.0), Impulse(), objective=DeltaV()),
    "State": lambda: hop(goal=State((2, None), (0, None))),
    "Condition": lambda: hop(
        goal=Condition(lambda t, q, v, m: ca.dot(q, q) - 4, "circle", 4.0, State((None, None), (0, 0)))
    ),
    "Moving": lambda: hop(goal=moving()),
    "Moving, Time": lambda: hop(goal=moving(), objective=Time(), duration=(0.5, 6.0)),
    "CircularOrbit": lambda: orbit(CircularOrbit(1.3, 1.0, center=(0, 0))),
    "CircularOrbit, Time": lambda: orbit(CircularOrbit(1.3, 1.0, center=(0, 0)), Time(), (1.0, 8.0)),
    "Orbit": lambda: orbit(Orbit(mu=1.0, a=1.3, e=0.2, i=0.1, center=(0, 0, 0)), duration=5.0),
    "Attitude": lambda: turn(goal=Attitude(rotation((0, 0, 1), 60), (None, None, None))),
    "Pose": lambda: carried(constraints=[SpeedLimit(0.45)]),
    "Free": lambda: legs(
        Leg(4.0, actuator=BallForce(2.0)), goal=Free(), objective=Effort() - 0.5 * FinalHeight(0)
    ),
    "Periodic": lambda: legs(
        *(Leg(2.0), Via((1, 1)), Leg(2.0)), start=Free(2), goal=Periodic(), effects=[Spring(0.5, (0, 0))]
    ),
    "Via": lambda: legs(Leg(2.0), Via((1, 0.4)), Leg(2.0)),
    "Via, SpeedLimit": lambda: legs(Leg(2.0), Via((1, 0.4)), Leg(2.0), constraints=[SpeedLimit(0.9)]),
    "Drop": lambda: legs(Leg(2.0), Drop(0.2), Leg(2.0), actuator=BURNS, objective=Fuel()),
    "Impulse": lambda: legs(
        *(Impulse(), Coast((2.0, 6.0)), Impulse()),
        start=State((1, 0), (0, 1)),
        goal=CircularOrbit(1.4, 1.0, center=(0, 0)),
        effects=[PointGravity(1.0)],
        objective=DeltaV(),
    ),
    "Bounce": lambda: legs(
        *(Leg((0.1, 2.0)), Bounce(lambda q: q[1], 0.8), Leg((0.1, 2.0))),
        start=State((0, 1), (1, 0)),
        goal=State((2, 0.5), (None, None)),
        effects=[UniformGravity((0, -1.0))],
        duration=(0.5, 3.0),
    ),
    "Frame": lambda: legs(
        Leg(2.0), Frame(lambda t, q: q - ca.DM([1, 0]), "another"), Leg(2.0), goal=State((1, 0), (0, 0))
    ),
    "Flyby": lambda: legs(
        *(Leg((1.0, 6.0)), Flyby(lambda t: (1 + 0.1 * t, 0.4 + 0 * t), radius=0.01, mu=0.02), Leg((1.0, 6.0))),
        duration=6.0,
    ),
    "Apart": lambda: Team((hop(), hop(start=State((2, 0.1), (0, 0)), goal=BACK)), (Apart(0.4),)),
    "Meet": lambda: Team((hop(goal=OPEN), hop(start=State((2, 0.5), (0, 0)), goal=OPEN)), (Meet(),)),
}
# (order, tolerance, hold). Of these every tenth is run each time: the first of every second part.
WAYS = [(None, 1e-3, False), (2, None, False), (8, None, True), (None, 1e-3, True), (6, 1e-6, False)]
KINDS = (
    dmoc.Actuator,
    dmoc.Constraint,
    dmoc.Objective,
    dmoc.Boundary,
    dmoc.Together,
    *Via.__mro__[1:2],
)


def test_the_table_has_every_public_part():
    kinds = {getattr(dmoc, name) for name in dmoc.__all__ if inspect.isclass(getattr(dmoc, name))}
    parts = {kind.__name__ for kind in kinds if issubclass(kind, KINDS) and kind not in KINDS}
    assert parts == {name.split(",")[0] for name in PARTS}


# Not met yet: the way, its place in WAYS, and what is red.
NOT_MET = {
    ("Time, Torque", 4): "a residual of 3e-5 N m on 4,000 steps after five minutes",
    ("Time, Engine", 4): "finer meshes are given up at an error of 1e-4, and that is said",
    ("Orbit", 1): "40 steps of order 2 miss the goal by 1.5 % of the path, which the check says",
}
CASES = [
    pytest.param(
        name,
        *way,
        marks=[pytest.mark.xfail(strict=True, reason=NOT_MET[name, i])] if (name, i) in NOT_MET else (),
    )
    for name in PARTS
    for i, way in enumerate(WAYS)
]


def test_an_engine_that_burns_in_least_time_is_found_on_its_usual_mesh():
    """Its propellant is not paid for: at the node where its thrust is reversed Ipopt wandered for minutes."""
    solution = solve(PARTS["Time, Engine"]()).raise_for_status()
    assert verify(solution).ok and sum(level.iterations for level in solution.ladder) < 400
    assert solution.objective == pytest.approx(solve(PARTS["Time, Engine"](), steps=200).objective, rel=5e-4)


@pytest.mark.parametrize("name, order, tol, hold", CASES)
def test_it_solves_on_a_mesh_and_to_a_tolerance(name, order, tol, hold):
    solution = solve(PARTS[name](), order, tol=tol, hold=hold, steps=None if tol else 40)
    assert solution.success, solution.message
    failed = [check for check in verify(solution).checks if not check.ok]
    assert not failed, failed
