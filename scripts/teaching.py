"""Flights that teach what the body weighs: what a plan promises, and what sixty flights of it tell.

A free flyer of 18.97 kg with linear drag moves by one metre in twenty seconds, once with the least effort and
then with more and more weight on the information on its mass. Each plan is flown sixty times and seen every
tenth of a second with errors of a millimetre; `dmoc.identify` says what the mass is.

    ./scripts/run python scripts/teaching.py [--flights 60] [--plot teaching.png]
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from dmoc import (
    BallForce,
    Effort,
    Information,
    LinearDrag,
    State,
    TransferProblem,
    Unknown,
    fly,
    foresee,
    identify,
    solve,
)

MASS, AIR = 18.97, LinearDrag(1.2)
NOISE, EVERY = 0.001, 0.1
START, GOAL = State((0, 0), (0, 0)), State((1, 0), (0, 0))
STEPS = 200
# What a unit of information is worth [N^2 s]; 0 is the plan of least effort.
WEIGHTS = (0.0, 0.1, 0.3, 1.0)


def planned(weight: float) -> Any:
    objective = Effort() - weight * Information("mass", NOISE, EVERY) if weight else Effort()
    # From a straight guess the path stays straight for ever; one to the side may teach more.
    times = np.linspace(0, 20, STEPS + 1)
    guess = times, np.stack([times / 20, 0.3 * np.sin(2 * np.pi * times / 20)], axis=1)
    problem = TransferProblem(MASS, START, GOAL, 20.0, [AIR], BallForce(0.4), objective, guess=guess)
    return solve(problem, order=4, steps=STEPS, hold=True).raise_for_status()


def told(plan: Any, flights: int) -> tuple[float, float, int]:
    """Root mean square error of the mass, mean width of its 95 % interval [kg], and how many hold the truth."""
    times = np.linspace(0, 20, STEPS + 1)
    commands = np.vstack([plan.path.control, plan.path.control[-1:]])
    errors, widths, held = [], [], 0
    for seed in range(flights):
        flight = fly(times, commands, START, mass=MASS, effects=[AIR], noise=NOISE, seed=seed)
        found = identify(flight, mass=Unknown(15), effects=[AIR], noise=NOISE)
        low, high = found.interval()["mass"]
        errors.append(found.values["mass"] - MASS)
        widths.append(high - low)
        held += low <= MASS <= high
    return float(np.sqrt(np.mean(np.square(errors)))), float(np.mean(widths)), held


def draw(file: str, plans: dict[float, Any]) -> None:
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    for weight, plan in plans.items():
        label = f"{weight:g} N$^2$ s per nat" if weight else "least effort"
        left.plot(*plan.position.T, label=label)
        right.plot(20 * plan.path.mesh[:-1], np.linalg.norm(plan.path.control, axis=1), label=label)
    left.set(xlabel="x [m]", ylabel="y [m]", title="path", aspect="equal")
    right.set(xlabel="time [s]", ylabel="|F| [N]", title="force")
    right.legend(fontsize=8)
    figure.savefig(file, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flights", type=int, default=60)
    parser.add_argument("--plot", help="draw the plans into this file")
    given = parser.parse_args()
    plans = {weight: planned(weight) for weight in WEIGHTS}
    print("| weight | effort | foreseen sigma | 95 % interval, foreseen | found | error (rms) | hold |")
    print("|---|---|---|---|---|---|---|")
    for weight, plan in plans.items():
        sigma = foresee(plan, "mass", NOISE, EVERY)["mass"]
        error, width, held = told(plan, given.flights)
        effort = 0.5 * 20 / STEPS * np.sum(plan.path.control**2)
        print(
            f"| {weight:g} | {effort:.3f} N² s | {1e3 * sigma:.1f} g | {3.92e3 * sigma:.0f} g | "
            f"{1e3 * width:.0f} g | {1e3 * error:.1f} g | {held} of {given.flights} |"
        )
    if given.plot:
        draw(given.plot, plans)


if __name__ == "__main__":
    main()
