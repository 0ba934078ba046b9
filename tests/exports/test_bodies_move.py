"""What is exported of bodies that turn obeys Newton and Euler, and says so where a plan is no motion."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dmoc import Attitude, Pose, Thrusters, Torque, TransferProblem, Wrench, export, rotation
from dmoc.assembly.compiled import compiler
from dmoc.basics.quaternions import rotated, times, turned_by
from dmoc.exports.export import functions_of
from dmoc.planners.planner import Planner, nominal, solver

INERTIA = np.diag([1.0, 2.0, 2.8])
# Six pairs of thrusters around a cube; both of a pair push the same way.
PLACES = np.array([(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0), (0, 1, 1), (0, 1, -1), (0, -1, 1)])
PLACES = 0.5 * np.concatenate([PLACES, [(0, -1, -1), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1)]])
WAYS = np.repeat([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)], 2, axis=0)
MOVED = TransferProblem(
    3.0,
    Pose((0, 0, 0)),
    Pose((2, 1, -1), attitude=rotation((0.2, 0.5, -0.8), np.degrees(1.5))),
    6.0,
    inertia=(1, 2, 2.8),
    actuator=Thrusters(PLACES, WAYS, 1.0),
)
TURN = TransferProblem(
    1.0,
    Attitude((1, 0, 0, 0)),
    Attitude(rotation((1, 2, 2), 170)),
    5.0,
    inertia=(1, 2, 2.8),
    actuator=Torque(),
)


def functions(problem, order, steps):
    return {e.function.name(): e.function for e in functions_of(Planner.of(problem, order, steps, False))}


def test_the_residual_is_what_newton_and_euler_say_of_a_smooth_path():
    """R(q) F - m a and tau - (J dw/dt + w x J w) at the nodes of order 2, but for an error of order h^2."""

    def gap(steps):
        t = np.linspace(0, 6.0, steps + 1)
        made = functions(MOVED, 2, steps)["residual"]
        # a turn about a fixed axis, then one about another: rates and their slopes follow from the chain rule
        first, second = np.array([0.3, -0.5, 0.2]), np.array([0.1, 0.2, 0.4])
        angles = np.sin(0.7 * t)[:, None], np.cos(0.5 * t)[:, None]
        slopes = 0.7 * np.cos(0.7 * t)[:, None], -0.5 * np.sin(0.5 * t)[:, None]
        bends = -0.49 * angles[0], -0.25 * angles[1]
        last = turned_by(angles[1] * second)
        q = times(turned_by(angles[0] * first), last)
        back = last * [1, -1, -1, -1]
        seen = rotated(back, slopes[0] * first)
        w = seen + slopes[1] * second
        dw = rotated(back, bends[0] * first) - np.cross(slopes[1] * second, seen) + bends[1] * second
        place = np.stack([np.sin(t), 0.3 * t**2, np.cos(0.8 * t)], axis=1)
        speed = np.stack([np.cos(t), 0.6 * t, -0.8 * np.sin(0.8 * t)], axis=1)
        pull = 3.0 * np.stack([-np.sin(t), 0.6 + 0 * t, -0.64 * np.cos(0.8 * t)], axis=1)
        u = np.abs(np.sin(t[:, None] + np.arange(12)))
        found = made(
            positions=place.T,
            attitudes=q.T,
            forces=u.T,
            mass=3.0,
            duration=6.0,
            start_velocity=speed[0],
            goal_velocity=speed[-1],
            start_rate=w[0],
            goal_rate=w[-1],
        )
        force = rotated(q, u @ WAYS) - pull
        torque = u @ np.cross(PLACES, WAYS) - dw @ INERTIA - np.cross(w, w @ INERTIA)
        inner = slice(1, -1)
        assert np.abs(torque).max() > 0.5 and np.abs(force).max() > 1.0
        return [
            np.abs(np.array(found[name]).T - exact)[inner].max()
            for name, exact in (("residual", force), ("residual_torque", torque))
        ]

    coarse, fine = gap(60), gap(120)
    assert max(fine) < 5e-3
    for large, small in zip(coarse, fine, strict=True):
        assert np.log2(large / small) == pytest.approx(2.0, abs=0.1)


def test_a_plan_that_jumps_between_signs_shows_in_its_largest_turn():
    """Such a path solves the equations of orders above 2, but is no motion: its turn between nodes tells."""
    made = functions(TURN, 4, 12)
    inputs = made["nominal"]()
    jumped = np.array(inputs["guess_attitudes"]) * np.where(np.arange(25) > 12, -1.0, 1.0)
    plan = made["solver"](**(inputs | {"guess_attitudes": jumped}))
    assert float(plan["largest_turn"]) > np.pi / 2 > 3 * float(made["solver"](**inputs)["largest_turn"])


def test_the_manifest_has_the_unit_of_every_part_of_a_pose(tmp_path):
    wrenched = replace(MOVED, actuator=Wrench(2.0, (1.0, 1.0, 0.5)))
    export(wrenched, tmp_path / "out", order=2, steps=8, c=False)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    arguments = manifest["functions"]["solver"]["inputs"]
    assert all(arg["unit"] and arg["words"] for arg in arguments)
    units = {arg["name"]: arg["unit"] for arg in arguments}
    for end in ("start", "goal"):
        found = [units[f"{end}_{name}"] for name in ("position", "velocity", "attitude", "rate")]
        assert found == ["m", "m/s", "-", "rad/s"]
    assert (units["actuator_force_limit"], units["actuator_torque_limit"]) == ("N", "N m")


def test_what_a_warm_start_leaves_to_mumps_costs_no_iteration():
    """The warm solver does without scaling and refinement of the linear systems: with them it does the same."""
    with_them = {
        "ipopt.mumps_scaling": 77,
        "ipopt.min_refinement_steps": 1,
        "ipopt.fast_step_computation": "no",
    }
    planner = Planner.of(MOVED, 2, 20, False)
    inputs = nominal(planner).function()
    plan = solver(planner, None, warm=False).function(**inputs)
    inputs |= {f"guess_{name}": value for name, value in plan.items() if f"guess_{name}" in inputs}
    inputs |= {
        "start_position": (0.02, -0.01, 0.01),
        "start_attitude": turned_by(np.array([0.01, 0.01, -0.005])),
    }
    counts, costs = [], []
    for options in (None, with_them):
        warm = solver(planner, options, warm=True).function
        costs.append(float(warm(**inputs)["objective"]))
        assert warm.stats()["success"]
        counts.append(warm.stats()["iter_count"])
    assert costs[0] == pytest.approx(costs[1], rel=1e-9)
    assert abs(counts[0] - counts[1]) <= 1 and 2 <= max(counts) <= 12


@pytest.mark.skipif(compiler() is None, reason="needs a C compiler")
def test_an_option_compiles_all_functions_of_the_warm_solver(tmp_path, monkeypatch):
    """As CasADi's option "jit" says, and not f and g alone: a second derivative takes a tenth of the time."""
    monkeypatch.chdir(tmp_path)
    options = {"jit": True, "compiler": "shell", "jit_options": {"compiler": compiler()}, "jit_cleanup": False}
    planner = Planner.of(TURN, 4, 10, False)
    inputs = nominal(planner).function()
    plain, fast = (solver(planner, given, warm=True).function for given in (None, options))
    assert float(fast(**inputs)["objective"]) == pytest.approx(float(plain(**inputs)["objective"]), rel=1e-12)
    assert fast.stats()["iter_count"] == plain.stats()["iter_count"]
    sources = "".join(file.read_text() for file in tmp_path.glob("*.c"))
    for name in ("nlp_f", "nlp_g", "nlp_grad_f", "nlp_jac_g", "nlp_hess_l"):
        assert f"{name}(const casadi_real** arg" in sources
