"""Solve every problem in problems/ from its defaults, draw it, and print the table of docs/gallery.md.

    ./scripts/run python scripts/gallery.py                   # all of them
    ./scripts/run python scripts/gallery.py goddard           # some; the pictures of the others stay
    ./scripts/run python scripts/gallery.py stability         # the long runs of `dmoc stability`, two minutes
    ./scripts/run python scripts/gallery.py sweep             # the map of times and angles, one minute
    ./scripts/run python scripts/gallery.py porkchop          # the map of launch windows, two minutes

Pictures go to problems/gallery. The exit code is 1 if a problem is not solved or fails a check.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from dmoc import solve, sweep, verify
from dmoc.basics.docstrings import first_line
from dmoc.charts.stability import stability_figure
from dmoc.charts.study import save_page
from dmoc.charts.sweep import sweep_figure
from dmoc.plots.page import save_figure
from dmoc.results.solution import Solution
from dmoc.scene.problem_file import load_problem
from dmoc.studies.drift import drift, kepler, per_revolution
from dmoc.studies.rounding import growth, round_off

PROBLEMS = Path(__file__).parents[1] / "problems"
GALLERY = PROBLEMS / "gallery"
# Dots an inch: at 13.33 inches a picture is 1200 pixels wide, as wide as a page shows it.
DPI = 90
# A picture of more bytes than this is stored with a palette of 256 colours.
LARGEST = 250_000
# The argument that stands for the long runs, and the name of their picture.
LONG_RUNS = "stability"
# The arguments that stand for the sweeps, and the names of their pictures.
SWEEP, PORKCHOP = "sweep", "porkchop"
# What is varied in the sweeps: duration [s] and angle [rad] of orbit_raise, departure and flight time [s] from
# one planet to another, 525 points each.
SWEEPS = {
    SWEEP: ("orbit_raise", {"duration": "5:17:25", "angle": "4:14:21"}, {"order": 8, "steps": 25}),
    PORKCHOP: ("planet_to_planet", {"departure": "7:13:25", "flight": "1.5:7.5:21"}, {}),
}


def row(name: str, words: str, solution: Solution, holds: bool) -> str:
    """One line of the table."""
    seconds = solution.build_s + solution.solve_s
    value = f"{solution.objective:.6g} {solution.provenance.objective_unit}".replace("^2", "\u00b2").rstrip()
    found = value if holds else f"{value} (a check fails)" if solution.success else solution.status
    cells = (
        f"[{name}](../problems/gallery/{name}.png)",
        words,
        f"`dmoc solve {name}`",
        found,
        f"{seconds:.2g}",
    )
    return f"| {' | '.join(cells)} |"


def reduce_colors(picture: Path) -> None:
    """A palette instead of full colour for a picture that is too large; greys are then a little off."""
    if picture.stat().st_size < LARGEST:
        return
    with Image.open(picture) as full:
        full.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            picture, optimize=True
        )


def draw_long_runs() -> None:
    """What `dmoc stability --revolutions 1000 --steps 1000000` draws."""
    runs = [(f"e = {e}", drift(kepler(e), 1000, per_revolution(e))) for e in (0.3, 0.7)]
    save_page(stability_figure(runs, round_off(), growth()), GALLERY / f"{LONG_RUNS}.png", DPI)


def draw_sweep(name: str) -> None:
    """What the sweep of docs/sweeps.md over 525 points draws."""
    problem, varied, numerics = SWEEPS[name]
    with TemporaryDirectory() as work:
        data = sweep(problem, varied, Path(work) / "map.nc", **numerics)
    save_page(sweep_figure(data), GALLERY / f"{name}.png", DPI)
    reduce_colors(GALLERY / f"{name}.png")


def main(names: list[str]) -> int:
    GALLERY.mkdir(exist_ok=True)
    for name in SWEEPS:
        if name in names or not names:
            draw_sweep(name)
    if LONG_RUNS in names or not names:
        draw_long_runs()
    print("| problem | what it is | command | objective | s |", "|---|---|---|---|---|", sep="\n")
    worst = 0
    wanted = names or sorted(path.stem for path in PROBLEMS.glob("*.py"))
    for name in [name for name in wanted if name not in (LONG_RUNS, *SWEEPS)]:
        file = load_problem(str(PROBLEMS / f"{name}.py"))
        solution = solve(file.make())
        report = verify(solution) if solution.success else None
        holds = report is not None and report.ok
        save_figure(solution, GALLERY / f"{name}.png", report, dpi=DPI)
        reduce_colors(GALLERY / f"{name}.png")
        print(row(name, first_line(file.docstring).rstrip("."), solution, holds), flush=True)
        worst |= not holds
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
