"""What each digit costs in time: five problems, dmoc's orders, `--tol`, and methods written by hand.

    ./scripts/run python scripts/accuracy.py

Under three minutes. A cell is the time from a problem to an objective with that relative error, build and
solve, with the meshes interpolated. Every solve writes its functions down anew, as the first one of a scene in
a process does. Optima are those of `references.py`. The methods of `alternatives.py` know fixed durations
without constraints or engines alone.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import time
from functools import partial
from pathlib import Path
from statistics import median

from alternatives import METHODS, radau
from references import TABLE

from dmoc import solve
from dmoc.basics.memory import forget
from dmoc.scene.problem import TransferProblem
from dmoc.scene.problem_file import load_problem
from dmoc.studies.accuracy import TARGETS, time_to_reach, work_precision

PAGE = Path(__file__).parents[1] / "docs" / "accuracy.md"
PLACE = re.compile(r"(?<=<!-- accuracy -->\n).*?(?=<!-- end of accuracy -->)", re.DOTALL)
HEAD = "| problem | how | " + " | ".join(f"{target:.0e}" for target in TARGETS) + " |\n"
HEAD += "|---" * (2 + len(TARGETS)) + "|\n"
# Each solve is timed this often; the median counts.
REPEATS = 3
# Steps at each order, from coarse meshes to such as reach the last of TARGETS.
MESHES = {
    "order 2": (25, 100, 400, 1600, 6400, 25600),
    "order 4": (10, 25, 50, 100, 200, 400, 800),
    "order 6": (6, 12, 24, 48, 96, 192),
    "order 8": (4, 8, 12, 16, 24, 32, 64, 128),
}
# Where controls switch, a mesh takes many iterations and high orders are no more accurate: fewer meshes, and
# orders 2 and 4 alone.
SWITCHING = {"order 2": (50, 200, 800, 3200), "order 4": (25, 100, 400, 1600)}
OTHERS = METHODS | {f"Radau {d}": partial(radau, degree=d) for d in (3, 5, 7)}
OTHERS.pop("plain")
OTHER_MESHES = {
    name: (10, 25, 50, 100, 200, 400, 800) if name in ("Hermite-Simpson", "RK4 shooting") else (100, 800, 3200)
    for name in OTHERS
} | {f"Radau {d}": (4, 8, 16, 32, 64) for d in (5, 7)}
OTHER_MESHES["Radau 3"] = (8, 16, 32, 64, 128, 256)
# By problem: the meshes of the orders, those of the methods written by hand, and the tightest relative error
# that `--tol` is asked for [-].
PROBLEMS = {
    "orbit_raise": (MESHES, OTHER_MESHES, 1e-9),
    "rendezvous": (MESHES, OTHER_MESHES, 1e-9),
    "earth_mars": (MESHES, {}, 1e-9),
    "lunar_landing": (SWITCHING, {}, 1e-9),
    "two_body_fuel": ({"order 2": (50, 200, 800), "order 4": (25, 100, 400)}, {}, 1e-5),
}


def optimum(name: str) -> float:
    return next(known.value for known in TABLE if known.problem == name and not known.parameters)


def asked_for(problem: TransferProblem, best: float, tightest: float) -> list[str]:
    """Cells of a solve with that tolerance: its time, and the error it really has."""
    cells = []
    for target in TARGETS:
        times = []
        for _ in range(REPEATS if target >= tightest else 0):
            forget()
            begun = time.perf_counter()
            found = solve(problem, tol=target).raise_for_status()
            times.append(time.perf_counter() - begun)
        cells.append(f"{shown(median(times))} ({abs(found.objective / best - 1):.0e})" if times else "-")
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
    meshes, by_hand, tightest = PROBLEMS[name]
    orders = [int(title.split()[1]) for title in meshes]
    others = {title: OTHERS[title] for title in by_hand}
    trials = work_precision(problem, orders, meshes | by_hand, REPEATS, others, best)
    times = time_to_reach(trials, TARGETS)
    own = {title: times[title] for title in meshes}
    lines = {
        "best order": cheapest(own),
        "order 2": [shown(seconds) for seconds in own["order 2"]],
        "`--tol` (true error)": asked_for(problem, best, tightest),
    }
    if by_hand:
        lines["by hand"] = cheapest({title: times[title] for title in by_hand})
    heads = [f"`{name}`", *[""] * (len(lines) - 1)]
    return [
        f"| {head} | {how} | {' | '.join(cells)} |\n"
        for head, (how, cells) in zip(heads, lines.items(), strict=True)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the table into docs/accuracy.md")
    into_page, begun, text = parser.parse_args().write, time.perf_counter(), HEAD
    print(HEAD, end="")
    for name in PROBLEMS:
        found = "".join(rows(name))
        print(found, end="", flush=True)
        text += found
    machine = f"{os.cpu_count()} shared cores, {platform.machine()}, Python {platform.python_version()}"
    note = f"\nMedians of {REPEATS} on {machine}.\n"
    print(f"{note}{time.perf_counter() - begun:.0f} s in all")
    if into_page:
        PAGE.write_text(PLACE.sub(lambda _: text + note, PAGE.read_text()))


if __name__ == "__main__":
    main()
