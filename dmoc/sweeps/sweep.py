"""Sweeps: one problem over a grid or a sample of its parameters, in worker processes, kept as it goes."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.assembly.compiled import usable_cores
from dmoc.basics.arguments import number, short
from dmoc.scene.problem_file import ProblemFile, load_problem
from dmoc.sweeps.data import FLIGHTS, PATH, as_attributes, sweep_dataset, write_sweep
from dmoc.sweeps.journal import Journal
from dmoc.sweeps.loop import Sweep, SweepProgress
from dmoc.sweeps.plan import Plan, make_plan
from dmoc.sweeps.pool import LocalPool, Pool, SchedulerPool
from dmoc.sweeps.worker import Task

if TYPE_CHECKING:
    from xarray import Dataset

# A sweep takes at most this many worker processes: more than any computer has cores.
MOST_WORKERS = 4096


def sweep(
    problem: str | os.PathLike,
    vary: Mapping[str, Any],
    out: str | os.PathLike,
    *,
    settings: Mapping[str, Any] | None = None,
    sample: int | None = None,
    method: str = "sobol",
    seed: int = 0,
    order: int | None = None,
    steps: int | None = None,
    tol: float | None = None,
    hold: bool = False,
    follow: bool = False,
    keep: str | None = None,
    errors: Mapping[str, Any] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
    progress: SweepProgress | None = None,
    time_limit: float | None = None,
) -> Dataset:
    """Solve and verify a problem at many values of its parameters.

    Every point is solved in a worker process, from the problem's own guess. One that failed, or that
    is worse than its neighbours on every side along a dimension, is tried again from the best of
    them, and so are the neighbours of what became better; the better answer counts.

    Each finished point goes into a journal beside `out`. A sweep that was interrupted or killed goes
    on where it was when it is started again, and ends with the same numbers; the journal goes when
    the result is written. Failures are data: see the variables status and message.

    In a script, call this below `if __name__ == "__main__":`, as for everything that starts processes.

    Parameters
    ----------
    problem : str or path
        Name or path of a problem file.
    vary : mapping
        By name of the parameter the values of the grid, or a text "start:stop:count" or
        "value,value,..."; for a sample a range (start, stop) or "start:stop". "start:stop:log7" has seven
        values of equal ratio, "start:stop:log" a sample even in the logarithm. Units as documented there.
    out : path
        The netCDF file to write_sweep.
    settings : mapping
        Values of other parameters.
    sample : int
        Number of points to spread over the ranges instead of a grid; by `method`, "sobol" or
        "latin" (a Latin hypercube), from `seed`.
    order, steps, tol, hold
        As for `solve`.
    follow : bool
        Start every point from the answer of the one before along the last dimension, in runs of
        eight: up to twice as fast, but on the branch of local optima that the run begins with.
    keep : str
        "paths": the file holds the path of every answer, too, a few kilobytes each, so that a point of it can
        be a guess or a picture (`dmoc solve --guess map.nc:duration=12`, `dmoc plot map.nc:duration=12`).
    errors : mapping
        Arguments of `disperse`, as {"start": (0.01, 0.001), "force": 0.01, "samples": 200}: every answer is
        flown with errors, and the result has the variables miss, miss_speed and broken, too.
    workers : int
        Processes; as many as there are cores if not given.
    scheduler : str
        Address of a `dask.distributed` scheduler whose workers do it instead. They read the problem
        file at the same path.
    restart : bool
        Begin anew even where a journal is there.
    progress : callable
        Called with (tries made, tries in all as far as known, points not solved so far).
    time_limit : float
        Seconds after which the solve of a point ends: that is no success, the message says so, and the point is
        tried again from a neighbour.

    Returns
    -------
    xarray.Dataset
        What is in the file: dimensions are the swept parameters, or `sample`; variables objective,
        duration, final_mass, success, status and more, each with its unit. A result that has the
        name of a swept parameter is called found_<name>.

    Raises
    ------
    ValueError
        If an argument has no meaning for the problem, every point is refused, or the journal belongs
        to another sweep.
    OSError
        If the scheduler is lost; the journal is kept.
    """
    file, fixed = load_problem(str(problem)), dict(settings or {})
    plan = make_plan(file, vary, sample, method, seed, fixed)
    if follow and plan.sampled:
        raise ValueError("a sample has no order in which to follow a branch; leave out follow, or use a grid")
    wrong = isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= MOST_WORKERS
    if workers is not None and wrong:
        raise ValueError(
            f"workers must be a whole number of at most {MOST_WORKERS} and at least 1; got {workers!r}"
        )
    if keep not in (None, "paths"):
        raise ValueError(f"keep must be 'paths' or nothing; got {keep!r}")
    numerics: dict[str, Any] = {"order": order, "steps": steps, "tol": tol, "hold": hold}
    if time_limit is not None:
        numerics["time_limit"] = number("time_limit", time_limit, "s", positive=True)
    known = _errors(errors)
    facts = _facts(file, plan, fixed, numerics | {"follow": follow} | ({"errors": known} if known else {}))
    if plan.sampled:
        facts |= {"method": method, "seed": seed}

    def task(point: int, start: str | None, again: bool) -> Task:
        values = fixed | plan.at(point)
        return Task(str(file.path.resolve()), file.source_hash, values, numerics, start, again, known)

    with Journal(out, facts | {"vary": plan.listing()}, restart) as journal:
        with _pool(workers, scheduler) as pool:
            under_way = Sweep(plan, journal, pool, task, progress)
            records = under_way.run(follow)
        if all(record["status"] == "refused" for record in records):
            journal.remove()
            raise ValueError(f"every point was refused, the first with: {records[0]['message']}")
        created = {"created": datetime.now(UTC).isoformat(timespec="seconds")}
        if keep is not None:
            records = [record | {"path": under_way.path(point)} for point, record in enumerate(records)]
        more = (PATH if keep is not None else {}) | (FLIGHTS if known is not None else {})
        data = sweep_dataset(plan, records, as_attributes(facts) | created, more)
        write_sweep(data, out)
        journal.remove()
    return data


def _errors(given: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Arguments of `disperse`, or a line that says which there are."""
    if given is None:
        return None
    from inspect import signature

    from dmoc.sensitivity.dispersion import disperse

    names = [name for name in signature(disperse).parameters if name != "solution"]
    if strange := [name for name in given if name not in names]:
        raise ValueError(f"no error is called {short(strange[0])}; there are {', '.join(names)}")
    return dict(given)


def _pool(workers: int | None, scheduler: str | None) -> Pool:
    if scheduler is None:
        return LocalPool(workers or usable_cores())
    if workers is not None:
        raise ValueError("a scheduler has its own workers; leave out the number of workers")
    return SchedulerPool(scheduler)


def _facts(file: ProblemFile, plan: Plan, fixed: dict[str, Any], numerics: dict[str, Any]) -> dict[str, Any]:
    """What decides the numbers of a sweep."""
    import casadi
    import scipy

    from dmoc import __version__

    versions = {"dmoc": __version__, "casadi": casadi.__version__, "numpy": np.__version__}
    versions |= {"scipy": scipy.__version__, "python": platform.python_version()}
    facts = {"problem": file.name, "source_hash": file.source_hash, "settings": fixed}
    return facts | numerics | {"sampled": plan.sampled} | versions
