"""How fast dmoc is, end to end (build and solve), against the methods of scripts/alternatives.py.

    ./scripts/run python scripts/benchmark.py                 under three minutes
    ./scripts/run python scripts/benchmark.py --json out.json --largest 1000000
    ./scripts/run python scripts/benchmark.py --peers         beside ASSET and CasADi by hand, eight minutes
    ./scripts/run python scripts/benchmark.py --peers --write  and into docs/peers.md

Ratios are between medians of runs that take turns, so that whatever else the computer does falls on both
alike. Iterations and evaluations stand beside the seconds: they do not depend on the computer. dmoc remembers
the functions it writes down for a scene, so its times are two: of the first solve in a process, and of another
one in the same process.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from alternatives import METHODS, radau
from benchmark_report import (
    console,
    milliseconds,
    show_equal_error,
    show_pairs,
    show_parts,
    show_verdicts,
    verdicts,
)
from peers import table, turns

from dmoc import BallForce, PointGravity, State, TransferProblem, solve, transcribe, verify
from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.scene.problem_file import load_problem
from dmoc.studies.accuracy import Trial, time_to_reach, work_precision

# The true optimum of each problem, to the digits that are known.
OPTIMA = {"orbit_raise": 1.6903228946e-3, "rendezvous": 1.0488423230643e-3, "K1": 0.010173701094176}
# Methods are compared by the time they take to this relative error of the objective [-].
TARGET = 1e-6
# Whether the same process has solved the scene before.
STATES = {"first": False, "same process": True}
ORDERS = {"order 2": 2, "order 4": 4, "order 6": 6, "order 8": 8}
OTHERS = METHODS | {f"Radau {d}": partial(radau, degree=d) for d in (2, 3, 4, 5, 7)}
ORDERS |= {"plain": 2, "trapezoid": 2, "RK4 shooting, held": 2, "RK4 shooting": 4, "Hermite-Simpson": 4}
ORDERS |= {f"Radau {d}": 2 * d - 1 for d in (2, 3, 4, 5, 7)}
# By order, steps of a first solve; the number of steps for TARGET follows from its error and the order.
PILOT = {2: 800, 3: 100, 4: 60, 5: 30, 6: 16, 7: 12, 8: 10, 9: 8, 13: 5}


def kepler_transfer() -> TransferProblem:
    """K1: from the circular orbit of radius 1 to that of 1.5 by 4 rad in 5 time units, least effort."""
    speed = 1 / math.sqrt(1.5)
    goal = State((1.5 * math.cos(4), 1.5 * math.sin(4)), (-speed * math.sin(4), speed * math.cos(4)))
    return TransferProblem(1.0, State((1, 0), (0, 1)), goal, 5.0, effects=[PointGravity(1.0)])


def smooth_problems() -> dict[str, TransferProblem]:
    made = {name: load_problem(name).make() for name in ("orbit_raise", "rendezvous")}
    return made | {"K1": kepler_transfer()}


# --- the same scheme, written plainly ---------------------------------------------------------------------


def against_plain(steps: int, repeats: int) -> dict[str, Any]:
    """Coarse to fine with assembled derivatives against eq. (16) written down: the same discrete optimum."""
    problem = load_problem("orbit_raise").make()
    given = problem, (2,), (steps,), repeats, {"plain": METHODS["plain"]}, OPTIMA["orbit_raise"]
    found = {state: work_precision(*given, solved_before=before) for state, before in STATES.items()}
    return {
        "steps": steps,
        "dmoc": {state: _facts(ours) for state, (ours, _) in found.items()},
        "plain": _facts(found["first"][1]),
        "ratio": {state: theirs.seconds / ours.seconds for state, (ours, theirs) in found.items()},
    }


def _facts(trial: Trial) -> dict[str, Any]:
    names = ("build_s", "solve_s", "iterations", "calls", "error", "steps")
    return {"seconds": trial.seconds} | {name: getattr(trial, name) for name in names}


# --- another start or limit, without a rebuild ------------------------------------------------------------


def resolve(name: str, change: Any, steps: int = 400, repeats: int = 9) -> dict[str, Any]:
    """A problem solved again with another start or limit, against solving it anew, by dmoc and by `plain`."""
    problem = load_problem(name).make()
    changed, known = change(problem), solve(problem, steps=steps).raise_for_status()
    nlp = transcribe(problem, steps, guess=known)
    ways = {
        "no rebuild": partial(nlp.solve, changed, guess=known),
        "anew": partial(solve, changed, steps=steps),
    }
    times: dict[str, list[float]] = {way: [] for way in (*ways, "plain")}
    found: dict[str, Any] = {}
    for _ in range(repeats):
        for way, again in ways.items():
            begun = time.perf_counter()
            found[way] = again().raise_for_status()
            times[way].append(time.perf_counter() - begun)
        (theirs,) = work_precision(changed, (), (steps,), 1, {"plain": METHODS["plain"]}, 1.0)
        times["plain"].append(theirs.seconds)
    seconds = {way: median(each) for way, each in times.items()}
    return {
        "problem": name,
        "same optimum": {way: abs(one.objective / theirs.objective - 1) for way, one in found.items()},
        "dmoc": {way: {"seconds": seconds[way], "iterations": found[way].iterations} for way in ways},
        "plain": {"seconds": seconds["plain"], "iterations": theirs.iterations},
        "ratio": {way: seconds["plain"] / seconds[way] for way in ways},
    }


def moved_start(problem: TransferProblem) -> TransferProblem:
    """Start one hundredth further out and half a hundredth slower."""
    position, velocity = problem.start.fixed()
    return replace(problem, start=State(1.01 * position, 0.995 * velocity))


def weaker(problem: TransferProblem) -> TransferProblem:
    """A limit lower by three hundredths."""
    return replace(problem, actuator=BallForce(0.97 * problem.actuator.force_limit()))


# --- equal error ------------------------------------------------------------------------------------------


def equal_error(name: str, problem: TransferProblem) -> dict[str, Any]:
    """Seconds of every method to an error of TARGET in the objective, from meshes just coarser and finer."""
    optimum, meshes = OPTIMA[name], {}
    for method, order in ORDERS.items():
        (trial,) = _some(problem, {method: [PILOT[order]]}, 1, optimum)
        steps = PILOT[order] * (max(trial.error, 1e-14) / TARGET) ** (1 / order)
        meshes[method] = [max(3, math.floor(0.8 * steps)), max(5, math.ceil(1.25 * steps))]
    many = {method: counts for method, counts in meshes.items() if counts[-1] > 2000}
    few = {method: counts for method, counts in meshes.items() if method not in many}
    trials = _some(problem, few, 5, optimum) + _some(problem, many, 1, optimum)
    rows = {
        method: {
            "seconds": {"first": found},
            "steps": meshes[method],
            "solves": [_facts(trial) for trial in trials if trial.method == method],
        }
        for method, (found,) in time_to_reach(trials, (TARGET,)).items()
    }
    own = {method: counts for method, counts in few.items() if method.startswith("order ")}
    for state, before in STATES.items():
        again = time_to_reach(_some(problem, own, 7, optimum, before), (TARGET,))
        for method, (found,) in again.items():
            rows[method]["seconds"][state] = found
    best = {state: min(rows[method]["seconds"][state] or math.inf for method in own) for state in STATES}
    for row in rows.values():
        first = row["seconds"]["first"]
        row["ratio"] = {state: None if first is None else first / best[state] for state in STATES}
    return {"problem": name, "target": TARGET, "best": best, "methods": rows}


def _some(
    problem: TransferProblem,
    meshes: dict[str, list[int]],
    repeats: int,
    optimum: float,
    solved_before: bool = False,
) -> list[Trial]:
    orders = [ORDERS[method] for method in meshes if method.startswith("order ")]
    others = {method: OTHERS[method] for method in meshes if method in OTHERS}
    return work_precision(problem, orders, meshes, repeats, others, optimum, solved_before=solved_before)


# --- where the time goes ----------------------------------------------------------------------------------


def import_seconds() -> float:
    """Seconds until `dmoc.solve` is there, in a new process."""
    code = "import time; t = time.perf_counter(); import dmoc; dmoc.solve; print(time.perf_counter() - t)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True) for _ in range(3)]
    return median(float(done.stdout) for done in runs)


def parts_of_a_solve(steps: int) -> dict[str, Any]:
    """Seconds of guess, building, evaluating, linear algebra, the rest of Ipopt, and verification."""
    problem = load_problem("orbit_raise").make()
    begun = time.perf_counter()
    starting_guess(problem, uniform_mesh(steps), 2, False)
    guess = time.perf_counter() - begun
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ipopt.txt"
        options = {"output_file": str(file), "file_print_level": 3, "file_append": "yes"}
        options["print_timing_statistics"] = "yes"
        begun = time.perf_counter()
        found = solve(problem, steps=steps, options={f"ipopt.{key}": value for key, value in options.items()})
        seconds = time.perf_counter() - begun
        evaluating, algebra = (spent_in(file, part) for part in ("Function Evaluations", "PDSystemSolverTotal"))
    return {
        "steps": steps,
        "guess": guess,
        "build": found.build_s,
        "evaluation": evaluating,
        "linear algebra": algebra,
        "rest of Ipopt": found.solve_s - evaluating - algebra,
        "rest": seconds - guess - found.build_s - found.solve_s,
        "solve in all": seconds,
        "verification": verify(found).seconds,
        "levels": [(level.steps, level.iterations) for level in found.ladder],
    }


def spent_in(file: Path, part: str) -> float:
    """Seconds on all meshes in a part of Ipopt, from the statistics it wrote."""
    lines = [line for line in file.read_text().splitlines() if line.startswith(part)]
    return sum(float(line.split("wall:")[1].rstrip(" )")) for line in lines)


def measure(largest: int) -> dict[str, Any]:
    """Everything, shown as it comes."""
    results: dict[str, Any] = {"import": import_seconds()}
    console.print(f"import dmoc: {milliseconds(results['import'])} ms")
    results["plain"] = [against_plain(400, 7), against_plain(25_600, 2)]
    show_pairs("The same scheme: orbit_raise", [(f"{each['steps']} steps", each) for each in results["plain"]])
    results["resolve"] = {"start": resolve("orbit_raise", moved_start), "limit": resolve("drone_hop", weaker)}
    pairs = [(f"{each['problem']}, another {what}", each) for what, each in results["resolve"].items()]
    show_pairs("Solved again, 400 steps", pairs)
    results["equal error"] = [equal_error(name, problem) for name, problem in smooth_problems().items()]
    for found in results["equal error"]:
        show_equal_error(found)
    results["parts"] = [
        parts_of_a_solve(n) for n in (50, 400, 3200, 25_600, 100_000, 1_000_000) if n <= largest
    ]
    show_parts(results["parts"])
    show_verdicts(verdicts(results))
    return results


def beside_peers(repeats: int, asset: str, write: bool) -> list[dict[str, Any]]:
    """Every tool to every accuracy, shown and, if asked for, written into the page."""
    bench = turns.Bench(asset, console.print)
    runs = turns.compared(bench, repeats)
    table.show(runs, console)
    if write:
        table.write(runs, bench.version_of_asset())
    return table.facts(runs)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures here")
    parser.add_argument("--largest", type=int, default=25_600, help="most steps to take apart (1000000: slow)")
    peers = parser.add_argument_group("beside ASSET and CasADi by hand")
    peers.add_argument("--peers", action="store_true", help="measure these, and nothing else")
    peers.add_argument("--repeats", type=int, default=9, help="processes of each run; medians count")
    peers.add_argument("--asset", default=sys.executable, metavar="PYTHON", help="interpreter that has ASSET")
    peers.add_argument("--write", action="store_true", help="write the table into docs/peers.md")
    given, begun = parser.parse_args(), time.perf_counter()
    if given.repeats < 1:
        parser.error(f"--repeats must be at least 1; got {given.repeats}")
    if given.write and not given.peers:
        parser.error("--write is for the table of --peers; give both")
    if given.peers:
        results: Any = beside_peers(given.repeats, given.asset, given.write)
    else:
        results = measure(given.largest)
    console.print(f"\n{time.perf_counter() - begun:.0f} s")
    if given.json is not None:
        given.json.write_text(json.dumps(results, indent=2))


if __name__ == "__main__":
    main()
