"""Refining an answer: how large its error is, where it arises, and the steps that bring it down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.meshes.cut_off import CutOff, cut_off
from dmoc.meshes.cuts import PARTS, SHORTEST, cut, cuts_of
from dmoc.motion.path import DiscretePath
from dmoc.results.estimate import (
    LEAST_FALL,
    change,
    estimate,
    estimate_at_once,
    local_errors,
    rounding_cost,
)
from dmoc.results.facts import Error, off_optimum
from dmoc.results.flown_cost import TINY
from dmoc.results.solution import NOT_MET, Solution
from dmoc.results.switches import burns_unpaid, corners, has_linear_controls, switches_in_words
from dmoc.rungs.rung import Rung, at_rest, unmet
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder
from dmoc.solver.mended import goal_missed

# Refinement ends on a mesh of more nodes than this, which bounds time and memory.
MOST_NODES = 200_000
# Refinement ends after this many meshes: steps at a switch have then come down to the shortest.
MOST_MESHES = 14
# The rounding of |F| may cost this part of the tolerance.
ROUNDING_SHARE = 0.5
# An attempt with |F| rounded less is given up after this many iterations: it takes 20 to 100 or leads nowhere.
MOST_SHARPENING = 200
# |F| is not rounded over less than this part of the largest thrust: its curvature there is one over that.
LEAST_ROUNDING = 1e-8
# Durations are equally good if a change by this part of them costs, to first order, at most the tolerance [-].
EQUALLY_GOOD = 0.1
# Where the cost is linear in controls and its optimum flat, an answer is held near that on the mesh before, by
# so many times the tolerance [-]: seven flat optima then met tolerances that none had met.
HELD = 10.0
# An answer is held by no more than this [-]: it would keep switches from their places.
MOST_HELD = 1e-3
# Paths cost the same if their costs differ by less than this part of the tolerance [-].
SAME_COST = 0.3
# Where the cost changes more than the path, and that falls by less than this factor from mesh to mesh [-],
# all steps are cut, and not those alone that make the error of the path.
SLOW = 2.0
# An optimum is flat if the cost changes by less than this times what the path changes from mesh to mesh [-].
FLAT = 0.03
# Costs below this part of the unit of cost are nothing [-]: a target may be met by a coast alone.
NOTHING = 1e-3
# A refinement of more iterations than this wanders: others take 20 to 90.
LONG = 100
# One that is not held ends after this many: then it is tried anew, and held.
LONGEST_FREE = 150
# A path of settled cost that still changes is held so many times as strongly on the next mesh [-].
TIGHTER = 10.0
# A mesh does no better if its change is more than this part of the one before [-]: estimates go up and down.
FALLING = 0.95
# What a user is told of paths that cost the same.
ALIKE = "; paths that differ by {:.1g} of the extent cost the same"
# After this many meshes that do no better the best one is the answer: steps have come down to rounding.
PATIENCE = 2


@dataclass(frozen=True)
class _Found:
    """An answer on one mesh, and its estimated error."""

    rung: Rung
    error: Error


class Refinement:
    """The meshes after the first, each a refinement of the one before, and the best answer so far."""

    def __init__(self, ladder: Ladder, tol: float, local: bool, reason: str):
        self.ladder, self.problem, self.tol = ladder, ladder.problem, tol
        self.local, self.reason, self.off = local, reason, off_optimum(tol)
        self.changes: list[tuple[float, float]] = []
        self.errors: dict[int, float] = {}
        self.best: _Found | None = None
        self.rounded, self.flat, self.lean, self.worse = 0.0, False, 0.0, 0
        self.linear = has_linear_controls(ladder.problem) and not burns_unpaid(ladder.problem)

    def of(self, rung: Rung, order: int, hold: bool) -> Solution:
        """Refine from a first answer until the tolerance is met or nothing is gained any more."""
        longest = np.diff(rung.nlp.mesh).max()
        if rung.pull > 0:
            self.lean = min(HELD * self.tol, MOST_HELD)
        while True:
            coarse, cost = rung.path, rung.level.objective
            parts, most = self._cuts(coarse, cost, longest)
            rung = self._refined(coarse.onto(cut(coarse.mesh, parts), order, hold))
            if not rung.solved or EQUALLY_GOOD * rung.gain > self.tol:
                if self.best is None or rung.stopped:
                    found = self.ladder.solution(rung, self.errors, tolerance=self.tol)
                    if not rung.solved:
                        return found
                    # A duration that was kept although another one costs less makes no answer.
                    return replace(found, success=False, status=NOT_MET, message=unmet(None, self.tol))
                return self.settled(f"{self.reason}; {len(rung.nlp.mesh) - 1} steps were given up")
            if not self.changes and rung.pull > self.off:
                rung = at_rest(self.ladder.try_on, rung, self.lean, self.tol)
            fine = rung.path
            now, least = (fine, rung.level.objective), NOTHING * rung.nlp.units.cost
            self.changes.append(change(self.problem, (coarse, cost), now, parts, least))
            self._hold_if_flat(rung)
            self._settle_if_alike(fine)
            if rung.pinned and not self.flat:
                self.flat = True
                self.reason += "; durations cost the same, one was kept"
            met = self._judge(rung, fine, most)
            if met and rung.pull > self.off:
                rung = self._released(rung)
                self.best = None if rung.pull <= self.off else self.best
                met = self._judge(rung, rung.path, most) and rung.pull <= self.off
            if met:
                self._sharpen(rung, most)
            if met or len(fine.position) > MOST_NODES or len(self.changes) == MOST_MESHES:
                return self.settled(self.reason)
            if self.worse == PATIENCE:
                return self.settled(f"{self.reason}; finer meshes did no better")

    def meets_at_once(self, rung: Rung) -> bool:
        """Whether an answer of a smooth problem meets the tolerance without a second mesh."""
        found = estimate_at_once(self.problem, self.ladder.dynamics, rung.path, rung.level.objective)
        self.errors[rung.number] = found.largest
        self.best = _Found(rung, found) if found.largest <= self.tol else None
        return self.best is not None

    def _refined(self, start: DiscretePath) -> Rung:
        """An answer on a finer mesh; where that wanders among paths that cost the same, one that is held."""
        if self.linear and not self.lean:
            rung = self.ladder.try_on(start, most=LONGEST_FREE, pinned=self.flat)
            if rung.solved or rung.stopped:
                return rung
            self.lean = min(HELD * self.tol, MOST_HELD)
        return self.ladder.refine_on(start, self.flat, self.lean)

    def _hold_if_flat(self, rung: Rung) -> None:
        """Hold the answers to come near the one before if the path changes and the cost does not."""
        moved, cost = self.changes[-1]
        wanders = len(self.changes) > 1 and LEAST_FALL * moved > self.changes[-2][0]
        flat = cost < FLAT * moved or wanders or rung.answer.iterations > LONG
        if self.linear and moved > self.tol and flat:
            tighter = TIGHTER * self.lean if wanders and cost < SAME_COST * self.tol else self.lean
            self.lean = max(tighter, min(HELD * self.tol, MOST_HELD))

    def _settle_if_alike(self, path: DiscretePath) -> None:
        """Where paths wander from mesh to mesh and cost the same, take one by how well it is flown.

        No mesh tells such paths apart, so that their changes are no errors of the mesh.
        """
        (before, first), (moved, cost) = self.changes[-2:] if len(self.changes) > 1 else ((0.0, 1.0),) * 2
        wanders = self.tol < moved and before < LEAST_FALL * moved
        if self.linear and wanders and max(first, cost) < SAME_COST * self.tol:
            self.changes[-1] = (goal_missed(self.ladder, path), cost)
            self.reason += ALIKE.format(moved)

    def _cuts(self, path: DiscretePath, objective: float, longest: float) -> tuple[np.ndarray, float]:
        """Into how many parts to cut each step, and by how much the error falls then at most."""
        parts, most = self._cuts_for_errors(path, objective, longest)
        return np.maximum(parts, self._past(path, objective).parts(self.tol)), most

    def _cuts_for_errors(
        self, path: DiscretePath, objective: float, longest: float
    ) -> tuple[np.ndarray, float]:
        """The same by the errors of the steps and where controls switch.

        Where a control jumps the error falls with the length of the step there alone.
        """
        if not self.local:
            return np.full(len(path.mesh) - 1, 2), 2.0
        wanted = max(longest / PARTS ** (len(self.changes) + 1), SHORTEST)
        errors = local_errors(self.ladder.dynamics, path, self.problem.start_time)
        places = corners(self.problem, path, objective)
        most = PARTS - 1.0 if len(places) else 2.0 ** (2 if path.hold else path.order)
        fall = max(self.changes[-2]) / max(*self.changes[-1], TINY) if len(self.changes) > 1 else np.inf
        slow = fall < SLOW and self.changes[-1][1] > self.changes[-1][0]
        return cuts_of(path, errors, places, wanted, 2 if slow else 1), most

    def _judge(self, rung: Rung, path: DiscretePath, most: float) -> bool:
        """Estimate the error of an answer and keep it if it is the best; whether it meets the tolerance.

        The cost of the rounding of |F| counts in the error, but not in whether the tolerance is met: no mesh
        brings it down.
        """
        found = estimate(self.problem, self.ladder.dynamics, path, rung.level.objective, self.changes, most)
        found = self._past(path, rung.level.objective, NOTHING * rung.nlp.units.cost).counted(found)
        met = found.largest <= self.tol
        rounded = rounding_cost(self.problem, path) / max(abs(rung.level.objective), TINY)
        found = replace(found, objective=found.objective + rounded)
        self.errors[rung.number] = found.largest
        if self.best is None or found.largest < self.best.error.largest:
            self.best, self.worse = _Found(rung, found), 0
        elif max(self.changes[-1]) > FALLING * max(self.changes[-2:][0]):
            self.worse += 1
        self.rounded = rounded
        return met

    def _past(self, path: DiscretePath, objective: float, least: float = TINY) -> CutOff:
        """What a path cuts off its limits between its nodes, of its cost, or of `least` if that is more."""
        passed = cut_off(self.problem, self.ladder.dynamics, path, self.problem.start_time)
        return passed.of(max(abs(objective), least))

    def _released(self, rung: Rung) -> Rung:
        """An optimum on the same mesh; another path of the same cost is no error of the mesh."""
        if (found := at_rest(self.ladder.try_on, rung, self.lean, self.tol)) is rung:
            return rung
        before, after = ((one.path, one.level.objective) for one in (rung, found))
        moved = change(self.problem, before, after, np.ones(len(found.nlp.mesh) - 1, int))
        if moved[1] > SAME_COST * self.tol:
            self.changes[-1] = (self.changes[-1][0] + moved[0], self.changes[-1][1] + moved[1])
        elif moved[0] > self.tol and ALIKE[-8:] not in self.reason:
            self.reason += ALIKE.format(moved[0])
        return found

    def _sharpen(self, rung: Rung, most: float) -> None:
        """Where the rounding of |F| alone costs more than the tolerance, round it less on the same mesh."""
        width = self.problem.actuator.smoothing
        while width is not None and self._rounded_too_much() and width > LEAST_ROUNDING:
            share = min(max(0.5 * ROUNDING_SHARE * self.tol / self.rounded, 0.1), 0.5)
            for less in (share, share**0.5):
                sharper = self.ladder.try_on(rung.path, max(width * less, LEAST_ROUNDING), MOST_SHARPENING)
                if sharper.solved or sharper.stopped:
                    break
            if not sharper.solved:
                return
            width = sharper.problem.actuator.smoothing
            rung, self.problem = sharper, sharper.problem
            self._judge(rung, rung.path, most)
            self.reason += f"; |F| rounded over {width:.0e} of the largest thrust"

    def _rounded_too_much(self) -> bool:
        over = self.best is not None and self.best.error.largest > self.tol
        return self.rounded > 0 and (over or self.rounded > ROUNDING_SHARE * self.tol)

    def settled(self, reason: str) -> Solution:
        """The best answer that was found, which need not be the last one."""
        assert self.best is not None
        words = _words(self.problem, self.best.rung.path, reason)
        more = {"tolerance": self.tol, "error": self.best.error, "reason": words}
        solution = self.ladder.solution(self.best.rung, self.errors, **more)
        reached = self.best.error.largest
        if reached <= self.tol:
            return solution
        return replace(solution, success=False, status=NOT_MET, message=unmet(reached, self.tol))


def _words(problem: TransferProblem, path: DiscretePath, reason: str) -> str:
    """Such as: order 4, 145 steps: controls switch or limits set in; switches at 0.06, 4.45 s."""
    found = switches_in_words(problem, path)
    words = f"order {path.order}, {len(path.mesh) - 1} steps: {reason}"
    return f"{words}; switches at {found}" if found else words
