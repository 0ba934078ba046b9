"""Fly the free flyer with an exported solver that plans again once a second, as a robot would.

The solver is exported and built once; from then on CasADi alone is used. Every plan starts where the robot
is, has the time that is left, and is warm started from the plan before, moved on, multipliers included. The
robot is heavier than the planner believes and is pushed about; it moves in steps of 20 ms.

Then the same with longer times between plans, each with and without a feedback in between: the exported
`predict` says how force and state of the first plan move with its start, and so what force answers a robot that
is off the plan.

    ./scripts/run python scripts/closed_loop.py --plot closed_loop.png
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

from dmoc import export, solve
from dmoc.scene.problem_file import load_problem

# A plan has this many steps.
STEPS = 40
# A new plan is made after this time [s].
PERIOD = 1.0
# The robot moves, and its force changes, in steps of this length [s].
TICK = 0.02
# No new plan is made when less time than this is left [s]: what is off by then cannot be made good any more.
LAST_PLAN = 2.0
# The robot is heavier than the planner believes, by this factor [-].
MASS_ERROR = 1.08
# The planner takes obstacles to be larger by this [m], since a plan keeps clear of them at its nodes only.
MARGIN = 0.05
# Plans are made so seldom, too [s]; the longest leaves the first plan alone.
PERIODS = (1.0, 2.0, 4.0, 8.0, 100.0)
# From this part of the time on the gains of the feedback stay what they are [-].
LAST_GAIN = 0.8
# A plan is flown if its largest residual [N] and its violation of limits [-] are no larger than this.
GOOD = {"largest_residual": 1e-6, "violation": 1e-6}


def push_at(t: float, noise: np.random.Generator) -> np.ndarray:
    """What nobody told the planner about [N]: a draught, a slow swing and gusts."""
    swing = np.sin(2 * np.pi * t / np.array([11.0, 7.0, 17.0]))
    return np.array([-0.012, 0.015, 0.008]) + 0.01 * swing + noise.normal(0.0, 0.02, 3)


def moved_on(plan: dict, left: float, gone: float) -> dict:
    """A plan for `left` seconds as the guess of the plan for what is left of them `gone` seconds later."""
    places = {STEPS + 1: np.linspace(0, 1, STEPS + 1), STEPS: (np.arange(STEPS) + 0.5) / STEPS}
    guess = {f"guess_{name}": np.array(value) for name, value in plan.items()}
    for name, values in guess.items():
        if (old := places.get(values.shape[1])) is not None:
            new = (gone + old * (left - gone)) / left
            # positions are joined by a cubic, for their second differences are forces; multipliers of limits by
            # straight lines, for a cubic would overshoot and change their sign
            smooth = name in ("guess_positions", "guess_velocities", "guess_multipliers_dynamics")
            linear = np.stack([np.interp(new, old, row) for row in values])
            guess[name] = CubicSpline(old, values.T)(new).T if smooth else linear
    return guess


class Planner:
    """The exported solvers, and how long they took."""

    def __init__(self, folder: Path):
        nominal, self.cold, self.warm, self.step = (
            ca.Function.load(f"{folder}/{name}.casadi") for name in ("nominal", "solver", "warm_solver", "step")
        )
        self.inputs = {name: np.array(value) for name, value in nominal().items()}
        self.mass, self.duration = self.inputs["mass"].item(), self.inputs["duration"].item()
        names = [name.removesuffix("_radius") for name in self.inputs if name.endswith("_radius")]
        self.centers = np.array([self.inputs[f"{name}_center"].ravel() for name in names])
        self.radii = np.array([self.inputs[f"{name}_radius"].item() for name in names])
        self.inputs |= {f"{name}_radius": self.inputs[f"{name}_radius"] + MARGIN for name in names}
        self.seconds, self.iterations, self.refused = [], [], 0

    def plan(self, q: np.ndarray, v: np.ndarray, left: float, guess: dict) -> dict | None:
        """A plan from a state, or None if the solver has none that is good."""
        solver = self.warm if guess else self.cold
        state = {"start_position": q, "start_velocity": v, "duration": left}
        begun = time.perf_counter()
        plan = solver(**{**self.inputs, **state, **guess})
        self.seconds.append(time.perf_counter() - begun)
        self.iterations.append(solver.stats()["iter_count"])
        good = all(float(plan[name]) <= limit for name, limit in GOOD.items())
        self.refused += not good
        return {name: x for name, x in plan.items() if f"guess_{name}" in self.inputs} if good else None


def gains_of(folder: Path) -> np.ndarray:
    """For each step of the plan the force [N] that answers a state off it, (steps, 3, 6), from `predict`."""
    predict = ca.Function.load(f"{folder}/predict.casadi")
    nominal = {name: ca.DM(value) for name, value in ca.Function.load(f"{folder}/nominal.casadi")().items()}
    start = ca.MX.sym("start", 6)
    known = {name: nominal[name] for name in predict.name_in() if name in nominal}
    plan = predict(**{**known, "start_position": start[:3], "start_velocity": start[3:]})
    states = ca.vertcat(plan["positions"], plan["velocities"])
    slopes = ca.Function("slopes", [start], [ca.jacobian(states, start), ca.jacobian(plan["forces"], start)])
    begin = ca.vertcat(nominal["start_position"], nominal["start_velocity"])
    moved, pushed = (
        np.array(part).reshape(-1, rows, 6) for part, rows in zip(slopes(begin), (6, 3), strict=True)
    )
    gains = np.array([push @ np.linalg.pinv(move) for push, move in zip(pushed, moved[:-1], strict=True)])
    gains[int(LAST_GAIN * STEPS) :] = gains[int(LAST_GAIN * STEPS)]
    return gains


def fly(planner: Planner, period: float = PERIOD, gains: np.ndarray | None = None) -> tuple:
    """Path [m] every tick, the last velocity [m/s], and the plans."""
    noise, duration, plan, since, plans = np.random.default_rng(1), planner.duration, None, 0.0, []
    q, v = (planner.inputs[f"start_{name}"].ravel() for name in ("position", "velocity"))
    path = [q]
    for tick in range(round(duration / TICK)):
        t = tick * TICK
        if plan is None or (tick % round(period / TICK) == 0 and duration - t >= LAST_PLAN):
            guess = moved_on(plan, duration - since, t - since) if plan else {}
            if found := planner.plan(q, v, duration - t, guess):
                plan, since = found, t
                plans.append(np.array(plan["positions"]))
                states = CubicSpline(
                    np.linspace(since, duration, STEPS + 1),
                    np.vstack([np.array(plan[name]) for name in ("positions", "velocities")]).T,
                )
            elif plan is None:
                raise SystemExit("there is no first plan")
        now = int((t + 0.5 * TICK - since) / (duration - since) * STEPS)
        force = np.array(plan["forces"])[:, now] + push_at(t, noise)
        if gains is not None:
            force = force + gains[int((t + 0.5 * TICK) / duration * STEPS)] @ (np.append(q, v) - states(t))
        q, v = (np.array(x).ravel() for x in planner.step(q, v, planner.mass * MASS_ERROR, t, TICK, force))
        path.append(q)
    return np.array(path), v, plans


def with_predict(folder: Path) -> np.ndarray:
    """The gains around the first plan, whose zones are larger as the planner's are."""
    problem = load_problem("free_flyer").make()
    zones = [replace(zone, radius=zone.radius + MARGIN) for zone in problem.constraints]
    problem = replace(problem, constraints=zones)
    answer = solve(problem, steps=STEPS, hold=True)
    export(problem, folder, steps=STEPS, hold=True, c=False, guess=answer)
    return gains_of(folder)


def draw(file: str, planner: Planner, path: np.ndarray, plans: list) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(11, 5.5), layout="constrained")
    for panel, other, title in ((axes[0, 0], 1, "from above"), (axes[1, 0], 2, "from the side")):
        for center, radius in zip(planner.centers, planner.radii, strict=True):
            panel.add_patch(plt.Circle(center[[0, other]], radius, color="#CC79A7", alpha=0.35, lw=0))
        for positions in plans[::4]:
            panel.plot(positions[0], positions[other], color="#555555", lw=0.8)
        panel.plot(path[:, 0], path[:, other], color="#0072B2", lw=2.5)
        panel.set_title(f"{title}: flown (blue), every fourth plan (grey)")
        panel.set(xlabel="x [m]", ylabel=f"{'xyz'[other]} [m]", aspect="equal", ylim=(-1.1, 2.2))
    axes[0, 1].plot(np.arange(len(path)) * TICK, clearance_of(planner, path), color="#0072B2")
    axes[0, 1].set(xlabel="time [s]", ylabel="clearance [m]", ylim=(0, None))
    axes[1, 1].bar(np.arange(len(planner.seconds)), 1e3 * np.array(planner.seconds), color="#E69F00")
    axes[1, 1].set(xlabel="time of the plan [s]; the first is a cold start", ylabel="time to plan [ms]")
    figure.savefig(file, dpi=120)


def clearance_of(planner: Planner, path: np.ndarray) -> np.ndarray:
    return (np.linalg.norm(path[:, None] - planner.centers, axis=2) - planner.radii).min(axis=1)


def report(planner: Planner, path: np.ndarray, v: np.ndarray) -> str:
    miss = np.linalg.norm(path[-1] - planner.inputs["goal_position"].ravel())
    nearest = clearance_of(planner, path).min()
    return f"clearance {1e3 * nearest:.1f} mm, miss {1e3 * miss:.1f} mm and {1e3 * np.linalg.norm(v):.1f} mm/s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", help="draw the flight into this file")
    file = parser.parse_args().plot
    with tempfile.TemporaryDirectory() as work:
        begun, folder = time.perf_counter(), Path(work) / "free_flyer"
        export(load_problem("free_flyer").make(), folder, steps=STEPS, hold=True, c=False)
        planner, built = Planner(folder), time.perf_counter() - begun
        gains = with_predict(Path(work) / "with_predict")
    path, v, plans = fly(planner)
    ms, count = 1e3 * np.array(planner.seconds), planner.iterations
    print(f"built once, in {built:.2f} s, for {len(ms)} plans, {planner.refused} of them refused")
    print(f"first plan, cold: {ms[0]:.1f} ms, {count[0]} iterations")
    print(f"warm plans: median {np.median(ms[1:]):.1f} ms, 95 % {np.quantile(ms[1:], 0.95):.1f} ms,", end=" ")
    print(f"max {ms[1:].max():.1f} ms; iterations median {np.median(count[1:]):.0f}, max {max(count[1:])}")
    print("planning again:    ", report(planner, path, v))
    if file:
        draw(file, planner, path, plans)
    for period in PERIODS:
        for name, gain in (("nothing", None), ("predict", gains)):
            flown = report(planner, *fly(planner, period, gain)[:2])
            print(f"a plan every {period:3.0f} s, {name} between them: {flown}")
    if clearance_of(planner, path).min() <= 0:
        raise SystemExit("the robot touched an obstacle")


if __name__ == "__main__":
    main()
