"""What a program reads: one JSON object, without the libraries that draw tables."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from dmoc.answers.facts import facts_of
from dmoc.basics.plain import finite
from dmoc.reports.ends import dates_object
from dmoc.reports.verdict import accuracy

if TYPE_CHECKING:
    from dmoc.checks.verification import Report
    from dmoc.motion.march import Trajectory
    from dmoc.results.solution import Solution
    from dmoc.sensitivity.dispersion import Dispersion
    from dmoc.sensitivity.worth import Worth


def solve_object(solution: Solution, report: Report | None) -> dict[str, Any]:
    """The JSON object of a solve; `message` says what to try if it failed, `worst` names its worst rows."""
    listed = report.checks if report else ()
    return {
        "problem": solution.require_problem().name,
        "success": bool(solution.success),
        "status": solution.status,
        "message": solution.message,
        "worst": [
            {"row": row, "violation": float(violation), "unit": unit} for row, violation, unit in solution.worst
        ],
        "warnings": list(solution.warnings),
        "objective": float(solution.objective),
        "duration": float(solution.duration),
        "final_mass": float(solution.final_mass),
        "order": int(solution.order),
        "steps": int(solution.steps),
        "nodes": len(solution.position),
        "iterations": int(solution.iterations),
        "build_s": float(solution.build_s),
        "solve_s": float(solution.solve_s),
        "verify_s": float(report.seconds if report else 0.0),
        "accuracy": accuracy(solution, report) if report else None,
        "checks": {
            check.name: {
                "value": _float(check.value),
                "limit": _float(check.limit),
                "unit": check.unit,
                "ok": bool(check.ok),
            }
            for check in listed
        },
        **dates_object(solution),
        "facts": _facts(solution) if report and math.isfinite(solution.objective) else {},
        **(_of_mission(solution) if hasattr(solution, "impulses") else {}),
        **(_of_team(solution) if hasattr(solution, "members") else {}),
    }


def _of_mission(solution: Any) -> dict[str, Any]:
    """The legs, the impulses and the length of the primer vector over time."""
    axes = solution.dimension
    times, sizes = solution.primer if solution.impulses and solution.path.warm else ([], [])
    return {
        "legs": [
            {
                "name": leg.provenance.problem_name,
                "start_time": float(leg.provenance.start_time),
                "duration": float(leg.duration),
                "order": int(leg.order),
                "steps": int(leg.steps),
                "cost": float(leg.objective),
                "start_mass": float(leg.path.mass[0]),
                "final_mass": float(leg.final_mass),
            }
            for leg in solution.legs
        ],
        "impulses": [
            {
                "at": kick.joint,
                "time": float(kick.time),
                "position": [float(x) for x in kick.position],
                "velocity_change": [float(x) for x in kick.change[:axes]],
                "size": float(kick.size),
            }
            for kick in solution.impulses
        ],
        "primer": {"time": [float(t) for t in times], "length": [float(size) for size in sizes]},
    }


def _facts(solution: Any) -> dict[str, Any]:
    """What users ask of an answer, in SI units."""
    return {name: {"value": fact.value, "unit": fact.unit} for name, fact in facts_of(solution).items()}


def _of_team(solution: Any) -> dict[str, Any]:
    """The bodies, and the least distance of each two of them at the nodes."""
    names = solution.names
    return {
        # All bodies share them.
        "nodes": len(solution.time),
        "bodies": [
            {
                "name": name,
                "cost": float(one.objective),
                "final_mass": float(one.final_mass),
                **(_of_mission(one) if hasattr(one, "legs") else {}),
            }
            for name, one in zip(names, solution.members, strict=True)
        ],
        "distances": [
            {"between": [a, b], "least": float(apart.min()), "at": float(solution.time[apart.argmin()])}
            for i, a in enumerate(names)
            for b in names[i + 1 :]
            for apart in [solution.distance(a, b)]
        ],
    }


def motion_object(trajectory: Trajectory, problem: Any, coast: bool) -> dict[str, Any]:
    """The JSON object of a simulation: its end, and how much its energy changed on the way."""
    energy = trajectory.energy
    most, kept = energy_change(trajectory, problem, coast)
    last = {
        "position": trajectory.position[-1],
        "velocity": trajectory.velocity[-1],
        "attitude": None if trajectory.attitude is None else trajectory.attitude[-1],
        "rate": None if trajectory.rate is None else trajectory.rate[-1],
    }
    return {
        "problem": problem.name,
        "coast": coast,
        "steps": len(trajectory.time) - 1,
        "start_time": float(trajectory.time[0]),
        "final_time": float(trajectory.time[-1]),
        **{f"final_{name}": [float(x) for x in row] for name, row in last.items() if row is not None},
        "final_mass": float(trajectory.mass[-1]),
        "start_energy": float(energy[0]),
        "final_energy": float(energy[-1]),
        "energy_change": most,
        "energy_is_kept": kept,
    }


def energy_change(trajectory: Trajectory, problem: Any, coast: bool) -> tuple[float, bool]:
    """The largest change of the energy [J/kg], and whether any is an error of the scheme: nothing does work."""
    from dmoc.effects.base import Conservative

    energy = trajectory.energy
    kept = coast and all(isinstance(effect, Conservative) for effect in problem.effects)
    return float(abs(energy - energy[0]).max()), kept


def sweep_object(data: Any, path: Any) -> dict[str, Any]:
    """The JSON object of a sweep: how many points were solved, and each with its parameters and results."""
    import numpy as np

    from dmoc.sweeps.data import COLUMNS

    varied = [str(name) for name in data.coords]
    columns = {name: data[f"found_{name}" if name in varied else name].values for name in COLUMNS}
    points = []
    for at in np.ndindex(columns["success"].shape):
        given = {
            name: data[name].values[at if data[name].ndim == len(at) else at[data["success"].dims.index(name)]]
            for name in varied
        }
        found = {name: values[at] for name, values in columns.items()}
        points.append({name: _plain(value) for name, value in ({"parameters": given} | found).items()})
    solved = int(columns["success"].sum())
    objective = data["found_objective" if "objective" in varied else "objective"].attrs
    return {
        "problem": str(data.attrs.get("problem", "")),
        "file": str(path),
        "varied": varied,
        "points": len(points),
        "solved": solved,
        "checks_fail": solved - int((columns["success"] & columns["checks_hold"]).sum()),
        "objective": str(objective["kind"]),
        "objective_unit": str(objective["units"]),
        "results": points,
    }


def _plain(value: Any) -> Any:
    """A number, a text or a dictionary of them as JSON holds it."""
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    return value.item() if hasattr(value, "item") else value


def worth_object(found: dict[str, Worth]) -> dict[str, Any]:
    """For JSON: of each number its worth, the unit of that, the number itself with its unit, and the range."""
    return {
        name: {
            "value": one.value,
            "unit": one.unit,
            "range": None if one.range is None else list(one.range),
            "number": one.number,
            "number_unit": one.of,
        }
        for name, one in found.items()
    }


def dispersion_object(found: Dispersion, solution: Any) -> dict[str, Any]:
    """For JSON: spread at the end, miss of the planned end, and of each limit how often it is broken."""
    axes = found.position.shape[2]
    spread = {
        name: {"position": list(map(float, sigma[-1][:axes])), "velocity": list(map(float, sigma[-1][axes:]))}
        for name, sigma in (("linear", found.sigma), ("sampled", found.sampled_sigma))
    }
    return {
        "problem": solution.provenance.problem_name,
        "samples": found.samples,
        "seed": found.seed,
        "sigma_at_end": spread,
        "miss": [{"part": part, "position": place, "velocity": speed} for part, place, speed in found.miss],
        "limits": {name: asdict(chance) for name, chance in found.chances.items()},
    }


def as_text(value: dict[str, Any]) -> str:
    """One object as JSON, where numbers that are not finite become null."""
    return json.dumps(finite(value), indent=2, allow_nan=False)


def _float(value: Any) -> float | None:
    return None if value is None else float(value)
