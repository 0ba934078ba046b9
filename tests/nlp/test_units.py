"""The same transfer in other units, and turned, mirrored, shifted: the same answer, step by step.

Pass criterion: objectives agree to 1e-9 relative. Iterations are identical in all units, and in other
axes for smooth least effort; where limits act, rounding differs in other axes and they may differ by a
factor of two. Units run from millimetres and tonnes to astronomical
units, forces from 1e-6 to 1e7 N, durations from 1e-3 to 1e9 s.
"""

import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    KeepOut,
    LinearDrag,
    PointGravity,
    SpeedLimit,
    State,
    TransferProblem,
    UniformGravity,
    solve,
)

# length [m], time [s], mass [kg] of one canonical unit
UNITS = {
    "millimetres and tonnes": (1e-3, 1.0, 1e3),
    "astronomical units": (1.495978707e11, 5.0226757e6, 1e3),
    "a microchip": (1e-6, 1e-4, 1e-9),
    "an hour of low orbit": (6.78e6, 870.0, 500.0),
    "a shock": (1.0, 1e-4, 1.0),
    "a glacier": (1e3, 1e8, 1e12),
    "a micronewton": (1.0, 1e3, 1.0),
    "ten meganewton": (1e4, 1e2, 1e7),
}
STEPS = 200


def plane(angle=0.0, mirror=False):
    """A rotation of the first two axes, or the same after a mirror image."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return turn @ np.diag([1.0, -1.0]) if mirror else turn


class Frame:
    """Units, axes, origin and clock that a scene is stated in."""

    def __init__(self, units=(1.0, 1.0, 1.0), axes=None, origin=None, begin=0.0, n=2):
        self.length, self.time, self.mass = units
        self.axes, self.begin = np.eye(n) if axes is None else axes, begin * self.time
        self.origin = np.zeros(n) if origin is None else np.asarray(origin) * self.length
        self.speed = self.length / self.time
        self.force = self.mass * self.length / self.time**2
        self.effort = self.force**2 * self.time

    def place(self, q):
        return tuple(self.origin + self.axes @ np.asarray(q, float) * self.length)

    def vector(self, v, unit):
        return tuple(self.axes @ np.asarray(v, float) * unit)

    def state(self, q, v):
        return State(self.place(q), self.vector(v, self.speed))

    def transfer(self, start, goal, duration, **parts):
        ends = self.state(*start), self.state(*goal)
        return TransferProblem(self.mass, *ends, duration * self.time, start_time=self.begin, **parts)


def orbits(frame, limit=None):
    """From a circle of radius 1 to one of 1.5 in one and a half revolutions."""
    pull = PointGravity(frame.length**3 / frame.time**2, frame.place((0, 0)))
    far = ((-1.5, 0), (0, -np.sqrt(1 / 1.5)))
    push = {} if limit is None else {"actuator": BallForce(limit * frame.force)}
    return frame.transfer(((1, 0), (0, 1)), far, 12.0, effects=[pull], **push)


def bounded(frame):
    return orbits(frame, limit=0.03)


def drop(frame):
    """Uphill against gravity and drag."""
    effects = [
        UniformGravity(frame.vector((0.3, -1.0), frame.speed / frame.time)),
        LinearDrag(0.5 * frame.mass / frame.time),
    ]
    return frame.transfer(((0, 0), (0, 0)), ((2, 1), (0.5, 0)), 3.0, effects=effects)


def obstacles(frame):
    zones = [KeepOut(frame.place(center), 0.5 * frame.length) for center in ((1.0, 0.2), (2.2, 0.5))] + [
        SpeedLimit(1.2 * frame.speed)
    ]
    push = BallForce(1.5 * frame.force)
    return frame.transfer(((0, 0), (0, 0)), ((3, 1), (0, 0)), 5.0, actuator=push, constraints=zones)


SCENES = {make.__name__: make for make in (orbits, bounded, drop, obstacles)}
SMOOTH = ("orbits", "drop")


@pytest.fixture(scope="module")
def plain():
    return {name: solve(make(Frame()), steps=STEPS) for name, make in SCENES.items()}


def compare(plain, name, frame, identical):
    found, known = solve(SCENES[name](frame), steps=STEPS), plain[name]
    assert known.success and found.success, found.message
    assert found.objective / frame.effort == pytest.approx(known.objective, rel=1e-9)
    if identical:
        assert [level.iterations for level in found.ladder] == [level.iterations for level in known.ladder]
    assert 0.5 * known.iterations <= found.iterations <= 2 * known.iterations


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", SCENES)
def test_units_change_nothing(plain, name, units):
    compare(plain, name, Frame(UNITS[units]), identical=True)


MOVES = {
    "turned": {"axes": plane(0.7)},
    "mirrored": {"axes": plane(0.0, mirror=True)},
    "axes swapped": {"axes": np.array([[0.0, 1.0], [1.0, 0.0]])},
    "moved": {"origin": (3.0, -7.0)},
    "later": {"begin": 40.0},
    "all of it, in kilometres": {
        "axes": plane(2.1, mirror=True),
        "origin": (-2.0, 5.0),
        "begin": 3.0,
        "units": (1e3, 60.0, 20.0),
    },
}


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("name", SCENES)
def test_no_place_or_direction_is_special(plain, name, move):
    compare(plain, name, Frame(**MOVES[move]), identical=name in SMOOTH)


def test_the_order_of_three_axes_does_not_matter():
    def cube(order):
        axes = np.eye(3)[list(order)]
        frame = Frame(axes=axes, n=3)
        pull = [PointGravity(1.0)]
        return frame.transfer(((1, 0, 0), (0, 0.9, 0.2)), ((-1.2, 0.1, 0.3), (0, -0.8, 0)), 4.0, effects=pull)

    known = solve(cube((0, 1, 2)), steps=STEPS)
    for order in ((1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0)):
        found = solve(cube(order), steps=STEPS)
        assert found.success and found.objective == pytest.approx(known.objective, rel=1e-9)
        assert found.iterations == known.iterations


def test_a_force_limit_an_axis_is_tied_to_the_axes():
    """What is not symmetric shows: turned by 45 degrees, a box gives more force along the way."""
    still = ((0.0, 0.0), (0.0, 0.0))
    straight, diagonal = (
        TransferProblem(1.0, State(*still), State(frame.place((1, 0)), (0, 0)), 2.1, actuator=BoxForce(1.0))
        for frame in (Frame(), Frame(axes=plane(np.pi / 4)))
    )
    assert solve(diagonal).objective < 0.99 * solve(straight).objective
