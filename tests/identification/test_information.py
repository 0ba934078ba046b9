"""Flights that teach: what a plan will tell is foreseen, and what is learned is as sure as that."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import (
    BallForce,
    Coast,
    Effort,
    Engine,
    Flight,
    Information,
    LinearDrag,
    Mission,
    PointGravity,
    Rod,
    State,
    Team,
    TransferProblem,
    Unknown,
    export,
    fly,
    foresee,
    identify,
    plan_for,
    simulate,
    solve,
    transcribe,
    verify,
)
from dmoc.nlp.lesson import SENSITIVITY
from dmoc.sensitivity.flights import Flights

DRAG = "linear_drag_1_coefficient"
BOTH = ("mass", DRAG)
REST = State((0, 0), (0, 0))
HOP = {
    "mass": 18.97,
    "start": REST,
    "goal": State((1, 0), (0, 0)),
    "duration": 20.0,
    "effects": [LinearDrag(1.2)],
    "actuator": BallForce(0.4),
}
NOISE, EVERY = 1e-3, 0.5


def hop(**changes):
    return solve(TransferProblem(**HOP | changes), order=4, steps=40, hold=True)


def flown(plan, mass=18.97, drag=1.2, start=REST, seed=None, finer=1):
    times = np.linspace(0, plan.duration, finer * (len(plan.path.mesh) - 1) + 1)
    commands = np.repeat(plan.path.control, finer, axis=0)
    commands = np.vstack([commands, commands[-1:]])
    noise = {} if seed is None else {"noise": NOISE, "seed": seed}
    return fly(times, commands, start, mass=mass, effects=[LinearDrag(drag)], **noise)


@pytest.fixture(scope="module")
def plans():
    return hop(), hop(objective=Effort() - 0.3 * Information("mass", NOISE, EVERY))


def test_a_plan_that_teaches_tells_more_for_a_little_more_effort(plans):
    straight, taught = plans
    assert taught.success and verify(taught).ok
    before, after = (foresee(plan, BOTH, NOISE, EVERY) for plan in plans)
    assert after["mass"] < 0.75 * before["mass"]
    effort = [0.5 * np.sum(plan.path.control**2) * 0.5 for plan in plans]
    assert effort[0] == pytest.approx(straight.objective) and effort[0] < effort[1] < 1.5 * effort[0]


def test_what_is_foreseen_is_what_identification_says(plans):
    """Its covariance comes from another system of equations, that of the flight; one sample of 160 is more."""
    for plan in plans:
        effects = [LinearDrag(Unknown(1.0))]
        told = identify(flown(plan, seed=1, finer=4), mass=Unknown(15), effects=effects, noise=NOISE)
        foreseen = foresee(plan, BOTH, NOISE, EVERY / 4)
        assert [told.sigma[name] for name in BOTH] == pytest.approx([foreseen[name] for name in BOTH], rel=0.03)


def test_sensitivities_are_differences_of_flights(plans):
    """To the start and to both numbers, along the discrete path."""
    plan = plans[1]
    problem = replace(plan.problem, objective=Information(BOTH, NOISE, EVERY))
    nlp = transcribe(problem, order=4, mesh=plan.path.mesh, hold=True, guess=plan)
    x = nlp.pack(plan.path) * nlp.columns.scales()
    found = nlp.columns[SENSITIVITY].of(x)[::2].reshape(41, 6, 2)
    step, T = 1e-4, plan.duration

    def place(**changes):
        return flown(plan, **changes).positions

    differences = [
        place(start=State((step, 0), (0, 0))) - place(start=State((-step, 0), (0, 0))),
        place(start=State((0, step), (0, 0))) - place(start=State((0, -step), (0, 0))),
        place(start=State((0, 0), (step / T, 0))) - place(start=State((0, 0), (-step / T, 0))),
        place(start=State((0, 0), (0, step / T))) - place(start=State((0, 0), (0, -step / T))),
        place(mass=18.97 * (1 + step)) - place(mass=18.97 * (1 - step)),
        place(drag=1.2 * (1 + step)) - place(drag=1.2 * (1 - step)),
    ]
    assert found == pytest.approx(np.stack(differences, axis=1) / (2 * step), abs=1e-6)


def test_the_objective_is_the_information_that_is_foreseen():
    taught = hop(objective=Information("mass", NOISE, EVERY) - 2 * Effort())
    foreseen = foresee(taught, "mass", NOISE, EVERY)["mass"]
    effort = 0.5 * np.sum(taught.path.control**2) * 0.5
    assert taught.objective == pytest.approx(-np.log(foreseen / 18.97) - 2 * effort, abs=1e-6)


def test_a_mass_that_burns_and_the_gravity_of_an_attractor():
    """Against the Jacobians of the one-step maps; what a planet attracts by, against differences."""
    ends = State((1, 0), (0, 1)), State((-1.2, 0.1), (0, -0.9))
    scene = {"effects": [PointGravity(1.0)], "actuator": Engine(0.3, exhaust_velocity=1.0)}
    problem = TransferProblem(1.0, *ends, 3.0, **scene)
    plan = solve(problem, order=4, steps=30)
    names = ("mass", "point_gravity_1_mu")
    twin = replace(problem, objective=Information(names, NOISE, EVERY))
    nlp = transcribe(twin, order=4, mesh=plan.path.mesh, guess=plan)
    x = nlp.pack(plan.path) * nlp.columns.scales()
    found = nlp.columns[SENSITIVITY].of(x)[::2].reshape(31, 6, 2)
    slopes = Flights(problem, plan.path).slopes()[:, :2]
    assert found[:, :2] == pytest.approx(slopes[:, :, :2].transpose(0, 2, 1), abs=1e-7)
    assert found[:, 2:4] == pytest.approx(slopes[:, :, 2:4].transpose(0, 2, 1) / 3.0, abs=1e-7)
    assert found[:, 4] == pytest.approx(slopes[:, :, -1], abs=1e-7)
    heavier, lighter = (
        simulate(replace(problem, effects=[PointGravity(1.0 + step)]), plan).position for step in (1e-5, -1e-5)
    )
    assert found[:, 5] == pytest.approx((heavier - lighter) / 2e-5, abs=1e-6)


def test_a_number_that_moves_nothing_is_not_foreseen():
    coasting = solve(
        TransferProblem(1.0, State((0, 0), (1, 0)), State((2, 0), (1, 0)), 2.0, effects=[LinearDrag(0.0)])
    )
    assert foresee(coasting, "mass", NOISE, EVERY)["mass"] == np.inf


@pytest.mark.parametrize("order, hold", [(2, False), (8, False), (2, True)])
def test_every_scheme_and_a_free_duration(order, hold):
    objective = Effort() - 0.1 * Information("mass", NOISE, EVERY)
    problem = TransferProblem(**HOP | {"objective": objective, "duration": (10.0, 30.0)})
    answer = solve(problem, order=order, steps=40, hold=hold)
    assert answer.success and verify(answer).ok and answer.duration == pytest.approx(30.0, abs=1e-3)


def test_what_has_no_meaning_is_refused(plans, tmp_path):
    def refused(words, make):
        with pytest.raises(ValueError, match=words):
            make()

    objective = Information("mass", NOISE, EVERY)
    refused(
        "no number is called 'drag'; there are mass, linear_drag_1",
        lambda: hop(objective=Information("drag", 1, 1)),
    )
    still = HOP | {"effects": [LinearDrag(0.0)], "objective": Information(DRAG, 1, 1)}
    refused("is 0, and errors are relative", lambda: TransferProblem(**still))
    refused("unknown must be names", lambda: Information(("mass", "mass"), 1, 1))
    refused("noise must be greater than 0", lambda: Information("mass", 0, 1))
    refused("every must be greater than 0", lambda: Information("mass", 1, 0))
    refused("one Information", lambda: objective + objective)
    links = {"links": [Rod((0, 1), 1.0)], "goal": State((1, 1), (0, 0))}
    refused("held by no links", lambda: TransferProblem(**HOP | links | {"objective": objective}))
    legs = {key: HOP[key] for key in ("mass", "start", "goal", "effects")}
    refused("of one transfer", lambda: Mission(**legs, legs=[Coast(1.0), Coast(1.0)], objective=objective))
    one = TransferProblem(**HOP | {"objective": objective})
    refused("transfer alone", lambda: Team([one, one]))
    refused("another objective", lambda: export(one, tmp_path / "out"))
    refused("solution must be", lambda: foresee(one, "mass", NOISE, EVERY))


def test_what_was_not_solved_and_what_is_measured_after_the_flight_foretell_nothing(plans):
    with pytest.raises(ValueError, match=r"every is 30 s, longer than the flight of 20 s.*at most 20 s"):
        foresee(plans[0], "mass", NOISE, 30.0)
    failed = hop(actuator=BallForce(0.01))
    with pytest.raises(ValueError, match="a path that can be flown; this solve ended with"):
        foresee(failed, "mass", NOISE, EVERY)


@pytest.mark.parametrize("wrong", [None, "a plan"])
def test_a_plan_is_made_for_an_estimate_alone(wrong):
    with pytest.raises(ValueError, match=r"estimate must be a dmoc\.Estimate; got"):
        plan_for(wrong)


@pytest.mark.filterwarnings("error")
def test_what_stands_still_without_a_force_tells_no_mass():
    still = np.zeros((4, 1))
    found = identify(Flight([0.0, 1.0, 2.0, 3.0], still, still), mass=Unknown(2.0))
    assert np.isinf(found.sigma["mass"])
