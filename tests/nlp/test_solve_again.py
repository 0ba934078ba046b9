"""An NLP solves again for other numbers: to the optimum of a fresh solve, sooner, and only what it can."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import BallForce, BoxForce, KeepOut, LinearDrag, State, TransferProblem, solve, transcribe
from dmoc.basics.memory import forget
from dmoc.ipopt import run as ipopt
from dmoc.nlp import transcription
from dmoc.scene.problem_file import load_problem

STEPS = 60


def hop(**changes):
    parts = {
        "mass": 1.2,
        "start": State((0, 0), (0, 0)),
        "goal": State((6.0, 0.5), (0, 0)),
        "duration": 3.0,
        "effects": [LinearDrag(0.3)],
        "actuator": BallForce(5.0),
        "constraints": [KeepOut((3.0, 0.1), 1.0)],
    }
    return TransferProblem(**(parts | changes))


CHANGED = {
    "start": {"start": State((0.2, 0.1), (0.1, 0))},
    "goal": {"goal": State((5.8, 0.8), (0, 0.1))},
    "mass": {"mass": 1.25},
    "limit": {"actuator": BallForce(4.7)},
    "zone": {"constraints": [KeepOut((3.1, 0.1), 1.1)]},
    "duration": {"duration": 3.1},
}


@pytest.fixture(scope="module")
def nlp():
    return transcribe(hop(), STEPS)


@pytest.fixture(scope="module")
def before(nlp):
    return nlp.solve().raise_for_status()


@pytest.mark.parametrize("what", CHANGED)
def test_the_optimum_is_that_of_a_fresh_solve(nlp, before, what):
    new = hop(**CHANGED[what])
    again, fresh = nlp.solve(new, guess=before), solve(new, steps=STEPS)
    assert again.success and again.problem is new and again.message == "a local optimum"
    assert again.objective == pytest.approx(fresh.objective, rel=1e-7)
    assert again.position == pytest.approx(fresh.position, abs=1e-4)
    # it is another optimum than the one before, and that one is not touched
    assert abs(again.objective / before.objective - 1) > 1e-3
    assert nlp.solve(guess=before).objective == pytest.approx(before.objective, rel=1e-9)


@pytest.mark.parametrize("what", CHANGED)
def test_a_warm_start_takes_fewer_iterations_than_a_cold_one(nlp, before, what):
    new = hop(**CHANGED[what])
    path_alone = replace(before, path=replace(before.path, multipliers={}))
    warm, near, cold = (nlp.solve(new, guess=guess) for guess in (before, path_alone, None))
    assert warm.objective == pytest.approx(cold.objective, rel=1e-7)
    assert warm.iterations < near.iterations < cold.iterations


def test_nothing_is_written_down_again(nlp, before, monkeypatch):
    """Neither formulas nor an assembled NLP."""
    for place in ("dmoc.nlp.stencils._written", "dmoc.nlp.transcription.assemble"):
        monkeypatch.setattr(place, None)
    assert nlp.solve(hop(mass=1.3), guess=before).success


@pytest.mark.parametrize(
    "changes, named",
    [
        ({"effects": [LinearDrag(0.4)]}, "effects"),
        ({"effects": []}, "effects"),
        ({"constraints": []}, "constraints"),
        ({"duration": (2.0, 4.0)}, "free duration"),
        ({"effects": [], "actuator": BoxForce(6.0)}, "effects, actuator"),
    ],
)
def test_what_it_was_not_built_for_is_refused_by_name(nlp, changes, named):
    from dmoc import BoxForce

    changes = {name: BoxForce(6.0) if value is None else value for name, value in changes.items()}
    with pytest.raises(
        ValueError, match=f"^this NLP was built for another {named}; transcribe the new problem$"
    ):
        nlp.solve(hop(**changes))


def test_a_loop_follows_a_target_that_moves(nlp, before):
    """Each plan starts from the one before; the last is as good as from nothing."""
    plan = before
    for height in np.linspace(0.5, 1.5, 6):
        plan = nlp.solve(hop(goal=State((6.0, height), (0, 0))), guess=plan).raise_for_status()
    assert plan.objective == pytest.approx(solve(plan.problem, steps=STEPS).objective, rel=1e-7)


def test_a_failed_solve_says_so(nlp, before):
    weak = nlp.solve(replace(before.problem, actuator=BallForce(0.2)), guess=before)
    assert not weak.success and weak.status != "solved" and weak.message


@pytest.mark.parametrize(
    ("name", "changed"),
    [("orbit_raise", {"radius": 1.6}), ("earth_mars", {"duration": 3.4}), ("free_flyer", {"mass": 11.0})],
)
def test_a_second_solve_builds_nothing(name, changed, monkeypatch):
    """Neither one of a problem of other numbers, in other units, nor a stage of the rounding of |F|."""

    def solved(**more):
        return solve(load_problem(name).make(**more), order=4, steps=20).raise_for_status()

    solved(**{key: 3.3193 for key in changed if key == "duration"})
    with monkeypatch.context() as patched:
        for place, maker in ((transcription, "assemble"), (ipopt, "_made")):
            patched.setattr(place, maker, lambda *given, **more: pytest.fail("something is built anew"))
        again = solved(**changed)
    forget()
    assert again.objective == pytest.approx(solved(**changed).objective, rel=1e-9)


def test_a_solve_within_a_solve_keeps_its_own_watch():
    """A user's function that follows a solve may solve the same problem."""
    inner = []

    def progress(order, steps, iteration, *rest):
        if iteration == 2 and not inner:
            inner.append("begun")
            inner.append(solve(hop(), steps=STEPS, progress=lambda *row: inner.append(row[2])))

    outer = solve(hop(), steps=STEPS, progress=progress)
    alone = solve(hop(), steps=STEPS)
    assert outer.iterations == inner[-1].iterations == alone.iterations
    assert outer.success and any(isinstance(one, int) for one in inner)
