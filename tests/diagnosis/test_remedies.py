"""A number in a message is a promise: the scene with that number, as printed, is solved and every check holds.

Where a message names the least that is needed, a tenth less does not do.
"""

import inspect
import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import dmoc
from dmoc import (
    Actuator,
    ApproachCone,
    Attitude,
    BallForce,
    BallTorque,
    BoxForce,
    CircularOrbit,
    ClohessyWiltshire,
    Constraint,
    Engine,
    Fuel,
    JointForce,
    JointState,
    JointTorque,
    KeepIn,
    KeepOut,
    LinearDrag,
    Member,
    MomentumLimit,
    Moving,
    Nozzles,
    On,
    PointGravity,
    PointingKeepIn,
    PointingKeepOut,
    Pose,
    Prismatic,
    RateLimit,
    Revolute,
    RotatingFrame,
    SpeedLimit,
    Spring,
    State,
    System,
    Thrusters,
    Time,
    Torque,
    TransferProblem,
    UniformGravity,
    Wheels,
    Wrench,
    rotation,
    solve,
    verify,
)
from dmoc.motion.stability import OPEN
from dmoc.scene.problem_file import load_problem

NUMBER = r"(-?[\d.]+(?:e[+-]?\d+)?)"
J = (1.0, 2.0, 2.8)
CROSS = ((1, 0), (-1, 0), (0, 1), (0, -1))


def hop(goal=(4.0, 1.0), duration=4.0, **parts):
    still = np.zeros(len(goal))
    return TransferProblem(1.0, State(still, still), State(goal, still), duration, **parts)


def turn(degrees=150, axis=(1, 2, 1), duration=2.0, **more):
    goal = Attitude(rotation(axis, degrees))
    return TransferProblem(1.0, Attitude((1, 0, 0, 0)), goal, duration, inertia=J, **more)


def both(force, torque, duration, **more):
    goal = Pose((2, 1, 0), attitude=rotation((1, 0, 1), 80))
    return TransferProblem(
        3.0, Pose((0, 0, 0)), goal, duration, inertia=J, actuator=Wrench(force, torque), **more
    )


def meet(force, longest):
    def target(t):
        return ca.vertcat(3 + 0.5 * t, 1.0)

    return TransferProblem(
        1.0, State((0, 0), (0, 0)), Moving(target), (1.0, longest), actuator=BallForce(force)
    )


def loaded(dry):
    still, engine = (0.0, 0.0), Engine(12.0, exhaust_velocity=20.0, dry_mass=dry)
    ends = State(still, still), State((2.0, 0.0), still)
    return TransferProblem(1.7, *ends, 4.0, actuator=engine, objective=Fuel())


def half(dry):
    """The dry mass that leaves half of the propellant: how much more than needed is named is not said."""
    return (1.7 - 0.5 * (1.7 - dry),)


def raised(dry):
    """To a larger circular orbit: in a longer time an engine needs hardly less propellant."""
    engine = Engine(0.15, exhaust_velocity=1.8, dry_mass=dry)
    ends = State((1.0, 0.0), (0.0, 1.0)), CircularOrbit(1.3, mu=1.0)
    return TransferProblem(1.0, *ends, 5.0, effects=[PointGravity(1.0)], actuator=engine)


def half_of_raised(dry):
    return (1.0 - 0.5 * (1.0 - dry),)


def under(radius, **more):
    """Between a wall and a sphere there is room for a radius of 0.7 m."""
    walls = [KeepIn((-1, -0.2), (5, 1.2)), KeepOut((2, 0.5), radius)]
    return hop((4.0, 0.0), 5.0, constraints=walls, **({"actuator": BallForce(2.0)} | more))


def gate(first, second):
    """Two discs that overlap between two walls: each has to give way by itself to 1 m."""
    walls = [KeepIn((-1, -2), (5, 2)), KeepOut((2, 1.05), first), KeepOut((2, -1.05), second)]
    return hop((4.0, 0.0), 5.0, actuator=BallForce(2.0), constraints=walls)


def tunnel(radius):
    """The same in a low duct in space: beside the sphere there is room for 0.7 m and hardly more."""
    walls = [KeepIn((-1, -0.2, -0.1), (5, 1.2, 0.1)), KeepOut((2, 0.5, 0.0), radius)]
    return hop((4.0, 0.0, 0.0), 5.0, actuator=BallForce(2.0), constraints=walls)


def docked(half):
    """To the tip of a cone past a sphere: the cone needs the half angle of its tangents, asin(0.6 / 2.5)."""
    walls = [KeepOut((2.5, 0, 0), 0.6), ApproachCone((0, 0, 0), (1, 0, 0), half)]
    ends = State((5, 0, 0), (0, 0, 0)), State((0, 0, 0), (0, 0, 0))
    return TransferProblem(1.0, *ends, 10.0, constraints=walls)


def lamp(out, near):
    """An axis must pass a lamp while another axis stays near its place."""
    limits = [
        PointingKeepOut((1, 0, 0), (np.cos(1.2), np.sin(1.2), 0), out),
        PointingKeepIn((0, 0, 1), (0, 0, 1), near),
    ]
    return turn(150, (0, 0, 1), 8.0, actuator=Torque(), constraints=limits)


PLACES = [(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0), (0, 1, 1), (0, 1, -1)]
PLACES += [(0, -1, 1), (0, -1, -1), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1)]
WAYS = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0), (0, -1, 0), (0, -1, 0)]
WAYS += [(0, 1, 0), (0, 1, 0), (0, 0, -1), (0, 0, -1), (0, 0, 1), (0, 0, 1)]


def pushed(thrust, duration):
    goal = Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), 86))
    return TransferProblem(
        3.0, Pose((0, 0, 0)), goal, duration, inertia=J, actuator=Thrusters(PLACES, WAYS, thrust)
    )


HINGE = Revolute((0, 0, 1), on="b", to="a")
SLIDE = Prismatic((1, 0, 0), on="b", to="a")


def jointed(joint, actuator, duration=3.0, rate=0.0, **more):
    """Two free bodies and a joint between them, opened by half a metre or radian."""
    ends = {"a": Pose((0, 0, 0)), joint: JointState(0.0, rate)}, {joint: JointState(0.5)}
    members = [Member("a", 3.0, J), Member("b", 2.0, (0.4, 0.5, 0.6))]
    return TransferProblem(System(members, [joint]), *ends, duration, actuator=actuator, **more)


def wheeled(torque, momentum, duration=4.0, **more):
    return turn(60, (0, 0, 1), duration, actuator=Wheels(np.eye(3).tolist(), torque, momentum), **more)


def stored(momentum, duration):
    """Wheels without a limit of their own, but with one in the scene."""
    limit = MomentumLimit((momentum,) * 3)
    return wheeled(3.0, None, duration, constraints=[limit])


LIMIT = "a force limit of # N [(]"
THRUST = "a largest thrust of # N [(]"
TORQUE = "a torque limit of # N m [(]"
SPEED = "a speed limit of # m/s [(]"
RATE = "a rate limit of # rad/s [(]"
SECONDS = "(?:needs|or) # s [(]"
RADIUS = "keep-out {} of at most # m radius"

# A scene as a function of what a message may name, the values given, how it is solved, and the remedies, each
# by itself: which values it changes, and how it is worded with # for their numbers.
SCENES = {
    "force": (
        lambda f, t: hop(duration=t, actuator=BallForce(f)),
        (0.5, 4.0),
        {"steps": 40, "hold": True},
        [((0,), LIMIT), ((1,), SECONDS)],
    ),
    "force at order 8": (
        lambda f, t: hop(duration=t, actuator=BallForce(f)),
        (0.5, 4.0),
        {"steps": 12, "order": 8},
        [((0,), LIMIT), ((1,), SECONDS)],
    ),
    "force of two axes": (
        lambda f, g, t: hop(duration=t, actuator=BoxForce((f, g))),
        (0.5, 0.4, 4.0),
        {"steps": 40},
        [((0, 1), r"force limits of \(#, #\) N"), ((2,), SECONDS)],
    ),
    "force for least fuel": (
        lambda f, t: hop((4.0, 0.0), t, actuator=BoxForce(f), objective=Fuel()),
        (0.3, 5.0),
        {"steps": 100},
        [((0,), LIMIT), ((1,), SECONDS)],
    ),
    "force of two axes for least fuel": (
        lambda f, g: hop((4.0, 1.0), 5.0, actuator=BoxForce((f, g)), objective=Fuel()),
        (0.3, 0.2),
        {"steps": 100},
        [((0, 1), r"force limits of \(#, #\) N")],
    ),
    "hover": (
        lambda f: hop(duration=5.0, actuator=BallForce(f), effects=[UniformGravity((0, -9.81))]),
        (9.0,),
        {"steps": 50},
        [((0,), LIMIT)],
    ),
    "least time": (
        lambda f, t: hop((1.0,), (0.5, t), actuator=BoxForce(f), objective=Time()),
        (1.0, 1.5),
        {"steps": 50},
        [((0,), LIMIT), ((1,), SECONDS)],
    ),
    "a target that moves": (meet, (0.5, 3.0), {"steps": 50}, [((0,), LIMIT), ((1,), SECONDS)]),
    "nozzles of their own": (
        lambda a, b, c, d, t: hop(duration=t, actuator=Nozzles(CROSS, (a, b, c, d))),
        (0.5, 0.6, 0.1, 0.1, 4.0),
        {"steps": 50},
        [((0, 1, 2, 3), r"largest thrusts of \(#, #, #, #\) N"), ((4,), SECONDS)],
    ),
    "nozzles that burn": (
        lambda f, t: hop(duration=t, actuator=Nozzles(CROSS, f, exhaust_velocity=20.0), objective=Fuel()),
        (0.5, 4.0),
        {"steps": 50},
        [((0,), THRUST), ((1,), SECONDS)],
    ),
    "engine": (
        lambda f, t: hop((4.0, 0.0), t, actuator=Engine(f, exhaust_velocity=50), objective=Fuel()),
        (0.3, 5.0),
        {"steps": 50},
        [((0,), THRUST), ((1,), SECONDS)],
    ),
    "engine with sides": (
        lambda f, side: hop(
            (4.0, 2.0), 5.0, actuator=Engine(f, exhaust_velocity=50, box=(side, side)), objective=Fuel()
        ),
        (0.8, 0.4),
        {"steps": 50},
        [((0, 1), THRUST + ".*? and a force limit of # N [(].*? along each axis")],
    ),
    "dry mass": (loaded, (1.64,), {"steps": 100}, [((0,), "a dry mass of # kg [(]", half)]),
    "dry mass around an attractor": (
        raised,
        (0.98,),
        {},
        [((0,), "a dry mass of # kg [(]you gave 0.98 kg, which leaves too little propellant", half_of_raised)],
    ),
    "speed": (
        lambda v, t: hop((10.0, 0.0), t, constraints=[SpeedLimit(v)]),
        (1.5, 5.0),
        {"steps": 100},
        [((0,), SPEED), ((1,), SECONDS)],
    ),
    "two speeds": (
        lambda v, w, t: hop((10.0, 0.0), t, constraints=[SpeedLimit(v), SpeedLimit(w)]),
        (1.8, 1.5, 5.0),
        {"steps": 100},
        [((0, 1), f"{SPEED}.*? and {SPEED}"), ((2,), SECONDS)],
    ),
    "speed and force": (
        lambda f, v, t: hop((10.0, 0.0), t, actuator=BallForce(f), constraints=[SpeedLimit(v)]),
        (1.0, 1.5, 5.0),
        {"steps": 100},
        [((0, 1), f"{LIMIT}.*? and {SPEED}"), ((2,), SECONDS)],
    ),
    "torques of three axes": (
        lambda x, y, z, t: turn(duration=t, actuator=Torque((x, y, z))),
        (0.75, 0.5, 0.3, 2.0),
        {"steps": 24},
        [((0, 1, 2), r"torque limits of \(#, #, #\) N m"), ((3,), SECONDS)],
    ),
    "force and torque": (
        both,
        (1.0, 0.5, 3.0),
        {"steps": 16},
        [((0, 1), f"{LIMIT}.*? and {TORQUE}"), ((2,), SECONDS)],
    ),
    "rate": (
        lambda w, t: turn(150, (0, 0, 1), t, actuator=Torque(), constraints=[RateLimit(w)]),
        (0.5, 4.0),
        {"steps": 40},
        [((0,), RATE), ((1,), SECONDS)],
    ),
    "rate and speed": (
        lambda w, v, t: both(None, None, t, constraints=[RateLimit(w), SpeedLimit(v)]),
        (0.3, 0.5, 3.0),
        {"steps": 40},
        [((0, 1), f"{RATE}.*? and {SPEED}"), ((2,), SECONDS)],
    ),
    "ball torque": (
        lambda x, t: turn(60, (0, 0, 1), t, actuator=BallTorque(x)),
        (0.2, 4.0),
        {"steps": 24},
        [((0,), TORQUE), ((1,), SECONDS)],
    ),
    "motors of wheels": (
        lambda x, t: wheeled(x, None, t),
        (0.2, 4.0),
        {"steps": 24},
        [((0,), "a motor torque of # N m [(]"), ((1,), SECONDS)],
    ),
    "what wheels store": (
        lambda x, t: wheeled(3.0, x, t),
        (0.5, 4.0),
        {"steps": 24},
        [((0,), "a max_momentum of # N m s [(]"), ((1,), SECONDS)],
    ),
    "a limit of momentum": (
        stored,
        (0.5, 4.0),
        {"steps": 24},
        [((0,), "a momentum limit of # N m s [(]"), ((1,), SECONDS)],
    ),
    "a motor in a hinge": (
        lambda x, t: jointed(HINGE, JointTorque(HINGE, x), t),
        (0.05, 3.0),
        {"steps": 20},
        [((0,), "a joint torque of # N m in"), ((1,), SECONDS)],
    ),
    "a motor in a slide": (
        lambda x, t: jointed(SLIDE, JointForce(SLIDE, x), t),
        (0.05, 3.0),
        {"steps": 20},
        [((0,), "a joint force of # N in"), ((1,), SECONDS)],
    ),
    "pushes on one of two bodies": (
        lambda x, y, t: jointed(HINGE, On("a", Wrench(x, y)), t),
        (0.1, 0.1, 3.0),
        {"steps": 20},
        [((0, 1), f"{LIMIT}.*? and {TORQUE}"), ((2,), SECONDS)],
    ),
    "thrusters": (pushed, (0.2, 6.0), {"steps": 16}, [((0,), THRUST), ((1,), SECONDS)]),
    "a passage": (under, (1.0,), {"steps": 100}, [((0,), RADIUS.format(2))]),
    "a passage that is leapt": (under, (0.72,), {"steps": 100}, [((0,), RADIUS.format(2))]),
    "a passage in space": (tunnel, (1.0,), {"steps": 100}, [((0,), RADIUS.format(2))]),
    "a passage in a free time": (
        lambda radius: replace(under(radius), duration=(2.0, 9.0)),
        (1.0,),
        {"steps": 100},
        [((0,), RADIUS.format(2))],
    ),
    "two zones": (gate, (1.1, 1.1), {"steps": 100}, [((0,), RADIUS.format(2)), ((1,), RADIUS.format(3))]),
    "an approach cone": (docked, (0.15,), {"steps": 80}, [((0,), "approach cone 2 of at least # rad")]),
    "two cones": (
        lamp,
        (40.0, 10.0),
        {"steps": 40},
        [
            ((0,), "pointing keep-out 1 of at most # degrees"),
            ((1,), "pointing keep-in 2 of at least # degrees"),
        ],
    ),
}


def holds(problem, **how):
    """Whether a problem is solved and every check holds."""
    solution = solve(problem, **how)
    return solution.success and verify(solution).ok


def remedied(given, which, numbers, share=1.0):
    """The values with some of them changed to these numbers, or to a share of these."""
    values = list(given)
    for place, number in zip(which, numbers, strict=True):
        values[place] = number * share if number > given[place] else number / share
    return values


# Where each part with a limit that a message may name is followed.
FOLLOWED = {
    "ApproachCone": "an approach cone",
    "BallForce": "force",
    "BallTorque": "ball torque",
    "BoxForce": "force of two axes",
    "Engine": "engine",
    "JointForce": "a motor in a slide",
    "JointTorque": "a motor in a hinge",
    "KeepOut": "a passage",
    "MomentumLimit": "a limit of momentum",
    "Nozzles": "nozzles of their own",
    "On": "pushes on one of two bodies",
    "PointingKeepIn": "two cones",
    "PointingKeepOut": "two cones",
    "RateLimit": "rate",
    "SpeedLimit": "speed",
    "Thrusters": "thrusters",
    "Torque": "torques of three axes",
    "Wheels": "what wheels store",
    "Wrench": "force and torque",
}
# Several actuators are relaxed each as by itself, and the sides of a room and the stops of a joint stand for a
# wall: they are never said to be in the way.
NOT_NAMED = {"JointLimit", "KeepIn", "Several"}


def test_every_limit_that_can_be_named_is_followed():
    """What can be eased, or told what is needed in its place, has a scene above; a new part needs one."""
    kinds = (getattr(dmoc, name) for name in dmoc.__all__)
    parts = [kind for kind in kinds if inspect.isclass(kind) and issubclass(kind, (Actuator, Constraint))]
    base = vars(Actuator) | vars(Constraint)
    eased = {
        kind.__name__
        for kind in parts
        if any(getattr(kind, name, None) is not base.get(name) for name in ("eased", "times", "needs"))
    } - {"Actuator", "Constraint", "FreeForce", "Unpowered"}
    assert eased == set(FOLLOWED) | NOT_NAMED
    assert set(FOLLOWED.values()) <= set(SCENES)


# These take four seconds and more; the others run every time.
LONG = {
    "rate",
    "rate and speed",
    "speed and force",
    "a passage",
    "a passage in space",
    "a passage in a free time",
    "two zones",
    "an approach cone",
    "motors of wheels",
    "what wheels store",
    "a limit of momentum",
    "ball torque",
    "a motor in a hinge",
    "a motor in a slide",
    "pushes on one of two bodies",
}


EVERY = [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in SCENES]


@pytest.mark.parametrize("name", EVERY)
def test_what_a_message_names_is_enough_and_a_tenth_less_is_not(name):
    make, given, how, remedies = SCENES[name]
    failed = solve(make(*given), **how)
    assert not failed.success
    for which, words, *least in remedies:
        found = re.search(words.replace("#", NUMBER), failed.message)
        assert found, failed.message
        numbers = [float(number) for number in found.groups()]
        assert holds(make(*remedied(given, which, numbers)), **how), failed.message
        too_little = least[0](*numbers) if least else remedied(given, which, numbers, 0.9)
        assert not holds(make(*too_little), **how), failed.message


def spun(rate, degrees, duration=5.0):
    """A body that keeps its rate [rad/s] about z, and is turned by so much more."""
    ends = Attitude((1, 0, 0, 0), (0, 0, rate)), Attitude(rotation((0, 0, 1), degrees), (0, 0, rate))
    return TransferProblem(1.0, *ends, duration, inertia=J, actuator=Torque())


def swung(*effects, duration=20.0):
    ends = State((1.0, 0.0), (0.0, 0.0)), State((0.0, 0.0), (0.0, 0.0))
    return TransferProblem(1.0, *ends, duration, effects=effects)


# Scenes of which so few steps are refused before the solve, with their order.
REFUSED = {
    "a spring": (swung(Spring(100.0, (0.0, 0.0))), 10, 2),
    "a spring at order 4": (swung(Spring(100.0, (0.0, 0.0))), 10, 4),
    "a spring at order 8": (swung(Spring(100.0, (0.0, 0.0))), 10, 8),
    "a frame that turns": (swung(RotatingFrame(3.0)), 10, 6),
    "a spring that is damped": (swung(Spring(100.0, (0.0, 0.0)), LinearDrag(3.0)), 10, 4),
    "near an orbit": (
        TransferProblem(
            1.0,
            State((100, 0, 0), (0, 0, 0)),
            State((0, 0, 0), (0, 0, 0)),
            2e4,
            effects=[ClohessyWiltshire(1e-3)],
        ),
        3,
        4,
    ),
    "a turn": (turn(170, (0, 0, 1), 5.0, actuator=Torque()), 3, 2),
    "a spin": (spun(2.0, 170), 4, 2),
    "a spin at order 4": (spun(2.0, 170), 4, 4),
    "a spin at order 6": (spun(3.0, 170), 4, 6),
    "a spin at order 8": (spun(3.0, 170), 3, 8),
}


@pytest.mark.parametrize("name", REFUSED)
def test_steps_that_are_refused_come_with_the_least_number_that_is_not(name):
    problem, few, order = REFUSED[name]
    with pytest.raises(ValueError, match=f"{few} steps of order {order}") as refusal:
        solve(problem, steps=few, order=order)
    enough = int(re.search(r"(\d+) equal steps", str(refusal.value))[1])
    assert enough > few
    solve(problem, steps=enough, order=order)
    with pytest.raises(ValueError, match=f"{enough - 1} steps of order {order}"):
        solve(problem, steps=enough - 1, order=order)


@pytest.mark.parametrize("name", REFUSED)
def test_the_program_finds_steps_that_are_enough_where_few_are_refused(name):
    """What the refusal names besides: a tolerance."""
    assert "tol=1e-4" in OPEN
    assert holds(REFUSED[name][0], tol=1e-4)


def test_a_scene_of_a_hundred_oscillations_is_not_refused_for_its_default_steps():
    """On 400 steps h omega would be 2.5."""
    assert holds(swung(Spring(100.0, (0.0, 0.0)), duration=100.0))


def to_mars(dry):
    """In least time, with an engine that burns throughout if it may."""
    problem = load_problem("earth_mars").make()
    return replace(problem, actuator=replace(problem.actuator, dry_mass=dry))


def test_a_lack_of_propellant_is_named_before_much_else_is_tried():
    """Half the propellant of the cheapest way, 0.095 kg: no rows of mass flow, and no thousand iterations."""
    failed = solve(to_mars(0.95))
    named = re.search("the transfer needs a dry mass of # kg".replace("#", NUMBER), failed.message)
    assert named and 0.9 < float(named[1]) < 1 - 0.0954
    assert sum(level.iterations for level in failed.ladder) < 1000


@pytest.mark.slow
def test_the_propellant_that_is_named_is_enough_in_least_time():
    assert holds(to_mars(0.9))
