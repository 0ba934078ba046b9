"""What a finer mesh takes follows from the problem, not from which mesh the ladder happens to begin on."""

import numpy as np
import pytest

from dmoc import CircularOrbit, PointGravity, State, TransferProblem
from dmoc.guess.starting import starting_guess
from dmoc.meshes.choices import guess_on
from dmoc.motion.mesh import uniform_mesh
from dmoc.nlp.units import units_of
from dmoc.solver.ladder import Ladder


def kepler(duration=20.0):
    """From the perigee of an ellipse of e = 0.5 to a circle: its guess needs an impulse at either end."""
    start, goal = State((1.0, 0.0), (0.0, 1.5**0.5)), CircularOrbit(2.0, mu=1.0)
    return TransferProblem(1.0, start, goal, duration, effects=[PointGravity(1.0)])


@pytest.mark.parametrize("hold", [False, True])
def test_the_unit_of_the_cost_is_that_of_the_path_not_of_the_mesh(hold):
    """An impulse at an end, spread over the share of one node, has a square that grows with the steps."""
    problem = kepler()
    costs = [
        units_of(problem, starting_guess(problem, uniform_mesh(steps), 2, hold)).cost for steps in (200, 800)
    ]
    assert costs[1] == pytest.approx(costs[0], rel=0.05)


@pytest.mark.parametrize(("order", "steps"), [(2, 400), (2, 700), (2, 800), (2, 1600), (4, 400), (6, 270)])
def test_meshes_of_more_than_400_nodes_are_not_solved_from_a_guess(order, steps):
    problem = kepler()
    ladder = Ladder(problem)
    rung = ladder.climb_to(guess_on(problem, uniform_mesh(steps), order, False))
    assert rung.solved
    nodes = [level.order // 2 * level.steps for level in (one.level for one in ladder.rungs)]
    assert nodes[0] <= 400 and (len(nodes) == 1) == (order // 2 * steps <= 400)
    if len(nodes) > 1:
        assert rung.level.iterations <= 5


def test_a_guess_with_impulses_at_its_ends_is_solved_as_soon_on_every_mesh():
    problem = kepler(13.0)
    counts = []
    for steps in (100, 250, 400):
        rung = Ladder(problem).climb_to(guess_on(problem, uniform_mesh(steps), 2, False))
        counts.append(rung.level.iterations)
    assert np.ptp(counts) <= 2 and max(counts) <= 10
