"""Every problem file meets its closed form or published optimum, and passes its own checks."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad_vec, solve_ivp
from scipy.linalg import expm
from scipy.optimize import root

from dmoc import solve, verify
from dmoc.scene.problem_file import catalogue, load_problem

ROOT = Path(__file__).parents[2]
REFERENCES = runpy.run_path(str(ROOT / "scripts" / "references.py"))


def make(name, **values):
    return load_problem(name).make(**values)


def gramian_optimum(a, b, start, duration):
    """Least 1/2 integral |u|^2 that brings x' = a x + b u from `start` to the origin."""

    def integrand(t):
        reach = expm(a * t) @ b
        return reach @ reach.T

    gramian = quad_vec(integrand, 0, duration, epsabs=0, epsrel=1e-13)[0]
    coast = expm(a * duration) @ start
    return 0.5 * coast @ np.linalg.solve(gramian, coast)


@pytest.mark.parametrize("name", [name for name, _ in catalogue()])
def test_defaults_are_solved_and_every_check_holds(name):
    solution = solve(make(name))
    assert solution.success, solution.message
    report = verify(solution)
    assert report.ok, [check for check in report.checks if not check.ok]


@pytest.mark.parametrize("known", REFERENCES["TABLE"], ids=lambda known: f"{known.problem}-{known.quantity}")
def test_published_and_closed_form_optima_are_met(known):
    if known.problem == "earth_mars_2028":
        # its reference is for positions of the ephemeris
        pytest.importorskip("jplephem")
        pytest.importorskip("skyfield_data")
    solution = known.solve()
    assert abs(known.difference(solution)) < known.tolerance
    table = REFERENCES["PLACE"].search(REFERENCES["PAGE"].read_text())[0]
    shown = [stated(line) for line in table.splitlines() if line.startswith("|")]
    assert stated(known.row(solution)) in shown, "run scripts/references.py --write"


def stated(line):
    """A line of the table without what the solve found."""
    name, quantity, _, reference, _, *rest = line.split("|")[1:-1]
    return name, quantity, reference, rest


def test_point_to_point_is_the_cubic():
    case = make("point_to_point", goal=(2.0, -1.0, 2.0), duration=5.0, mass=3.0)
    exact = 6 * 3.0**2 * 3.0**2 / 5.0**3
    errors = [abs(solve(case, steps=steps).objective / exact - 1) for steps in (100, 200, 400)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)
    assert solve(case, order=4, steps=10).objective == pytest.approx(exact, rel=1e-9)
    assert solve(make("point_to_point"), order=4).objective == pytest.approx(0.0576923077, rel=1e-8)


def test_bang_bang_takes_twice_the_root():
    assert solve(make("bang_bang")).duration == pytest.approx(2.0, rel=1e-6)
    heavy = solve(make("bang_bang", distance=7.0, limit=0.5, mass=20.0))
    assert heavy.duration == pytest.approx(2 * np.sqrt(20 * 7 / 0.5), rel=1e-6)
    middle = heavy.steps // 2
    assert np.all(heavy.force[: middle - 1] > 0.499) and np.all(heavy.force[middle + 2 :] < -0.499)


def test_free_flyer_finds_the_optimum_next_to_the_straight_line():
    case = make("free_flyer")
    assert solve(case, steps=1600).objective == pytest.approx(0.86242, abs=1e-5)


def test_free_flyer_finds_a_better_optimum_on_the_other_side():
    def around(t):
        return np.array([8.0, 1.0, 1.0]) * t / 40 + np.array([0.0, 1.5, 0.0]) * np.sin(np.pi * t / 40)

    solution = solve(make("free_flyer"), guess=around, steps=1600)
    assert solution.objective == pytest.approx(0.83690, abs=1e-5)


def test_free_flyer_is_the_cubic_where_no_obstacle_is_in_the_way():
    case = make("free_flyer", radius=0.05)
    assert solve(case, order=4).objective == pytest.approx(6 * 100 * 66 / 40**3, rel=1e-9)


def test_rendezvous_meets_the_controllability_gramian():
    n, duration = 0.00113, 2400.0
    a, b = np.zeros((6, 6)), np.zeros((6, 3))
    a[:3, 3:] = b[3:] = np.eye(3)
    a[3, 0], a[3, 4], a[4, 3], a[5, 2] = 3 * n**2, 2 * n, -2 * n, -(n**2)
    exact = gramian_optimum(a, b, np.array([200.0, -1000.0, 100.0, 0, 0, 0]), duration)
    assert exact == pytest.approx(1.048842323e-3, rel=1e-8)
    for order in (6, 8):
        assert solve(make("rendezvous"), order=order).objective == pytest.approx(exact, rel=1e-8)
    assert solve(make("rendezvous"), steps=400).objective == pytest.approx(exact, rel=1e-4)


def drone_by_shooting(goal, duration, mass, limit, drag):
    """Pontryagin: mu' = -lambda + drag/m mu with lambda constant; thrust -mu/m, cut off at the limit."""
    weight = np.array([0, 0, -9.81])

    def fly(unknowns):
        constant, first = unknowns[:3] * mass / drag, unknowns[3:]

        def rates(t, y):
            thrust = -(constant + (first - constant) * np.exp(drag / mass * t)) / mass
            thrust = thrust * min(1.0, limit / np.linalg.norm(thrust))
            velocity = y[3:6]
            change = (thrust - drag * velocity) / mass + weight
            return np.concatenate([velocity, change, [0.5 * thrust @ thrust]])

        flown = solve_ivp(rates, (0, duration), np.zeros(7), "DOP853", rtol=1e-11, atol=1e-12, max_step=0.05)
        return flown.y[:, -1]

    target = np.concatenate([goal, np.zeros(3)])
    # without drag and limit the thrust is linear in time
    slope = 12 * np.array(goal) * mass / duration**3
    start = np.concatenate([-slope * mass, -(0.5 * slope * duration - mass * weight) * mass])
    found = root(lambda unknowns: fly(unknowns)[:6] - target, start, tol=1e-11)
    assert found.success, found.message
    return fly(found.x)[6]


def test_drone_hop_meets_indirect_shooting():
    parameters = {entry.name: entry.default for entry in load_problem("drone_hop").parameters}
    exact = drone_by_shooting(**parameters)
    assert exact == pytest.approx(211.4604947, rel=1e-8)
    solution = solve(make("drone_hop"), order=4)
    assert solution.objective == pytest.approx(exact, rel=1e-6)
    thrust = np.linalg.norm(solution.force, axis=1)
    at_limit = thrust > 15 * (1 - 1e-4)
    assert at_limit[0] and not at_limit[-1]
    assert solution.position[:, 2].min() > -1e-9


@pytest.mark.slow
def test_halo_transfer_is_the_same_on_fine_meshes_and_no_worse_than_twenty_segments():
    halo = make("halo_transfer")
    default, fine = solve(halo), solve(halo, order=8, steps=100)
    assert default.objective == pytest.approx(fine.objective, rel=2e-3)
    assert fine.objective == pytest.approx(0.0154632, rel=2e-4)
    # forward-backward shooting, the best of fourteen random starts
    assert fine.final_mass > 0.98420
    equal = solve(halo, order=4, mesh=np.linspace(0, 1, 101))
    assert not verify(equal)["reference"].ok


def test_bryson_and_denhams_arcs_give_the_closed_form_to_rounding():
    for ceiling in (1 / 9, 0.1):
        found = solve(make("bryson_denham", ceiling=ceiling), structure=True)
        assert found.objective == pytest.approx(4 / (9 * ceiling), rel=1e-11)
        # It meets the ceiling after three times its height, at the speed of 1.
        assert [leg.duration for leg in found.legs] == pytest.approx(
            [3 * ceiling, 1 - 6 * ceiling, 3 * ceiling], abs=1e-3
        )


def test_an_ascent_in_two_stages_has_the_linear_tangent_of_shooting():
    """Two unknowns of the tangent and the time of the last burn meet height and velocity of the goal."""

    def flown(begin, slope, last):
        state, mass, time = np.zeros(4), 300e3, 0.0
        for thrust, exhaust, lasts in ((4.2e6, 3000.0, 150.0), (7.5e5, 4400.0, last)):
            flow = thrust / exhaust

            def rate(t, s, at=(time, mass, thrust, flow)):
                angle, push = np.arctan(begin - slope * t), at[2] / (at[1] - at[3] * (t - at[0]))
                return [s[2], s[3], push * np.cos(angle), push * np.sin(angle) - 9.81]

            state = solve_ivp(rate, (time, time + lasts), state, method="DOP853", rtol=1e-12, atol=1e-6).y[
                :, -1
            ]
            time, mass = time + lasts, mass - flow * lasts - (18e3 if not time else 0.0)
        return state, mass

    def missed(z):
        (_, height, along, up), _ = flown(z[0], z[1] / 100, 100 * z[2])
        return [(height - 200e3) / 1e5, (along - 7.8e3) / 1e3, up / 1e3]

    begin, slope, last = root(missed, [1.0, 0.2, 3.0], tol=1e-12).x
    found = solve(make("two_stage_ascent"))
    assert found.final_mass == pytest.approx(flown(begin, slope / 100, 100 * last)[1], rel=5e-8)
    for leg in found.legs:
        tangent = leg.force[:, 1] / leg.force[:, 0]
        assert tangent == pytest.approx(begin - slope / 100 * leg.time, abs=1e-6)
