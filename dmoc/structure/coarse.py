"""The coarse answer in which arcs are seen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dmoc.meshes.choices import TRIAL_ORDER, TRIAL_STEPS, first_path
from dmoc.results.solution import OUT_OF_TIME, Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.solve import solve
from dmoc.structure.arcs import is_switched
from dmoc.structure.build import FOUND_ORDER

# |F| is rounded at zero over this part of the largest thrust [-] in the coarse answer, over the second one
# if an arc is hardly there, over the third in a second coarse answer: where the fuel hardly depends on
# where it burns, a wide rounding hides short burns.
WIDE, ROUNDED, LESS_ROUNDED = 1e-2, 1e-3, 1e-4
# The coarse answer has this many steps at these orders, if no number is given and the motion needs no more.
COARSE_STEPS = {2: 60, 4: 30}
# The status of what the user or the time ended.
ENDED = ("stopped", OUT_OF_TIME)


def coarse_answer(
    problem: TransferProblem, order: int | None, steps: int | None, rounded: float = WIDE, **more: Any
) -> Solution:
    """An answer that is good enough to see the arcs in, |F| `rounded` at zero over that part of its limit."""
    engine: Any = problem.actuator
    if engine.smoothing is not None and engine.smoothing < rounded:
        problem = replace(problem, actuator=replace(engine, smoothing=rounded))
    tried = steps is not None and steps >= 2 * TRIAL_STEPS
    if order is None and steps is None:
        wanted = first_path(problem, guess=more.get("guess"))
        order, steps = wanted.order, len(wanted.mesh) - 1
        if order <= FOUND_ORDER:
            # On a singular arc forces of order 2 do not chatter.
            order = 2 if engine.smoothing is None and is_switched(problem) else FOUND_ORDER
            steps = COARSE_STEPS[order]
        tried = order == TRIAL_ORDER
    fixed = bool(problem.constraints) and not problem.free_duration
    if tried and fixed and more.get("guess") is None:
        # Around zones there are several optima: a solve to a tolerance begins so, and leads to the same.
        trial = solve(problem, TRIAL_ORDER, TRIAL_STEPS, sharp=False, **more)
        if trial.success:
            found = solve(problem, order, steps, sharp=False, **more | {"guess": trial.path})
            return replace(found, ladder=(*trial.ladder, *found.ladder)) if found.success else trial
        if trial.status in ENDED:
            return trial
    return solve(problem, order, steps, sharp=False, **more)
