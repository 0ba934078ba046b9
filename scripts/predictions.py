"""What a prediction for changed numbers costs, and how far off it is.

The mass of `orbit_raise` and its duration are changed by small parts; beside each prediction the problem is
solved again from the answer before, by `solve` and by `nlp.solve` on the same mesh.

    ./scripts/run python scripts/predictions.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from dmoc import predict, solve, transcribe, worth
from dmoc.scene.problem_file import load_problem

ORDER, STEPS = 8, 32
CHANGES = (1e-3, 1e-2, 3e-2)
# Times are medians of so many runs.
RUNS = 15


def main() -> None:
    problem = load_problem("orbit_raise").make()
    nlp = transcribe(problem, STEPS, ORDER)
    answer = nlp.solve()
    print(f"orbit_raise, order {ORDER}, {STEPS} steps; medians of {RUNS} runs")
    begun = time.perf_counter()
    worth(replace(answer))
    print(f"worth of all numbers, with the factorisation: {1e3 * (time.perf_counter() - begun):.1f} ms")
    worth(answer)
    print(
        "change  prediction  nlp.solve  solve   error of the path and of the force, as a part of their change"
    )
    for part in CHANGES:
        mass, duration = 1 + part, 12 * (1 + part)
        changed = replace(problem, mass=mass, duration=duration)
        near, fast = timed(lambda m=mass, d=duration: predict(answer, mass=m, duration=d))
        _, plain = timed(lambda p=changed: solve(p, ORDER, STEPS, guess=answer))
        again, warm = timed(lambda p=changed: nlp.solve(p, guess=answer))
        errors = [
            np.abs(ours - true).max() / np.abs(before - true).max()
            for ours, true, before in (
                (near.position, again.position, answer.position),
                (near.control, again.path.control, answer.path.control),
            )
        ]
        print(f"{part:6.3f}  {fast:7.2f} ms  {warm:6.1f} ms  {plain:4.0f} ms  {errors[0]:.1%}, {errors[1]:.1%}")


def timed(run: Callable[[], Any]) -> tuple[Any, float]:
    """What a function gives, and how long it takes [ms]."""
    times = []
    for _ in range(RUNS):
        begun = time.perf_counter()
        found = run()
        times.append(1e3 * (time.perf_counter() - begun))
    return found, median(times)


if __name__ == "__main__":
    main()
