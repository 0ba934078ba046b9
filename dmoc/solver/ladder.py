"""The way up: one problem solved on mesh after mesh, each from the answer of the one before."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.guess.starting import angle_around, starting_guess
from dmoc.guess.tube import in_tube, out_of_tube
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.motion.stability import flow_matrices, refuse_unstable
from dmoc.nlp.ipopt import Answer, Interrupt, Progress, Watch, make_solver, path_of, run
from dmoc.nlp.transcription import NLP, transcribe_onto, units_of
from dmoc.results.facts import Level, Provenance
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.cause import Cause, cause_of
from dmoc.solver.iterate import refuse_undefined_motion, refuse_undefined_rows, worst_in_units

# Nodes of the coarsest mesh, and how much finer the next ones are: where there are limits, which take many
# iterations, and where there are none. Without, 400 nodes take no longer than 100 and 400 after them.
COARSEST_NODES, FINER = {True: 100, False: 400}, {True: 4, False: 16}
# Without limits all is smooth: one coarse mesh of this order is nearer the answer than finer ones of order 2.
SMOOTH_ORDER = 6
MOST_COARSE = 400
# Steps of order 2 over the number of revolutions to the power 1.5, for a phase that is roughly right.
IN_PHASE = 50
WIDEST_ROUNDING = 1e-2
# How far beyond its limits a transfer on a coarse mesh is given up for good, and up to how many nodes it is
# worth while to find out: the error of the coarse mesh is far below the one, the time small up to the other.
HOPELESS, MOST_EXPLAINED = 0.05, 2000
# Statuses that do not tell whether there is a path at all.
UNEXPLAINED = ("infeasible", "restoration failed", "iteration limit", "failed")

# What to try, in words, for each way Ipopt can end.
ADVICE = {
    "infeasible": "no path near the guess meets every row; relax the duration, the force limit or a zone, "
    "or try another guess (this is a local verdict)",
    "iteration limit": "another number of steps helps most often, then another order, hold=True or a better "
    "guess, and last options={'ipopt.max_iter': ...}",
    "invalid number": "the guess or an iterate met an undefined value (a distance of 0, say): change the guess",
    "restoration failed": "another number of steps or another order helps most often; if not, look for "
    "contradictory or repeated conditions, then try another guess",
    "diverging": "the objective has no lower bound here; limit the force or the duration",
    "stopped": "interrupted; the best iterate is kept",
    "failed": "try another number of steps, another order, hold=True, or another guess",
}


class Climb:
    """The last NLP and its answer, and every level so far, of one problem."""

    def __init__(
        self,
        problem: TransferProblem,
        options: dict[str, Any] | None = None,
        progress: Progress | None = None,
        compiled: bool = False,
    ):
        self.problem, self.options, self.progress, self.compiled = problem, options, progress, compiled
        self.dynamics = Dynamics.of(problem)
        self.interrupt = Interrupt()
        self.levels: list[Level] = []
        self.cause: Cause | None = None
        self.nlp: NLP
        self.answer: Answer

    @property
    def path(self) -> DiscretePath:
        """The last answer."""
        return path_of(self.nlp, self.problem, self.answer)

    def up_to(self, first: DiscretePath, given: Any = None) -> bool:
        """Solve on the mesh of a first guess, by way of coarser meshes unless it brings multipliers along.

        On the coarsest the guess is made anew from what it was made from, `given`: brought there from
        a finer mesh its controls would no longer fit its path.
        """
        refuse_unstable(self.dynamics, first, self.problem.start_time, self.problem.duration_bounds[0])
        order, meshes = self._meshes(first)
        stages = _stages(meshes, self.problem.actuator.smoothing)
        known, solved = first, False
        if len(meshes) > 1 and not first.multipliers:
            known = starting_guess(self.problem, meshes[0], order, first.hold, given)
        refuse_undefined_motion(self.dynamics, self.problem, known)
        if first.multipliers:
            return self.solve_on(first) or self._explained(first, None)
        for mesh, rounding in stages:
            this = first.order if mesh is first.mesh else order
            start = known.onto(mesh, this, first.hold)
            solved = self.solve_on(start, rounding)
            if not solved and self.problem.free_duration and self.answer.status != "stopped":
                longer = min(self.problem.duration_bounds[1], 10 * first.duration)
                again = replace(first.onto(mesh, this, first.hold), duration=longer)
                solved = self.solve_on(again, rounding)
            solved = solved or self._explained(start, rounding)
            hopeless = self.cause is not None and HOPELESS < self.cause.excess < np.inf
            if self.answer.status == "stopped" or (not solved and hopeless):
                return False
            # a coarse mesh may have no path where a finer one does: then go on from the first guess
            known = self.path if solved else first
        return solved or self._by_half(first)

    @property
    def _unexplained(self) -> bool:
        """Whether the last attempt failed without a reason; one that the user cut short has a reason."""
        limited = any("max_" in name for name in self.options or ())
        return self.answer.status in UNEXPLAINED and not limited and not (self.cause and self.cause.words())

    def _by_half(self, first: DiscretePath) -> bool:
        """Where nothing tells why a mesh fails, one of half as many steps often does not."""
        if not self._unexplained or len(first.mesh) < 9:
            return False
        failed, half = (self.nlp, self.answer), np.append(first.mesh[:-1:2], 1.0)
        if self.solve_on(first.onto(half, first.order, first.hold)):
            return self.solve_on(self.path.onto(first.mesh, first.order, first.hold))
        if self.answer.status != "stopped":
            self.nlp, self.answer = failed
        return False

    def _explained(self, start: DiscretePath, rounding: float | None) -> bool:
        """Say why there is no path near a guess; where there is one, solve again from it."""
        if not self._unexplained or self.cause is not None or len(start.position) > MOST_EXPLAINED:
            return False
        cause = cause_of(self._rounded(rounding), start)
        if cause.path is not None:
            return self.solve_on(cause.path, rounding)
        self.cause = cause
        return False

    def solve_on(self, guess: DiscretePath, rounding: float | None = None) -> bool:
        """Solve on the mesh of a guess; a warm start that fails is tried again cold."""
        problem = self._rounded(rounding)
        if guess.multipliers:
            if self._attempt(guess, problem) or self.answer.status == "stopped":
                return self.answer.status == "solved"
            guess = replace(guess, multipliers={})
        near = in_tube(problem, guess)
        if near is not None and self._attempt(guess, near):
            guess = out_of_tube(self.path)
        return self._attempt(guess, problem)

    def _attempt(self, guess: DiscretePath, problem: TransferProblem) -> bool:
        if self.interrupt.seen and self.levels:
            self.answer = replace(self.answer, status="stopped")
            return False
        begun = time.perf_counter()
        carried = bool(self.levels) and not np.array_equal(guess.mesh, self.nlp.mesh)
        self.nlp = transcribe_onto(problem, guess, units_of(problem, guess), self.compiled)
        if not self.levels:
            refuse_undefined_rows(self.nlp, problem, guess)
        watch = Watch(self.nlp, self.progress, self.interrupt)
        solver = make_solver(self.nlp, self.options, bool(guess.multipliers), watch, carried)
        built = time.perf_counter() - begun
        answer = self.answer = run(solver, self.nlp, problem, guess)
        if watch.error is not None:
            raise watch.error
        steps, objective = len(guess.mesh) - 1, self.nlp.objective(answer.objective)
        counts = {"iterations": answer.iterations, "evaluations": answer.evaluations}
        times: dict[str, Any] = {"build_s": built, "solve_s": answer.seconds}
        self.levels.append(
            Level(guess.order, steps, objective=objective, status=answer.status, **counts, **times)
        )
        return answer.status == "solved"

    def _rounded(self, rounding: float | None) -> TransferProblem:
        """The problem with this rounding of |F| at zero."""
        if rounding is None:
            return self.problem
        engine: Any = self.problem.actuator
        return replace(self.problem, actuator=replace(engine, smoothing=rounding))

    def _meshes(self, first: DiscretePath) -> tuple[int, list[np.ndarray]]:
        """The order of the coarse meshes, and all meshes up to the final one.

        The coarsest has 100 or 400 nodes, or as many as keep h omega below 1 on the guess: a mesh that
        cannot follow the motion has optima of its own. Over many revolutions that takes more at order 2:
        its error in the phase adds up.
        """
        final, limited = first.mesh, self.problem.limited
        order = first.order if limited or first.hold else max(first.order, SMOOTH_ORDER)
        counts, least = [(len(final) - 1) * (first.order // 2)], COARSEST_NODES[limited]
        if counts[0] > 2 * least:
            turns = angle_around(self.problem, first) / (2 * np.pi) if order == 2 else 0.0
            least = max(least, order // 2 * self.least_steps(first), int(IN_PHASE * turns**1.5))
        while counts[-1] > 2 * least:
            counts.append(max(least, -(-counts[-1] // FINER[limited])) if order == first.order else least)
        places = np.linspace(0.0, 1.0, len(final))
        steps = [count // (order // 2) for count in reversed(counts[1:])]
        return order, [*(np.interp(uniform_mesh(count), places, final) for count in steps), final]

    def least_steps(self, guess: DiscretePath) -> int:
        """Steps that keep h omega below 1 along a guess, omega the fastest rate of the linearised motion.

        At most 400: where a guess strays to where no path would go, its rates mean nothing.
        """
        sample = guess.onto(uniform_mesh(min(100, len(guess.mesh) - 1)), 2, guess.hold)
        slopes = np.gradient(sample.position, sample.duration * sample.fractions, axis=0)
        flow, _ = flow_matrices(self.dynamics, sample, self.problem.start_time, slopes)
        rates = np.linalg.eigvals(flow) if np.isfinite(flow).all() else np.full(1, np.inf)
        # what dies out need not be followed
        fastest = max(rates.real.max(), np.abs(rates.imag).max())
        return int(np.clip(guess.duration * fastest, 2, MOST_COARSE))

    def solution(self, **found: Any) -> Solution:
        """What the last level found; `found` are further fields of the Solution."""
        path, answer, problem = self.path, self.answer, self.problem
        momentum, velocity = end_momenta(self.dynamics, path, problem.start_time)
        success = answer.status == "solved"
        reason = "" if self.cause is None else self.cause.words()
        return Solution(
            problem=problem,
            path=path,
            velocity=velocity,
            momentum=momentum,
            force=force_of(self.dynamics, path.control),
            objective=self.nlp.objective(answer.objective),
            success=success,
            status=answer.status,
            message="a local optimum" if success else reason or ADVICE[answer.status],
            ladder=tuple(self.levels),
            worst=() if success else worst_in_units(self.nlp, problem, answer.x, answer.g),
            provenance=Provenance.of(problem, self.options),
            **found,
        )


def _stages(meshes: list[np.ndarray], rounding: float | None) -> list[tuple[np.ndarray, float | None]]:
    """The meshes, each with the rounding of |F| at zero: wide on the coarse ones, as asked for on the last."""
    if rounding is None:
        return [(mesh, None) for mesh in meshes]
    count = max(int(np.ceil(np.log10(WIDEST_ROUNDING / rounding))), 0)
    widths = [WIDEST_ROUNDING * 0.1**i for i in range(count)] + [rounding]
    repeated = [meshes[0]] * (len(widths) - len(meshes)) + meshes
    return list(zip(repeated, widths + [rounding] * (len(meshes) - len(widths)), strict=True))
