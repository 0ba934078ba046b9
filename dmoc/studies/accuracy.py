"""What accuracy costs in time: solves on many meshes, by orders and by other methods."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np

from dmoc.basics.arguments import number
from dmoc.basics.memory import forget
from dmoc.basics.records import dataclass
from dmoc.guess.starting import starting_guess
from dmoc.meshes.choices import guess_on
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.motion.reference import apart
from dmoc.motion.reference import reference as fly
from dmoc.motion.scales import Scales, path_scales
from dmoc.nlp.transcription import check_mesh
from dmoc.results.solution import Solution
from dmoc.scene.problem import TransferProblem
from dmoc.solver.ladder import Ladder
from dmoc.solver.solve import solve
from dmoc.studies.other_methods import Formulation as Formulation
from dmoc.studies.other_methods import Method, Run, counted, solve_other

# By order, the numbers of steps that are solved unless others are asked for: they span the errors of `TARGETS`,
# as far as an order gets there in well under a second.
STEPS = {2: (100, 200, 400, 800, 1600), 4: (25, 50, 100, 200, 400), 6: (16, 24, 48, 96), 8: (8, 16, 32, 64)}
# Numbers of steps for methods of other people, most of which are of order 2 to 4.
OTHER_STEPS = (25, 50, 100, 200, 400)
# The optimum that errors are measured from is solved at order 8 with twice this many steps, and with this many
# to see how much it still changes.
REFERENCE_STEPS = 100
# What the name of a method ends with where no coarser mesh came first.
COLD = ", cold"
# What the name of a method ends with where its functions are machine code.
COMPILED = ", compiled"
# The time is interpolated for these relative errors of the objective [-], from a sketch to all digits shown.
TARGETS = (1e-3, 1e-5, 1e-7, 1e-9)
# The reference objective is taken to be known to this relative error [-] at best, however little it changed.
LEAST_ERROR = 1e-14
# A reference objective that the user gives is taken to be exact to the last bit [-].
GIVEN_ERROR = 1e-16


@dataclass(frozen=True)
class Trial:
    """One method on one mesh: how far off it was and what it took.

    Attributes
    ----------
    method : str
        "order 2" to "order 8" are dmoc's own, with ", cold" if without coarse meshes on the way
        and ", compiled" if with functions as machine code.
    order : int or None
        None for other methods.
    steps, nodes : int
        Steps of the mesh and places on it where there is a control.
    objective : float
        [unit of the objective].
    error : float
        Relative error of the objective [-], no less than what the reference is known to.
    path_error : float
        How far an independent integrator, driven by the controls found, misses the goal that the
        method believes to reach: of the path's extent or of its speed, whichever is more [-].
    iterations, calls : int
        Iterations of Ipopt and evaluations of functions and derivatives it asked for, on all meshes.
    build_s, solve_s : float
        Medians of the seconds spent in Ipopt, and before and after it.
    coarse_to_fine : bool
        Whether coarser meshes came first.
    status : str
        "solved", or why not.
    """

    method: str
    order: int | None
    steps: int
    nodes: int
    objective: float
    error: float
    path_error: float
    iterations: int
    calls: int
    build_s: float
    solve_s: float
    coarse_to_fine: bool
    status: str

    @property
    def seconds(self) -> float:
        """Seconds from the problem to the answer."""
        return self.build_s + self.solve_s


def work_precision(
    problem: TransferProblem,
    orders: Sequence[int] = (2, 4, 6, 8),
    steps: Sequence[int] | Mapping[str, Sequence[int]] | None = None,
    repeats: int = 3,
    against: Mapping[str, Method] | Sequence[tuple[str, Method]] = (),
    reference: float | None = None,
    cold: bool = False,
    compiled: bool = False,
    progress: Callable[[str], None] | None = None,
    solved_before: bool = False,
) -> list[Trial]:
    """Solve a problem at several orders on several meshes, and measure error and time.

    The repetitions take turns, so that whatever else the computer does falls on all solves alike.

    Parameters
    ----------
    problem : TransferProblem
    orders : sequence of int
        Of 2, 4, 6, 8.
    steps : sequence of int, or mapping, optional
        Meshes, for all or by the method's name ("order 2", ...); by default 100 to 1600 steps at order 2,
        and down to 8 to 64 at order 8.
    repeats : int
        How often each solve is timed; the median counts.
    against : mapping or pairs
        Other methods by name: functions of (problem, steps) that give a `Formulation`. They get the
        options of dmoc's own solves, and a tolerance that is no tighter.
    reference : float, optional
        The true objective; by default that of order 8 on a fine mesh.
    cold : bool
        Also solve each mesh at each order from the starting guess alone.
    compiled : bool
        Also solve each with functions as machine code, see `solve`.
    progress : callable
        Called before every solve with what it is.
    solved_before : bool
        Time each solve as one of a scene that this process has solved before: all are solved once more
        first, not timed. By default dmoc forgets the functions it has written down before each.

    Returns
    -------
    list of Trial

    Raises
    ------
    ValueError
        If an argument has no meaning, or the problem cannot be solved for a reference.
    """
    if isinstance(repeats, bool) or not isinstance(repeats, int) or repeats < 1:
        raise ValueError(f"repeats must be a whole number of at least 1; got {repeats!r}")
    meshes = _checked_meshes(steps, {f"order {scheme(order).order}": STEPS[order] for order in orders})
    others = dict(against)
    variants = [("", True), *([(COLD, False)] if cold else []), *([(COMPILED, True)] if compiled else [])]
    runs: list[tuple[tuple, Callable[[], Run]]] = [
        (
            (name + variant, order, count, climbs),
            partial(_own, problem, order, count, climbs, variant == COMPILED),
        )
        for order, (name, counts) in zip(orders, meshes.items(), strict=True)
        for count in counts
        for variant, climbs in variants
    ]
    runs += [
        ((name, None, count, False), partial(solve_other, problem, name, others[name], count))
        for name, counts in _checked_meshes(steps, dict.fromkeys(others, OTHER_STEPS)).items()
        for count in counts
    ]
    value, doubt = (
        best_known(problem) if reference is None else (number("reference", reference, ""), GIVEN_ERROR)
    )
    untimed = int(solved_before)
    # the loop over repetitions is the outer one: a slow minute of the computer then falls on all solves alike
    rounds = [
        [_told(progress, labels, solved_before, run) for labels, run in runs] for _ in range(untimed + repeats)
    ]
    scales = path_scales(starting_guess(problem, uniform_mesh(100), 2, False))
    return [
        _trial(problem, labels, timed, (value, doubt), scales)
        for (labels, _), timed in zip(runs, zip(*rounds[untimed:], strict=True), strict=True)
    ]


def _told(progress: Callable[[str], None] | None, labels: tuple, solved_before: bool, run: Callable) -> Run:
    if progress is not None:
        progress(f"{labels[0]}, {labels[2]} steps")
    if not solved_before:
        forget()
    return run()


def _checked_meshes(steps: Any, default: dict[str, tuple[int, ...]]) -> dict[str, tuple[int, ...]]:
    """Numbers of steps by the name of the method, checked."""
    chosen = steps if isinstance(steps, Mapping) else {} if steps is None else dict.fromkeys(default, steps)
    meshes = default | {name: tuple(chosen[name]) for name in default if name in chosen}
    for count in (count for counts in meshes.values() for count in counts):
        check_mesh(count)
    return meshes


def _trial(
    problem: TransferProblem, labels: tuple, timed: Sequence[Run], known: tuple, scales: Scales
) -> Trial:
    (name, order, steps, climbs), (value, doubt) = labels, known
    last, solve_s = timed[-1], median(run.solve_s for run in timed)
    return Trial(
        name,
        order,
        steps,
        last.nodes,
        last.objective,
        # no error is claimed to be smaller than what the reference itself is known to
        max(abs(last.objective - value) / (abs(value) or 1.0), doubt),
        _miss(problem, last.path, scales),
        last.iterations,
        last.calls,
        median(run.seconds for run in timed) - solve_s,
        solve_s,
        climbs,
        last.status,
    )


def best_known(problem: TransferProblem) -> tuple[float, float]:
    """Objective by order 8 on a fine mesh, and how much it still changed from half as many steps, relative."""
    half, full = (solve(problem, order=8, steps=count * REFERENCE_STEPS) for count in (1, 2))
    if not full.success:
        raise ValueError(f"no reference: order 8 on a fine mesh ended with {full.status!r}; give reference=...")
    change = abs(half.objective - full.objective) / (abs(full.objective) or 1.0)
    return full.objective, max(change, LEAST_ERROR)


def time_to_reach(trials: Sequence[Trial], targets: Sequence[float] = TARGETS) -> dict[str, list[float | None]]:
    """Seconds each method takes to an error, on the frontier of what was measured; None where not reached.

    Between two solves the time is interpolated, logarithm over logarithm. Where already the fastest
    solve is better than a target its time counts.
    """
    table: dict[str, list[float | None]] = {}
    for name in dict.fromkeys(trial.method for trial in trials):
        points = frontier([trial for trial in trials if trial.method == name])
        table[name] = [_when(points, target) for target in targets]
    return table


def frontier(trials: Sequence[Trial]) -> list[Trial]:
    """The solves that no faster one equals in accuracy, fastest first."""
    best: list[Trial] = []
    for trial in sorted(trials, key=lambda trial: trial.seconds):
        if trial.status == "solved" and (not best or trial.error < best[-1].error):
            best.append(trial)
    return best


def _when(points: list[Trial], target: float) -> float | None:
    if points and points[0].error <= target:
        return points[0].seconds
    for before, after in pairwise(points):
        if after.error <= target:
            # a straight line between two solves, where error and time are both drawn on logarithmic axes
            share = np.log(target / before.error) / np.log(after.error / before.error)
            return float(before.seconds * (after.seconds / before.seconds) ** share)
    return None


def _own(problem: TransferProblem, order: int, steps: int, climbs: bool, compiled: bool = False) -> Run:
    """One of dmoc's own solves, by way of coarser meshes or not."""

    def solve_with(options: dict[str, Any]) -> tuple[Solution, float]:
        begun = time.perf_counter()
        ladder = Ladder(problem, options, compiled=compiled)
        first = guess_on(problem, uniform_mesh(steps), order, False)
        # `climb_to` solves coarser meshes first, `solve_on` the mesh itself from its starting guess
        rung = ladder.climb_to(first) if climbs else ladder.solve_on(first)
        return ladder.solution(rung), time.perf_counter() - begun

    try:
        (found, seconds), calls = counted(solve_with)
    except ValueError as error:
        # steps beyond the scheme's limit of stability are refused; the finer meshes are measured all the same
        return Run(None, steps * order // 2 + 1, np.nan, f"refused: {error}", 0, 0, np.nan, np.nan)
    facts = found.objective, found.status, found.iterations
    return Run(found.path, len(found.path.control), *facts, calls, seconds, found.solve_s)


def _miss(problem: TransferProblem, path: DiscretePath | None, scales: Scales) -> float:
    """By how much the independent integrator misses the goal of a path, of an extent [m] or speed [m/s]."""
    if path is None or not np.isfinite(path.control).all():
        return np.nan
    dynamics = Dynamics.of(problem)
    position, velocity = fly(dynamics, path, problem.start_time, path.start_velocity)
    return scales.share(apart(path.coordinates, position, path.position[-1]), velocity - path.goal_velocity)
