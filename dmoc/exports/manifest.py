"""What the manifest of an export says: functions with their arguments, schemes, versions, checksums."""

from __future__ import annotations

import platform
from typing import Any

import casadi as ca
import numpy as np

from dmoc import __version__
from dmoc.planners.functions import Scene
from dmoc.planners.mission import MissionPlanner
from dmoc.planners.planner import Planner
from dmoc.planners.terms import Exported

# The manifest names this format: a folder whose manifest does not is never written over.
EXPORT_FORMAT = "dmoc export"
# The version of the manifest, for programs that read it: one of version 1 has no checksum of its own.
EXPORT_VERSION = 2


def about_transfer(planner: Planner) -> dict[str, Any]:
    """What the manifest says of a transfer beside its functions."""
    scene, problem = planner.scene, planner.scene.problem
    return {
        "problem": {"name": problem.name, "parameters": problem.parameters},
        "scheme": _scheme(scene),
        "controls": list(problem.actuator.labels(scene.axes)),
    }


def about_mission(planner: MissionPlanner) -> dict[str, Any]:
    """What the manifest says of a mission or a team beside its functions: a scheme for each leg or body."""
    mission, legs = planner.mission, zip(planner.names, planner.mission.leg_names, planner.scenes, strict=True)
    return {
        "problem": {"name": mission.name, "parameters": mission.parameters},
        planner.stretches: {
            name: {
                "words": words,
                "scheme": _scheme(scene) | {"mesh": list(scene.mesh) or "equal steps"},
                "controls": list(scene.problem.actuator.labels(scene.axes)),
            }
            for name, words, scene in legs
        },
    }


def _scheme(scene: Scene) -> dict[str, Any]:
    return {"order": scene.rule.order, "steps": scene.steps, "hold": scene.hold, "nodes": scene.nodes}


def manifest(
    about: dict[str, Any], functions: list[Exported], count: int, sums: dict[str, str]
) -> dict[str, Any]:
    """The manifest; the first `count` functions are C code too."""
    names = {exported.function.name() for exported in functions[:count]}
    return {
        "format": EXPORT_FORMAT,
        "format_version": EXPORT_VERSION,
        **about,
        "versions": {
            "dmoc": __version__,
            "casadi": ca.__version__,
            "numpy": np.__version__,
            "python": platform.python_version(),
        },
        "functions": {
            exported.function.name(): _entry(exported, exported.function.name() in names)
            for exported in functions
        },
        "files": sums,
    }


def _entry(exported: Exported, in_c: bool) -> dict[str, Any]:
    f = exported.function
    places = {
        "inputs": [(f.name_in(i), f.size_in(i)) for i in range(f.n_in())],
        "outputs": [(f.name_out(i), f.size_out(i)) for i in range(f.n_out())],
    }
    lists = {
        kind: [{"name": name, "shape": list(shape), **vars(exported.term(name))} for name, shape in found]
        for kind, found in places.items()
    }
    files = {"file": f"{f.name()}.casadi"} | ({"c": "c/functions.c"} if in_c else {})
    return {"words": exported.words, **files, **lists}


def plain(value: Any) -> Any:
    """What JSON does not know: arrays as lists, everything else as text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
