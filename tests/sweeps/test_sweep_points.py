"""A sweep knows its points, which of them deserve a second look, and what it has already done."""

import errno
import json
import os

import numpy as np
import pytest
from sweep_helpers import FAILED, Here, found, plan_of, write_push

from dmoc.scene.problem_file import load_problem
from dmoc.sweeps.journal import Journal, differences, journal_of
from dmoc.sweeps.loop import Sweep
from dmoc.sweeps.plan import Plan, make_plan, parse_vary
from dmoc.sweeps.worker import Task


def test_grids_and_samples_are_what_was_asked_for(tmp_path):
    file = load_problem(str(write_push(tmp_path)))
    vary = parse_vary(["duration=8:20:25", "mass = 10,5,20"])
    plan = make_plan(file, vary, None, "sobol", 0, {})
    assert plan.shape == (25, 3) and plan.at(1) == {"duration": 8.0, "mass": 10.0}
    assert plan.values[0][1] == 8.5 and list(plan.values[1]) == [5, 10, 20]
    assert [parameter.unit for parameter in plan.parameters] == ["s", "kg"]
    ranges = {"duration": "8:20", "mass": (5, 20)}
    for method in ("sobol", "latin"):
        plan = make_plan(file, ranges, 20, method, 3, {})
        assert plan.shape == (20,) and set(plan.at(7)) == {"duration", "mass"}
        for values, (low, high) in zip(plan.values, [(8, 20), (5, 20)], strict=True):
            counts, _ = np.histogram(values, 4, (low, high))
            assert counts.min() >= 4, "a quarter of the range is nearly empty"
        again, other = (make_plan(file, ranges, 20, method, seed, {}) for seed in (3, 4))
        assert np.array_equal(plan.values, again.values) and not np.array_equal(plan.values, other.values)


def test_neighbours_are_one_step_away():
    plan = plan_of(3, 4)
    assert plan.neighbours(0) == [[4], [1]] and plan.neighbours(5) == [[1, 9], [4, 6]]
    sample = Plan(plan_of(1, 1).parameters, (np.array([0.0, 1, 9, 10, 11]), np.array([0.0, 1, 5, 5, 5])), True)
    assert sample.neighbours(0)[0][0] == 1 and sorted(sample.neighbours(3)[0][:2]) == [2, 4]
    assert [plan_of(20).before(i) for i in (0, 1, 7, 8, 9)] == [None, 0, 6, None, 8]
    assert plan_of(20).joined(7) == [8] and plan_of(20).joined(8) == [7] and plan_of(20).joined(3) == []


def swept(tmp_path, plan, function, follow=False):
    """Records and tasks of a sweep whose points are solved by `function(point, where it starts from)`."""

    def solve(task):
        record = function(task.values["point"], None if task.start is None else int(task.start))
        return record, str(task.values["point"]) if record.get("success") else None

    pool = Here(solve)
    with Journal(tmp_path / f"{len(os.listdir(tmp_path))}.nc", {}) as journal:
        records = Sweep(plan, journal, pool, lambda p, start, again: Task("", "", {"point": p}, {}, start)).run(
            follow
        )
    return records, [(task.values["point"], task.start) for task in pool.tasks]


def test_what_failed_is_tried_again_from_neighbours_as_far_as_that_leads(tmp_path):
    """Cold only points 0 and 1 of 6 can be solved; the others need an answer next to them; 5 never."""

    def solve(point, start):
        return found(10 - point) if point < 5 and (point < 2 or start == point - 1) else FAILED

    records, tasks = swept(tmp_path, plan_of(6), solve)
    assert [record["status"] for record in records] == ["solved"] * 5 + ["infeasible"]
    again = tasks[6:]
    assert [task for task in again if task[0] > 1] == [(2, "1"), (3, "2"), (4, "3"), (5, "4")]


def test_a_bad_optimum_is_replaced_and_its_neighbours_are_looked_at(tmp_path):
    """Points 4 to 8 are stuck 3 too high; 4 stands out, and what it becomes is handed on."""

    def solve(point, start):
        stuck = 4 <= point <= 8 and start is None
        return found((point - 6) ** 2 / 40 + 3 * stuck)

    records, tasks = swept(tmp_path, plan_of(12), solve)
    assert [record["objective"] for record in records] == [(point - 6) ** 2 / 40 for point in range(12)]
    assert len(tasks) < 12 + 10


def test_a_smooth_sweep_costs_no_second_looks_but_at_its_ends(tmp_path):
    for function in (lambda x: x * x, lambda x: 1 / (1 + x), lambda x: (x - 7.3) ** 2 + 1):
        for held in (True, False):
            record = {"checks_hold": held}
            _, tasks = swept(tmp_path, plan_of(20), lambda p, start, f=function, r=record: found(f(p)) | r)
            assert len(tasks) <= 22


def test_a_second_look_never_makes_it_worse_and_a_failed_check_never_wins(tmp_path):
    def solve(point, start):
        if start is None:
            return found(5.0 if point == 3 else 1.0)
        return found(7.0) if point == 3 else found(0.1) | {"checks_hold": False}

    records, tasks = swept(tmp_path, plan_of(7), solve)
    assert records[3]["objective"] == 5.0 and all(record["checks_hold"] for record in records)
    assert (3, "2") in tasks[7:]


def test_maximised_objectives_are_better_the_greater(tmp_path):
    def solve(point, start):
        return found(1.0 if point == 3 and start is None else 2.0) | {"objective_sense": -1}

    assert [record["objective"] for record in swept(tmp_path, plan_of(7), solve)[0]] == [2.0] * 7


def test_what_was_refused_or_kills_its_worker_is_not_looked_at_again(tmp_path):
    def solve(point, start):
        if point == 2:
            raise ChildProcessError
        return {"status": "refused", "message": "no"} if point == 4 else found(point)

    records, tasks = swept(tmp_path, plan_of(6), solve)
    assert [record["status"] for record in records] == ["solved"] * 2 + [
        "worker died",
        "solved",
        "refused",
        "solved",
    ]
    tried = [point for point, _ in tasks]
    assert tried.count(2) == 2, "once, and once more alone"
    assert tried.count(4) == 1
    # in company of the one that died others may have to be solved again, and are
    assert all(records[point]["objective"] == point for point in (0, 1, 3, 5))


def test_following_starts_from_the_point_before_in_runs_of_eight(tmp_path):
    _, tasks = swept(tmp_path, plan_of(2, 10), lambda point, start: found(1.0), follow=True)
    first = dict(tasks[:20])
    assert {point for point, start in first.items() if start is None} == {0, 8, 10, 18}
    assert all(start == str(point - 1) for point, start in first.items() if start is not None)
    # where two runs meet, each is held against the other
    assert {point for point, _ in tasks[20:]} == {7, 8, 17, 18}


def test_a_journal_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match=r"^cannot write .*out\.nc\.journal: No space left on device; make room"):
        Journal(tmp_path / "out.nc", {})


def test_the_journal_keeps_every_whole_line_and_forgets_a_torn_one(tmp_path):
    out, facts = tmp_path / "out.nc", {"problem": "p", "vary": {"mass": [1.0, 2.0]}}
    with Journal(out, facts) as journal:
        for point in range(3):
            journal.append(0, point, found(point / 3) | {"failed_by": float("nan")}, f"path {point}")
    whole = journal_of(out).read_bytes()
    head = whole.index(b"\n") + 1
    for cut in {*range(0, len(whole), 37), head - 1, head, head + 1, len(whole) - 1}:
        journal_of(out).write_bytes(whole[:cut])
        with Journal(out, facts) as journal:
            lines = max(whole[:cut].count(b"\n") - 1, 0)
            assert sorted(journal.records) == [(0, point) for point in range(lines)]
            assert all(journal.records[0, point]["objective"] == point / 3 for point in range(lines))
            assert all(journal.path_at(0, point) == f"path {point}" for point in range(lines))
            journal.append(0, 9, found(9), "path 9")
            assert journal.path_at(0, 9) == "path 9"
        assert journal_of(out).read_bytes()[:head] == whole[:head]
        for line in journal_of(out).read_bytes().splitlines():
            json.loads(line)


def test_nothing_else_is_overwritten_and_nobody_else_writes(tmp_path):
    out = tmp_path / "out.nc"
    journal_of(out).write_text("my diary\n")
    for restart in (False, True):
        with pytest.raises(ValueError, match="not the journal of a sweep"):
            Journal(out, {}, restart)
    assert journal_of(out).read_text() == "my diary\n"
    with Journal(tmp_path / "other.nc", {}), pytest.raises(ValueError, match="another sweep is writing"):
        Journal(tmp_path / "other.nc", {})


def test_differences_are_said_in_words():
    old = {"vary": {"mass": [1.0, 2.0, 3.0, 4.0]}, "casadi": "3.7", "seed": 1}
    new = {"vary": {"mass": [1.0, 5.0]}, "casadi": "3.8"}
    assert differences(old, new) == [
        "mass was 4 values from 1.0 to 4.0 and is now 1.0, 5.0",
        "casadi was 3.7 and is now 3.8",
        "seed was 1 and is now not given",
    ]
