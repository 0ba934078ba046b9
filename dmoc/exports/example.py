"""An example in C that calls exported functions: a path from the start, and what is left of its equations."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.planners.functions import Scene
from dmoc.planners.planner import Planner
from dmoc.planners.terms import ATTITUDE, PLACE, TERMS, WHEELS

# A program that calls rollout and residual.
EXAMPLE = """\
/* Roll out a constant {push_name} from the start of {name}, then check the path that comes out.
   Build and run: cc -O2 main.c functions.c -lm -o transfer && ./transfer */
#include <math.h>
#include <stdio.h>

#include "transfer.h"

{state}
static const casadi_real push[DMOC_CONTROLS] = {{{push}}}; /* {push_unit} */
static casadi_real forces[DMOC_CONTROLS * DMOC_FORCES];
{arrays}
static casadi_real w[rollout_SZ_W + residual_SZ_W];
static casadi_int iw[rollout_SZ_IW + residual_SZ_IW + 1];
{numbers}

int main(void) {{
  const casadi_real *start[rollout_SZ_ARG] = {{{start}}};
  const casadi_real *path[residual_SZ_ARG] = {{{path}}};
  casadi_real *found[rollout_SZ_RES] = {{{found}}}, *rows[residual_SZ_RES] = {{{rows}}}, worst;
  for (int i = 0; i < DMOC_CONTROLS * DMOC_FORCES; ++i) forces[i] = push[i % DMOC_CONTROLS];
  if (rollout(start, found, iw, w, 0) || residual(path, rows, iw, w, 0)) return 1;
{told}
  return 0;
}}
"""

# Statements that print a part of the state at the end of the path.
TOLD = """\
  printf("{label}:"{more});
  for (int i = 0; i < {size}; ++i) printf(" %.15g", {path}[{size} * ({last}) + i]);
  printf("\\n");
"""

# Statements that print the largest of some rows of the residual.
WORST = """\
  worst = 0;
  for (int i = 0; i < {size} * DMOC_NODES; ++i) worst = fmax(worst, fabs({rows}[i]));
  printf("{label} [{unit}]: %.3g\\n", worst);
"""


def example_call(planner: Planner, rollout: ca.Function, residual: ca.Function) -> str:
    """The program, with the state at the start of the problem's own guess."""
    scene, guess = planner.scene, planner.guess
    problem = scene.problem
    known = {"mass": problem.mass, "start_time": problem.start_time, "duration": guess.duration}
    known |= {name: planner.numbers.value(name) for name in scene.flow.name_in()[1:]}
    used = dict.fromkeys([*rollout.name_in(), *residual.name_in()])
    numbers = [f"static casadi_real {name}[] = {{{_c_values(known[name])}}};" for name in used if name in known]
    if scene.burns:
        numbers.append("static casadi_real masses[DMOC_NODES]; /* kg */")
    push, unit = _push(planner)
    ends: dict[str, str] = {}
    for part in scene.parts:
        ends |= {f"start_{part.speed}": part.speed}
        ends |= {f"goal_{part.speed}": f"{part.speeds} + {macro_of(part.speed)} * DMOC_STEPS"}
    return EXAMPLE.format(
        name=in_comment(problem.name),
        push_name="control" if scene.turns else "force",
        state=_start(planner),
        push=_c_values(push),
        push_unit=unit,
        arrays=_arrays(scene, residual),
        numbers="\n".join(numbers),
        start=", ".join(rollout.name_in()),
        path=", ".join(ends.get(name, name) for name in residual.name_in()),
        found=", ".join(rollout.name_out()),
        rows=", ".join(_rows_array(name) for name in residual.name_out()),
        told=_told(scene, residual),
    )


def _push(planner: Planner) -> tuple[list[float], str]:
    """A control to begin with, and its unit: a tenth of the largest, along x or the first of all."""
    scene, actuator = planner.scene, planner.scene.problem.actuator
    labels, units = actuator.labels(scene.axes), actuator.units(scene.axes)
    force = 0.1 * planner.nlp.units.of(units[0] if scene.turns else "N")
    push = [force if label in ("x", "throttle") else 0.0 for label in labels]
    unit = (scene.terms.get("forces") or TERMS["forces"]).unit
    return (push if any(push) else [force, *push[1:]]), unit


def _start(planner: Planner) -> str:
    """The state that the program starts from, an array for each part."""
    scene, guess = planner.scene, planner.guess
    values = scene.parted(ca.DM(guess.position[0]), "place")
    values |= scene.parted(ca.DM(guess.start_velocity), "speed")
    return "\n".join(
        f"static casadi_real {name}[{macro_of(name)}] = {{{_c_values(value.full().ravel())}}}; "
        f"/* {TERMS[name].unit} */"
        for name, value in values.items()
    )


def _arrays(scene: Scene, residual: ca.Function) -> str:
    """Room for the path and its residual."""
    path = [
        f"static casadi_real {part.places}[{macro_of(part.place)} * DMOC_NODES], "
        f"{part.speeds}[{macro_of(part.speed)} * (DMOC_STEPS + 1)];"
        for part in scene.parts
    ]
    rows = [
        f"static casadi_real {_rows_array(name)}[{_rows_size(name)} * DMOC_NODES];"
        for name in residual.name_out()
    ]
    return "\n".join([*path, *rows])


def _rows_array(name: str) -> str:
    return name.replace("residual", "defects")


def _rows_size(name: str) -> str:
    sizes = {PLACE.residual: "DMOC_AXES", ATTITUDE.residual: "DMOC_RATES", WHEELS.residual: "DMOC_WHEELS"}
    return sizes.get(name, "1")


def _told(scene: Scene, residual: ca.Function) -> str:
    """Statements that print where the path ends, and what is left of the discrete equations."""
    states = []
    for part in scene.parts:
        place = part.place, part.places, "DMOC_NODES - 1", " after %g s", ", duration[0]"
        for name, path, last, when, more in (place, (part.speed, part.speeds, "DMOC_STEPS", "", "")):
            label = f"{name}{when} [{TERMS[name].unit}]"
            states.append(TOLD.format(label=label, more=more, size=macro_of(name), path=path, last=last))
    rows = [
        WORST.format(label=_label(name), unit=TERMS[name].unit, size=_rows_size(name), rows=_rows_array(name))
        for name in residual.name_out()
    ]
    return "".join([*states, *rows]).rstrip("\n")


def _label(name: str) -> str:
    return "largest residual of the path" if name == PLACE.residual else f"largest {name.replace('_', ' ')}"


def macro_of(name: str) -> str:
    """The macro that has the number of entries of a part of a state."""
    wheels = {WHEELS.place: "DMOC_WHEELS", WHEELS.speed: "DMOC_WHEELS"}
    known = {ATTITUDE.place: "DMOC_QUATERNION", ATTITUDE.speed: "DMOC_RATES"} | wheels
    return known.get(name, "DMOC_AXES")


def _c_values(values: Any) -> str:
    return ", ".join(repr(float(value)) for value in np.atleast_1d(values))


def in_comment(text: str) -> str:
    return text.replace("*/", "* /")
