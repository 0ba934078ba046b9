"""What a person sees: a scene in words, the ladder of meshes, the table of checks."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from dmoc.basics.digits import lasting
from dmoc.reports.ends import (
    body_words,
    dates_rows,
    dates_words,
    final_rows,
    goal_words,
    met_words,
    start_words,
)
from dmoc.reports.layout import console, effect_words, pairs, plain_table, value_words
from dmoc.reports.verdict import verdict_words

if TYPE_CHECKING:
    from dmoc.checks.verification import Report
    from dmoc.motion.march import Trajectory
    from dmoc.nlp.solving import NLP
    from dmoc.results.solution import Solution
    from dmoc.scene.problem import TransferProblem
    from dmoc.scene.problem_file import Parameter

# The live line is drawn again after this time at the earliest [s]: drawing must not slow the solve down.
REDRAW = 0.1


def scene(problem: TransferProblem) -> RenderableType:
    """What is to be done, in words."""
    if hasattr(problem, "plan"):
        from dmoc.reports.missions import mission_scene

        return mission_scene(problem)  # type: ignore[arg-type]
    if hasattr(problem, "together"):
        from dmoc.reports.teams import team_scene

        return team_scene(problem, scene)
    shortest, longest = problem.duration_bounds
    free = f"free between {lasting(shortest, 6)} and {lasting(longest, 6)}"
    return pairs(
        [
            ("body", body_words(problem)),
            ("start", start_words(problem)),
            ("goal", goal_words(problem)),
            ("duration", free if problem.free_duration else lasting(shortest, 6)),
            ("effects", [effect_words(effect) for effect in problem.effects] or "none: the body is free"),
            ("actuator", problem.actuator.words()),
            ("objective", _objective(problem)),
            *dates_rows(problem),
            *([("links", [link.words() for link in problem.links])] if problem.links else []),
            ("constraints", [f"{one.on} {one.words()}".strip() for one in problem.constraints] or "none"),
        ]
    )


def _objective(problem: TransferProblem) -> str:
    """What is minimised, in the unit that it has with the actuator."""
    objective = problem.objective
    unit = objective.unit_with(problem.actuator)
    return objective.words().rstrip(".").replace(f"[{objective.unit}]", f"[{unit}]")


def prose(docstring: str) -> str:
    """A docstring whose paragraphs may be broken anew; indented lines stay as they are."""
    return re.sub(r"(?<=\S)\n(?=\S)", " ", docstring)


def parameters(entries: Sequence[Parameter]) -> RenderableType:
    """The parameters of a problem file with defaults and units."""
    table = plain_table(["parameter", "default", "unit", "what it is"])
    for entry in entries:
        default = value_words(entry.default) if not isinstance(entry.default, str) else repr(entry.default)
        table.add_row(entry.name, default, entry.unit, entry.description)
    return table


def sizes(nlp: NLP) -> RenderableType:
    """The size of the NLP."""
    jacobian, hessian = nlp.assembly.jacobian.nnz_out(1), nlp.assembly.hessian.nnz_out(0)
    mesh = f"order {nlp.scheme.order}, {len(nlp.mesh) - 1} steps"
    counts = f"{nlp.columns.size} unknowns, {nlp.rows.size} rows"
    entries = f"nonzeros: {jacobian} in the Jacobian, {hessian} in the Hessian's upper triangle"
    return pairs([("NLP", [f"{counts} ({mesh})", entries])])


def ladder(solution: Solution) -> RenderableType:
    """The meshes on the way, coarse to fine."""
    objective = f"objective [{solution.provenance.objective_unit}]"
    table = plain_table(
        ["order", "steps", "iterations", objective, "build [s]", "solve [s]", "status"], numbers=slice(6)
    )
    asked = any(level.question for level in solution.ladder)
    if asked:
        table.add_column("what was asked")
    estimated = any(level.error is not None for level in solution.ladder)
    if estimated:
        table.add_column("error [-]")
    for level in solution.ladder:
        row = [str(number) for number in (level.order, level.steps, level.iterations)]
        # The objective of another question has another unit, and would be read as one of the problem.
        cost = "" if level.question else f"{level.objective:.8g}"
        row += [cost, f"{level.build_s:.2f}", f"{level.solve_s:.2f}", level.status]
        row += [level.question] * asked
        error = "" if level.error is None else f"{level.error:.1e}"
        table.add_row(*row, *([error] if estimated else []))
    # on a narrow terminal the headers are broken into lines, not the numbers
    for column in table.columns:
        column.min_width = max((len(str(cell)) for cell in column.cells), default=0)
    return table


def checks(report: Report) -> RenderableType:
    """The checks, one line each."""
    table = plain_table(["check", "value", "limit", "unit", "verdict", "note"])
    for check in report.checks:
        if check.value is None:
            verdict = Text("does not apply", "dim")
        else:
            verdict = Text("holds", "green") if check.ok else Text("FAILS", "bold red")
        value, limit = ("-" if number is None else f"{number:.4g}" for number in (check.value, check.limit))
        table.add_row(check.name, value, limit, check.unit, verdict, check.note)
    return table


def answer(
    solution: Solution,
    report: Report,
    quiet: bool = False,
    written: Sequence[Path] = (),
    more: Sequence[RenderableType] = (),
) -> RenderableType:
    """What a solve that succeeded shows: ladder, checks, `more`, files, and one line that sums it up."""
    total = solution.build_s + solution.solve_s + report.seconds
    found = f"Solved, a local optimum: {figures(solution)} ({solution.iterations} iterations, {total:.1f} s). "
    last = Text(found, "green" if solution.success and report.ok else "yellow")
    if not solution.success:
        last.append(f"{solution.status.capitalize()}: {solution.message}. ")
    last.append(verdict_words(solution, report))
    for warning in solution.warnings:
        last.append(f" Note that {warning}.", "yellow")
    if quiet:
        return last
    verdicts = Text("Checks of the answer", "bold"), checks(report), Text(), *_facts(solution)
    above = [*_ladder_lines(solution), *_estimate(solution), Text(), *_legs(solution)]
    return Group(*above, *verdicts, *more, *_file_lines(written), last)


def failure(solution: Solution, quiet: bool = False, written: Sequence[Path] = ()) -> RenderableType:
    """What a solve that failed shows: the worst rows by name, and what to try."""
    head = Text(f"Not solved: {solution.status} after {solution.iterations} iterations.", "bold red")
    stopped = solution.status == "stopped"
    advice = Text("The best iterate is kept." if stopped else f"What to try: {solution.message}.")
    if quiet:
        return Group(head, advice)
    worst = plain_table(["worst rows of the last iterate", "violation"])
    # `solution.worst` is ordered by scaled size, in which rows of different units compare: units keep the order
    # in which they come, and rows of one unit are shown largest first
    units = [unit for _, _, unit in solution.worst]
    for name, violation, unit in sorted(solution.worst, key=lambda row: (units.index(row[2]), -row[1])):
        worst.add_row(name, f"{violation:.2e} {unit}")
    return Group(*_ladder_lines(solution), Text(), worst, Text(), *_file_lines(written), head, advice)


def motion(trajectory: Trajectory, problem: TransferProblem, coast: bool) -> RenderableType:
    """The end of a simulation, and how much its energy changed on the way."""
    from dmoc.reports.as_json import energy_change

    energy = trajectory.energy
    most, kept = energy_change(trajectory, problem, coast)
    scale = float(abs(energy).max()) if kept else 0.0
    share = f", {most / scale:.1e} of it" if scale else ""
    rows = [
        ("final time", lasting(trajectory.time[-1], 10)),
        *final_rows(trajectory),
        ("final mass", f"{trajectory.mass[-1]:.10g} kg"),
        ("energy", f"{energy[0]:.10g} J/kg at the start, {energy[-1]:.10g} J/kg at the end"),
        ("energy drift" if kept else "energy change", f"{most:.2e} J/kg at most{share}"),
    ]
    return pairs(rows)


def figures(solution: Solution) -> str:
    """Such as `effort 0.075 N^2 s, duration 26 s`."""
    problem = solution.require_problem()
    name, unit = problem.objective.label, solution.provenance.objective_unit
    cost = lasting(solution.objective) if unit == "s" else f"{solution.objective:.8g} {unit}".rstrip()
    parts = [f"{name} {cost}"]
    if name != "time":
        parts.append(f"duration {lasting(solution.duration)}")
    if name != "final mass" and abs(solution.final_mass - problem.mass) > 1e-9 * problem.mass:
        parts.append(f"final mass {solution.final_mass:.8g} kg")
    return ", ".join(filter(None, [*parts, met_words(solution), dates_words(solution)]))


@contextmanager
def live_line(unit: str) -> Iterator[Callable | None]:
    """A `progress` for `solve` that keeps one line of the terminal up to date; None without a terminal."""
    screen = console(stderr=True)
    if not screen.is_terminal:
        yield None
        return
    from rich.live import Live

    drawn = -math.inf
    with Live(Text("building"), console=screen, auto_refresh=False, transient=True) as live:

        def progress(
            order: int, steps: int, iteration: int, objective: float, row: str, violation: float
        ) -> bool:
            nonlocal drawn
            if time.monotonic() - drawn > REDRAW:
                drawn = time.monotonic()
                mesh = f"order {order}, {steps} steps, iteration {iteration}"
                worst = f", worst {row} {violation:.1e}" if row else ""
                line = f"{mesh}: objective {objective:.6g} {unit}{worst}"
                live.update(Text(line, no_wrap=True, overflow="ellipsis"), refresh=True)
            return False

        yield progress


def _legs(solution: Any) -> list[RenderableType]:
    """The legs and impulses of a mission, or the bodies of a team; nothing of a transfer."""
    if hasattr(solution, "members"):
        from dmoc.reports.teams import bodies_table

        return [bodies_table(solution), Text()]
    if not hasattr(solution, "impulses"):
        return []
    from dmoc.reports.missions import legs_table

    return [legs_table(solution), Text()]


def _facts(solution: Solution) -> list[RenderableType]:
    """What users ask of an answer, in few lines."""
    # It asks the scene, and so loads CasADi, which `dmoc --help` does without.
    from dmoc.answers.facts import facts_of

    lines = facts_of(solution).lines()
    return [Text("The answer in numbers", "bold"), pairs(lines), Text()] if lines else []


def _ladder_lines(solution: Solution) -> list[RenderableType]:
    return [Text("Meshes, coarse to fine", "bold"), ladder(solution)]


def _estimate(solution: Solution) -> list[Text]:
    """The estimated error and why this mesh, where a tolerance was asked for."""
    if solution.error is None:
        return []
    found, asked = solution.error.largest, solution.tolerance or 0.0
    words = f"estimated relative error {found:.1e}, asked for {asked:g}"
    return [Text(f"{solution.reason}; {words}")]


def _file_lines(written: Sequence[Path]) -> list[Text]:
    return [Text(f"wrote {path}") for path in written]
