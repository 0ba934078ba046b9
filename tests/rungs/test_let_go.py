"""How an answer that is held near another one is let go."""

from dataclasses import dataclass
from itertools import pairwise

import pytest

from dmoc.results.facts import off_optimum
from dmoc.rungs.rung import MOST_LETTING_GO, let_go


@dataclass(frozen=True)
class Held:
    """What letting go reads of an answer that is held."""

    iterations: int
    pull: float
    path: int = 0
    pinned: bool = False
    stopped: bool = False

    @property
    def solved(self):
        return self.iterations < MOST_LETTING_GO

    @property
    def answer(self):
        return self


@pytest.mark.parametrize(
    "iterations, shares",
    [
        (6, [0.3, 0.03, 0.03]),
        (20, [0.3, 0.1, 0.1]),
        (40, [0.3, 1.0, 0.3, 1.0, 0.3, 1.0, 0.3, 1.0, 0.3]),
    ],
)
def test_an_answer_is_let_go_sooner_where_that_takes_few_iterations(iterations, shares):
    """The pull of an answer that moves by the same each time is in proportion to how strongly it is held."""
    held = []

    def try_on(path, most, pinned, lean):
        held.append(lean)
        return Held(iterations, 0.1 * lean)

    found = let_go(try_on, Held(0, 1.0), 1e-2)
    assert found is not None and found.pull <= off_optimum()
    known = [1e-2, *held]
    given = [after / before for before, after in pairwise(known)]
    assert given == pytest.approx(shares)
