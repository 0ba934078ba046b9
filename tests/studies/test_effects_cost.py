"""What an effect is said to do is what it does: held to closed forms."""

import io
import runpy
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from dmoc import (
    LinearDrag,
    PointGravity,
    State,
    ThirdBody,
    TransferProblem,
    UniformGravity,
    circular_motion,
    solve,
)
from dmoc.reports.tables import influence_table
from dmoc.studies.effects import EARTH_MU, candidates, influences


def test_leaving_out_gravity_moves_the_goal_by_the_fall():
    fall = TransferProblem(2.0, State((0, 0), (1, 0)), State((4, 1), (1, 0)), 3.0, [UniformGravity((0, -9.81))])
    (found,) = influences(solve(fall, order=4, steps=10))
    assert found.acceleration == pytest.approx(9.81, rel=1e-12)
    assert found.displacement == pytest.approx(0.5 * 9.81 * 9.0, rel=1e-9)
    assert found.listed and found.instructions > 0


def test_an_effect_of_no_strength_moves_nothing():
    scene = TransferProblem(2.0, State((0, 0), (1, 0)), State((4, 1), (1, 0)), 3.0, [LinearDrag(0.0)])
    (found,) = influences(solve(scene, order=4, steps=10))
    assert (found.acceleration, found.displacement) == (0.0, pytest.approx(0.0, abs=1e-12))


def test_around_the_earth_the_library_offers_what_is_missing():
    radius = 7e6
    speed = np.sqrt(EARTH_MU / radius)
    orbit = TransferProblem(
        500.0, State((radius, 0, 0), (0, speed, 0)), State((-radius, 0, 0), (0, -speed, 0)),
        np.pi * radius / speed, [PointGravity(EARTH_MU)],
    )  # fmt: skip
    rows = influences(solve(orbit, order=6, steps=20), others=True)
    names = [type(row.effect).__name__ for row in rows]
    assert names[0] == "PointGravity" and {"J2", "ThirdBody", "Drag", "RadiationPressure"} <= set(names)
    assert [row.listed for row in rows] == [True] + [False] * (len(rows) - 1)
    oblateness = rows[names.index("J2")]
    # Vallado, Fundamentals of Astrodynamics: 3/2 mu J2 R^2 / r^4 in the equatorial plane
    assert oblateness.acceleration == pytest.approx(
        1.5 * EARTH_MU * 1.08263e-3 * 6.378137e6**2 / radius**4, rel=1e-3
    )
    assert not candidates(TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 1.0))
    moon = ThirdBody(4.9028e12, circular_motion(3.844e8, 2.66e-6))
    ends = State((7e6, 0), (0, 7546.0)), State((0, 7e6), (-7546.0, 0))
    missing = candidates(TransferProblem(1.0, *ends, 1457.0, [PointGravity(EARTH_MU), moon]))
    assert "ThirdBody, the Sun" in missing and "ThirdBody, the Moon" not in missing
    assert "ThirdBody, the Moon" in [row.name for row in rows]


def test_the_table_keeps_what_is_in_the_scene_apart_and_is_a_word_without_effects():
    def shown(problem, others):
        console = Console(width=120, record=True, file=io.StringIO())
        solution = solve(problem, order=4, steps=10)
        console.print(influence_table(influences(solution, others), solution))
        return console.export_text()

    ends = State((7e6, 0), (0, 7546.0)), State((0, 7e6), (-7546.0, 0))
    table = shown(TransferProblem(500.0, *ends, 1457.0, [PointGravity(EARTH_MU)]), True)
    assert "PointGravity, mu 3.986e+14 m^3/s^2" in table and "(ThirdBody, the Moon)" in table
    assert "no effect" in shown(TransferProblem(500.0, *ends, 1457.0), False)


def test_every_further_effect_costs_more_and_none_costs_least():
    """The scenes of scripts/effects_cost.py: the same transfer with no effect, one, two, ..."""
    script = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "effects_cost.py"))
    scenes = script["scenes"]()
    assert list(scenes)[:4] == ["none", "PointGravity", "+ J2", "+ Drag"]
    counts = [script["instructions"](scene, 2) for scene in scenes.values()]
    for name in script["FUNCTIONS"]:
        found = [count[name] for count in counts]
        assert found == sorted(set(found))
    for scene in list(scenes.values())[:4]:
        assert solve(scene, order=8, steps=40).raise_for_status().iterations < 10
