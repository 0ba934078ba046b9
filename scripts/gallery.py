"""Solve every problem in problems/ from its defaults, draw it, and print the table of docs/gallery.md.

    ./scripts/run python scripts/gallery.py                   # all of them
    ./scripts/run python scripts/gallery.py goddard           # some; the pictures of the others stay
    ./scripts/run python scripts/gallery.py stability         # the long runs of `dmoc stability`, two minutes
    ./scripts/run python scripts/gallery.py sweep             # the map of times and angles, one minute
    ./scripts/run python scripts/gallery.py porkchop          # the map of launch windows, two minutes
    ./scripts/run python scripts/gallery.py report            # the page for a browser, with Chromium

Pictures go to problems/gallery. The exit code is 1 if a problem is not solved or fails a check.
"""

import sys
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from PIL import Image

from dmoc import report, solve, sweep, verify
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
# The argument that stands for the page for a browser, whose problem this is, and its size [pixels].
PAGE, PAGE_OF, PAGE_SIZE = "report", "free_flyer", {"width": 1400, "height": 1120}
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


def draw_page() -> None:
    """What a browser shows of `dmoc report`, at a third of the flight."""
    from playwright.sync_api import sync_playwright

    arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with TemporaryDirectory() as work, sync_playwright() as driver:
        file = Path(work) / "flight.html"
        report(solve(load_problem(str(PROBLEMS / f"{PAGE_OF}.py")).make()), file)
        browser = driver.chromium.launch(executable_path=which("chromium"), args=arguments)
        view = browser.new_page(viewport=PAGE_SIZE)
        view.goto(file.as_uri())
        view.wait_for_selector("html[data-ready=yes]", timeout=120_000)
        view.evaluate("slider.value = 80; slider.dispatchEvent(new Event('input'))")
        view.wait_for_timeout(1000)
        view.screenshot(path=GALLERY / f"{PAGE}.png")
        browser.close()
    reduce_colors(GALLERY / f"{PAGE}.png")


def main(names: list[str]) -> int:
    GALLERY.mkdir(exist_ok=True)
    if PAGE in names or not names:
        draw_page()
    for name in SWEEPS:
        if name in names or not names:
            draw_sweep(name)
    if LONG_RUNS in names or not names:
        draw_long_runs()
    print("| problem | what it is | command | objective | s |", "|---|---|---|---|---|", sep="\n")
    worst = 0
    wanted = names or sorted(path.stem for path in PROBLEMS.glob("*.py"))
    for name in [name for name in wanted if name not in (PAGE, LONG_RUNS, *SWEEPS)]:
        file = load_problem(str(PROBLEMS / f"{name}.py"))
        solution = solve(file.make())
        checked = verify(solution) if solution.success else None
        holds = checked is not None and checked.ok
        save_figure(solution, GALLERY / f"{name}.png", checked, dpi=DPI)
        reduce_colors(GALLERY / f"{name}.png")
        print(row(name, first_line(file.docstring).rstrip("."), solution, holds), flush=True)
        worst |= not holds
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
