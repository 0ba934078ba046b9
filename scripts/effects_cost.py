"""What each further effect costs: instructions, iterations and time of one transfer around the Earth.

    ./scripts/run python scripts/effects_cost.py              # the table
    ./scripts/run python scripts/effects_cost.py --write     # and write it into docs/effects.md

The transfer is that of leo_raise from its start to a fixed place on its goal orbit, with a free force at
least effort, so that every scene, also the one without any effect, takes a handful of iterations.
Instructions are those of one step with its share of the nodes. Scenes take turns; every solve begins as a
new process does.
"""

import argparse
import math
import re
from dataclasses import replace
from pathlib import Path
from statistics import median

from dmoc import (
    CircularOrbit,
    ConicalShadow,
    Effort,
    FreeForce,
    RadiationPressure,
    State,
    ThirdBody,
    TransferProblem,
    circular_motion,
    solve,
)
from dmoc.basics.memory import forget
from dmoc.nlp.stencils import stencils_of
from dmoc.scene.problem_file import load_problem

PAGE = Path(__file__).parents[1] / "docs" / "effects.md"
PLACE = re.compile(r"(?<=<!-- effects -->\n).*?(?=<!-- end of effects -->)", re.DOTALL)
# Every scene is solved at this order, at which a step has the most nodes.
ORDER = 8
# Steps of the mesh, for about two revolutions.
STEPS = 100
# Each solve is timed this often; the median counts.
REPEATS = 9
# Columns of the table, and the CasADi functions whose instructions each adds up.
FUNCTIONS = {"function": ("rows", "cost"), "Jacobian": ("jacobian", "gradient"), "Hessian": ("hessian",)}
HEAD = "| effects | function | Jacobian | Hessian | iterations | build [ms] | solve [ms] |\n"
HEAD += "|---|---|---|---|---|---|---|\n"


def scenes() -> dict[str, TransferProblem]:
    """The same transfer with no effect, and with one more each time."""
    raised = load_problem("leo_raise").make()
    goal = raised.goal
    assert isinstance(goal, CircularOrbit)
    start, along = raised.start.position, raised.start.velocity
    radius, speed = math.hypot(*start), math.hypot(*along)
    # halfway between the two orbits' mean motions, so that little force is needed
    rate = 0.5 * (speed / radius + math.sqrt(goal.mu / goal.radius**3))
    cos, sin = math.cos(rate * raised.duration), math.sin(rate * raised.duration)
    ahead = [(a / radius, b / speed) for a, b in zip(start, along, strict=True)]
    place = [goal.radius * (a * cos + b * sin) for a, b in ahead]
    velocity = [math.sqrt(goal.mu / goal.radius) * (b * cos - a * sin) for a, b in ahead]
    parts = {"goal": State(place, velocity), "actuator": FreeForce(), "objective": Effort()}
    sun = circular_motion(1.495978707e11, 1.99098e-7)
    moon = ThirdBody(4.9048695e12, circular_motion(3.844e8, 2.66170e-6))
    sunlight = RadiationPressure(5.0, 0.3, sun, ConicalShadow(6.378137e6))
    effects = [*raised.effects, moon, sunlight]
    names = [type(effect).__name__ for effect in effects]
    titles = ["none", names[0], *(f"+ {name}" for name in names[1:])]
    return {title: replace(raised, effects=effects[:k], **parts) for k, title in enumerate(titles)}


def instructions(problem: TransferProblem, order: int) -> dict[str, int]:
    """CasADi instructions of one step and of the nodes that are new with it."""
    times = {"node": order // 2, "step": 1, "ends": 0}
    counts = dict.fromkeys(FUNCTIONS, 0)
    for stencil in stencils_of(problem, order, False).stencils:
        for name, parts in FUNCTIONS.items():
            functions = stencil.kernel.functions
            counts[name] += times[stencil.every] * sum(functions[part].n_instructions() for part in parts)
    return counts


def rows() -> list[str]:
    """Lines of the table; seconds are medians of runs in which the scenes take turns."""
    problems, found = scenes(), {}
    for _ in range(REPEATS):
        for name, problem in problems.items():
            forget()
            found.setdefault(name, []).append(solve(problem, order=ORDER, steps=STEPS).raise_for_status())
    lines = []
    for name, runs in found.items():
        counts = "".join(f" {count} |" for count in instructions(problems[name], ORDER).values())
        build, run = (1e3 * median(getattr(each, part) for each in runs) for part in ("build_s", "solve_s"))
        lines.append(f"| {name} |{counts} {runs[0].iterations} | {build:.0f} | {run:.0f} |\n")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the table into docs/effects.md")
    into_page = parser.parse_args().write
    table = HEAD + "".join(rows())
    print(table, end="")
    if into_page:
        PAGE.write_text(PLACE.sub(lambda _: table, PAGE.read_text()))


if __name__ == "__main__":
    main()
