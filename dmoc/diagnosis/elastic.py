"""How far limits are from being met: the same NLP with one limit, or every row, made elastic."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import field, replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.ipopt.run import ALWAYS, Follower, Interrupt, Watch, run
from dmoc.motion.path import DiscretePath
from dmoc.nlp.solving import NLP
from dmoc.results.facts import Level
from dmoc.scene.problem import TransferProblem

# The objective is the sum of the slacks plus this part of the scaled effort [-]: the effort makes the path
# unique, and changes the slack by about this part.
EFFORT_SHARE = 1e-4
# A run of the elastic NLP is given up after this many iterations: those that converged took fewer than 100.
MOST_ITERATIONS = 200
# A ladder tells of these runs by this question.
QUESTION = "how far limits must give way"
# A row counts as met if its scaled violation is below this [-].
MET = 1e-7
# Ipopt gets these options where it starts from an answer near by: it stays within 1e-8 of the limits that act,
# and the barrier begins low.
WARM = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-4,
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}


@dataclass(frozen=True)
class Relaxed:
    """The answer of one elastic NLP: the slacks, the path, and whether it keeps all rows with these slacks.

    The slacks are the least ones if it is `exact`, else they are enough.
    """

    slack: np.ndarray
    path: DiscretePath
    feasible: bool
    multipliers: dict[str, Any] = field(default_factory=dict)
    exact: bool = True


class Relaxation:
    """An NLP whose rows g and unknowns x keep their limits but for slacks s >= least, at the least sum of s.

        lbg <= g(x) + G s <= ubg,      lbx - below s <= x <= ubx + above s

    One slack for many limits finds the least factor by which all of them must give way; two for every
    row find rows that cannot be met together. Exact derivatives, those of the NLP and constants.

    Parameters
    ----------
    nlp : NLP
        Its objective should be the effort.
    rows : array or ca.DM, shape (rows, slacks)
        G; as a DM if it is large and sparse: a dense array of two thousand rows takes a tenth of a second.
    columns : array of int
        Unknowns whose limits give way by the first slack.
    below, above : arrays
        How far the lower and the upper limits of these unknowns give way for a slack of 1, scaled.
    tell : callable
        Takes the `Level` of every run.
    interrupt : Interrupt, optional
        Ends a run, which then counts as one that found nothing.
    """

    def __init__(
        self,
        nlp: NLP,
        rows: Any,
        columns=(),
        below=(),
        above=(),
        least: float = 0.0,
        tell: Callable[[Level], None] = lambda level: None,
        interrupt: Interrupt | None = None,
    ):
        begun = time.perf_counter()
        self.nlp, self.least, self.count, self.tell = nlp, least, rows.shape[1], tell
        self.columns = np.asarray(columns, int)
        number = len(self.columns)
        # A bound on an unknown has no place for a slack, so these bounds become rows, one for either side.
        pick = ca.DM.triplet(
            list(range(number)), self.columns.tolist(), ca.DM.ones(number), number, nlp.columns.size
        )
        given = np.concatenate([-np.asarray(above, float), np.asarray(below, float)])
        share = ca.horzcat(ca.sparsify(ca.DM(given)), ca.DM(2 * number, self.count - 1))
        nlp_parts, settings = self._parts(ca.sparsify(ca.DM(rows)), ca.vertcat(pick, pick), share)
        # CasADi holds no reference to its callbacks.
        sizes = [nlp_parts[name].numel() for name in ("x", "g", "p")]
        self._follower = Follower(sizes[0], sizes[1], sizes[2], Watch(None, interrupt or Interrupt()))
        settings |= {"iteration_callback": self._follower}
        self.solver = ca.nlpsol("relaxed", "ipopt", nlp_parts, settings)
        self.warm = ca.nlpsol("relaxed", "ipopt", nlp_parts, settings | WARM)
        self._built = time.perf_counter() - begun

    def _parts(self, elastic: ca.DM, pick: ca.DM, share: ca.DM) -> tuple[dict, dict]:
        """The elastic NLP, and Ipopt's settings with its exact derivatives."""
        parts, size, rows = self.nlp.assembly, self.nlp.columns.size, self.nlp.rows.size
        z, p = ca.MX.sym("z", size + self.count), parts.p
        x, slack = z[:size], z[size:]
        cost = ca.sum1(slack) + EFFORT_SHARE * parts.objective(x, p)
        slope = ca.vertcat(EFFORT_SHARE * parts.gradient(x, p)[1], ca.MX.ones(self.count, 1))
        g = ca.vertcat(parts.constraints(x, p) + elastic @ slack, pick @ x + share @ slack)
        jacobian = ca.vertcat(ca.horzcat(parts.jacobian(x, p)[1], elastic), ca.horzcat(pick, share))
        weight, multipliers = ca.MX.sym("weight"), ca.MX.sym("multipliers", g.numel())
        hessian = parts.hessian(x, p, EFFORT_SHARE * weight, multipliers[:rows])
        settings = ALWAYS | {
            "jac_g": ca.Function(
                "nlp_jac_g", [z, p], [ca.MX(*g.shape), jacobian], ["x", "p"], ["g", "jac_g_x"]
            ),
            "grad_f": ca.Function("nlp_grad_f", [z, p], [ca.MX(1, 1), slope], ["x", "p"], ["f", "grad_f_x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [z, p, weight, multipliers],
                [ca.diagcat(hessian, ca.MX(self.count, self.count))],
                ["x", "p", "lam_f", "lam_g"],
                ["h"],
            ),
            "ipopt.mumps_permuting_scaling": 0,
            "ipopt.acceptable_iter": 0,
            "ipopt.max_iter": MOST_ITERATIONS,
        }
        return {"x": z, "p": p, "f": cost, "g": g}, settings

    def __call__(self, problem: TransferProblem, guess: DiscretePath, near: Relaxed | None = None) -> Relaxed:
        """Solve for a problem that the NLP accepts, from a path on its mesh, or from an answer near by."""
        lbx, ubx, lbg, ubg = self.nlp.bounds(problem)
        low, high = lbx[self.columns], ubx[self.columns]
        start, free = np.clip(self.nlp.pack(guess), lbx, ubx), np.full(self.count, np.inf)
        # The bounds of these unknowns are now rows, which give way; as bounds they would still be hard.
        lbx[self.columns], ubx[self.columns] = -np.inf, np.inf
        none = np.full(len(low), np.inf)
        solver = self.solver if near is None else self.warm
        slack = np.ones(self.count) if near is None else near.slack
        bounds: dict[str, Any] = {
            "lbx": np.concatenate([lbx, np.full(self.count, self.least)]),
            "ubx": np.concatenate([ubx, free]),
            "lbg": np.concatenate([lbg, -none, low]),
            "ubg": np.concatenate([ubg, high, none]),
        }
        known = {} if near is None else near.multipliers
        found: Any = run(
            solver, x0=np.concatenate([start, slack]), p=self.nlp.parameters(problem), **bounds, **known
        )
        self.tell(replace(self.nlp.level(found, self._built), question=QUESTION))
        self._built = 0.0
        z, g = found.x, found.g
        excess = np.maximum(bounds["lbg"] - g, g - bounds["ubg"]).max(initial=0.0)
        path = self.nlp.unpack(z[: -self.count], problem)
        multipliers = {"lam_x0": found.lam_x, "lam_g0": found.lam_g}
        feasible = bool(np.isfinite(z).all() and excess <= MET)
        return Relaxed(z[-self.count :], path, feasible, multipliers, found.status == "solved")
