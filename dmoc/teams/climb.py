"""Solve a team, coarse to fine, on one mesh for all its bodies."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from dmoc.chains.path import cold
from dmoc.meshes.cut_off import CutOff
from dmoc.missions.attempt import Attempt, cost_scale
from dmoc.missions.climb import Climb
from dmoc.missions.meshes import mesh_around
from dmoc.missions.sharper import onto_magnitude
from dmoc.motion.mesh import uniform_mesh
from dmoc.nlp.transcription import check_mesh
from dmoc.parts.objectives import Effort
from dmoc.results.facts import Error
from dmoc.scene.team import Team
from dmoc.solver.ladder import Ladder
from dmoc.solver.solve import check_numerics
from dmoc.teams.answer import answered
from dmoc.teams.cuts import cut_off_between, leapt
from dmoc.teams.guess import aimed, bent_apart, guessed, other_sides
from dmoc.teams.path import TeamPath
from dmoc.teams.program import TeamProgram
from dmoc.teams.solution import TeamSolution

# A team has this order if none is asked for: where bodies touch their distance the forces have kinks, from
# which orders above it gain little.
ORDER = 4
# It has this many steps at each order, if no number is asked for.
STEPS = {2: 120, 4: 30, 6: 20, 8: 15}
# Steps in which two bodies come too near between nodes are cut in two at most so many times.
MOST_CUT = 4
# Where they leap through each other between nodes after that, so many other ways round are tried.
MOST_SIDES = 4
# Steps in which two bodies touch are cut in two so many times.
SHARPENED = 3


class TeamClimb(Climb):
    """The attempts at one team, in their order."""

    program: Any = TeamProgram
    answered: Any = answered

    def prepared(self, first: Attempt, path: Any) -> Attempt:
        return onto_magnitude(self, first)

    def finished(self, first: Attempt, path: Any, tol: float | None) -> tuple[Attempt, Error | None, bool]:
        found, error, met = self.refined(first, tol)
        found = self.unleapt(found) if met else found
        if found.solved and not path.warm:
            found = self.round_the_other_way(found, path)
        return (self.sharpened(found) if tol is None else found), error, met

    def _error(self, attempt: Attempt, changes: list[float], summed: float) -> Error:
        """As of a mission; where two bodies touch, the objective nears its limit by leaps.

        It errs by about the square of the time from the touch to a node, which is anything up to a step. So a
        small change says little if the one before, over four as the square of half the step, was larger.
        """
        error = super()._error(attempt, changes, summed)
        path: Any = attempt.path
        if not path.touches:
            return error
        seen = changes[-1], *[0.25 * change for change in changes[-2:-1]]
        error = replace(error, objective=max(error.objective, *seen))
        return self.cut_off_between(path).of(cost_scale(attempt)).counted(error)

    def cut_off_between(self, path: Any) -> CutOff:
        """What bodies cut off the distances that they keep, between the nodes."""
        return cut_off_between(self.mission, path)

    def cut_at_leaps(self, path: Any) -> Any:
        """A path on steps cut in two in which bodies come too near between nodes; None if there are none."""
        steps = leapt(self.mission, path)
        return path.cut(path.mesh, steps) if len(steps) else None

    def straight(self, path: Any) -> Any:
        """The guess on the mesh of a path that is not bent."""
        return guessed(self.mission, (path.mesh, path.order, path.legs[0].hold), bent=False)

    def unleapt(self, attempt: Attempt) -> Attempt:
        """The answer on a mesh on which no two bodies come too near between nodes, if that is found."""
        for _ in range(MOST_CUT):
            if (onto := self.cut_at_leaps(attempt.path)) is None:
                break
            found = self.attempt(onto, carried=True)
            if not found.solved and found.answer.status != "stopped":
                found = self.attempt(cold(onto), carried=True)
            if not found.solved:
                return found if found.answer.status == "stopped" else attempt
            attempt = found
        return attempt

    def otherwise(self, attempt: Attempt, path: TeamPath) -> Attempt:
        """An answer from paths that every body would take by itself, if all of them have one, bent apart."""
        team, legs = self.mission, []
        for problem, leg in zip(aimed(team.members, team.meetings(), path.duration), path.legs, strict=True):
            if problem.free_duration:
                # All of them must last equally long.
                problem = replace(problem, duration=path.duration, objective=Effort())
            ladder = Ladder(problem, self.options, compiled=self.compiled)
            ladder.interrupt = self.interrupt
            rung = ladder.climb_to(leg, leg)
            if not rung.solved:
                return attempt
            legs.append(replace(rung.path, multipliers={}))
        tried = self.from_guess(bent_apart(team, replace(path, legs=tuple(legs))))
        return tried if tried.solved else attempt

    def round_the_other_way(self, attempt: Attempt, path: Any) -> Attempt:
        """An answer on which bodies pass on other sides, where they leap through each other on this one."""
        team, answer = self.mission, attempt
        if self.cut_at_leaps(attempt.path) is None:
            return attempt
        straight = self.straight(path)
        for sides in islice(other_sides(team, straight), 1, MOST_SIDES):
            tried = self.from_guess(bent_apart(team, straight, sides))
            answer = self.unleapt(tried) if tried.solved else tried
            if answer.solved and self.cut_at_leaps(answer.path) is None:
                return answer
            if self.interrupt.seen:
                break
        return attempt

    def sharpened(self, attempt: Attempt) -> Attempt:
        """The answer on a mesh that is finer where two bodies touch, if that is found."""
        for _ in range(SHARPENED):
            path: Any = attempt.path
            if not attempt.solved or not path.touches:
                break
            found = self.attempt(path.cut(path.mesh, path.touched()), carried=True)
            if not found.solved:
                return found if found.answer.status == "stopped" else attempt
            attempt = found
        return attempt


def solve_team(
    team: Team,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    mesh: Any = None,
    guess: Any = None,
    options: dict[str, Any] | None = None,
    progress: Any = None,
    compiled: bool = False,
    time_limit: float | None = None,
) -> TeamSolution:
    """Solve a team; the arguments are those of `dmoc.solve`, and the mesh is one for all bodies."""
    check_numerics(order, steps, tol, hold, options, progress, time_limit)
    climb = TeamClimb(team, options, progress, compiled, time_limit)
    path = first_path(team, order, steps, hold, guess, mesh)
    return climb.solve(path, tol, steps is not None or mesh is not None)


def first_path(
    team: Team, order: int | None, steps: int | None, hold: bool, guess: Any = None, mesh: Any = None
) -> TeamPath:
    """The path to start from, on its first mesh."""
    given = team.guess if guess is None else guess
    given = getattr(given, "path", given)
    this = order or ORDER
    if isinstance(given, TeamPath):
        _check_fits(team, given)
        if order is None and steps is None and mesh is None:
            return given
        same = given.mesh if steps is None else uniform_mesh(steps)
        return given.onto([(same if mesh is None else check_mesh(None, mesh), order or given.order)])
    ends = uniform_mesh(steps or STEPS[this]) if mesh is None else check_mesh(None, mesh)
    path = guessed(team, (ends, this, hold), given)
    if mesh is not None:
        return path
    # Steps of equal angles for the body that needs most of them around an attractor.
    around = [
        mesh_around(problem, leg.place, leg.fractions, leg.duration, this, STEPS[this], steps)
        for problem, leg in zip(team.members, path.legs, strict=True)
    ]
    finest = max(around, key=len)
    return path if np.array_equal(finest, ends) else guessed(team, (finest, this, hold), given)


def _check_fits(team: Team, path: TeamPath) -> None:
    for name, problem, leg in zip(team.names, team.members, path.legs, strict=False):
        sizes = (leg.position.shape[1], leg.control.shape[1]), (problem.size, problem.controls)
        if sizes[0] != sizes[1]:
            raise ValueError(
                f"guess: {name} has {sizes[0][0]} coordinates and {sizes[0][1]} controls there, "
                f"and {sizes[1][0]} and {sizes[1][1]} in the team"
            )
    if len(team.members) != len(path.legs):
        raise ValueError(f"guess is of {len(path.legs)} bodies, and the team has {len(team.members)}")
