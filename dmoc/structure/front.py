"""What a user calls: it takes a transfer, a mission or a team, and does for each what is made for it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from dmoc.basics.arguments import short
from dmoc.basics.memory import unchanged
from dmoc.checks import verification
from dmoc.checks.verification import Report
from dmoc.ipopt.run import one_clock
from dmoc.nlp.solving import Progress
from dmoc.results import solution as transfers
from dmoc.results.solution import Solution
from dmoc.scene.named import attached_as_named
from dmoc.scene.problem import TransferProblem
from dmoc.solver import solve as transfer_solver

# What missions and teams are made of is loaded for them alone.
if TYPE_CHECKING:
    from dmoc.missions.solution import MissionSolution
    from dmoc.scene.mission import Mission
    from dmoc.scene.team import Team
    from dmoc.teams.solution import TeamSolution

# A file of a mission says that it has this format.
MISSION = "dmoc mission"
# A file of a team says that it has this one.
TEAM = "dmoc team"
# A file of a team of missions says that it has this one.
PHASED = "dmoc team of missions"
# Below this tolerance [-] structure pays by itself: steps cut at switches reach it in seconds, and hardly more.
TIGHT = 1e-5
# With a free duration it pays up to this one [-]: paths that differ in it cost the same, and steps are cut for
# minutes where legs take seconds.
TIGHT_IF_FREE = 1e-4


@overload
def solve(
    problem: TransferProblem,
    order: int | None = ...,
    steps: int | None = ...,
    tol: None = ...,
    hold: bool = ...,
    mesh: Any = ...,
    guess: Any = ...,
    options: dict[str, Any] | None = ...,
    progress: Progress | None = ...,
    compiled: bool = ...,
    time_limit: float | None = ...,
    *,
    structure: Literal[False] | None = ...,
    impulses: None = ...,
) -> Solution: ...


@overload
def solve(
    problem: TransferProblem,
    order: int | None = ...,
    steps: int | None = ...,
    tol: float | None = ...,
    hold: bool = ...,
    mesh: Any = ...,
    guess: Any = ...,
    options: dict[str, Any] | None = ...,
    progress: Progress | None = ...,
    compiled: bool = ...,
    time_limit: float | None = ...,
    *,
    structure: Literal[False],
    impulses: None = ...,
) -> Solution: ...


@overload
def solve(
    problem: TransferProblem | Mission | Team,
    order: int | None = ...,
    steps: int | None = ...,
    tol: float | None = ...,
    hold: bool = ...,
    mesh: Any = ...,
    guess: Any = ...,
    options: dict[str, Any] | None = ...,
    progress: Progress | None = ...,
    compiled: bool = ...,
    time_limit: float | None = ...,
    *,
    structure: bool | None = ...,
    impulses: str | None = ...,
) -> Any: ...


@unchanged()
@one_clock()
def solve(
    problem: TransferProblem | Mission | Team,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
    compiled: bool = False,
    time_limit: float | None = None,
    *,
    structure: bool | None = None,
    impulses: str | None = None,
) -> Any:
    """Solve a transfer problem, a mission or a team, coarse to fine.

    With `structure=True` a transfer is solved by its structure: the burns, coasts, singular arcs, touches of
    zones and ways along limits of a coarse answer become the legs of a mission with free ends, in each of which
    nothing switches, so that the full order of the scheme is had. `order` and `steps` are then those of the
    coarse answer. The answer is a MissionSolution; where that does not succeed, or there is one arc alone, it
    is as without. Where a tolerance below 1e-5 is all that is asked for, and an engine, a zone or a limited
    force may switch, this is tried by itself, and for a switched engine in a free time up to a tolerance of
    1e-4; not with `structure=False`.

    Parameters
    ----------
    problem : TransferProblem, Mission or Team
    order : int
        2 (the default, equation (16)), 4, 6 or 8. Where the guess passes so near an attractor that the
        motion there is five times as fast as elsewhere, steps are equal angles, not equal times, and
        the default is 4; from three revolutions on it is 6. For a body that turns it is 4, and so it is in
        least time for an engine that burns.
    steps : int
        Steps of the last mesh; if not given 400, 100, 50, 32 at orders 2, 4, 6, 8, and over many
        revolutions as many as these need. Or `mesh`: the step ends as increasing fractions 0..1. Of a
        mission the order is 6, and the steps are those of each leg; of a team they are 4 and 30, the mesh is
        one for all bodies, and steps in which two of them touch are cut.
    tol : float
        Relative error [-] of path and objective to reach instead: mesh, and the order if it is not
        given, follow from it; `steps` is then where to begin.
    hold : bool
        Forces constant over each step.
    guess
        Overrides the problem's own guess: function of time, (times, positions), (times, positions, controls),
        a DiscretePath or a Solution. If the answer costs far more than what the program's own guess leads to
        on a coarse mesh, a warning says so; a DiscretePath or a Solution of this process is not compared.
    options : dict
        CasADi `nlpsol` options, for example {"ipopt.max_iter": 50}.
    progress : callable
        Called every iteration with (order, steps, iteration, objective, row, violation): the worst
        violated row by name and its scaled size. Return True to stop; an exception
        that it raises ends the solve and is raised by it.
    compiled : bool
        Evaluate the functions of nodes and steps as machine code. The C compiler takes a second or two
        once for a scene and order, then the library is kept (`dmoc.assembly.compiled`); it pays in scenes with
        several effects and in repeated solves. Without a compiler nothing changes.
    time_limit : float
        Seconds after which the solve ends, at the next iteration, with the answer on the last mesh that was
        solved: its status is then "time limit", and it is no success.

    structure : bool, optional
        Of a transfer, as above.
    impulses : "auto", optional
        Of a mission with impulses: as many as the primer vector asks for, none that is zero.

    Returns
    -------
    Solution, MissionSolution or TeamSolution
        Whether it succeeded or not; `raise_for_status()` raises if not.

    Raises
    ------
    ValueError
        If an argument has no meaning for this problem.
    """
    stated: Any = getattr(problem, "alone", None) or problem
    rest = options, progress, compiled, time_limit
    if impulses not in (None, "auto"):
        raise ValueError(f"impulses must be 'auto' or not given; got {short(impulses)}")
    if hasattr(stated, "together"):
        if structure or impulses is not None:
            raise ValueError("structure and impulses are of one transfer or mission; a dmoc.Team has neither")
        if stated.phased:
            from dmoc.phases.climb import solve_phased

            return solve_phased(stated, order, steps, tol, hold, mesh, guess, *rest)
        from dmoc.teams.climb import solve_team

        return solve_team(stated, order, steps, tol, hold, mesh, guess, *rest)
    if not hasattr(stated, "joints"):
        if impulses is not None:
            raise ValueError("impulses are those of a dmoc.Mission; a transfer has none")
        found = None
        if structure is None:
            structure = _pays(stated, (order, steps, mesh), tol, hold)
        if structure:
            found = _by_structure(stated, order, steps, tol, hold, mesh, guess, rest)
        return found or transfer_solver.solve(stated, order, steps, tol, hold, mesh, guess, *rest)
    from dmoc.missions.climb import solve_mission

    answer = solve_mission(stated, order, steps, tol, hold, mesh, guess, *rest)
    if impulses is None:
        return answer
    from dmoc.structure.impulses import with_best_impulses

    def again(mission: Mission, path: Any) -> MissionSolution:
        return solve_mission(mission, order, steps, tol, hold, None, path, *rest)

    return with_best_impulses(answer, again)


def _pays(problem: Any, chosen: tuple, tol: Any, hold: bool) -> bool:
    """Whether structure is tried without being asked for."""
    if (
        hold is not False
        or any(part is not None for part in chosen)
        or not (isinstance(tol, float) and 0 < tol <= TIGHT_IF_FREE)
        or not (tol < TIGHT or getattr(problem, "free_duration", False))
    ):
        return False
    from dmoc.structure.arcs import can_be_parted, has_switches, is_switched

    return has_switches(problem) if tol < TIGHT else is_switched(problem) and can_be_parted(problem)


def _by_structure(
    problem: Any, order: Any, steps: Any, tol: Any, hold: bool, mesh: Any, guess: Any, rest: tuple
) -> Any:
    from dmoc.structure.solve import solve_by_structure

    if hold or mesh is not None:
        raise ValueError(
            "with structure=True forces are not held and meshes are chosen: give neither hold nor mesh"
        )
    more = dict(zip(("options", "progress", "compiled", "time_limit"), rest, strict=True))

    def otherwise() -> Solution:
        return transfer_solver.solve(problem, order, steps, tol, False, None, guess, *rest)

    return solve_by_structure(problem, order, steps, tol, otherwise, guess=guess, **more)


def verify(
    solution: Solution | MissionSolution | TeamSolution,
    problem: TransferProblem | Mission | Team | None = None,
    more: Sequence[Callable] = (),
) -> Report:
    if problem is None and getattr(solution, "problem", solution) is None:
        solution = attached_as_named(solution)
    if hasattr(solution, "joints"):
        from dmoc.phases.checks import verify_phased

        return verify_phased(solution, problem, more)  # type: ignore[arg-type]
    if hasattr(solution, "members"):
        from dmoc.teams.checks import verify_team

        return verify_team(solution, problem, more)  # type: ignore[arg-type]
    if not hasattr(solution, "impulses"):
        return verification.verify(solution, problem, more)  # type: ignore[arg-type]
    from dmoc.missions.checks import verify_mission

    return verify_mission(solution, problem, more)  # type: ignore[arg-type]


verify.__doc__ = (verification.verify.__doc__ or "").replace(
    "if it is not the solution's own.",
    "if it is not the solution's own. One that was loaded finds the problem file that it names, as long as\n"
    "        that is, to the last letter, the one it was made from.",
)


def load(path: str | os.PathLike) -> Any:
    from dmoc.results.netcdf import as_path, format_of

    kind = format_of(path) if as_path(path).is_file() else None
    if kind == TEAM:
        from dmoc.teams.solution import read_team

        return read_team(path)
    if kind == PHASED:
        from dmoc.phases.solution import read_phased

        return read_phased(path)
    if kind != MISSION:
        return transfers.load(path)
    from dmoc.missions.solution import read_mission
    from dmoc.structure.solution import as_found

    return as_found(read_mission(path))


load.__doc__ = transfers.load.__doc__
