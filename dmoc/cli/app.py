"""The command line: one small function a verb."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from copy import copy
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from dmoc.cli import flights as flights_command
from dmoc.cli import pages as pages_command
from dmoc.cli import paths as paths_command
from dmoc.cli import solve as solve_command
from dmoc.cli import stability as stability_command
from dmoc.cli import study as study_command
from dmoc.cli import sweep as sweep_command
from dmoc.cli.ending import INTERRUPTED
from dmoc.cli.options import (
    BAD_INPUT,
    NOT_SOLVED,
    SAVED,
    SOLVED,
    File,
    Hold,
    Json,
    Name,
    Order,
    Settings,
    Source,
    Steps,
    Version,
    Worth,
    attached,
    ends_at_once,
    fail,
    not_a_team,
    problem_of,
    seen,
    show_answer,
    switch,
    writable,
)

# Everything else is imported where it is used: `dmoc --help` answers at once.

# The class of all usage errors. Typer exports only one that derives from it.
USAGE_ERROR: Any = typer.BadParameter.__base__

app = typer.Typer(
    pretty_exceptions_enable=False,
    help="Discrete mechanics and optimal control: move a body from A to B at least effort, fuel or time. "
    "Begin with: dmoc solve free_flyer",
    epilog="Exit codes: 0 all is well, 2 bad input, 3 not solved, 4 a check failed or a tolerance was missed, "
    "130 interrupted.",
)


@app.callback()
def options(version: Version = False) -> None:
    """What goes before a verb."""


@app.command("list", epilog="Example: dmoc list")
def list_problems() -> None:
    """List the problem files, those in ./problems first."""
    from dmoc.reports import words as report
    from dmoc.scene import problem_file as library

    found = library.catalogue()
    if not found:
        raise ValueError(f"no problem files in {' or '.join(map(str, library.folders()))}")
    report.console().print(report.pairs(found))


@app.command(epilog="Example: dmoc new my_flight --from orbit_raise")
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the new problem file, without .py.")],
    source: Annotated[
        str, typer.Option("--from", help="The problem to copy: a name (see dmoc list) or a path to a .py file.")
    ] = "free_flyer",
) -> None:
    """Copy a problem file into this folder, to change it there."""
    from dmoc.basics.files import whole_file
    from dmoc.reports import words as report
    from dmoc.scene.problem_file import find

    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise ValueError(
            f"{name!r} is no name for a problem file; give letters, digits and _, such as my_flight"
        )
    target = Path(f"{stem}.py")
    if target.exists():
        raise ValueError(f"{target} is there already; give another name, or remove it first")
    text = find(source).read_bytes()
    with whole_file(target) as temporary:
        Path(temporary).write_bytes(text)
    report.console().print(
        f"wrote {target}, a copy of {source}; change it, and solve it with: dmoc solve {target}"
    )


@app.command(epilog="Example: dmoc show free_flyer")
def show(name: Name, settings: Settings = None) -> None:
    """Say what a problem is: the scene, its parameters, the size of its NLP as solved without options."""
    from dmoc.meshes.choices import first_path
    from dmoc.nlp.transcription import transcribe_onto
    from dmoc.nlp.units import units_of
    from dmoc.reports import words as report

    file, problem = problem_of(name, settings)
    console = report.console()
    tables = [report.scene(problem), report.parameters(file.parameters)]
    if not hasattr(problem, "leg_names"):
        guess = first_path(problem)
        tables.append(report.sizes(transcribe_onto(problem, guess, units_of(problem, guess))))
    for part in (report.prose(file.docstring), *tables):
        console.print(part, "", sep="\n")
    console.print(f"{file.path}; solve it with: dmoc solve {name}")


app.command(epilog="Example: dmoc solve free_flyer --set mass=12 --tol 1e-4 --out flight.nc --plot flight.png")(
    solve_command.solve
)


@app.command(epilog="Example: dmoc effects leo_raise --all")
def effects(
    name: Name,
    order: Order = None,
    steps: Steps = None,
    hold: Hold = False,
    settings: Settings = None,
    others: Annotated[
        bool, switch("--all", help="Also effects of the library that are not in the scene.")
    ] = False,
) -> None:
    """Solve a problem and show what each effect does to the path and what it costs."""
    import dmoc
    from dmoc.reports import words as report
    from dmoc.reports.tables import influence_table
    from dmoc.studies.effects import influences

    problem = not_a_team(name, settings, "effects")
    solution = dmoc.solve(problem, order=order, steps=steps, hold=hold)
    if not solution.success:
        show_answer(solution, None, as_json=False)
    report.console().print(influence_table(influences(solution, others), solution))


@app.command(epilog="Example: dmoc check flight.nc")
def check(file: File, source: Source = None, worth: Worth = False, as_json: Json = False) -> None:
    """Check a saved solution again, against its problem file."""
    from dmoc.structure.front import verify

    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        solution = attached(file, source)
        verdict = verify(solution)
    show_answer(solution, verdict, as_json, stopped=NOT_SOLVED, with_worth=worth)


@app.command(epilog="Example: dmoc plot flight.nc --out flight.pdf")
def plot(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help=f"{SAVED}, the result of a sweep, or a point of it: map.nc:duration=12."
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Where to; the file's name with .png if not given.")] = None,
    source: Source = None,
    dark: pages_command.Dark = False,
) -> None:
    """Draw a saved solution, or the result of a sweep."""
    from dmoc.reports import words as report
    from dmoc.sweeps import data as sweep_data

    target = file.with_suffix(".png") if out is None else out
    if (chosen := pages_command.point_of(file, out)) is not None:
        solution, target = chosen
        pages_command.draw(solution, target, dark=dark)
    elif sweep_data.is_sweep(file):
        from dmoc.charts.sweep import save_sweep

        writable(target, drawn=True)
        save_sweep(sweep_data.read_sweep(file), target, dark=dark)
    else:
        pages_command.drawable(target)
        pages_command.draw(seen(file, source), target, dark=dark)
    report.console().print(f"wrote {target}")


@app.command(epilog="Example: dmoc animate flight.nc --out flight.mp4")
def animate(
    file: File,
    out: Annotated[Path | None, typer.Option(help="Where to; the file's name with .gif if not given.")] = None,
    frames: Annotated[int, typer.Option(help="Number of frames, 2 to 200; 20 are shown a second.")] = 80,
    source: Source = None,
    dark: pages_command.Dark = False,
) -> None:
    """Write a moving picture of a saved solution."""
    import dmoc
    from dmoc.reports import words as report

    target = file.with_suffix(".gif") if out is None else out
    writable(target, moving=True)
    dmoc.animate(seen(file, source), target, frames, dark)
    report.console().print(f"wrote {target}")


@app.command(epilog="Example: dmoc export free_flyer planner --steps 40 --hold")
def export(
    name: Name,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A new folder, or one of an earlier export.")],
    order: Order = None,
    steps: Steps = None,
    hold: Hold = False,
    settings: Settings = None,
    guess: Annotated[
        Path | None, typer.Option(help="A saved solution for the solver to start from; best for a mission.")
    ] = None,
    no_c: Annotated[bool, switch("--no-c", help="Leave out the C code.")] = False,
) -> None:
    """Write integrator, residual and solver of a problem as CasADi files and C code.

    They need CasADi alone, the C code nothing. A .casadi file is code: load only those you trust.
    """
    import json

    import dmoc
    from dmoc.reports import words as report

    _, problem = problem_of(name, settings)
    start = None if guess is None else dmoc.load(guess)
    paths = dmoc.export(problem, folder, order, steps, hold, not no_c, start)
    functions = json.loads(paths[0].read_text())["functions"]
    console = report.console()
    console.print(report.pairs([(name, entry["words"]) for name, entry in functions.items()]))
    console.print(f"wrote {len(paths)} files to {folder}; README.md there says how to use them")


# Verbs that take more than a page have files of their own.
for _verb, _example in (
    (pages_command.doctor, "dmoc doctor"),
    (pages_command.report, "dmoc report flight.nc --out flight.html"),
    (paths_command.simulate, "dmoc simulate orbit_raise --steps 2000 --order 4 --plot coast.png"),
    (paths_command.convert, "dmoc convert flight.nc --to csv"),
    (
        flights_command.disperse,
        "dmoc disperse flight.nc --start 0.01,0.001 --force 0.01 --pointing 0.01 --plot flights.png",
    ),
    (
        flights_command.identify,
        "dmoc identify free_flyer --unknown mass=10 --unknown drag=1 --unknown offset --noise 0.001",
    ),
    (sweep_command.sweep, "dmoc sweep orbit_raise --vary duration=8:20:25 --out map.nc"),
    (study_command.study, "dmoc study orbit_raise --against scripts/alternatives.py --plot study.png"),
    (stability_command.stability, "dmoc stability --revolutions 1000 --plot stability.png"),
):
    app.command(epilog=f"Example: {_example}")(_verb)


def _only(verb: str) -> typer.Typer:
    """The command line with this verb alone, if it is one: to read the options of all others takes time."""
    alone, every = copy(app), app.registered_commands
    alone.registered_commands = [
        one for one in every if verb in (one.name, getattr(one.callback, "__name__", None))
    ] or every
    return alone


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line; every bad input becomes one line on stderr and exit code 2."""
    from dmoc.scene.problem_file import users_line

    given = (sys.argv[1:] if arguments is None else arguments) or ["--help"]
    try:
        code = _only(given[0])(args=given, standalone_mode=False) or SOLVED
    except USAGE_ERROR as error:
        verb = f"{error.ctx.info_name} " if error.ctx and error.ctx.parent else ""
        fail(f"error: {error.format_message()} (dmoc {verb}--help)", BAD_INPUT)
    except (ValueError, OSError) as error:
        fail(f"error: {error}{users_line(error)}", BAD_INPUT)
    except Exception as error:
        place = users_line(error)
        if not place:
            raise
        fail(f"error: {type(error).__name__}: {error}{place}", BAD_INPUT)
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    if code == INTERRUPTED:
        fail("interrupted", INTERRUPTED)
    sys.exit(code)


if __name__ == "__main__":
    main()
