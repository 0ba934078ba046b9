"""An answer that was found after a failure among zones is compared with those past the zones."""

from dataclasses import replace

import pytest

from dmoc import Effort, Engine, KeepOut, State, TransferProblem, solve
from dmoc.meshes.choices import first_path
from dmoc.solver.ladder import Ladder
from dmoc.solver.leapt import FAILED, LED, past_zones


def test_after_a_failure_among_zones_a_cheaper_way_past_them_is_found():
    """Four other meshes of orders 2 to 8 end in this cost; the search for a cause leads to 1.42."""
    zones = [((-1.8984, 0.5488), 0.0622), ((-1.0586, 1.2447), 0.2404), ((-1.8687, 0.9112), 0.2544)]
    start, goal = State((-1.2304, 1.7634), (0.2169, -0.4871)), State((-2.3844, 0.1746), (-1.4347, -0.6254))
    problem = TransferProblem(
        0.75, start, goal, 2.392, (), Engine(2.2335), Effort(), [KeepOut(*zone) for zone in zones]
    )
    solution = solve(problem, 6, 40).raise_for_status()
    assert solution.objective == pytest.approx(0.4111, rel=2e-3)
    assert LED in solution.warnings


def test_a_failure_among_zones_is_followed_by_the_ways_past_them():
    problem = TransferProblem(
        1.0, State((0, 0), (0, 0)), State((4, 0), (0, 0)), 4.0, constraints=[KeepOut((2.0, 0.1), 1.0)]
    )
    ladder, first = Ladder(problem), first_path(problem, 4, 20, False, None)
    rung = ladder.climb_to(first)
    failed = replace(rung, answer=replace(rung.answer, status="iteration limit"))
    ladder.rungs[-1] = failed
    found = past_zones(ladder, failed, first, None, refined=False)
    assert found.solved and FAILED in found.notes
    assert found.cost == pytest.approx(rung.cost, rel=1e-6)
