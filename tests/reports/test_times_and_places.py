"""Times and places as a person would tell them: long times in days, a target that moves where it is met."""

import pytest
from rich.console import Console

from dmoc import BallForce, BoxForce, Moving, State, Time, TransferProblem, simulate, solve, verify
from dmoc.basics.digits import lasting
from dmoc.reports import words
from dmoc.reports.as_json import solve_object

DAY = 86400.0


def shown(part):
    """What a page says, without the breaks of its lines."""
    page = Console(width=200, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    page.print(part)
    return " ".join(page.export_text().split())


def drive(duration, **parts):
    """A cart of a kilogram that meets one that left 2 m further on at -0.5 m/s, and is itself on the way."""
    ends = Moving(lambda t: [0.25 * t]), Moving(lambda t: [2.0 - 0.5 * t])
    return TransferProblem(1.0, *ends, duration, start_time=1.0, **parts)


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (34560000.0, "400 days"),
        (3 * DAY, "3 days"),
        (3 * DAY - 3600, "71 h"),
        (3 * 3600.0, "3 h"),
        (10799.0, "10799 s"),
        (-10 * DAY, "-10 days"),
        (0.0, "0 s"),
        (2.00000001, "2 s"),
    ],
)
def test_a_time_is_told_in_a_unit_that_fits_it(seconds, told):
    assert lasting(seconds) == told


def test_the_closing_line_tells_days_and_json_keeps_seconds():
    problem = TransferProblem(1.0, State((0, 0), (0, 0)), State((1e9, 0), (0, 0)), 400 * DAY)
    solution = solve(problem, steps=4)
    report = verify(solution)
    last = shown(words.answer(solution, report, quiet=True))
    assert ", duration 400 days (" in last and "34560000" not in last
    assert solve_object(solution, report)["duration"] == 34560000.0
    assert "duration 400 days effects" in shown(words.scene(problem))
    assert "final time 400 days" in shown(words.motion(simulate(problem, steps=4), problem, coast=True))


def test_a_least_time_is_told_in_the_same_way():
    # 2 sqrt(m d / F) is four days for this distance
    problem = TransferProblem(
        1.0,
        State([0], [0]),
        State([(2 * DAY) ** 2], [0]),
        (DAY, 9 * DAY),
        actuator=BallForce(1.0),
        objective=Time(),
    )
    solution = solve(problem, order=2, steps=40)
    assert words.figures(solution) == "time 4 days"
    assert "free between 24 h and 9 days" in shown(words.scene(problem))


def test_what_to_try_has_one_unit_for_what_is_needed_and_what_was_given():
    far = State([(2 * DAY) ** 2], [0])
    problem = TransferProblem(1.0, State([0], [0]), far, 3.5 * DAY, actuator=BallForce(1.0))
    needed = solve(problem, steps=40).message
    assert "4.0" in needed and needed.endswith(" days (you gave 3.5 days)"), needed


def test_switches_of_a_long_transfer_are_told_in_its_unit():
    far = State([(2 * DAY) ** 2], [0])
    problem = TransferProblem(
        1.0, State([0], [0]), far, (DAY, 9 * DAY), actuator=BoxForce(1.0), objective=Time(), start_time=DAY
    )
    assert solve(problem, tol=1e-4).reason.endswith("switches at 3 days")


def test_a_target_that_moves_is_told_where_it_is_met():
    problem = drive(2.0)
    told = shown(words.scene(problem))
    assert "start a point that moves, with its velocity, at (0.25) m at 1 s" in told
    assert "goal a point that moves, with its velocity, at (0.5) m at 3 s" in told
    assert words.figures(solve(problem, steps=10)).endswith("duration 2 s, goal met at (0.5) m")


def test_a_free_duration_has_an_earliest_and_a_latest_place():
    problem = drive((2.0, 4.0), objective=Time(), actuator=BallForce(8.0))
    assert "at (0.5) m at 3 s and at (-0.5) m at 5 s" in shown(words.scene(problem))
    solution = solve(problem, steps=20)
    met = 2.0 - 0.5 * (1.0 + solution.duration)
    assert words.figures(solution).endswith(f"goal met at ({met:.5g}) m")


def test_of_ends_that_stand_no_place_is_added():
    stands = TransferProblem(1.0, State((0, 0), (0, 0)), State((1, None), (0, 0)), 2.0)
    assert "met at" not in words.figures(solve(stands, steps=4))
    assert " at (" not in shown(words.scene(stands))
