"""One point of a sweep, solved in a process of its own.

A worker is told where the problem file is and what to make of it, and reads it itself. What comes
back is plain: a record of numbers and texts, and the path as text, so that a journal can hold both.
"""

from __future__ import annotations

import base64
import io
import json
import threading
import time
from contextlib import redirect_stderr, redirect_stdout
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from dmoc.basics.plain import unbroken
from dmoc.basics.records import dataclass
from dmoc.scene.problem_file import ProblemFile, load_problem

if TYPE_CHECKING:
    from dmoc.checks.verification import Report

# In a packed path the names of multipliers begin with this, so that they cannot be taken for those of a field.
MULTIPLIER = "multiplier "
# What belongs to the joints of a mission's path, or stands between the bodies of a team.
JOINTS = ("own", "forces", "densities")
# What a path of a team of missions knows of its bodies.
PHASES = ("names", "joints")
# A process solves one point at a time, also where a scheduler runs several threads in it: the output of a
# point is redirected, which is done for the whole process.
_TURN = threading.Lock()


@dataclass(frozen=True)
class Task:
    """What a worker has to know of one point.

    Attributes
    ----------
    path, source_hash : str
        The problem file, and what it was when the sweep began.
    values : dict
        Its parameters.
    numerics : dict
        order, steps, tol, hold and, if there is one, time_limit of `solve`.
    start : str or None
        The path of a neighbour, from `pack`.
    again : bool
        Whether the problem's own guess has failed already.
    errors : dict or None
        Arguments of `disperse`, if flights with errors are asked for.
    """

    path: str
    source_hash: str
    values: dict[str, Any]
    numerics: dict[str, Any]
    start: str | None = None
    again: bool = False
    errors: dict[str, Any] | None = None


def solve_point(task: Task) -> tuple[dict[str, Any], str | None]:
    """Record and path of a point; a failure is a record too.

    Raises
    ------
    ValueError
        If the problem file is not the one the sweep began with: then no point is worth solving.
    """
    with _TURN, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        file = _problem_file(task.path, task.source_hash)
        try:
            problem = file.make(**task.values)
            solution, warm = _solve(problem, task)
            record = _record_of(solution, warm)
            if task.errors is not None and solution.success:
                record |= _dispersed(solution, task.errors)
            return record, pack(solution.path) if solution.success else None
        except ValueError as error:
            return failed_record("refused", error), None
        except Exception as error:  # a user's own effect can raise anything
            return failed_record("error", f"{type(error).__name__}: {error}"), None


def failed_record(status: str, message: Any) -> dict[str, Any]:
    """The record of a point that came to no iterate."""
    return {"status": status, "message": unbroken(message)}


def pack(path: Any) -> str:
    """A path, or that of a mission, as text, exact to the last bit."""
    import numpy as np

    if hasattr(path, "legs"):
        kinds = [name for name in JOINTS if hasattr(path, name)]
        joints = {name: {key: known.tolist() for key, known in getattr(path, name).items()} for name in kinds}
        facts = {"begins": path.begins, "idle": path.idle}
        facts |= {name: getattr(path, name) for name in PHASES if hasattr(path, name)}
        return json.dumps({"legs": [pack(leg) for leg in path.legs], **facts, **joints})
    arrays = {name: getattr(path, name) for name in ("mesh", "position", "control", "mass")}
    arrays |= {name: getattr(path, name) for name in ("start_velocity", "goal_velocity")}
    arrays |= {MULTIPLIER + str(key): values for key, values in path.multipliers.items()}
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer, order=path.order, hold=path.hold, duration=path.duration, allow_pickle=False, **arrays
    )
    return base64.b64encode(buffer.getvalue()).decode()


def unpack(text: str) -> Any:
    """The path that `pack` wrote."""
    import numpy as np

    from dmoc.motion.path import DiscretePath, Key

    if text.startswith("{"):
        held = json.loads(text)
        kinds = [name for name in JOINTS if name in held]
        joints = {name: {key: np.array(known) for key, known in held[name].items()} for name in kinds}
        facts: Any = {"idle": tuple(held.get("idle", ()))} | joints
        legs, begins = tuple(map(unpack, held["legs"])), tuple(held["begins"])
        if "joints" in held:
            from dmoc.phases.order import Place
            from dmoc.phases.path import PhasedPath

            order = tuple(tuple(Place(*place) for place in group) for group in held["joints"])
            return PhasedPath(legs, begins, **facts, names=tuple(held["names"]), joints=order)
        if "densities" in kinds:
            from dmoc.teams.path import TeamPath

            return TeamPath(legs, begins, **facts)
        from dmoc.chains.path import MissionPath

        return MissionPath(legs, begins, **facts)
    with np.load(io.BytesIO(base64.b64decode(text)), allow_pickle=False) as stored:
        arrays = dict(stored)
    multipliers = {
        Key.parse(name.removeprefix(MULTIPLIER)): arrays.pop(name)
        for name in list(arrays)
        if name.startswith(MULTIPLIER)
    }
    order, hold, duration = (arrays.pop(name).item() for name in ("order", "hold", "duration"))
    return DiscretePath(order=order, hold=hold, duration=duration, multipliers=multipliers, **arrays)


@lru_cache(maxsize=4)
def _problem_file(path: str, source_hash: str) -> ProblemFile:
    file = load_problem(path)
    if file.source_hash != source_hash:
        raise ValueError(f"{path} has changed since the sweep began; begin again with --restart")
    return file


def _solve(problem: Any, task: Task) -> tuple[Any, bool]:
    """From the neighbour if there is one, else, or if that fails, from the problem's own guess."""
    from dmoc.structure.front import solve

    if task.start is not None:
        solution = solve(problem, guess=unpack(task.start), **task.numerics)
        if solution.success or task.again:
            return solution, True
    return solve(problem, **task.numerics), False


def _record_of(solution: Any, warm: bool) -> dict[str, Any]:
    """What is kept of a solution; figures of a failed one mean nothing and are left out."""
    from dmoc.structure.front import verify

    problem = solution.require_problem()
    record: dict[str, Any] = {
        "status": solution.status,
        "message": "" if solution.success else solution.message,
        "from_neighbour": warm,
        "order": solution.order,
        "steps": solution.steps,
        "iterations": solution.iterations,
        "build_s": solution.build_s,
        "solve_s": solution.solve_s,
    }
    if not solution.success:
        return record
    begun = time.perf_counter()
    verdict = verify(solution)
    return record | {
        "success": True,
        "objective": solution.objective,
        "objective_name": problem.objective.label,
        "objective_unit": solution.provenance.objective_unit,
        "objective_sense": problem.objective.sense,
        "duration": solution.duration,
        "final_mass": solution.final_mass,
        "propellant": problem.mass - getattr(problem, "dropped", 0.0) - solution.final_mass,
        **_efforts(solution),
        **_worst(verdict),
        "verify_s": time.perf_counter() - begun,
    }


def _dispersed(solution: Any, errors: dict[str, Any]) -> dict[str, float]:
    """How far flights with errors come off, and how often they break a limit."""
    from dmoc.sensitivity.dispersion import SURE, disperse

    found = disperse(solution, **errors)
    _, away, fast = next(entry for entry in found.miss if entry[0] == SURE)
    broken = max((chance.value for chance in found.chances.values()), default=0.0)
    return {"miss": away, "miss_speed": fast, "broken": broken}


def _efforts(solution: Any) -> dict[str, float]:
    """Effort [N^2 s] and impulse [N s] of the force, by the scheme's own weights; kicks count as impulses."""
    import numpy as np

    from dmoc.motion.lobatto import scheme
    from dmoc.motion.mesh import node_weights

    effort = impulse = 0.0
    for leg in solution.parts:
        path = leg.path
        weights = np.diff(path.mesh) if path.hold else node_weights(path.mesh, scheme(path.order))
        size = np.linalg.norm(leg.force, axis=1)
        effort += float(0.5 * path.duration * weights @ size**2)
        impulse += float(path.duration * weights @ size)
    for one in getattr(solution, "members", (solution,)):
        for kick in getattr(one, "impulses", ()):
            # The mass before it: of the leg that ends there or, at the start, of the whole.
            before = [leg.final_mass for leg in one.legs if leg.time[-1] <= kick.time] or [one.problem.mass]
            impulse += before[-1] * kick.size
    return {"effort": effort, "impulse": impulse}


def _worst(verdict: Report) -> dict[str, Any]:
    """The failed check that is furthest beyond its limit, and how many times beyond."""
    failed = {
        check.name: check.value / check.limit if check.value is not None and check.limit else float("inf")
        for check in verdict.checks
        if not check.ok
    }
    worst = max(failed, key=lambda name: failed[name], default="")
    return {"checks_hold": verdict.ok, "failed_check": worst, "failed_by": failed.get(worst)}
