"""What the commands share: options, the way to a problem and to its answer, and what Ctrl-C does."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from dmoc.basics.plain import unbroken
from dmoc.cli.ending import INTERRUPTED, end

# Everything else is imported where it is used: `dmoc --help` answers at once.
if TYPE_CHECKING:
    from dmoc.checks.verification import Report
    from dmoc.results.solution import Solution
    from dmoc.scene.problem_file import ProblemFile

# An option that takes no value; without the empty metavar the help would show its type beside it.
switch = partial(typer.Option, metavar="")

# Exit code where all is well: solved, and every check holds.
SOLVED = 0
# Exit code where the input has no meaning; nothing was solved.
BAD_INPUT = 2
# Exit code where no optimum was found.
NOT_SOLVED = 3
# Exit code where an optimum was found but a check of it fails.
CHECK_FAILED = 4


def names_like(begun: str) -> list[str]:
    """Names of problem files, for the completion of a shell."""
    from dmoc.scene.problem_file import catalogue

    return [name for name, _ in catalogue() if name.startswith(begun)]


def say_version(wanted: bool) -> None:
    if wanted:
        from dmoc import __version__

        print(f"dmoc {__version__}")
        raise typer.Exit


Name = Annotated[
    str,
    typer.Argument(
        metavar="PROBLEM", help="A name from `dmoc list`, or a path to a .py file.", autocompletion=names_like
    ),
]
# The help of several commands describes FILE with these words.
SAVED = "A solution saved with `dmoc solve --out`"
File = Annotated[Path, typer.Argument(metavar="FILE", help=f"{SAVED}.")]
Source = Annotated[
    str | None,
    typer.Option("--problem", metavar="PROBLEM", help="The problem, if not the one named in the file."),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="NAME=VALUE", help="A parameter of the problem, such as mass=12; repeat for more."
    ),
]
Order = Annotated[
    int | None,
    typer.Option(help="Order of the scheme: 2, 4, 6 or 8; if not given, the default of the scene."),
]
Steps = Annotated[
    int | None,
    typer.Option(help="Number of steps, at least 2; if not given 400, 100, 50 or 32 at order 2, 4, 6 or 8."),
]
Version = Annotated[bool, switch("--version", callback=say_version, is_eager=True, help="Print the version.")]
Structure = Annotated[
    bool | None,
    switch(
        "--structure/--no-structure",
        help="Make burns, coasts and touches of zones legs with free ends, for high accuracy; tried by itself "
        "if --tol is below 1e-5, or for an engine in a free time up to 1e-4.",
    ),
]
Impulses = Annotated[
    str | None,
    typer.Option(
        metavar="auto", help="Find how many impulses of a mission cost least, beginning with those it has."
    ),
]
Worth = Annotated[
    bool,
    switch(
        "--worth",
        help="Also say what each number of the problem is worth: the derivative of the objective by it.",
    ),
]
TimeLimit = Annotated[
    float | None,
    typer.Option(metavar="S", help="End after so many seconds with the best answer so far."),
]
Hold = Annotated[bool, switch("--hold", help="Keep forces constant over each step.")]
Json = Annotated[bool, switch("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, switch("--quiet", "-q", help="Print the last line only.")]


def problem_of(name: str, settings: list[str] | None) -> tuple[ProblemFile, Any]:
    """The problem file, and the problem made with the values of --set."""
    from dmoc.scene.problem_file import load_problem, parse_settings

    values = parse_settings(settings or ())
    file = load_problem(name)
    problem = file.make(**values)
    return file, getattr(problem, "alone", None) or problem


def not_a_team(name: str, settings: list[str] | None, verb: str) -> Any:
    """The problem of a verb that has no meaning for a team of bodies."""
    problem = problem_of(name, settings)[1]
    if hasattr(problem, "together"):
        raise ValueError(
            f"dmoc {verb} takes a transfer or a mission, but {name} is a team of bodies; state the body that "
            "you mean as a TransferProblem"
        )
    return problem


def best_start(problem: Any, starts: int, order: int | None, hold: bool, guess: Any, unit: str | None) -> Any:
    """The best of the optima that several guesses lead to; all of them are shown if a unit is given."""
    from dmoc.reports import words as report
    from dmoc.reports.tables import optima_table

    if hasattr(problem, "together"):
        from dmoc.phases.climb import team_optima

        found = team_optima(problem, starts, order, hold, guess)
    elif hasattr(problem, "plan"):
        from dmoc.studies.optima import mission_optima

        found = mission_optima(problem, starts, order, hold, guess)
    else:
        from dmoc.solver.starts import local_optima

        found = local_optima(problem, starts, order, hold, guess)
    if unit is not None:
        report.console().print(optima_table(found, unit))
    return found[0].path if found else guess


def watched(quiet: bool, unit: str) -> AbstractContextManager[Callable | None]:
    """What a solve is to tell of its progress, with the line of the terminal that shows it."""
    if quiet:
        return nullcontext()
    from dmoc.reports.words import live_line

    return live_line(unit)


def attached(path: Path, source: str | None) -> Solution:
    """A saved solution with its problem: the one given, else the one it names (`dmoc.scene.named`)."""
    import dmoc
    from dmoc.scene.named import attached_from, named
    from dmoc.scene.problem_file import load_problem

    solution = dmoc.load(path)
    known = solution.provenance
    source = source or named(known.problem_name, known.source_hash)
    if source is None:
        raise ValueError(
            f"{path} was made from {known.problem_name!r}, of which there is no problem file; "
            "give it with --problem PATH"
        )
    file = load_problem(source)
    found = attached_from(file, solution)
    # a solution that was saved from Python has no hash: there may have been no problem file
    if known.source_hash and known.source_hash != file.source_hash:
        warn(f"{file.path} is no longer, or never was, the file that {path} was made from")
    return found


def seen(file: Path, source: str | None) -> Any:
    """A saved solution to draw; without its problem, what the file itself has."""
    import dmoc

    try:
        return attached(file, source)
    except ValueError as error:
        solution = dmoc.load(file)
        if source is not None:
            raise
        warn(f"zones and limits are left out: {error}")
        return solution


def show_answer(
    solution: Solution,
    verdict: Report | None,
    as_json: bool,
    quiet: bool = False,
    written: Sequence[Path] = (),
    stopped: int = INTERRUPTED,
    with_worth: bool = False,
) -> None:
    """Print the answer and exit with the code that says how good it is."""
    found: tuple = ()
    if with_worth and solution.optimal and (as_json or not quiet):
        from dmoc.reports.worth import worth_told

        found = worth_told(solution)
    if as_json:
        from dmoc.reports import as_json as report_json

        more = found[0] if found else {}
        print(report_json.as_text(report_json.solve_object(solution, verdict) | more))
    else:
        from dmoc.reports import words as report

        if solution.optimal and verdict is not None:
            # A single line stays one, however wide the terminal is.
            report.console().print(report.answer(solution, verdict, quiet, written, found[1:]), soft_wrap=quiet)
        else:
            report.console().print(report.failure(solution, quiet, written))
    if not solution.optimal:
        raise typer.Exit(stopped if solution.status == "stopped" else NOT_SOLVED)
    raise typer.Exit(SOLVED if solution.success and verdict is not None and verdict.ok else CHECK_FAILED)


def warn(message: str) -> None:
    print(f"warning: {unbroken(message)}", file=sys.stderr)


def fail(message: str, code: int) -> NoReturn:
    print(unbroken(message), file=sys.stderr)
    sys.exit(code)


def writable(
    path: Path | None, drawn: bool = False, table: bool = False, moving: bool = False, page: bool = False
) -> None:
    """ValueError unless a file can be written there: said before the work, not after it.

    A result takes the place of another one, never that of a problem file or a thesis.
    """
    if path is None:
        return
    from dmoc.basics.files import as_path

    folder = as_path(path).parent
    if not folder.is_dir():
        raise ValueError(f"cannot write {path}: there is no folder {folder}; create it first")
    special = path.exists() and not path.is_file()
    if special or not os.access(folder, os.W_OK):
        raise ValueError(f"cannot write {path}: choose a file in a folder you may write to")
    if page:
        from dmoc.pages.report import check_page

        check_page(path)
    elif drawn:
        from dmoc.plots.page import SUFFIXES

        if path.suffix.lower() not in SUFFIXES:
            raise ValueError(f"cannot draw into {path}: the file must end in {', '.join(SUFFIXES)}")
    elif moving:
        from dmoc.films.film import check_target

        check_target(path)
    elif table:
        if path.suffix.lower() != ".csv":
            raise ValueError(f"cannot write a table into {path}: the file must end in .csv")
    elif path.exists() and path.stat().st_size:
        from dmoc.results.netcdf import HDF5_SIGNATURE

        with path.open("rb") as stream:
            if stream.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
                raise ValueError(
                    f"cannot write {path}: it is no result that may be replaced; give another name"
                )


@contextmanager
def ends_at_once() -> Iterator[None]:
    """Outside a solve, which stops at Ctrl-C and keeps its iterate, it ends the program.

    CasADi would swallow the exception. Nothing is being written here, so nothing is left behind.
    """

    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
