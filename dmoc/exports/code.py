"""C code of exported functions: CasADi's own, a header that says what every argument is, an example."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from dmoc.exports.example import example_call, in_comment, macro_of
from dmoc.planners.functions import Scene
from dmoc.planners.mission import MissionPlanner
from dmoc.planners.planner import Planner
from dmoc.planners.terms import Exported

# What stands before CasADi's own code.
PREFACE = """\
/* CasADi lends the addresses of local variables to the functions it calls; GCC 12 and later take some for
   addresses that outlive the call. */
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12
#pragma GCC diagnostic ignored "-Wdangling-pointer"
#endif
"""

# What a C file or header of CasADi ends with if it was written whole.
LAST_LINES = '} /* extern "C" */\n#endif\n'

# The header that documents the functions.
HEADER = """\
/* {name}: {about}
{documentation}
   Call f(arg, res, iw, w, 0) with pointers to the arguments in the order of this list. Matrices are stored
   column after column. A result whose pointer is NULL is left out; an argument that is NULL is 0. The
   working memory of f has f_SZ_W reals and f_SZ_IW integers, and the lists arg and res must be f_SZ_ARG
   and f_SZ_RES long. 0 is returned if all went well. Nothing is allocated, nothing is kept. */
#ifndef DMOC_TRANSFER_H
#define DMOC_TRANSFER_H

#include "functions.h"

{sizes}

#endif
"""


def write_code(planner: Planner, functions: Sequence[Exported], folder: Path) -> None:
    """functions.c, functions.h, transfer.h and main.c of step, rollout and residual, in a folder."""
    _generate(functions, folder)
    (folder / "transfer.h").write_text(_header(planner.scene, functions))
    by_name = {exported.function.name(): exported.function for exported in functions}
    (folder / "main.c").write_text(example_call(planner, by_name["rollout"], by_name["residual"]))


def write_mission_code(planner: MissionPlanner, functions: Sequence[Exported], folder: Path) -> None:
    """functions.c, functions.h and mission.h or team.h of steps, rollouts and residual, in a folder."""
    _generate(functions, folder)
    sizes: dict[str, tuple[int, str]] = {}
    for name, words, scene in zip(planner.names, planner.mission.leg_names, planner.scenes, strict=True):
        about = f"of {in_comment(words)}, order {scene.rule.order}"
        sizes[f"{name.upper()}_STEPS"] = scene.steps, f"steps {about}"
        sizes[f"{name.upper()}_NODES"] = scene.nodes, f"nodes {about}"
    about = f"{len(planner.names)} {planner.stretches}"
    text = _filled(planner.mission.name, about, functions, sizes)
    guard = f"DMOC_{planner.kind.upper()}_H"
    (folder / f"{planner.kind}.h").write_text(text.replace("DMOC_TRANSFER_H", guard))


def _generate(functions: Sequence[Exported], folder: Path) -> None:
    """functions.c and functions.h, whole."""
    generator = ca.CodeGenerator("functions.c", {"with_header": True})
    for exported in functions:
        generator.add(exported.function)
    generator.generate(f"{folder}{os.sep}")
    for name in ("functions.c", "functions.h"):
        # CasADi raises no error when the disk is full
        if not (folder / name).read_text().endswith(LAST_LINES):
            raise OSError(f"{name} could not be written whole")
    source = folder / "functions.c"
    source.write_text(PREFACE + source.read_text())


def _header(scene: Scene, functions: Sequence[Exported]) -> str:
    kind = "held over each step" if scene.hold else "at the nodes"
    states = {macro_of(name)[5:]: size for name, size in scene.names("place").items()}
    states |= {macro_of(name)[5:]: size for name, size in scene.names("speed").items()}
    words = {"AXES": "axes", "QUATERNION": "entries of an attitude", "RATES": "entries of a rate"}
    words |= {"WHEELS": "reaction wheels"}
    sizes = {
        **{name: (size, words[name]) for name, size in states.items()},
        "STEPS": (scene.steps, "steps"),
        "NODES": (scene.nodes, "nodes"),
        "CONTROLS": (scene.controls, ", ".join(scene.problem.actuator.labels(scene.axes))),
        "FORCES": (scene.shape("forces")[1], f"columns of forces, {kind}"),
    }
    about = f"order {scene.rule.order}, {scene.steps} steps, forces {kind}"
    return _filled(scene.problem.name, about, functions, sizes)


def _filled(name: str, about: str, functions: Sequence[Exported], sizes: dict[str, tuple[int, str]]) -> str:
    return HEADER.format(
        name=in_comment(name),
        about=about,
        documentation="".join(_documentation(exported) for exported in functions),
        sizes="\n".join(f"#define DMOC_{name} {size} /* {words} */" for name, (size, words) in sizes.items()),
    )


def _documentation(exported: Exported) -> str:
    f = exported.function
    lines = [f"\n   {f.name()}: {exported.words}"]
    for kind, count, name_of, size_of in (
        ("arg", f.n_in(), f.name_in, f.size_in),
        ("res", f.n_out(), f.name_out, f.size_out),
    ):
        for i in range(count):
            (rows, columns), term = size_of(i), exported.term(name_of(i))
            lines.append(
                f"     {kind}[{i}] {name_of(i)} ({rows} x {columns}) [{term.unit or '-'}] {term.words}"
            )
    return "\n".join(lines) + "\n"
