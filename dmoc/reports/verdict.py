"""What an answer is worth, in words: how exact it is or, where a check fails, what to try."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dmoc.checks.verification import Report
    from dmoc.results.solution import Solution

# What helps where a check fails.
FINER = "more steps, a higher order, or --tol 1e-4, which chooses both"
SHARPER = "another number of steps, another order, or another guess (--starts 6)"
REMEDIES = {
    "residual": SHARPER,
    "constraint": SHARPER,
    "rollout": FINER,
    "reference": FINER,
    "ledger": FINER,
    "bounds": FINER,
    "optimality": SHARPER,
    "joints": SHARPER,
    "together": FINER,
    "stability": "more steps: h omega must come below the limit of the order",
}
# A tolerance that is better than the accuracy of an answer by this factor is named [-]; where controls switch,
# by the second one, as no order makes the error fall fast there: two low thrust transfers meet that in 9 and
# 6 s, and one that is better by the first one not in a minute.
BETTER, SWITCHING = 100.0, 10.0
# No better tolerance is named where an answer is as accurate as this [-].
ACCURATE = 1e-6


def verdict_words(solution: Solution, report: Report) -> str:
    """One or two sentences on the checks of an answer."""
    broken = [check.name for check in report.checks if not check.ok]
    if not broken:
        return f"Every check holds.{accuracy_words(solution, report)}"
    remedies = dict.fromkeys(REMEDIES[name] for name in broken if name in REMEDIES)
    tries = f" What to try: {'; or '.join(remedies)}." if remedies else ""
    return f"Checks that fail: {', '.join(broken)}.{tries}"


def accuracy(solution: Solution, report: Report) -> float | None:
    """How exact the path is [-]: the estimated error or, without one, the integrator's miss of the goal.

    None where neither is known.
    """
    if solution.error is not None:
        return float(solution.error.largest)
    found = [check.value for check in report.checks if check.name == "reference"]
    return found[0] if found else None


def accuracy_words(solution: Solution, report: Report) -> str:
    """Such as: The path is right to about 4e-04 of its extent, 1.3e+08 m; --tol 1e-06 for better."""
    share = accuracy(solution, report)
    if share is None or not math.isfinite(share):
        return ""
    path = solution.path
    sizes = [f"{share * path.diagonal:.1e} m"] if path.place.size else []
    sizes += [f"{math.degrees(share * path.turn):.1e} degrees"] if path.attitudes else []
    words = f" The path is right to about {share:.0e} of its extent, {' and '.join(sizes)}"
    if solution.tolerance is None and share > ACCURATE:
        better = SWITCHING if _switches(solution) else BETTER
        words += f"; --tol {10 ** math.floor(math.log10(share / better)):.0e} for better"
    return words + "."


def _switches(solution: Solution) -> bool:
    """Whether controls may switch inside a step, if the problem is known; those of legs do between them."""
    from dmoc.results.switches import has_linear_controls
    from dmoc.scene.problem import TransferProblem

    problem = solution.problem
    return isinstance(problem, TransferProblem) and has_linear_controls(problem)
