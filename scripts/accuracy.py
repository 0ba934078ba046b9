"""What each digit costs in time: five problems, dmoc's orders, `--tol`, and methods written by hand.

    ./scripts/run python scripts/accuracy.py

Under three minutes. A cell is the time from a problem to an objective with that relative error, build and
solve, with the meshes interpolated; optima are those of `references.py`. The hand-written methods of
`alternatives.py` know fixed durations without constraints or engines alone.
"""

from __future__ import annotations

import os
import platform
import time
from functools import partial
from statistics import median

from alternatives import METHODS, radau
from references import TABLE

from dmoc import solve
from dmoc.library import load_problem
from dmoc.problem import TransferProblem
from dmoc.study import TARGETS, time_to_reach, work_precision

HEAD = "| problem | how | " + " | ".join(f"{target:.0e}" for target in TARGETS) + " |\n"
HEAD += "|---" * (2 + len(TARGETS)) + "|\n"
REPEATS = 3
MESHES = {
    "order 2": (25, 100, 400, 1600, 6400, 25600),
    "order 4": (10, 25, 50, 100, 200, 400, 800),
    "order 6": (6, 12, 24, 48, 96, 192),
    "order 8": (4, 8, 12, 16, 24, 32, 64, 128),
}
# Where controls switch, many iterations on each mesh, and accuracy that does not grow with the order.
SWITCHING = {"order 2": (50, 200, 800, 3200), "order 4": (25, 100, 400, 1600)}
OTHERS = METHODS | {f"Radau {d}": partial(radau, degree=d) for d in (3, 5, 7)}
OTHERS.pop("plain")
OTHER_MESHES = {
    name: (10, 25, 50, 100, 200, 400, 800) if name in ("Hermite-Simpson", "RK4 shooting") else (100, 800, 3200)
    for name in OTHERS
} | {f"Radau {d}": (4, 8, 16, 32, 64) for d in (5, 7)}
OTHER_MESHES["Radau 3"] = (8, 16, 32, 64, 128, 256)
PROBLEMS = {
    "orbit_raise": (MESHES, OTHER_MESHES),
    "rendezvous": (MESHES, OTHER_MESHES),
    "earth_mars": (MESHES, {}),
    "lunar_landing": (SWITCHING, {}),
    "two_body_fuel": ({"order 2": (50, 200, 800), "order 4": (25, 100, 400)}, {}),
}


def optimum(name: str) -> float:
    return next(known.value for known in TABLE if known.problem == name and not known.parameters)


def asked_for(problem: TransferProblem, best: float) -> list[str]:
    """Cells of a solve with that tolerance: its time, and the error it really has."""
    cells = []
    for target in TARGETS:
        times = []
        for _ in range(REPEATS):
            begun = time.perf_counter()
            found = solve(problem, tol=target)
            times.append(time.perf_counter() - begun)
            if times[-1] > 5:
                break
        error = abs(found.objective / best - 1)
        cells.append(f"{shown(median(times))} ({error:.0e})" if found.success else f"- ({found.status})")
    return cells


def shown(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    return f"{1e3 * seconds:.0f} ms" if seconds < 0.9995 else f"{seconds:.1f} s"


def cheapest(times: dict[str, list[float | None]]) -> list[str]:
    """For every target the fastest of some methods, with its name."""
    cells = []
    for k in range(len(TARGETS)):
        reached = {name: row[k] for name, row in times.items() if row[k] is not None}
        name = min(reached, key=lambda name: reached[name] or 0.0, default="")
        cells.append(f"{shown(reached[name])}, {name}" if name else "-")
    return cells


def rows(name: str) -> list[str]:
    """Lines of the table for one problem."""
    problem, best = load_problem(name).make(), optimum(name)
    meshes, by_hand = PROBLEMS[name]
    orders = [int(title.split()[1]) for title in meshes]
    others = {title: OTHERS[title] for title in by_hand}
    trials = work_precision(problem, orders, meshes | by_hand, REPEATS, others, best)
    times = time_to_reach(trials, TARGETS)
    own = {title: times[title] for title in meshes}
    lines = {"best order": cheapest(own), "order 2": [shown(seconds) for seconds in own["order 2"]]}
    lines["`--tol` (true error)"] = asked_for(problem, best)
    if by_hand:
        lines["by hand"] = cheapest({title: times[title] for title in by_hand})
    heads = [f"`{name}`", *[""] * (len(lines) - 1)]
    return [
        f"| {head} | {how} | {' | '.join(cells)} |\n"
        for head, (how, cells) in zip(heads, lines.items(), strict=True)
    ]


def main() -> None:
    begun = time.perf_counter()
    print(HEAD, end="")
    for name in PROBLEMS:
        print("".join(rows(name)), end="", flush=True)
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    print(f"\nMeasured on {machine}, medians of {REPEATS}, in {time.perf_counter() - begun:.0f} s.")


if __name__ == "__main__":
    main()
