"""What a program reads: one JSON object, without the libraries that draw tables."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dmoc.checks.verification import Report
    from dmoc.results.solution import Solution


def result(solution: Solution, report: Report | None) -> dict[str, Any]:
    """The JSON object of a solve; numbers that are not finite become null."""
    listed = report.checks if report else ()
    return {
        "problem": solution.require_problem().name,
        "success": bool(solution.success),
        "status": solution.status,
        "objective": _finite(solution.objective),
        "duration": _finite(solution.duration),
        "final_mass": _finite(solution.final_mass),
        "order": int(solution.order),
        "steps": int(solution.steps),
        "nodes": len(solution.position),
        "iterations": int(solution.iterations),
        "build_s": _finite(solution.build_s),
        "solve_s": _finite(solution.solve_s),
        "verify_s": _finite(report.seconds if report else 0.0),
        "checks": {
            check.name: {
                "value": _finite(check.value),
                "limit": _finite(check.limit),
                "unit": check.unit,
                "ok": bool(check.ok),
            }
            for check in listed
        },
    }


def as_text(value: dict[str, Any]) -> str:
    """One object, valid JSON even where a number was not finite."""
    return json.dumps(value, indent=2, allow_nan=False)


def _finite(value: Any) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None
