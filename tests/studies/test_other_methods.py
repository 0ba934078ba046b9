"""What dmoc is measured against is no straw man: each method has its own order and solves the same problem.

Orders are slopes of log error over log steps, over at least three meshes whose relative error of the objective
lies between 1e-3 and 3e-11: Ipopt's tolerance leaves a floor near 1e-11.
"""

import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from dmoc import FreeForce, PointGravity, Pose, State, TransferProblem, Wrench, rotation, solve
from dmoc.scene.problem_file import load_problem
from dmoc.studies.accuracy import work_precision
from dmoc.studies.other_methods import load_methods

METHODS = load_methods(Path(__file__).parents[2] / "scripts" / "alternatives.py")
ORDERS = {"plain": 2, "trapezoid": 2, "RK4 shooting, held": 2, "RK4 shooting": 4, "Hermite-Simpson": 4}
ORDERS |= {"Radau 3": 5, "Radau 5": 9}
MESHES = {2: (100, 200, 400, 800), 4: (24, 48, 96, 192), 5: (8, 16, 32, 64), 9: (3, 4, 5, 6, 8)}


def kepler_transfer():
    """From the circular orbit of radius 1 to that of 1.5 by 4 rad in 5 time units; optimum by shooting."""
    speed = 1 / math.sqrt(1.5)
    goal = State((1.5 * math.cos(4), 1.5 * math.sin(4)), (-speed * math.sin(4), speed * math.cos(4)))
    return TransferProblem(1.0, State((1, 0), (0, 1)), goal, 5.0, effects=[PointGravity(1.0)])


KEPLER_OPTIMUM = 0.010173701094176


def observed_order(meshes, errors):
    meshes, errors = np.asarray(meshes), np.asarray(errors)
    useful = (errors < 1e-3) & (errors > 3e-11)
    assert useful.sum() >= 3, f"errors {errors} leave fewer than three meshes between 1e-3 and 3e-11"
    return -np.polyfit(np.log(meshes[useful]), np.log(errors[useful]), 1)[0]


def trials_of(name, problem, meshes, reference):
    found = work_precision(problem, (), meshes, 1, {name: METHODS[name]}, reference)
    assert [trial.status for trial in found] == ["solved"] * len(meshes)
    return found


@pytest.mark.parametrize("name", METHODS)
def test_objective_converges_with_the_order_of_the_method(name):
    meshes = MESHES[ORDERS[name]]
    found = trials_of(name, kepler_transfer(), meshes, KEPLER_OPTIMUM)
    assert observed_order(meshes, [trial.error for trial in found]) == pytest.approx(ORDERS[name], abs=0.5)


@pytest.mark.parametrize("name", METHODS)
def test_the_controls_found_fly_to_the_goal(name):
    """The independent integrator, driven by the polynomials between a method's controls, converges too."""
    meshes = MESHES[ORDERS[name]]
    found = trials_of(name, kepler_transfer(), meshes, KEPLER_OPTIMUM)
    # between Radau's d points the force is a polynomial of degree d - 1, which has only order d
    least = {"Radau 3": 3, "Radau 5": 5}.get(name, ORDERS[name])
    assert observed_order(meshes, [trial.path_error for trial in found]) > least - 0.5


@pytest.mark.parametrize("name", ["orbit_raise", "rendezvous", "drone_hop", "point_to_point"])
def test_plain_is_the_same_scheme(name):
    """Drag, rotating frames, a limited force: the same discrete optimum as dmoc's own at order 2."""
    problem = load_problem(name).make()
    (plain,) = trials_of("plain", problem, [100], 1.0)
    assert plain.objective == pytest.approx(solve(problem, steps=100).objective, rel=1e-8)


@pytest.mark.parametrize("name", ["reorientation", "heavy_top", "spin_to_spin"])
def test_plain_is_the_same_scheme_of_bodies_that_turn(name):
    """Manchester and Peck's equations by hand, with potentials and spinning ends."""
    problem = load_problem(name).make()
    (plain,) = trials_of("plain", problem, [40], 1.0)
    assert plain.objective == pytest.approx(solve(problem, order=2, steps=40).objective, rel=1e-8)


OF_A_TURN = {2: (20, 40), 4: (10, 20), 5: (6, 12), 9: (6, 8)}


@pytest.mark.parametrize("name", METHODS)
def test_every_method_turns_a_body_with_its_order(name):
    """The optimum is that of indirect shooting on Euler's equations, as for dmoc's own orders."""
    meshes = OF_A_TURN[ORDERS[name]]
    found = trials_of(name, load_problem("reorientation").make(), meshes, 0.753733560549)
    seen = np.log(found[0].error / found[1].error) / np.log(meshes[1] / meshes[0])
    # With fewer steps than 12 Radau collocation of degree 5 is not yet at its order 9: 8.6 was seen.
    assert seen > ORDERS[name] - (1.0 if ORDERS[name] == 9 else 0.5)
    assert found[1].path_error < 0.3 * found[0].path_error


@pytest.mark.parametrize("name", METHODS)
def test_every_method_moves_and_turns_a_body(name):
    """By a force and a torque in body axes; the optimum is that of indirect shooting."""
    goal = Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), math.degrees(2)))
    problem = TransferProblem(3.0, Pose((0, 0, 0)), goal, 5.0, actuator=Wrench(), inertia=(1, 2, 2.8))
    (found,) = trials_of(name, problem, [20], 3.69659102851)
    assert found.error < (2e-2 if ORDERS[name] == 2 else 1e-4)


@pytest.mark.parametrize("name", METHODS)
def test_every_method_knows_drag_and_a_limited_force(name):
    problem = load_problem("drone_hop").make()
    (found,) = trials_of(name, problem, [64], 211.4604947)
    assert found.error < (2e-3 if ORDERS[name] == 2 else 2e-5)


@pytest.mark.parametrize("name", METHODS)
def test_the_options_are_those_of_dmoc(name, monkeypatch):
    """Same linear solver, no tighter tolerance; the derivatives and the cold start are the method's own."""
    given = []

    def remember(title, plugin, problem, options):
        given.append(options)
        return real(title, plugin, problem, options)

    real = ca.nlpsol
    monkeypatch.setattr(ca, "nlpsol", remember)
    problem = load_problem("orbit_raise").make()
    assert isinstance(problem.actuator, FreeForce)
    work_precision(problem, (2,), [60], 1, {name: METHODS[name]}, 1.0)
    own, other = given
    assert other["ipopt.tol"] >= own["ipopt.tol"]
    # A first attempt of dmoc ends sooner, as other ways follow.
    ends = {"ipopt.output_file", "ipopt.tol", "ipopt.max_iter"}
    hooks = {"jac_g", "hess_lag", "grad_f", "iteration_callback"} | ends
    assert all(other[key] is None for key in ("jac_g", "hess_lag", "grad_f"))
    assert {key: own[key] for key in own.keys() - hooks} == {key: other[key] for key in other.keys() - hooks}


@pytest.mark.parametrize("name", ["bang_bang", "free_flyer"])
def test_what_they_do_not_know_is_refused(name):
    with pytest.raises(ValueError, match="method 'plain': the alternatives know only"):
        work_precision(load_problem(name).make(), (), [20], 1, {"plain": METHODS["plain"]}, 1.0)
