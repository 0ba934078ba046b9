"""Solve random scenes that are possible (or not) by construction, and judge every answer without the package.

    ./scripts/run python scripts/campaign.py                     # the table, ten scenes a family
    ./scripts/run python scripts/campaign.py --each 20 --readme  # and write it into the README
    ./scripts/run python scripts/campaign.py --family orbits --seed 3     # one scene, with what is said of it

Green: solved, and every check of `verify` holds; or, where a scene is impossible, a failure that names a
limit. Red: no answer, or one that fails a check and says so. Wrong: an answer passed off as right which the
judge (`scripts/campaign/judge.py`, NumPy and SciPy alone) finds wrong, an impossible scene solved, or a crash.
The exit code is 1 if any is wrong.
"""

import argparse
import re
import sys
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from campaign import orbits, plain
from campaign.judge import faults
from campaign.making import Scene

from dmoc import solve, verify

README = Path(__file__).parents[1] / "README.md"
PLACE = re.compile(r"(?<=<!-- campaign -->\n).*?(?=<!-- end of campaign -->)", re.DOTALL)
HEAD = "| scenes | number | green | red | wrong | median s | worst s |\n|---|---|---|---|---|---|---|\n"
# Seconds after which a solve ends with what it has: a scene that takes longer counts as red.
LONGEST = 12.0
FAMILIES: dict[str, Callable[[np.random.Generator], Scene]] = {
    "free space": plain.free_space,
    "gravity and air": plain.falling,
    "turning frames": plain.turning,
    "propellant": plain.burning,
    "orbits": orbits.orbits,
}


@dataclass(frozen=True)
class Outcome:
    """What became of a scene: "green", "red" or "wrong", why, and the seconds for solving and checking."""

    family: str
    seed: int
    verdict: str
    why: str
    seconds: float


def make(family: str, seed: int) -> Scene:
    """A scene of a family; the same seed gives the same scene."""
    return FAMILIES[family](np.random.default_rng([zlib.crc32(family.encode()), seed]))


def run(family: str, seed: int) -> Outcome:
    """Make a scene, solve it, and judge the answer."""
    begin = time.process_time()
    try:
        scene = make(family, seed)
        verdict, why = judged(scene)
    except Exception as error:
        verdict, why = "wrong", f"{type(error).__name__}: {error}"
    return Outcome(family, seed, verdict, why, time.process_time() - begin)


def judged(scene: Scene) -> tuple[str, str]:
    """The verdict on a scene, and why."""
    solution = solve(scene.problem, **scene.options, time_limit=LONGEST)
    if scene.blames:
        if solution.success:
            return "wrong", "solved what is impossible"
        said = solution.message
        return ("green", said) if any(word in said for word in scene.blames) else ("red", said)
    if not solution.success:
        return "red", f"{solution.status}: {solution.message}"
    report = verify(solution)
    failed = [f"{check.name} {check.value:.1e} > {check.limit:.1e}" for check in report.checks if not check.ok]
    if failed:
        return "red", f"fails {', '.join(failed)}"
    found = faults(scene.truth, solution, scene.options.get("tol"))
    return ("wrong", "; ".join(found)) if found else ("green", "")


def table(outcomes: list[Outcome]) -> str:
    """One line a family, and one for all."""
    lines = []
    for family in [*dict.fromkeys(one.family for one in outcomes), "all"]:
        those = [one for one in outcomes if family in (one.family, "all")]
        counts = [sum(one.verdict == verdict for one in those) for verdict in ("green", "red", "wrong")]
        seconds = [one.seconds for one in those]
        cells = (family, len(those), *counts, f"{median(seconds):.2f}", f"{max(seconds):.1f}")
        lines.append(f"| {' | '.join(map(str, cells))} |\n")
    return HEAD + "".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--each", type=int, default=10, help="scenes a family")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--family", choices=FAMILIES, help="this family alone")
    parser.add_argument("--seed", type=int, help="this scene alone")
    parser.add_argument("--readme", action="store_true", help="write the table into the README")
    given = parser.parse_args()
    families = [given.family] if given.family else list(FAMILIES)
    seeds = range(given.first, given.first + given.each) if given.seed is None else [given.seed]
    outcomes = []
    for family in families:
        for seed in seeds:
            outcomes.append(one := run(family, seed))
            if one.verdict != "green" or given.seed is not None:
                print(f"{family} {seed}: {one.verdict}, {one.seconds:.1f} s, {one.why}", flush=True)
    print(found := table(outcomes), end="")
    if given.readme:
        README.write_text(PLACE.sub(lambda _: found, README.read_text()))
    return int(any(one.verdict == "wrong" for one in outcomes))


if __name__ == "__main__":
    sys.exit(main())
