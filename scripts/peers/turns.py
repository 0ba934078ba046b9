"""Which mesh each tool needs for an accuracy, and what that costs: runs in turns, a process each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from peers.answer import Answer, error
from peers.meshes import MESHES
from peers.tasks import TASKS

ACCURACIES = (1e-3, 1e-5, 1e-7)
# Names of the tools in the table, in its order.
TOOLS = {"asset": "ASSET", "casadi": "CasADi by hand", "dmoc": "dmoc"}
# Solves after the first in a process whose times count as warm: so many, but one where it took longer than
# BRIEF [s].
WARM, BRIEF = 2, 0.2
# A run that takes longer than this [s] does not count.
PATIENCE = 60
# Solves that take longer than this [s] are timed in the first LEAST turns alone.
SLOW, LEAST = 2.0, 3
SCRIPTS = Path(__file__).parents[1]
# Processor time adds up over threads, and threads that wait in turn cost some.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


class NotInstalledError(RuntimeError):
    """A tool that is not there."""


@dataclass
class Run:
    """A tool on a problem and a mesh, and the processor time of its solves [s]."""

    tool: str
    task: str
    mesh: tuple
    error: float = float("nan")
    status: str = ""
    first: list[float] = field(default_factory=list)
    warm: list[float] = field(default_factory=list)

    def facts(self) -> dict[str, Any]:
        """For JSON, times in [s]."""
        known = {"tool": self.tool, "problem": self.task, "mesh": list(self.mesh)}
        known |= {"error": self.error, "status": self.status}
        return known | {"first": median(self.first), "warm": median(self.warm), "runs": len(self.first)}


class Bench:
    """Runs of the tools, ASSET's by an interpreter that has it."""

    def __init__(self, asset: str = sys.executable, told: Callable[[str], None] = print):
        self.pythons = {"asset": asset, "casadi": sys.executable, "dmoc": sys.executable}
        self.told = told

    def refuse_missing(self, tool: str) -> None:
        """Raise `NotInstalledError` with the remedy if a tool is not there."""
        module = {"asset": "asset_asrl"}.get(tool, tool)
        seen = subprocess.run([self.pythons[tool], "-c", f"import {module}"], capture_output=True)
        if seen.returncode:
            raise NotInstalledError(
                f"{TOOLS[tool]} is not installed for {self.pythons[tool]}: its cells stay empty. "
                'Install it with "pip install dmoc[bench]", or name an interpreter that has it by --asset'
            )

    def version_of_asset(self) -> str:
        """Empty if it is not there."""
        code = "from importlib.metadata import version; print(version('asset_asrl'))"
        seen = subprocess.run([self.pythons["asset"], "-c", code], capture_output=True, text=True)
        return seen.stdout.strip()

    def once(self, tool: str, task: str, mesh: tuple, again: int) -> tuple[list[float], Answer] | None:
        """Times of the solves of a new process [s] and the last answer; None if it fails or takes too long."""
        words = [self.pythons[tool], "-m", "peers.worker", tool, task, json.dumps(mesh), str(again)]
        paths = os.pathsep.join([str(SCRIPTS), str(SCRIPTS.parent)])
        try:
            done = subprocess.run(
                words,
                env=os.environ | ONE_THREAD | {"PYTHONPATH": paths},
                capture_output=True,
                text=True,
                timeout=PATIENCE,
            )
        except subprocess.TimeoutExpired:
            return None
        if done.returncode:
            self.told(f"{tool} {task} {mesh}: {done.stderr.strip().splitlines()[-1]}")
            return None
        # a tool may print lines of its own before
        found = json.loads(done.stdout.splitlines()[-1])
        return found["seconds"], Answer.of(found["answer"])

    def tried(self, tool: str, task: str) -> list[tuple[float, Run]]:
        """Meshes of the short list up to the best accuracy, with the time of one warm solve [s]."""
        runs: list[tuple[float, Run]] = []
        for mesh in MESHES[tool][task]:
            if any(run.error <= ACCURACIES[-1] for _, run in runs):
                break
            if (found := self.once(tool, task, mesh, 1)) is not None:
                seconds, answer = found
                runs.append((seconds[-1], Run(tool, task, mesh, error(TASKS[task], answer), answer.status)))
                self.told(f"{tool:7} {task} {named(tool, mesh):32} error {runs[-1][1].error:.1e}")
        return runs

    def time(self, runs: list[Run], repeats: int) -> None:
        """The times of runs, which take turns, so that whatever else the computer does falls on all alike."""
        for turn in range(repeats):
            for run in runs:
                if turn >= LEAST and run.first and median(run.first) > SLOW:
                    continue
                again = 1 if run.first and run.first[-1] > BRIEF else WARM
                if (found := self.once(run.tool, run.task, run.mesh, again)) is not None:
                    run.first.append(found[0][0])
                    run.warm.append(median(found[0][1:]))
            self.told(f"turn {turn + 1} of {repeats}")


def cheapest(tried: list[tuple[float, Run]]) -> dict[float, Run]:
    """By accuracy, the run that was fastest of those that reach it; none where no mesh does."""
    chosen = {}
    for accuracy in ACCURACIES:
        reached = [each for each in tried if each[1].error <= accuracy]
        if reached:
            chosen[accuracy] = min(reached, key=lambda each: each[0])[1]
    return chosen


def compared(bench: Bench, repeats: int) -> dict[tuple[str, str, float], Run]:
    """By problem, tool and accuracy the cheapest run that reaches it, timed."""
    chosen: dict[tuple[str, str, float], Run] = {}
    for tool in TOOLS:
        try:
            bench.refuse_missing(tool)
        except NotInstalledError as missing:
            bench.told(str(missing))
            continue
        for task in TASKS:
            found = cheapest(bench.tried(tool, task))
            chosen |= {(task, tool, accuracy): run for accuracy, run in found.items()}
    different = {id(run): run for run in chosen.values()}
    bench.time(list(different.values()), repeats)
    return {key: run for key, run in chosen.items() if run.first}


def named(tool: str, mesh: tuple) -> str:
    """A mesh in words."""
    if tool == "dmoc":
        return f"`--tol {mesh[2]:g}`" if mesh[0] is None else f"order {mesh[0]}, {mesh[1]}"
    return f"{mesh[0]}, {' to '.join(str(count) for count in mesh[1:])}"
