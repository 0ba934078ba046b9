"""`dmoc sweep`: what it takes, how far it is, what came of it."""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmoc.cli.options import (
    CHECK_FAILED,
    INTERRUPTED,
    NOT_SOLVED,
    SOLVED,
    Hold,
    Json,
    Name,
    Order,
    Quiet,
    Settings,
    Steps,
    TimeLimit,
    switch,
    warn,
    writable,
)

# Everything else is imported where it is used: `dmoc --help` answers at once.
if TYPE_CHECKING:
    from dmoc.sweeps.loop import SweepProgress


Vary = Annotated[
    list[str],
    typer.Option(
        metavar="NAME=VALUES",
        help="A parameter and its values, start:stop:count, start:stop:log7 for 7 values of equal ratio, "
        "or value,value,...; repeat for a grid. With --sample a range start:stop or start:stop:log.",
    ),
]
Sample = Annotated[
    int | None,
    typer.Option(metavar="N", help="Solve so many points spread over the ranges instead of a grid."),
]
Keep = Annotated[
    str | None,
    typer.Option(metavar="paths", help="Also keep every path: a point is then a guess or a picture."),
]

Errors = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=VALUE",
        help="Also fly every answer with errors, as dmoc disperse does: start=0.01,0.001, force=0.01, "
        "samples=200 and so on; repeat for more.",
    ),
]

Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="A dask.distributed scheduler to solve on instead.")
]

Workers = Annotated[int | None, typer.Option(help="Worker processes; as many as there are cores if not given.")]


def sweep(
    problem: Name,
    vary: Vary,
    out: Annotated[Path, typer.Option(help="Where to write the results (netCDF).")],
    sample: Sample = None,
    method: Annotated[str, typer.Option(help="How a sample is spread: sobol or latin.")] = "sobol",
    seed: Annotated[int, typer.Option(help="The same seed gives the same sample.")] = 0,
    order: Order = None,
    steps: Steps = None,
    tol: Annotated[float | None, typer.Option(help="Relative error to reach instead, at every point.")] = None,
    hold: Hold = False,
    settings: Settings = None,
    follow: Annotated[
        bool,
        switch("--follow", help="Start points from their neighbours' answers: faster, on one branch."),
    ] = False,
    keep: Keep = None,
    error: Errors = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = None,
    restart: Annotated[bool, switch("--restart", help="Begin anew instead of going on.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Solve a problem over a grid or a sample of its parameters.

    Runs on all cores. A sweep that was interrupted goes on when the same command is given again.

    Draw the result with: dmoc plot FILE
    """
    from dmoc.scene.problem_file import parse_settings
    from dmoc.sweeps import sweep as sweeping
    from dmoc.sweeps.plan import parse_vary

    writable(out)
    begun = time.perf_counter()
    numerics: dict[str, Any] = {"order": order, "steps": steps, "tol": tol, "hold": hold}
    spread: dict[str, Any] = {"sample": sample, "method": method, "seed": seed}
    with _live(not (quiet or as_json)) as (progress, tries), _says_what_is_kept(out, tries), _warns_in_a_line():
        data = sweeping.sweep(
            problem,
            parse_vary(vary),
            out,
            settings=parse_settings(settings or ()),
            follow=follow,
            keep=keep,
            errors=parse_settings(error, "--error") if error else None,
            workers=workers,
            scheduler=scheduler,
            restart=restart,
            progress=progress,
            time_limit=time_limit,
            **numerics,
            **spread,
        )
    spent = time.perf_counter() - begun, tries["done"] - tries["before"]
    raise typer.Exit(_print_json(data, out) if as_json else _show(data, out, *spent, quiet))


def _print_json(data: Any, out: Path) -> int:
    """Print a sweep as one JSON object, and the exit code that says what came of it."""
    from dmoc.reports import as_json as report_json

    found = report_json.sweep_object(data, out)
    print(report_json.as_text(found))
    return _code(found["points"], found["solved"], found["checks_fail"])


def _code(points: int, solved: int, broken: int) -> int:
    return NOT_SOLVED if solved < points else CHECK_FAILED if broken else SOLVED


def _show(data: Any, out: Path, seconds: float, tries: int, quiet: bool) -> int:
    """Print what came of a sweep, and the exit code that says so."""
    from rich.text import Text

    from dmoc.reports import words as report
    from dmoc.sweeps.data import result

    success, statuses = result(data, "success").values, result(data, "status").values
    solved, broken = int(success.sum()), int((success & ~result(data, "checks_hold").values).sum())
    console = report.console()
    if not quiet:
        for status, count in sorted(Counter(statuses[~success].tolist()).items()):
            message = result(data, "message").values[statuses == status][0]
            console.print(f"{count} not solved, {status}: {message}")
        if warm := int(result(data, "from_neighbour").values.sum()):
            console.print(f"{warm} solved from the answer of a neighbour")
        console.print(f"{tries} solves in {seconds:.1f} s, {tries / seconds:.2g} a second")
        console.print(f"wrote {out}; draw it with: dmoc plot {out}")
    words = f"Solved {solved} of {success.size} points"
    failed = (
        "." if solved == success.size else f"; {success.size - solved} not solved, see the variable status."
    )
    failed_checks = Counter(name for name in result(data, "failed_check").values[success].tolist() if name)
    named = ", ".join(f"{name} at {count}" for name, count in failed_checks.most_common())
    checks = "" if not broken else f" Checks fail at {broken} of them ({named}), see failed_check."
    console.print(Text(words + failed + checks, "yellow" if solved < success.size or broken else "green"))
    return _code(success.size, solved, broken)


@contextmanager
def _says_what_is_kept(out: Path, tries: dict[str, int]) -> Iterator[None]:
    """Ctrl-C ends the program with a word on how many points are kept, if any are."""
    from dmoc.sweeps.journal import journal_of

    try:
        yield
    except KeyboardInterrupt:
        if (journal := journal_of(out)).exists():
            words = f"{tries['done']} of {tries['all']} points are kept in {journal}"
            print(f"{words}; give the same command again to go on", file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def _warns_in_a_line() -> Iterator[None]:
    """What dmoc warns of is one line of words, without the line of the program that it comes from."""
    with warnings.catch_warnings():
        # a worker's own warnings never come here: what it writes is thrown away
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_, **__: warn(str(message))
        yield


@contextmanager
def _live(wanted: bool) -> Iterator[tuple[SweepProgress, dict[str, int]]]:
    """A `progress` that keeps one line of a terminal up to date, and what it was last told."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from dmoc.reports import words as report

    screen, tries = report.console(stderr=True), {"before": -1, "done": 0, "all": 0}
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}{task.fields[unsolved]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    shown = wanted and screen.is_terminal
    begun = time.monotonic()
    with Progress(*columns, console=screen, transient=True, disable=not shown) as bar:
        line = bar.add_task("", total=None, rate="starting workers", unsolved="")

        def progress(done: int, total: int, unsolved: int) -> None:
            if tries["before"] < 0:
                tries["before"] = done
            tries.update(done=done, all=total)
            fresh = done - tries["before"]
            rate = f"{fresh / (time.monotonic() - begun):.2g} a second" if fresh else "starting"
            failed = f", {unsolved} not solved" if unsolved else ""
            bar.update(line, completed=done, total=total, rate=rate, unsolved=failed)

        yield progress, tries
