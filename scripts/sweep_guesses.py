"""Whether a predicted path is a better guess for the next point of a sweep than the path it is predicted from.

Along a row of points each is solved from the answer before it, as `dmoc sweep --follow` does, and from the path
that `predict` makes of that answer for the numbers of the point. Times are of the whole, prediction included.

    ./scripts/run python scripts/sweep_guesses.py
"""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import numpy as np

from dmoc import predict, solve
from dmoc.scene.problem_file import load_problem

# Problem, parameter, the name of the number that it is, values, and how it is solved.
ROWS: tuple[tuple[str, str, str, np.ndarray, dict[str, Any]], ...] = (
    ("orbit_raise", "mass", "mass", np.linspace(1.0, 1.5, 11), {"order": 4, "steps": 100}),
    ("orbit_raise", "duration", "duration", np.linspace(12.0, 13.0, 11), {"order": 8, "steps": 32}),
    ("free_flyer", "mass", "mass", np.linspace(9.58, 11.0, 11), {"order": 4, "steps": 100}),
    ("drone_hop", "duration", "duration", np.linspace(3.0, 4.0, 11), {"order": 4, "steps": 50}),
    ("rendezvous", "duration", "duration", np.linspace(1.5, 2.0, 11), {"order": 8, "steps": 32}),
)
# Times are medians of so many runs.
RUNS = 3


def main() -> None:
    print("problem, parameter    s a point, from the answer before: as it is, predicted   iterations   failed")
    for name, parameter, number, values, numerics in ROWS:
        file = load_problem(name)
        problems = [file.make(**{parameter: float(value)}) for value in values]
        seconds: dict[bool, list[float]] = {False: [], True: []}
        iterations, failed = {False: 0, True: 0}, {False: 0, True: 0}
        for guessed in (False, True) * RUNS:
            answer = solve(problems[0], **numerics)
            begun = time.perf_counter()
            for problem in problems[1:]:
                guess: Any = answer
                if guessed and answer.success:
                    value = problem.mass if number == "mass" else problem.duration
                    guess = predict(answer, **{number: value})
                answer = solve(problem, guess=guess, **numerics)
                iterations[guessed] += answer.iterations
                failed[guessed] += not answer.success
            seconds[guessed].append((time.perf_counter() - begun) / (len(problems) - 1))
        each = "  ".join(
            f"{median(seconds[on]):6.3f} s  {iterations[on] / RUNS / (len(problems) - 1):5.1f}  {failed[on]}"
            for on in (False, True)
        )
        print(f"{name}, {parameter}: {each}")


if __name__ == "__main__":
    main()
