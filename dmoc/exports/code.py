"""C code of exported functions: CasADi's own, a header that says what every argument is, an example."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from dmoc.exports.functions import Exported, Scene
from dmoc.exports.planner import Planner

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

# A program that calls two of them.
EXAMPLE = """\
/* Roll out a constant force from the start of {name}, then check the path that comes out.
   Build and run: cc -O2 main.c functions.c -lm -o transfer && ./transfer */
#include <math.h>
#include <stdio.h>

#include "transfer.h"

static casadi_real position[DMOC_AXES] = {{{position}}}; /* m */
static casadi_real velocity[DMOC_AXES] = {{{velocity}}}; /* m/s */
static const casadi_real push[DMOC_CONTROLS] = {{{push}}}; /* N */
static casadi_real forces[DMOC_CONTROLS * DMOC_FORCES];
static casadi_real positions[DMOC_AXES * DMOC_NODES], velocities[DMOC_AXES * (DMOC_STEPS + 1)];
static casadi_real defects[DMOC_AXES * DMOC_NODES];
static casadi_real w[rollout_SZ_W + residual_SZ_W];
static casadi_int iw[rollout_SZ_IW + residual_SZ_IW + 1];
{numbers}

int main(void) {{
  const casadi_real *start[rollout_SZ_ARG] = {{{start}}};
  const casadi_real *path[residual_SZ_ARG] = {{{path}}};
  casadi_real *found[rollout_SZ_RES] = {{{found}}}, *rows[residual_SZ_RES] = {{defects}}, worst = 0;
  for (int i = 0; i < DMOC_CONTROLS * DMOC_FORCES; ++i) forces[i] = push[i % DMOC_CONTROLS];
  if (rollout(start, found, iw, w, 0) || residual(path, rows, iw, w, 0)) return 1;
  for (int i = 0; i < DMOC_AXES * DMOC_NODES; ++i) worst = fmax(worst, fabs(defects[i]));
  printf("position after %g s [m]:", duration[0]);
  for (int i = 0; i < DMOC_AXES; ++i) printf(" %.15g", positions[DMOC_AXES * (DMOC_NODES - 1) + i]);
  printf("\\nvelocity [m/s]:");
  for (int i = 0; i < DMOC_AXES; ++i) printf(" %.15g", velocities[DMOC_AXES * DMOC_STEPS + i]);
  printf("\\nlargest residual of the path [N]: %.3g\\n", worst);
  return 0;
}}
"""


def write_code(planner: Planner, functions: Sequence[Exported], folder: Path) -> None:
    """functions.c, functions.h, transfer.h and main.c of step, rollout and residual, in a folder."""
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
    (folder / "transfer.h").write_text(_header(planner.scene, functions))
    by_name = {exported.function.name(): exported.function for exported in functions}
    (folder / "main.c").write_text(_example_call(planner, by_name["rollout"], by_name["residual"]))


def _header(scene: Scene, functions: Sequence[Exported]) -> str:
    kind = "held over each step" if scene.hold else "at the nodes"
    sizes = {
        "AXES": (scene.axes, "axes"),
        "STEPS": (scene.steps, "steps"),
        "NODES": (scene.nodes, "nodes"),
        "CONTROLS": (scene.controls, ", ".join(scene.problem.actuator.labels(scene.axes))),
        "FORCES": (scene.shape("forces")[1], f"columns of forces, {kind}"),
    }
    return HEADER.format(
        name=_in_comment(scene.problem.name),
        about=f"order {scene.rule.order}, {scene.steps} steps, forces {kind}",
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


def _example_call(planner: Planner, rollout: ca.Function, residual: ca.Function) -> str:
    scene, guess = planner.scene, planner.guess
    problem, force = scene.problem, 0.1 * planner.nlp.units.force
    known = {"mass": problem.mass, "start_time": problem.start_time, "duration": guess.duration}
    known |= {name: planner.numbers.value(name) for name in scene.flow.name_in()[1:]}
    used = dict.fromkeys([*rollout.name_in(), *residual.name_in()])
    numbers = [f"static casadi_real {name}[] = {{{_c_values(known[name])}}};" for name in used if name in known]
    arrays = {"start_velocity": "velocity", "goal_velocity": "velocities + DMOC_AXES * DMOC_STEPS"}
    if scene.burns:
        numbers.append("static casadi_real masses[DMOC_NODES]; /* kg */")
    push = [force if label in ("x", "throttle") else 0.0 for label in problem.actuator.labels(scene.axes)]
    return EXAMPLE.format(
        name=_in_comment(problem.name),
        position=_c_values(guess.position[0]),
        velocity=_c_values(guess.start_velocity),
        push=_c_values(push if any(push) else [force, *push[1:]]),
        numbers="\n".join(numbers),
        start=", ".join(rollout.name_in()),
        path=", ".join(arrays.get(name, name) for name in residual.name_in()),
        found=", ".join(rollout.name_out()),
    )


def _c_values(values: Any) -> str:
    return ", ".join(repr(float(value)) for value in np.atleast_1d(values))


def _in_comment(text: str) -> str:
    return text.replace("*/", "* /")
