"""Measure how right missions of legs, and switches as legs, are, and print the table of docs/legs.md.

    ./scripts/run python scripts/legs.py                # the tables, two minutes
    ./scripts/run python scripts/legs.py --write       # and write them into docs/legs.md

The exit code is 1 if an answer is further from its reference than its row allows.
"""

import argparse
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dmoc import BoxForce, Leg, Mission, SpeedLimit, State, Time, TransferProblem, Via, solve
from dmoc.missions.climb import solve_mission
from dmoc.scene.problem_file import load_problem

PAGE = Path(__file__).parents[1] / "docs" / "legs.md"
DOZEN = [(4, n) for n in (30, 40, 50, 60, 80, 100)] + [(2, 60), (2, 100), (2, 150), (6, 30), (6, 40), (8, 25)]
FREE_FLYER = (0.8368975590572365, 0.8624183666704004)


@dataclass(frozen=True)
class Row:
    """A mission whose optimum is known, orders and steps of each leg, and the error that is allowed."""

    name: str
    make: Callable[[], Any]
    reference: float
    source: str
    numerics: tuple[tuple[int, int], ...]
    allowed: float


def gallery(name: str) -> Any:
    return load_problem(name).make()


def by_way_of(free: bool) -> Mission:
    """From rest by way of (1, 1) to rest at (2, 0) in 2 s."""
    spans = ((0.1, 1.9), (0.1, 1.9)) if free else (0.7, 1.3)
    ends = State((0, 0), (0, 0)), State((2, 0), (0, 0))
    return Mission(1.0, *ends, [Leg(spans[0]), Via((1, 1)), Leg(spans[1])], duration=2.0)


def sped(least_time: bool) -> TransferProblem:
    """A metre from rest to rest below a speed."""
    ends = State((0.0,), (0.0,)), State((1.0,), (0.0,))
    if least_time:
        limits = {"actuator": BoxForce(1.0), "constraints": [SpeedLimit(0.6)]}
        return TransferProblem(1.0, *ends, (0.1, 10.0), objective=Time(), **limits)
    return TransferProblem(1.0, *ends, 1.0, constraints=[SpeedLimit(1.2)])


MISSIONS = (
    Row(
        "`hohmann`",
        lambda: gallery("hohmann"),
        0.2844570503761732,
        "closed form",
        ((2, 20), (2, 40), (2, 80), (4, 10), (4, 20), (8, 8), (8, 16)),
        2e-10,
    ),
    Row(
        "`bielliptic`",
        lambda: gallery("bielliptic"),
        0.520739091446076,
        "closed form",
        ((8, 16), (8, 32), (8, 64)),
        1e-9,
    ),
    Row(
        "`planet_to_planet`",
        lambda: gallery("planet_to_planet"),
        0.18520758105,
        "1,767 of Lambert's problems, the best refined",
        ((6, 12), (6, 24), (8, 20)),
        5e-9,
    ),
    Row(
        "`cw_impulses`",
        lambda: gallery("cw_impulses"),
        0.7645999702135722,
        "dual of the convex problem, on 4,001 times",
        ((8, 12), (8, 24)),
        2e-8,
    ),
    Row(
        "`delta_iii`",
        lambda: gallery("delta_iii"),
        7529.712296,
        "indirect shooting; Betts (2010) 7529.712",
        ((4, 20), (6, 8), (6, 12), (8, 16)),
        1e-9,
    ),
    Row("by way of a point", lambda: by_way_of(True), 15.0, "cubic splines", ((2, 20), (2, 40), (4, 2)), 1e-12),
    Row(
        "the same at 0.7 s",
        lambda: by_way_of(False),
        21.958249454928612,
        "cubic splines",
        ((2, 20), (2, 40), (4, 2)),
        1e-12,
    ),
)

STRUCTURES = (
    (
        "`free_flyer`",
        lambda: gallery("free_flyer"),
        FREE_FLYER,
        [(4, 15), (4, 20), *DOZEN[:5], (2, 20), (2, 40), (2, 100), (6, 20), (8, 12)],
    ),
    ("`two_body_fuel`", lambda: gallery("two_body_fuel"), (0.0767810992549,), DOZEN),
    (
        "`goddard`",
        lambda: gallery("goddard"),
        (1.012836918308,),
        [(2, n) for n in (40, 50, 60, 70, 80, 100, 120, 150, 200, 250, 300, 400)],
    ),
    (
        "`dionysus`",
        lambda: gallery("dionysus"),
        (2718.3396047,),
        [
            *((6, n) for n in (80, 104, 120, 150, 200)),
            *((8, n) for n in (60, 80, 100)),
            *((4, n) for n in (160, 200, 250, 300)),
        ],
    ),
    (
        "`halo_transfer`",
        lambda: gallery("halo_transfer"),
        (0.01546310798,),
        [(6, 40), (6, 60), (8, 24), (8, 32), (8, 48), (4, 60), (4, 100), (4, 150)],
    ),
    ("`bang_bang`", lambda: gallery("bang_bang"), (2.0,), DOZEN),
    ("`drone_hop`", lambda: gallery("drone_hop"), (211.4604945825,), DOZEN),
    ("`bryson_denham`", lambda: gallery("bryson_denham"), (4.0,), DOZEN),
    ("least effort below a speed", lambda: sped(False), (7.68,), DOZEN),
    ("least time below a speed", lambda: sped(True), (1 / 0.6 + 0.6,), DOZEN),
)


def timed(made: Callable[[], Any]) -> tuple[Any, float]:
    """A solution and the processor time it took [s]."""
    begun = time.process_time()
    return made(), time.process_time() - begun


def of_missions() -> tuple[str, bool]:
    lines, fine = "| mission | reference | source | order, steps of a leg | found | error | CPU s |\n", True
    lines += "|---|---|---|---|---|---|---|\n"
    for row in MISSIONS:
        for i, (order, steps) in enumerate(row.numerics):
            found, spent = timed(lambda row=row, mesh=(order, steps): solve(row.make(), *mesh))
            error = found.objective / row.reference - 1
            head = f"{row.name} | {row.reference:.13g} | {row.source}" if i == 0 else " | | "
            lines += f"| {head} | {order}, {steps} | {found.objective:.12g} | {signed(error)} | {spent:.2f} |\n"
        fine &= bool(found.success) and abs(error) < row.allowed
    return lines, fine


def of_structures() -> tuple[str, bool]:
    lines, fine = "| problem | reference | meshes | legs | largest error | CPU s, median and most |\n", True
    lines += "|---|---|---|---|---|---|\n"
    for name, make, values, meshes in STRUCTURES:
        found = [timed(lambda mesh=mesh, make=make: solve(make(), *mesh, structure=True)) for mesh in meshes]
        errors = [min(abs(one.objective / value - 1) for value in values) for one, _ in found]
        right = sum(error < 1e-8 and one.success for error, (one, _) in zip(errors, found, strict=True))
        legs = " or ".join(sorted({str(len(getattr(one, "legs", ""))) for one, _ in found}))
        spent = [seconds for _, seconds in found]
        known = " or ".join(f"{value:.12g}" for value in values)
        lines += (
            f"| {name} | {known} | {right} of {len(meshes)} | {legs} | "
            f"{max(errors):.0e} | {np.median(spent):.2f}, {max(spent):.2f} |\n"
        )
        fine &= right == len(meshes)
    return lines, fine


def of_orders() -> tuple[str, bool]:
    exact = solve(gallery("two_body_fuel"), tol=1e-10, structure=True)
    lines, fine = "| order | steps of a leg | errors | observed order |\n|---|---|---|---|\n", True
    for order, steps in ((2, (40, 80)), (4, (10, 20)), (6, (4, 8)), (8, (3, 6))):
        errors = [
            abs(solve_mission(exact.problem, order, count, guess=exact).objective / exact.objective - 1)
            for count in steps
        ]
        seen = float(np.log2(errors[0] / errors[1]))
        lines += f"| {order} | {steps[0]}, {steps[1]} | {errors[0]:.1e}, {errors[1]:.1e} | {seen:.1f} |\n"
        fine &= seen > order - 0.3
    return lines, fine


def signed(error: float) -> str:
    return "0" if error == 0 else f"{error:+.0e}"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the tables into docs/legs.md")
    into_page, fine = parser.parse_args().write, True
    solve(gallery("hohmann"), 4, 4)
    for name, made in (("missions", of_missions), ("structures", of_structures), ("orders", of_orders)):
        lines, right = made()
        fine &= right
        print(lines, flush=True)
        if into_page:
            place = re.compile(rf"(?<=<!-- {name} -->\n).*?(?=<!-- end of {name} -->)", re.DOTALL)
            PAGE.write_text(place.sub(lambda _, text=lines: text, PAGE.read_text()))
    return int(not fine)


if __name__ == "__main__":
    sys.exit(main())
