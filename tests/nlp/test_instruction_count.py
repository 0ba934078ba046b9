"""What a scene does not list costs nothing: no instruction, no unknown, no row.

Counts are of the small functions of one node, one step and the two ends, which are what every evaluation of
the NLP repeats.
"""

import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    ClohessyWiltshire,
    Engine,
    KeepIn,
    KeepOut,
    LinearDrag,
    PointGravity,
    RotatingFrame,
    SpeedLimit,
    Spring,
    State,
    TransferProblem,
    UniformGravity,
)
from dmoc.guess.starting import starting_guess
from dmoc.motion.lobatto import scheme
from dmoc.nlp.placement import Placement
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import units_of

STEPS = 6
RESTING = [UniformGravity((0, -9.81)), PointGravity(1.0), Spring(2.0, (0, 0))]
MOVING = [LinearDrag(0.3), RotatingFrame(0.2), ClohessyWiltshire(0.1)]

# Instructions of a body with nothing but its mass, pinned: whatever is added to the program later must leave
# these alone, or every scene pays for it. Lower a number that has shrunk; to raise one needs a reason.
BARE = {
    "nodal": {
        "node": {"rows": 12, "cost": 12, "gradient": 16, "jacobian": 8, "hessian": 7},
        "step": {"rows": 19, "cost": 2, "gradient": 5, "jacobian": 19, "hessian": 0},
        "ends": {"rows": 10, "cost": 2, "gradient": 9, "jacobian": 6, "hessian": 0},
    },
    "held": {
        "node": {"rows": 3, "cost": 2, "gradient": 3, "jacobian": 0, "hessian": 0},
        "step": {"rows": 35, "cost": 17, "gradient": 25, "jacobian": 31, "hessian": 7},
        "ends": {"rows": 10, "cost": 2, "gradient": 9, "jacobian": 6, "hessian": 0},
    },
}


def scene(**changes):
    changes = {"duration": 3.0, **changes}
    return TransferProblem(2.0, State((1, 0.2), (0, 0.8)), State((-0.5, 1), (-0.6, -0.4)), **changes)


def script(problem, order=2, hold=False):
    """Layouts and blocks of a problem."""
    mesh = np.linspace(0, 1, STEPS + 1)
    guess = starting_guess(problem, mesh, order, hold)
    return Placement(
        problem, stencils_of(problem, order, hold), scheme(order), hold, mesh, units_of(problem, guess)
    )


def counts(problem, order=2, hold=False):
    return {
        block.kernel.name: {kind: part.n_instructions() for kind, part in block.kernel.functions.items()}
        for block in script(problem, order, hold).blocks
    }


def total(count):
    return sum(sum(kinds.values()) for kinds in count.values())


def sizes(layout):
    return {group.name: group.indices.size for group in layout.groups}


def added(problem, order=2):
    """Unknowns and rows that a problem has beyond the bare scene's, by name, and its further instructions."""
    bare, full = script(scene(), order), script(problem, order)
    more = []
    for old, new in ((sizes(bare.columns), sizes(full.columns)), (sizes(bare.rows), sizes(full.rows))):
        assert old.keys() <= new.keys()
        more.append({name: size - old.get(name, 0) for name, size in new.items() if size != old.get(name)})
    return *more, total(counts(problem, order)) - total(counts(scene(), order))


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
def test_a_bare_body_costs_what_it_always_did(hold):
    assert counts(scene(), hold=hold) == BARE["held" if hold else "nodal"]


def test_the_bare_scene_has_no_unknown_and_no_row_to_spare():
    """Positions, forces and two boundary velocities; the discrete Euler-Lagrange equations alone."""
    bare = script(scene())
    nodes = STEPS + 1
    assert sizes(bare.columns) == {
        "position": 2 * nodes,
        "force": 2 * nodes,
        "start.velocity": 2,
        "goal.velocity": 2,
    }
    assert sizes(bare.rows) == {"dynamics": 2 * nodes}


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("effect", RESTING + MOVING, ids=lambda effect: type(effect).__name__)
def test_an_effect_adds_instructions_but_no_unknown_and_no_row(effect, order):
    unknowns, rows, instructions = added(scene(effects=[effect]), order)
    assert not unknowns and not rows
    assert instructions > 0


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("effect", RESTING, ids=lambda effect: type(effect).__name__)
def test_an_effect_of_position_acts_once_a_node(effect, order):
    """Not once for each step that shares it: the functions of a step and of the ends stay as they were."""
    bare, full = counts(scene(), order), counts(scene(effects=[effect]), order)
    assert full["step"] == bare["step"] and full["ends"] == bare["ends"]
    assert full["node"]["rows"] > bare["node"]["rows"]


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("effect", MOVING, ids=lambda effect: type(effect).__name__)
def test_an_effect_of_velocity_acts_in_the_steps(effect, order):
    bare, full = counts(scene(), order), counts(scene(effects=[effect]), order)
    assert full["node"] == bare["node"]
    assert full["step"]["rows"] > bare["step"]["rows"]


def test_effects_do_not_pay_for_each_other():
    """Two effects cost what each costs alone, or less where they share a term."""
    first, second = RESTING[0], MOVING[0]
    alone = added(scene(effects=[first]))[2] + added(scene(effects=[second]))[2]
    assert added(scene(effects=[first, second]))[2] <= alone


def test_a_free_duration_is_one_unknown_and_no_row():
    unknowns, rows, _ = added(scene(duration=(1.0, 5.0)))
    assert unknowns == {"duration": 1} and not rows


def test_a_box_is_bounds_alone():
    """Force limits an axis and a keep-in box: nothing to evaluate."""
    assert added(scene(actuator=BoxForce(3.0))) == ({}, {}, 0)
    assert added(scene(constraints=[KeepIn((-9, -9), (9, 9))])) == ({}, {}, 0)


@pytest.mark.parametrize(
    "changes, expected",
    [
        ({"actuator": BallForce(3.0)}, {"actuator": STEPS + 1}),
        ({"constraints": [KeepOut((0, 0), 0.1)]}, {"keep_out_1": STEPS + 1}),
        ({"constraints": [SpeedLimit(9.0)]}, {"speed_limit_1": STEPS, "start.speed": 1, "goal.speed": 1}),
    ],
    ids=["ball", "keep out", "speed limit"],
)
def test_a_limit_adds_its_own_rows_and_no_unknown(changes, expected):
    unknowns, rows, instructions = added(scene(**changes))
    assert not unknowns and rows == expected and instructions > 0


def test_only_an_engine_that_burns_has_a_mass_to_find():
    nodes = STEPS + 1
    unknowns, rows, _ = added(scene(actuator=Engine(3.0)))
    assert unknowns == {"force": nodes} and rows == {"actuator": nodes}
    unknowns, rows, _ = added(scene(actuator=Engine(3.0, exhaust_velocity=9.0)))
    assert unknowns == {"force": nodes, "mass": nodes} and rows == {"actuator": nodes, "mass_flow": STEPS}


def test_held_forces_are_fewer():
    nodal, held = script(scene(), 6), script(scene(), 6, hold=True)
    assert held.columns["force"].indices.size == 2 * STEPS
    assert nodal.columns["force"].indices.size == 2 * (3 * STEPS + 1)
    assert held.rows.size == nodal.rows.size
