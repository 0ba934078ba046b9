"""`dmoc disperse` and `dmoc identify`: flights with errors, and what a measured flight tells."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dmoc.cli.options import (
    NOT_SOLVED,
    File,
    Json,
    Settings,
    Source,
    attached,
    ends_at_once,
    problem_of,
    switch,
    writable,
)
from dmoc.cli.pages import Dark

# Everything else is imported where it is used: `dmoc --help` answers at once.
if TYPE_CHECKING:
    from dmoc.identification.estimate import Estimate

# What can be asked for without a scene, what it is thought to be, and whether it has an entry an axis.
ALWAYS = {
    "mass": (10.0, False),
    "drag": (1.0, False),
    "offset": (0.0, True),
    "strength": (1.0, False),
    "turn": (0.0, False),
    "delay": (0.0, False),
    "inertia": (0.1, True),
}


def disperse(
    file: File,
    start: Annotated[
        str,
        typer.Option(
            metavar="A,B",
            help="Standard deviations at the start: of the position in m, of the velocity in m/s.",
        ),
    ] = "0,0",
    force: Annotated[float, typer.Option(help="Standard deviation of the force: 0.01 is 1 %.")] = 0.0,
    pointing: Annotated[float, typer.Option(help="Standard deviation of its direction, in rad.")] = 0.0,
    mass: Annotated[float, typer.Option(help="Standard deviation of the mass: 0.01 is 1 %.")] = 0.0,
    force_noise: Annotated[
        float, typer.Option(help="Standard deviation of a force in N, another one in each step.")
    ] = 0.0,
    feedback: Annotated[
        bool, switch("--feedback", help="Let the force answer how far a flight is off the plan.")
    ] = False,
    samples: Annotated[int, typer.Option(help="Number of flights, at least 2.")] = 1000,
    seed: Annotated[int, typer.Option(help="The same seed gives the same flights.")] = 0,
    plot: Annotated[Path | None, typer.Option(help="Draw the flights here (png, pdf or svg).")] = None,
    dark: Dark = False,
    source: Source = None,
    as_json: Json = False,
) -> None:
    """Fly a saved solution many times with errors, and say how far it comes off and which limits it breaks."""
    import dmoc

    writable(plot, drawn=True)
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        solution = attached(file, source)
        found = dmoc.disperse(
            solution, _pair(start), force, pointing, mass, samples, seed, force_noise, feedback
        )
    if plot is not None:
        from dmoc.charts.dispersion import dispersion_figure
        from dmoc.charts.study import save_page

        save_page(dispersion_figure(found, solution), plot, dark=dark)
    if as_json:
        from dmoc.reports import as_json as report

        print(report.as_text(report.dispersion_object(found, solution)))
        return
    from dmoc.reports.flights import dispersion_report
    from dmoc.reports.layout import console

    console().print(dispersion_report(found, solution))
    if plot is not None:
        console().print(f"wrote {plot}")


def _pair(text: str) -> tuple[float, float]:
    """Two numbers with a comma between them."""
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        raise ValueError(
            f"--start must be two numbers A,B: position [m] and velocity [m/s]; got {text!r}"
        ) from None
    return first, second


def identify(
    flight: Annotated[
        str,
        typer.Argument(
            metavar="FLIGHT", help="A CSV table of a flight, or the name of one that comes with dmoc."
        ),
    ],
    unknown: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE,SIGMA",
            help="A number to find: mass, drag, offset, strength, turn, delay, inertia, with --scene tilt and "
            "exhaust_velocity, or one of an effect. What it is thought to be, and how surely, may be left out; "
            "repeat for more.",
        ),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(metavar="PROBLEM", help="A problem whose mass, effects and actuator are the body's."),
    ] = None,
    settings: Settings = None,
    mass: Annotated[float | None, typer.Option(help="The mass in kg, if it is known.")] = None,
    noise: Annotated[
        float | None, typer.Option(help="Standard deviation of positions in m; found if not given.")
    ] = None,
    force_noise: Annotated[float, typer.Option(help="That of forces in N, drawn anew each step.")] = 0.0,
    velocity_noise: Annotated[float | None, typer.Option(help="That of velocities in m/s.")] = None,
    attitude_noise: Annotated[
        float | None, typer.Option(help="That of attitudes in rad, where the body turns.")
    ] = None,
    rate_noise: Annotated[float | None, typer.Option(help="That of rates in rad/s.")] = None,
    order: Annotated[int, typer.Option(help="2, 4, 6 or 8, of the equations between samples.")] = 4,
    out: Annotated[Path | None, typer.Option(help="Write values and intervals here, as JSON.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the estimate here (png, pdf or svg).")] = None,
    dark: Dark = False,
    as_json: Json = False,
) -> None:
    """Find numbers of a body, such as its mass and drag, from a measured flight."""
    import dmoc

    writable(plot, drawn=True)
    writable(out)
    with redirect_stdout(sys.stderr if as_json else sys.stdout), ends_at_once():
        seen = dmoc.Flight.read(_file(flight))
        given = _given(
            seen, unknown or ["mass"], mass, None if scene is None else problem_of(scene, settings)[1]
        )
        sigmas: dict[str, Any] = {
            "velocity_noise": velocity_noise,
            "attitude_noise": attitude_noise,
            "rate_noise": rate_noise,
        }
        found = dmoc.identify(seen, **given, **sigmas, noise=noise, force_noise=force_noise, order=order)
    _show(found, as_json, out, plot, dark)
    if not found.success:
        raise typer.Exit(NOT_SOLVED)


def _show(found: Estimate, as_json: bool, out: Path | None, plot: Path | None, dark: bool) -> None:
    if out is not None:
        found.save(out)
    if plot is not None:
        found.plot(plot, dark)
    if as_json:
        from dmoc.reports.as_json import as_text

        print(as_text(found.as_object()))
        return
    from dmoc.reports.flights import estimate_report
    from dmoc.reports.layout import console

    console().print(estimate_report(found))
    for path in (out, plot):
        if path is not None:
            console().print(f"wrote {path}")


def _file(name: str) -> Path:
    """The table of a flight, by its path or by the name of one that comes with dmoc."""
    from dmoc.scene.problem_file import folders

    path = Path(name)
    if path.suffix or path.exists():
        if not path.is_file():
            raise ValueError(f"there is no flight {name}; give a CSV table")
        return path
    shipped = {file.stem: file for folder in reversed(folders()) for file in folder.glob("flights/*.csv")}
    if name not in shipped:
        raise ValueError(
            f"there is no flight {name!r}; give a CSV table, or one of {', '.join(sorted(shipped)) or 'none'}"
        )
    return shipped[name]


def _given(seen: Any, asked: list[str], mass: float | None, scene: Any) -> dict[str, Any]:
    """The arguments of `identify` that the options stand for."""
    from dmoc.basics.unknown import Unknown
    from dmoc.effects.atmosphere import LinearDrag
    from dmoc.identification.stated import with_unknown

    found: dict[str, Any] = {} if scene is None else _of_scene(scene)
    if mass is not None:
        found["mass"] = mass
    effects = list(found.get("effects", ()))
    for text in asked:
        name, value, sigma = _parsed(text)
        if name in ("tilt", "exhaust_velocity"):
            found |= _of_actuator(name, value, sigma, found)
        elif name in ALWAYS and not (name == "drag" and effects):
            begin, several = ALWAYS[name]
            begin = found[name] if name == "mass" and isinstance(found.get(name), float) else begin
            size = {"offset": seen.axes, "inertia": 3}.get(name, 1)
            if name == "turn" and seen.axes == 3:
                size, several = 3, True
            one = Unknown(begin if value is None else value, sigma)
            found[name] = (one,) * size if several else one
            if name == "inertia" and value is None and "inertia" in found and scene is not None:
                found[name] = Unknown(tuple(float(row[i]) for i, row in enumerate(scene.inertia)))
            if name == "drag":
                effects.append(LinearDrag(found.pop("drag")))
        else:
            effects = with_unknown(effects, name, value, sigma)
    return found | {"effects": effects}


def _of_actuator(name: str, value: float | None, sigma: float | None, found: dict[str, Any]) -> dict[str, Any]:
    """An unknown number of the actuator of a scene."""
    from dmoc.basics.unknown import Unknown, with_field

    actuator = found.get("actuator")
    if name == "tilt":
        return {"tilt": Unknown((value or 0.0,) * 2, sigma)}
    if actuator is None or not actuator.burns:
        raise ValueError("exhaust_velocity needs a --scene whose actuator burns propellant")
    begin = actuator.exhaust_velocity if value is None else value
    return {"actuator": with_field(actuator, name, Unknown(begin, sigma))}


def _of_scene(problem: Any) -> dict[str, Any]:
    """What a problem says of its body."""
    if hasattr(problem, "plan") or hasattr(problem, "members"):
        raise ValueError("--scene takes a transfer of one body, not a mission or a team")
    if problem.system is not None:
        raise ValueError("--scene takes a transfer of one body; this problem has several")
    known = {"mass": problem.mass, "effects": problem.effects}
    if problem.actuator.burns:
        known["actuator"] = problem.actuator
    if problem.inertia is not None:
        known |= {"inertia": problem.inertia, "actuator": problem.actuator}
    return known


def _parsed(text: str) -> tuple[str, float | None, float | None]:
    name, stated, numbers = text.partition("=")
    if not stated:
        return name.strip(), None, None
    try:
        parts = [float(part) for part in numbers.split(",")]
    except ValueError:
        parts = []
    if len(parts) not in (1, 2):
        raise ValueError(f"--unknown must be NAME, NAME=VALUE or NAME=VALUE,SIGMA; got {text!r}")
    return name.strip(), parts[0], parts[1] if len(parts) == 2 else None
