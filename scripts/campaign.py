"""Solve random scenes that are possible (or not) by construction, and judge every answer without the package.

    ./scripts/run python scripts/campaign.py                     # the table, ten scenes a family
    ./scripts/run python scripts/campaign.py --each 50 --journal campaign.jsonl  # goes on where it was ended
    ./scripts/run python scripts/campaign.py --each 50 --journal campaign.jsonl --again   # what was not green
    ./scripts/run python scripts/campaign.py --each 50 --journal campaign.jsonl --write  # into docs/campaign.md
    ./scripts/run python scripts/campaign.py --family orbits --seed 3     # one scene, with what is said of it

Green: solved, and every check of `verify` holds; or, where a scene is impossible, a failure that names a
limit. Red: no answer, or one that fails a check and says so. Wrong: an answer passed off as right which the
judge (`scripts/campaign/judge.py`, NumPy and SciPy alone) finds wrong, an impossible scene solved, or a crash.
The exit code is 1 if any is wrong.
"""

import argparse
import json
import re
import signal
import sys
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np
from campaign import ends, limits, mixed, orbits, plain
from campaign.bounds import sharpened
from campaign.judge import faults
from campaign.making import Scene

from dmoc import solve, verify

PAGE = Path(__file__).parents[1] / "docs" / "campaign.md"
PLACE = re.compile(r"(?<=<!-- campaign -->\n).*?(?=<!-- end of campaign -->)", re.DOTALL)
HEAD = "| scenes | number | green | red | wrong | median s | worst s |\n|---|---|---|---|---|---|---|\n"
# Seconds of processor time after which a solve is ended: a scene that takes longer counts as red.
LONGEST = 20.0
# Shorter times than this are none to a timer [s].
TICK = 0.01
FAMILIES: dict[str, Callable[[np.random.Generator], Scene]] = {
    "free space": plain.free_space,
    "gravity and air": plain.falling,
    "turning frames": plain.turning,
    "propellant": plain.burning,
    "zones": limits.zones,
    "speed limits": limits.speed,
    "hardly enough": limits.tight,
    "not enough": limits.impossible,
    "open ends": ends.open_ends,
    "moving goals": ends.moving,
    "all units": ends.units,
    "orbits": orbits.orbits,
    "eccentric": orbits.eccentric,
    "hyperbolic": orbits.hyperbolic,
    "polar": orbits.polar,
    "retrograde": orbits.retrograde,
    "perturbed orbits": orbits.perturbed,
    "three bodies": orbits.three_bodies,
    "circle to circle": orbits.circles,
    "several revolutions": orbits.revolutions,
    "anything with anything": mixed.mixed,
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


def run(family: str, seed: int, longest: float = LONGEST) -> Outcome:
    """Make a scene, solve it in `longest` [s] of processor time, and judge the answer.

    The seconds are those of the program alone.
    """
    begin, taken = time.process_time(), [0.0]
    try:
        verdict, why = judged(make(family, seed), taken, longest)
    except Exception as error:
        verdict, why = "wrong", f"{type(error).__name__}: {error}"
        taken[0] = taken[0] or time.process_time() - begin
    return Outcome(family, seed, verdict, why, round(taken[0], 3))


def judged(scene: Scene, taken: list[float], longest: float) -> tuple[str, str]:
    """The verdict on a scene, and why; the seconds for solving and checking go into `taken`."""
    begin = time.process_time()
    try:
        problem = scene.problem
        with at_most(longest):
            # The judge reads the answer of one mesh, not that of a chain of legs.
            solution = solve(problem, structure=False, **scene.options)
    except KeyboardInterrupt:
        return "red", "stopped where no iterate was known"
    except ValueError as refusal:
        if not scene.blames:
            raise
        return blamed(scene, str(refusal))
    finally:
        taken[0] = time.process_time() - begin
    if scene.blames:
        return ("wrong", "solved what is impossible") if solution.success else blamed(scene, solution.message)
    if not solution.success:
        return "red", f"{solution.status}: {solution.message}"
    report = verify(solution)
    taken[0] = time.process_time() - begin
    failed = [f"{check.name} {check.value:.1e} > {check.limit:.1e}" for check in report.checks if not check.ok]
    if failed:
        return "red", f"fails {', '.join(failed)}"
    found = faults(sharpened(scene).truth, solution, scene.options.get("tol"))
    return ("wrong", "; ".join(found)) if found else ("green", "")


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Ends what runs within as Ctrl-C does, after so many seconds of processor time [s].

    On a busy machine the clock would end solves that take no longer than others.
    """
    begun = time.process_time()

    def look(*_: object) -> None:
        # The timer counts in ticks, which may run ahead of the processor's own account.
        if (left := seconds - (time.process_time() - begun)) > 0:
            signal.setitimer(signal.ITIMER_PROF, max(left, TICK))
        else:
            signal.raise_signal(signal.SIGINT)

    former = signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, former)


def blamed(scene: Scene, said: str) -> tuple[str, str]:
    """The verdict on an impossible scene that was not solved: green if a limit is named."""
    return ("green" if any(word in said for word in scene.blames) else "red"), said


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


def journaled(
    path: Path | None, scenes: Iterable[tuple[str, int]], again: bool, known_alone: bool = False
) -> Iterator[Outcome]:
    """The outcomes of scenes, from a journal where it has them; others, and if `again` those that are not
    green, are run and written into it, one line each. The last line of a scene counts. If `known_alone`, none
    is run.
    """
    known: dict[tuple[str, int], Outcome] = {}
    if path is not None and path.exists():
        for line in path.read_text().splitlines():
            one = Outcome(**json.loads(line))
            known[one.family, one.seed] = one
    for family, seed in scenes:
        one = known.get((family, seed))
        if one is None and known_alone:
            continue
        if one is None or (again and one.verdict != "green"):
            one = run(family, seed)
            if path is not None:
                with path.open("a") as journal:
                    journal.write(json.dumps(asdict(one)) + "\n")
        yield one


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--each", type=int, default=10, help="scenes a family")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--family", choices=FAMILIES, help="this family alone")
    parser.add_argument("--seed", type=int, help="this scene alone")
    parser.add_argument("--journal", type=Path, help="keep outcomes in this file, and take known ones from it")
    parser.add_argument("--again", action="store_true", help="run anew what is not green in the journal")
    parser.add_argument("--known", action="store_true", help="what the journal has, and nothing more")
    parser.add_argument("--write", action="store_true", help="write the table into docs/campaign.md")
    given = parser.parse_args()
    families = [given.family] if given.family else list(FAMILIES)
    seeds = range(given.first, given.first + given.each) if given.seed is None else [given.seed]
    outcomes = []
    scenes = [(family, seed) for seed in seeds for family in families]
    for one in journaled(given.journal, scenes, given.again, given.known):
        outcomes.append(one)
        if one.verdict != "green" or given.seed is not None:
            print(f"{one.family} {one.seed}: {one.verdict}, {one.seconds:.1f} s, {one.why}", flush=True)
    print(found := table(outcomes), end="")
    if given.write:
        PAGE.write_text(PLACE.sub(lambda _: found, PAGE.read_text()))
    return int(any(one.verdict == "wrong" for one in outcomes))


if __name__ == "__main__":
    sys.exit(main())
