"""The NLP of a transfer problem on one mesh, and its solution by Ipopt."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.records import dataclass
from dmoc.guess.starting import starting_guess
from dmoc.ipopt.options import advice_of, rounding, settings_for
from dmoc.ipopt.run import Answer, Interrupt, Watch, make_solver, run
from dmoc.motion.march import force_of
from dmoc.motion.mesh import node_weights
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Curved
from dmoc.nlp.program import Program
from dmoc.results.facts import Level, Provenance
from dmoc.results.solution import Solution, reported
from dmoc.scene.problem import TransferProblem

# A path that answers are to stay near holds their positions so many times as strongly as their controls [-]:
# positions are the sums of sums of the controls, and change far less.
OF_POSITIONS = 10.0
# A user's function that follows a solve takes (order, steps, iteration, objective, name of the worst row, its
# scaled violation) and says whether to stop.
Progress = Callable[[int, int, int, float, str, float], bool | None]


@dataclass(frozen=True)
class NLP(Program):
    """One transfer problem on one mesh, as Ipopt sees it.

    Start, goal, mass, limits and times are bounds and parameters: `bounds(problem)` and
    `parameters(problem)` give them for any problem that `accepts` lets through, and `solve(problem)` solves
    it, without a rebuild.
    """

    def __repr__(self) -> str:
        sizes = f"{self.columns.size} unknowns, {self.rows.size} rows"
        return f"NLP of {self.problem.name!r}: order {self.scheme.order}, {len(self.mesh) - 1} steps, {sizes}"

    def solver(
        self,
        options: dict[str, Any] | None = None,
        warm: bool = False,
        carried: bool = False,
        watch: Watch | None = None,
        limits: dict[str, Any] | None = None,
    ) -> ca.Function:
        """Ipopt for this NLP; `warm` and `carried` as in `settings_for`, `limits` are further settings."""
        turned = 0.0 if self.chart is None else self.chart.turns
        settings = settings_for(self.problem, self.mesh, self.scheme.degree, warm, carried, turned)
        # Rows that hold up to their rounding hold no better: a run that waits for that wanders to its end.
        held = "ipopt.acceptable_constr_viol_tol"
        settings[held] = max(settings[held], self._rounding)
        return make_solver(self.assembly, settings | (limits or {}), options, watch)

    def leaning(self, path: DiscretePath, strength: float) -> NLP:
        """The same NLP, whose scaled objective grows with the distance to a path on its mesh.

        Half of the mean square is added, times `strength` for the controls and `OF_POSITIONS` times that for
        the positions.
        Where many paths cost the same the one next to the given path is the optimum, and Ipopt does not wander.
        """
        numbers = np.concatenate([self.numbers, self.pack(path), self._weights(strength)])
        return replace(self, assembly=self.assembly.leaning, numbers=numbers)

    def pull(self, path: DiscretePath, near: DiscretePath, strength: float) -> float:
        """The largest scaled gradient, over its weight, by which an answer of `leaning` is no optimum [-]."""
        moved = self.pack(path) - self.pack(near)
        gradient = self._weights(strength) * moved
        positions = np.abs(np.cumsum(self.columns["position"].of(gradient), axis=0)).max()
        controls = np.abs(self.columns["force"].of(moved)).max(initial=0.0)
        return float(max(positions, strength * controls))

    def _weights(self, strength: float) -> np.ndarray:
        weight, nodes = np.zeros(self.columns.size), node_weights(self.mesh, self.scheme)
        weight[self.columns["position"].indices] = OF_POSITIONS * strength * nodes
        weight[self.columns["force"].indices] = strength * (np.diff(self.mesh) if self.hold else nodes)
        return weight

    def watch(self, problem: TransferProblem, progress: Progress | None, interrupt: Interrupt) -> Watch:
        """A watch over the iterations that tells `progress` of each in the problem's own words."""

        def tell(iteration: int, objective: float, x: np.ndarray, g: np.ndarray) -> bool:
            if (curved := self.curved) is not None:
                # Each row of motion stands for the same share of the same node in both.
                x = curved.path(x.ravel())
            worst = self.violations(problem, x, g, count=1)
            name, size = (worst[0][0].name_of(worst[0][1]), worst[0][2]) if worst else ("", 0.0)
            steps = len(self.mesh) - 1
            return bool(progress(self.scheme.order, steps, iteration, self.objective(objective), name, size))  # type: ignore[misc]

        return Watch(tell if progress else None, interrupt)

    def run(
        self, solver: ca.Function, problem: TransferProblem, path: DiscretePath, pinned: bool = False
    ) -> Answer:
        """Solve for a problem that `accepts` lets through, from a path on this mesh.

        `pinned` keeps the duration of the path where it is free.
        """
        lbx, ubx, lbg, ubg = self.bounds(problem)
        if pinned:
            place = self.columns["duration"].start
            lbx[place] = ubx[place] = self.pack(path)[place]
        lam_x, lam_g = self.multipliers(path)
        x0, curved = np.clip(self.pack(path), lbx, ubx), self.curved
        if curved is not None:
            lam_x, lam_g = curved.multipliers(x0, lam_x, lam_g)
            x0, fixed = curved.unknowns(x0), lbx == ubx
            lbx, ubx = np.where(fixed, x0, lbx), np.where(fixed, x0, ubx)
        bounds = {"lbx": lbx, "ubx": ubx, "lbg": lbg, "ubg": ubg}
        given = {"x0": x0, "p": self.parameters(problem), "lam_x0": lam_x, "lam_g0": lam_g}
        found = run(solver, self._rounding, **given, **bounds)
        return found if curved is None else curved.answer(found)

    @property
    def _rounding(self) -> float:
        """By how much rows may be off by rounding alone, scaled.

        Their unit is the impulse of the unit of force, which falls with the forces that are needed; positions
        are rounded as ever.
        """
        units = self.units
        momentum = units.mass * units.length / units.time
        return rounding(self.mesh, self.scheme.degree) * max(1.0, momentum / (units.force * units.time))

    @property
    def curved(self) -> Curved | None:
        """The way to the unknowns of Ipopt and back, where these are not those of the path."""
        return Curved(self.chart, self.columns, self.rows) if self.chart else None

    def level(self, answer: Answer, build_s: float) -> Level:
        """One run as a level of the ladder: its mesh, iterations, times and status."""
        return Level(
            order=self.scheme.order,
            steps=len(self.mesh) - 1,
            iterations=answer.iterations,
            objective=self.objective(answer.objective),
            build_s=build_s,
            solve_s=answer.seconds,
            status=answer.status,
            evaluations=answer.evaluations,
        )

    def solution(
        self,
        problem: TransferProblem,
        answer: Answer,
        ladder: tuple[Level, ...],
        message: str,
        options: dict[str, Any] | None = None,
        **found: Any,
    ) -> Solution:
        """An answer as a Solution; `found` are further fields of it."""
        path, dynamics = self.path(problem, answer), replace(self.dynamics, effects=tuple(problem.effects))
        momentum, velocity = end_momenta(dynamics, path, problem.start_time)
        return Solution(
            problem=problem,
            path=path,
            **reported(path, velocity, momentum, force_of(dynamics, path)),
            objective=self.objective(answer.objective),
            success=answer.status == "solved",
            status=answer.status,
            message=message,
            ladder=ladder,
            provenance=Provenance.of(problem, options),
            **found,
        )

    def solve(
        self, problem: TransferProblem | None = None, guess: Any = None, options: dict[str, Any] | None = None
    ) -> Solution:
        """Solve again without a rebuild, for a problem that differs in states, mass, limits or times.

        One run of Ipopt on this mesh, for closed loops and families of problems; `dmoc.solve` goes from
        coarse to fine and says why there is no path.

        Parameters
        ----------
        problem : TransferProblem
            One that this NLP `accepts`; its own if not given.
        guess
            As in `dmoc.solve`; a former Solution on the same mesh starts warm, with its multipliers.
        options : dict
            CasADi `nlpsol` options.

        Raises
        ------
        ValueError
            By name, if the problem differs in more than that.
        """
        new = self.problem if problem is None else of_kind("problem", problem, TransferProblem)
        self.accepts(new)
        begun = time.perf_counter()
        path = starting_guess(new, self.mesh, self.scheme.order, self.hold, guess)
        solver = self.solver(options, warm=bool(path.multipliers))
        built = time.perf_counter() - begun
        answer = self.run(solver, new, path)
        words = "a local optimum" if answer.status == "solved" else advice_of(answer.status, options)
        return self.solution(new, answer, (self.level(answer, built),), words, options)
