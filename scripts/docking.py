"""Dock with a tumbling target, planning again once a second, with actuators that do not do what they are told.

The plans are those of `problems/tumbling_target.py` from where the chaser is, for the time that is left, each
started from the one before. Every torque comes out a tenth smaller than it was asked for, every force a
twentieth larger, and the chaser is heavier than the planner believes.

    ./scripts/run python scripts/docking.py
"""

import argparse
import sys
import time
from dataclasses import replace

import numpy as np

from dmoc import Pose, TransferProblem, simulate, solve
from dmoc.basics.quaternions import angle_between
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.results.solution import Solution
from dmoc.scene.problem_file import load_problem

# A plan has this many steps of this order.
STEPS, ORDER = 20, 4
# A new plan is made after this time [s].
PERIOD = 1.0
# The controls change in steps of this length [s].
TICK = 0.1
# No new plan is made when less time than this is left [s]: what is off by then cannot be made good any more.
LAST_PLAN = 2.0
# What comes out of each force and each torque, over what was asked for [-].
FORCE, TORQUE = 1.05, 0.9
# The chaser is heavier than the planner believes, by this factor [-].
MASS = 1.03
# The chaser has docked if it meets place [m], velocity [m/s], attitude [degrees] and rate [rad/s] of the port
# as well as this.
DOCKED = 0.02, 0.01, 2.0, 0.01


def controls(plan: Solution, since: float, begin: float, count: int) -> np.ndarray:
    """The controls of a plan made at `since` in the middle of the next ticks, shape (count, 6)."""
    fractions, values = flown(Dynamics.of(plan.require_problem()), plan.path).sampled(9)
    times = since + plan.duration * fractions
    middles = begin + TICK * (np.arange(count) + 0.5)
    return np.stack([np.interp(middles, times, column) for column in values.T], axis=1)


def fly(problem: TransferProblem, again: bool) -> tuple[np.ndarray, list[float], list[int]]:
    """How far off the port the chaser ends, and seconds and iterations of the plans."""
    duration, seconds, iterations = problem.duration_bounds[0], [], []
    here, plan, since, t = problem.start, None, 0.0, 0.0
    heavier = tuple(tuple(MASS * x for x in row) for row in np.array(problem.inertia))
    while t < duration - 1e-9:
        if plan is None or (again and duration - t >= LAST_PLAN):
            now = replace(problem, start=here, duration=duration - t, start_time=t)
            begun = time.perf_counter()
            found = solve(
                now, order=ORDER, steps=STEPS, guess=None if plan is None else moved_on(plan, t - since)
            )
            seconds.append(time.perf_counter() - begun)
            iterations.append(found.iterations)
            if found.success:
                plan, since = found, t
            elif plan is None:
                raise SystemExit(f"there is no first plan: {found.message}")
        span = min(PERIOD, duration - t)
        count = round(span / TICK)
        told = controls(plan, since, t, count) * np.repeat([FORCE, TORQUE], 3)
        body = replace(problem, mass=MASS * problem.mass, inertia=heavier, start=here, constraints=())
        body = replace(body, duration=span, start_time=t)
        moved = simulate(body, told, steps=count, order=4, hold=True)
        state = (moved.position, moved.velocity, moved.attitude, moved.rate)
        here = Pose(*(tuple(map(float, values[-1])) for values in state))
        t += span
    port, motion = problem.goal.estimate(duration)
    gaps = (
        np.linalg.norm(np.array(here.position) - port[:3]),
        np.linalg.norm(np.array(here.velocity) - motion[:3]),
        np.degrees(angle_between(np.array(here.attitude), port[3:])),
        np.linalg.norm(np.array(here.rate) - motion[3:]),
    )
    return np.array(gaps), seconds, iterations


def moved_on(plan: Solution, gone: float):
    """The rest of a plan `gone` seconds later, as a path on the same number of steps."""
    path, left = plan.path, plan.duration - gone
    fine = path.onto(np.unique(np.append(path.mesh, gone / plan.duration)), path.order, path.hold)
    cut = int(np.searchsorted(fine.mesh, gone / plan.duration - 1e-12))
    node = cut * (path.order // 2)
    mesh = (fine.mesh[cut:] - fine.mesh[cut]) / (1 - fine.mesh[cut])
    rest = replace(
        fine,
        mesh=mesh,
        duration=left,
        position=fine.position[node:],
        control=fine.control[node:],
        mass=fine.mass[node:],
        reaction=None if fine.reaction is None else fine.reaction[node:],
        multipliers={},
    )
    return rest


def main() -> int:
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
    problem = load_problem("tumbling_target").make()
    words = ("place [m]", "velocity [m/s]", "attitude [degrees]", "rate [rad/s]")
    found = {}
    for name, again in (("with one plan", False), ("planned again every second", True)):
        gaps, seconds, iterations = fly(problem, again)
        found[name] = gaps
        print(
            f"{name}: off by " + ", ".join(f"{word} {gap:.2g}" for word, gap in zip(words, gaps, strict=True))
        )
        if again:
            print(
                f"{len(seconds)} plans, median {1e3 * np.median(seconds[1:]):.0f} ms, "
                f"{np.median(iterations[1:]):.0f} iterations; the first {1e3 * seconds[0]:.0f} ms"
            )
    docked = (found["planned again every second"] <= DOCKED).all()
    print("docked" if docked else "missed the port")
    return 0 if docked else 1


if __name__ == "__main__":
    sys.exit(main())
