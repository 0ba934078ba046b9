"""A change is named as enough only if the problem with it is solved, and every check of that holds."""

from dataclasses import replace

import pytest

from dmoc import BallForce, State, TransferProblem, solve, verify
from dmoc.diagnosis.giving import Remedy
from dmoc.solver.ladder import Ladder
from dmoc.solver.proven import QUESTION, holds


def hop(limit):
    """Four metres in four seconds, for which a kilogram needs 1 N at least."""
    return TransferProblem(1.0, State((0, 0), (0, 0)), State((4, 0), (0, 0)), 4.0, actuator=BallForce(limit))


def as_a_user_would(trial):
    return solve(trial.problem, steps=40)


@pytest.mark.parametrize("limit, enough", [(0.9, False), (1.2, True)])
@pytest.mark.parametrize("near", [False, True])
def test_a_limit_holds_from_the_usual_guess_and_from_a_path(limit, enough, near):
    ladder, path = Ladder(hop(0.5)), solve(hop(2.0), steps=40).path if near else None
    told = []
    ladder.tell = told.append
    assert holds(ladder, Remedy("a force limit", hop(limit), path), as_a_user_would) is enough
    assert {level.question for level in told} == {QUESTION}


def test_an_answer_of_which_a_check_fails_proves_nothing():
    found = solve(hop(1.2), steps=40)
    position = found.path.position.copy()
    position[20] += 0.01
    broken = replace(found, path=replace(found.path, position=position))
    assert broken.success and not verify(broken).ok
    assert not holds(Ladder(hop(0.5)), Remedy("a force limit", hop(1.2)), lambda trial: broken)
