"""Lambert's problem against published solvers, coasts to start from, and how many impulses there are."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import dmoc
from dmoc import Coast, DeltaV, Impulse, Mission, Moving, PointGravity, State
from dmoc.chains.path import merged
from dmoc.legs.lambert import lambert
from dmoc.missions.arcs import cheapest_arc
from dmoc.missions.checks import primer_check
from dmoc.scene.problem_file import load_problem
from dmoc.structure.impulses import cut

# Places, duration, whole revolutions, whether about +z, whether the slower one, and both velocities, for
# mu = 1, by `izzo2015` of lamberthub 1.0.0 (J. Martinez Garrido, 2021) with tolerances of 1e-12.
ORACLE = [
    (
        [2.040919, -2.555665, 0.418099],
        [-0.963862, -0.76843, -0.366004],
        1.210512,
        0,
        False,
        False,
        [-2.451805460122, 1.344268796789, -0.6495349643461],
        [-2.415201686033, 1.729019549657, -0.6052968568823],
    ),
    (
        [-0.865213, 3.323, 0.225787],
        [-0.826776, -0.659505, -1.566298],
        5.750723,
        0,
        True,
        False,
        [-0.1789782988241, -0.3991410137354, -0.458203672212],
        [0.3412489625836, -0.8648430576613, 0.118100695466],
    ),
    (
        [0.481945, -0.238554, 0.957759],
        [-0.248954, 0.030227, 1.926098],
        2.08972,
        0,
        True,
        False,
        [-0.2978843683462, 0.169816774964, -1.174263080503],
        [0.0374320069723, -0.04784938293141, 0.8376289267294],
    ),
    (
        [-0.182839, 0.540525, 1.935088],
        [-0.38707, -0.349655, 1.438931],
        0.81786,
        0,
        False,
        False,
        [0.3716587990286, -1.033872889994, -3.818095159344],
        [-1.003494056223, -0.8758574087824, 3.784985886456],
    ),
    (
        [-0.29172, 0.882539, 0.58035],
        [0.210984, 1.544867, -6.520079],
        1.546678,
        0,
        True,
        False,
        [1.356028859262, -4.189221219074, -2.455055346648],
        [0.1426769880971, 1.164771884003, -4.744662328061],
    ),
    (
        [-1.66862, 0.276446, 0.700545],
        [-1.199182, -2.902206, 0.070438],
        0.883224,
        0,
        True,
        False,
        [0.4269668764696, -3.638751121136, -0.6775090169033],
        [0.587569046786, -3.542759312281, -0.7278151054855],
    ),
    (
        [0.747408, 0.193816, 1.111633],
        [-0.550359, -2.479418, 1.564019],
        1.869634,
        0,
        False,
        False,
        [-0.5803736685725, -1.538291800217, 0.5518378318006],
        [-0.7071424432537, -1.30107040586, 0.08789478222103],
    ),
    (
        [-0.782809, 0.229154, -2.493894],
        [1.642882, 1.169731, -3.901395],
        3.531774,
        0,
        True,
        False,
        [0.4491441753338, -0.1784459368828, 1.690825973997],
        [0.5806872067936, 0.4358278489512, -1.502826125691],
    ),
    (
        [1.59064, -1.191227, 0.354532],
        [-1.302009, 1.746058, -0.026889],
        82.473021,
        1,
        False,
        False,
        [-0.7767685303598, -0.1486414726251, -0.4225679794756],
        [0.07234506949168, 0.7952510549349, 0.3062263907862],
    ),
    (
        [0.752779, 0.753564, 1.137881],
        [0.768197, -1.406157, -1.760299],
        69.485014,
        2,
        True,
        True,
        [-0.7552604460406, 0.3911365502565, 0.3991700054259],
        [0.4910994504796, 0.2252202676366, 0.3845386502887],
    ),
    (
        [-0.59637, -0.321244, 0.224619],
        [0.46806, -1.01617, -1.407407],
        66.812246,
        2,
        True,
        False,
        [0.02211188597489, -1.117174776226, -1.104312605152],
        [0.6592734745989, 0.007304416768514, -0.585937581605],
    ),
]


@pytest.mark.parametrize("row", ORACLE, ids=range(len(ORACLE)))
def test_lamberts_problem_is_solved_as_by_another_solver(row):
    start, goal, duration, turns, up, slow, leaves, arrives = row
    normal = (0, 0, 1 if up else -1)
    v0, v1 = lambert(1.0, np.array(start), np.array(goal), np.array([duration]), normal, turns, slow)
    assert v0[0] == pytest.approx(leaves, rel=1e-9, abs=1e-10)
    assert v1[0] == pytest.approx(arrives, rel=1e-9, abs=1e-10)


def test_where_there_is_no_coast_with_so_many_revolutions_it_is_not_made_up():
    found = lambert(1.0, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([2.0]), (0, 0, 1), turns=2)
    assert np.isnan(found[0]).all()


def test_many_problems_at_once_are_those_one_by_one():
    random = np.random.default_rng(0)
    start, goal = random.normal(size=(2, 50, 3))
    duration = random.uniform(0.1, 9.0, 50)
    both = lambert(1.0, start, goal, duration, (0, 0, 1))
    alone = [lambert(1.0, start[i], goal[i], duration[i : i + 1], (0, 0, 1)) for i in range(50)]
    assert np.isfinite(both[0]).all()
    assert both[0] == pytest.approx(np.concatenate([one[0] for one in alone]), rel=1e-12)


def rendezvous(**more):
    """From one planet to another of `planet_to_planet`, at a time that is given."""
    whole = load_problem("planet_to_planet").make()
    return replace(whole, **more)


def test_a_free_departure_is_the_best_of_a_map_of_departures_and_durations():
    mission = rendezvous()
    found = dmoc.solve(mission, tol=1e-9)
    assert found.success and dmoc.verify(found).ok
    planets = [end._motion for end in (mission.start, mission.goal)]

    def cost(departures, durations):
        states = []
        for departure, duration in zip(departures, durations, strict=True):
            states.append(
                [np.pad(np.array(part).ravel(), (0, 1)) for part in planets[0].call([departure])]
                + [np.pad(np.array(part).ravel(), (0, 1)) for part in planets[1].call([departure + duration])]
            )
        q0, v0, q1, v1 = np.moveaxis(np.array(states), 1, 0)
        leaves, arrives = lambert(1.0, q0, q1, durations, (0, 0, 1))
        return np.linalg.norm(leaves - v0, axis=1) + np.linalg.norm(v1 - arrives, axis=1)

    departures, durations = (
        part.ravel() for part in np.meshgrid(np.arange(0, 14, 0.5), np.arange(0.5, 8, 0.5))
    )
    assert found.objective < cost(departures, durations).min()
    begin = found.legs[0].time[0]
    # Lambert's solver knows nothing of the scheme.
    assert cost([begin], np.array([found.duration]))[0] == pytest.approx(found.objective, rel=1e-8)
    near = begin + np.array([-1e-3, 1e-3, 0, 0]), found.duration + np.array([0, 0, -1e-3, 1e-3])
    assert (cost(*near) > found.objective).all()


def test_no_grid_is_made_where_a_mission_is_no_coast_between_impulses():
    assert cheapest_arc(load_problem("delta_iii").make()) is None
    assert cheapest_arc(load_problem("gates").make()) is None
    assert cheapest_arc(load_problem("cw_impulses").make()) is None


def from_two(mission):
    return dmoc.solve(mission, impulses="auto")


def test_the_primer_vector_asks_for_a_third_impulse_and_then_for_none():
    whole = load_problem("cw_impulses").make()
    two = replace(whole, legs=[Impulse(), Coast(whole.duration), Impulse()], duration=None)
    assert "another impulse near" in dmoc.verify(dmoc.solve(two))["primer"].note
    found = from_two(two)
    report = dmoc.verify(found)
    # The dual of the convex problem bounds the sum of any number of impulses.
    assert found.objective == pytest.approx(0.7645999702135722, rel=1e-7)
    assert len(found.impulses) == 3 and report.ok
    assert "no further impulse would help" in report["primer"].note


@pytest.mark.parametrize(("longest", "helps"), [(1 + 5e-5, False), (1 + 2e-4, True)])
def test_the_primer_vector_asks_for_an_impulse_where_it_is_longer_than_at_impulses(longest, helps):
    primer = np.array([0.0, 7.0, 9.0]), np.array([1.0, longest, 1.0])
    found = primer_check(SimpleNamespace(primer=primer, require_problem=load_problem("hohmann").make))
    assert found.value == pytest.approx(longest)
    assert ("another impulse near 7 s" in found.note) == helps


def test_a_file_of_added_impulses_is_checked_against_the_mission_as_it_was_stated(tmp_path):
    whole = load_problem("cw_impulses").make()
    two = replace(whole, legs=[Impulse(), Coast(whole.duration), Impulse()], duration=None)
    found = from_two(two)
    found.save(tmp_path / "more.nc")
    back = dmoc.load(tmp_path / "more.nc").attach(two)
    assert len(back.legs) == 2 and back.problem.sums
    kept = [(one.name, one.value) for one in dmoc.verify(found).checks]
    assert [(one.name, one.value) for one in dmoc.verify(back).checks] == kept


def test_only_missions_take_impulses_and_only_by_themselves():
    with pytest.raises(ValueError, match="impulses are those of a"):
        dmoc.solve(load_problem("orbit_raise").make(), impulses="auto")
    with pytest.raises(ValueError, match="impulses must be 'auto'"):
        dmoc.solve(load_problem("hohmann").make(), impulses="three")


def test_an_end_impulse_that_is_none_becomes_a_coast_before_the_first():
    mission = rendezvous(start_time=8.0, legs=[Impulse(), Coast((0.5, 7.0)), Impulse()])
    two = dmoc.solve(mission)
    found = from_two(mission)
    report = dmoc.verify(found)
    assert two.objective == pytest.approx(0.3936216, rel=1e-5)
    assert found.objective == pytest.approx(0.1852423, rel=1e-5) and report.ok
    assert found.impulses[0].size == 0.0


def test_a_third_impulse_that_does_not_help_is_not_added():
    found = from_two(load_problem("hohmann").make())
    assert len(found.impulses) == 2


def test_a_limit_holds_for_each_impulse():
    def half_way(t):
        return [np.cos(0.5) + 0 * t, np.sin(0.5) + 0 * t]

    mission = Mission(
        1.0,
        State((1.0, 0.0), (0.0, 1.0)),
        Moving(half_way, None),
        [Impulse(0.4), Coast((0.2, 2.0))],
        effects=[PointGravity(1.0)],
        objective=DeltaV(),
    )
    found = dmoc.solve(mission)
    assert found.success and found.impulses[0].size <= 0.4 * (1 + 1e-9)


@pytest.mark.parametrize("hold", [False, True])
def test_a_path_in_two_parts_is_the_path(hold):
    path = dmoc.solve(load_problem("orbit_raise").make(), order=4, steps=20, hold=hold).path
    first, last = cut(path, 0.37)
    assert first.duration + last.duration == pytest.approx(path.duration)
    assert first.position[-1] == pytest.approx(last.position[0])
    whole = merged(first, last)
    assert whole.onto(path.mesh, 4, hold).position == pytest.approx(path.position, abs=1e-4)
    assert len(whole.control) == len(whole.mesh) - 1 if hold else len(whole.position)
