"""Where an attempt leads nowhere around an attractor, a path walks to its optimum from tube to tube."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    BallForce,
    Engine,
    KeepIn,
    Orbit,
    PointGravity,
    RotatingFrame,
    State,
    TransferProblem,
    solve,
    verify,
)
from dmoc.meshes.choices import first_path
from dmoc.rungs.tube import MOST_IN_A_TUBE, ON_THE_WALK, around, walked
from dmoc.solver.ladder import Ladder

# On its way to another orbit in a free time a body may go round once more and once more, at ever less effort.
WINDING = TransferProblem(
    1.0,
    State((0.81045, 0.58581), (-0.62088, 0.85897)),
    Orbit(1.0, 1.13970, 0.168533, center=(0.0, 0.0)),
    (6.4475, 15.7982),
    effects=[PointGravity(1.0)],
    actuator=BallForce(0.040332),
)


@pytest.fixture(scope="module")
def walk():
    """A ladder, a guess from which one attempt leads nowhere, and the path at the end of a walk from it."""
    ladder, guess = Ladder(WINDING), first_path(WINDING, 8, 20)
    assert not ladder.try_on(guess).solved
    return ladder, guess, walked(ladder.ask, WINDING, guess)


def test_a_walk_ends_in_an_optimum_without_a_tube(walk):
    ladder, _, path = walk
    rung = ladder.try_on(path)
    assert rung.solved and rung.answer.iterations <= 3
    assert path.duration == pytest.approx(15.7982) and rung.cost == pytest.approx(2.293e-5, rel=1e-3)


def test_each_tube_is_asked_for_a_cheaper_path_in_few_iterations(walk):
    levels = [rung.level for rung in walk[0].rungs if rung.level.question == ON_THE_WALK]
    costs = [level.objective for level in levels if level.status == "solved"]
    assert len(costs) > 5 and np.all(np.diff(costs) < 0)
    assert max(level.iterations for level in levels) <= MOST_IN_A_TUBE


def test_an_answer_of_a_walk_passes_every_check():
    solution = solve(WINDING, order=8, steps=20).raise_for_status()
    assert verify(solution)["optimality"].ok


def test_past_one_of_several_attractors_the_way_is_found_in_tubes():
    """The guess keeps the limit, and is next to the answer: alone it took 1,000 iterations to get there."""
    ratio = 0.01215
    problem = TransferProblem(
        1.0,
        State(
            (0.9164231645789217, -0.043810702611899184, 0.09989111777283138),
            (0.13499542127335648, 0.13320003800155059, -0.11402048454561814),
        ),
        State(
            (0.685683861602914, 0.21905224641473756, 0.03968703271637671),
            (-0.2830415554184502, 0.23022591045058202, -0.1796049310241563),
        ),
        1.832089149265141,
        effects=[
            RotatingFrame(1.0),
            PointGravity(1 - ratio, center=(-ratio, 0, 0)),
            PointGravity(ratio, center=(1 - ratio, 0, 0)),
        ],
        actuator=Engine(0.2980870063830319),
    )
    solution = solve(problem, tol=1e-3, order=4).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) < 400
    assert any(level.question == ON_THE_WALK for level in solution.ladder)


def test_a_walk_that_is_stopped_ends(walk):
    _, guess, _ = walk
    calls = []

    def progress(*told):
        calls.append(told)
        return True

    stopped = Ladder(WINDING, progress=progress)
    assert walked(stopped.ask, WINDING, guess) is None and len(stopped.rungs) == 1


@pytest.mark.parametrize("change", [{"effects": ()}, {"constraints": [KeepIn((-9.0, -9.0), (9.0, 9.0))]}])
def test_without_an_attractor_or_among_zones_there_is_no_tube(walk, change):
    _, guess, _ = walk
    assert around(WINDING, guess) is not None
    assert around(replace(WINDING, **change), guess) is None


def test_a_tube_is_as_wide_as_the_body_is_far_away(walk):
    _, guess, _ = walk
    low, high = around(WINDING, guess, 0.5).constraints[0].bounds(2)
    away = np.linalg.norm(guess.position, axis=1, keepdims=True)
    assert np.allclose(high - low, 0.4 * away * np.ones(2)) and np.allclose(0.5 * (high + low), guess.position)
