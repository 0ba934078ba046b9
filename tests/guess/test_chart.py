"""Curved unknowns around an attractor: the same problem, the same answer, fewer iterations."""

import runpy
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from dmoc import (
    BallForce,
    BoxForce,
    CircularOrbit,
    Effort,
    Engine,
    Fuel,
    KeepIn,
    PointGravity,
    State,
    TransferProblem,
    UniformGravity,
    solve,
)
from dmoc.guess.chart import chart_of, is_curved
from dmoc.guess.starting import starting_guess
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import COSTATE
from dmoc.nlp.layout import Curved
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.scene.problem_file import load_problem

CASE = runpy.run_path(str(Path(__file__).parents[1] / "cases" / "leo_many.py"))


def plane(turns=10.0, **parts):
    """In the plane, in canonical units, to a circle a tenth farther out."""
    goal = CircularOrbit(1.1, 1.0, center=(0.0, 0.0))
    start = State((1, 0), (0, 1))
    return TransferProblem(1.0, start, goal, 2 * np.pi * turns, effects=[PointGravity(1.0)], **parts)


def charted(problem, order=8, steps=80):
    guess = starting_guess(problem, uniform_mesh(steps), order, False)
    units = units_of(problem, guess)
    return guess, units, chart_of(problem, guess, units.origin)


@pytest.mark.parametrize("problem", [plane(), CASE["problem"](days=1.0)])
def test_there_and_back_the_unknowns_are_the_same(problem):
    guess, units, chart = charted(problem)
    nlp = transcribe_onto(problem, guess, units, chart=chart)
    draw = np.random.default_rng(1)
    x = nlp.pack(guess) * (1 + 0.05 * draw.normal(size=nlp.columns.size))
    curved = Curved(chart, nlp.columns, nlp.rows)
    assert curved.path(curved.unknowns(x)) == pytest.approx(x, abs=1e-12)
    there = curved.unknowns(nlp.pack(guess))
    assert np.abs(nlp.columns["position"].of(there)).max() < 1e-12


def test_a_path_that_is_turned_has_other_angles_and_the_same_forces():
    problem = plane()
    guess, units, chart = charted(problem)
    nlp = transcribe_onto(problem, guess, units, chart=chart)
    curved = Curved(chart, nlp.columns, nlp.rows)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    turned = replace(guess, position=guess.position @ turn.T, control=guess.control @ turn.T)
    before, after = (curved.unknowns(nlp.pack(path)) for path in (guess, turned))
    place = [nlp.columns["position"].of(y) * units.length for y in (before, after)]
    assert place[1][:, 0] == pytest.approx(place[0][:, 0], abs=1e-12)
    assert place[1][:, 1] == pytest.approx(0.7 * chart.reach)
    force = nlp.columns["force"]
    assert force.of(after) == pytest.approx(force.of(before), abs=1e-12)


@pytest.mark.parametrize("problem", [plane(), load_problem("geo_raise").make(revolutions=9.0)])
def test_answer_and_multipliers_are_those_of_the_plain_unknowns(problem):
    guess, units, chart = charted(problem, steps=120)
    found = []
    for one in (None, chart):
        nlp = transcribe_onto(problem, guess, units, chart=one)
        found.append(nlp.path(problem, nlp.run(nlp.solver(), problem, guess)))
    plain, curved = found
    assert curved.position == pytest.approx(plain.position, abs=1e-6 * plain.diagonal)
    assert set(curved.multipliers) == set(plain.multipliers)
    largest = np.abs(plain.multipliers[COSTATE]).max()
    for key, value in plain.multipliers.items():
        scale = np.abs(value).max() or largest
        assert curved.multipliers[key] == pytest.approx(value, abs=1e-4 * scale), key
    # With multipliers nothing is left to do.
    again = transcribe_onto(problem, curved, units, chart=chart_of(problem, curved, units.origin))
    assert again.run(again.solver(warm=True), problem, curved).iterations <= 1


def test_what_belongs_to_an_axis_or_to_few_revolutions_keeps_its_axes():
    def is_so(problem, hold=False):
        return is_curved(problem, starting_guess(problem, uniform_mesh(200), 6, hold))

    assert is_so(plane())
    assert not is_so(plane(turns=4.0))
    assert not is_so(plane(), hold=True)
    assert not is_so(plane(actuator=BoxForce(1.0)))
    assert not is_so(plane(constraints=[KeepIn((-2.0, -2.0), (2.0, 2.0))]))
    partly = State((None, 1.1), (None, None))
    assert not is_so(replace(plane(), goal=partly))


def test_progress_is_told_of_in_the_axes_of_the_scene():
    told = []
    solution = solve(plane(), progress=lambda *each: told.append(each))
    assert solution.success and told[-1][4].startswith(("dynamics", "goal", "start", ""))


@pytest.mark.parametrize("revolutions", [20.0, 100.0])
def test_many_revolutions_take_few_iterations(revolutions):
    """In the axes of the scene a hundred of them take 48."""
    solution = solve(load_problem("geo_raise").make(revolutions=revolutions)).raise_for_status()
    assert sum(level.iterations for level in solution.ladder) <= 12


class Northward(Effort):
    """An effort of which a force to the north costs twice: it sees where the force points."""

    def rate(self, actuator, t, q, v, u, m):
        return super().rate(actuator, t, q, v, u, m) + 0.5 * u[1] ** 2


@dataclass(frozen=True)
class Lumpy(PointGravity):
    """An attractor whose field is not that of a point alone: it says that it attracts, and a wave is added."""

    def lagrangian(self, t, q, v, m):
        return super().lagrangian(t, q, v, m) + 1e-3 * q[0] * q[1]


def leaving(radius, effects, **parts):
    """From a circle around an attractor that is not at the origin."""
    start = State((radius + 0.2, 0.0, 0.3), (0.0, radius**-0.5, 0.1))
    return TransferProblem(1.0, start, State((0.2, 1.1, 0.3), (-1.0, 0.0, 0.0)), 60.0, effects, **parts)


@pytest.mark.parametrize(
    "problem",
    [
        plane(),
        plane(actuator=Engine(1e-2, exhaust_velocity=3.0), objective=Fuel()),
        plane(objective=Northward()),
        replace(plane(), effects=[Lumpy(1.0)]),
        leaving(1.0, [PointGravity(1.0, center=(0.2, 0.0, 0.3)), UniformGravity((1e-3, 0.0, 2e-3))]),
        CASE["problem"](days=1.0, limit=0.2),
    ],
)
def test_rows_and_cost_are_those_of_the_plain_unknowns(problem):
    """At any path near the one they are counted from, every row of motion turned into the frame of its node."""
    guess, units, chart = charted(problem)
    assert chart is not None
    plain, bent = (transcribe_onto(problem, guess, units, chart=one) for one in (None, chart))
    curved = Curved(chart, plain.columns, plain.rows)
    draw = np.random.default_rng(2)
    y = curved.unknowns(plain.pack(guess)) + 0.02 * draw.normal(size=plain.columns.size)
    place = plain.columns["position"]
    frames = chart.frames((place.of(y) * place.scales)[:, 1] / chart.reach)
    found = []
    for nlp, at in ((plain, curved.path(y)), (bent, y)):
        numbers = nlp.parameters(problem)
        cost, rows = (
            np.array(of(at, numbers)).ravel() for of in (nlp.assembly.objective, nlp.assembly.constraints)
        )
        found.append((cost, curved.rotated(rows, frames) if nlp is bent else rows))
    (cost, rows), (same, turned) = found
    assert same == pytest.approx(cost, rel=1e-12)
    assert turned == pytest.approx(rows, abs=1e-12 * np.abs(rows).max())


def test_only_what_sees_a_direction_is_turned_into_the_axes_of_the_scene():
    """In the frame of its node a force has one entry a row of motion; in the axes of the scene it has more."""

    def entries(problem):
        node = stencils_of(problem, 8, False, curved=True).stencils[0].kernel
        return node.jacobian.nnz(), node.hessian.nnz()

    assert entries(plane()) == (3, 3)
    assert entries(plane(actuator=BallForce(1.0)))[0] == 5
    assert entries(plane(objective=Northward()))[0] > 5
    assert entries(replace(plane(), effects=[Lumpy(1.0)]))[0] > 5
