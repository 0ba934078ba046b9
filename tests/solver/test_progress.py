"""A function that follows a solve is told of every iteration, may stop it, and what it raises is raised."""

import traceback

import pytest

from dmoc import BoxForce, KeepOut, State, TransferProblem, solve

PROBLEM = TransferProblem(
    1.0,
    State((0, 0), (0, 0)),
    State((4, 0), (0, 0)),
    6.0,
    actuator=BoxForce(1.0),
    constraints=[KeepOut((2, 0.1), 0.5)],
)


class RefusalError(Exception):
    pass


def test_every_iteration_is_told():
    told = []
    solution = solve(PROBLEM, steps=20, progress=lambda *at: told.append(at))
    # iteration 0 is the guess
    assert solution.success and len(told) == solution.iterations + 1
    assert [at[:3] for at in told] == [(2, 20, i) for i in range(len(told))]


@pytest.mark.parametrize("tol", [None, 1e-4])
@pytest.mark.parametrize("error", [RefusalError("enough"), KeyboardInterrupt(), SystemExit(7)], ids=repr)
def test_what_it_raises_ends_the_solve_and_reaches_the_caller_as_it_was_raised(error, tol, capfd):
    told = []

    def fail(*at):
        told.append(at)
        if len(told) == 3:
            raise error

    with pytest.raises(type(error)) as caught:
        solve(PROBLEM, tol=tol, progress=fail)
    assert caught.value is error and len(told) == 3
    assert traceback.extract_tb(error.__traceback__)[-1].name == "fail"
    assert capfd.readouterr() == ("", "")
    assert solve(PROBLEM, steps=20).success


def test_an_answer_that_is_neither_yes_nor_no_is_an_error_too(capfd):
    class Undecided:
        def __bool__(self):
            raise RefusalError("neither")

    with pytest.raises(RefusalError, match="neither"):
        solve(PROBLEM, steps=20, progress=lambda *at: Undecided())
    assert capfd.readouterr() == ("", "")
