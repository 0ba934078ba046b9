"""Where a guess has the largest force throughout, its direction alone is sought first."""

from dataclasses import replace

import numpy as np
import pytest

from dmoc import Condition, Engine, FinalRadius, Fuel, PointGravity, State, TransferProblem, solve
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.rungs import full

THRUST, FLOW, DURATION = 0.1405, 0.0749, 3.3193


def circular(t, q, v, m):
    """At the speed of a circular orbit around an attractor of mu = 1, across the position."""
    square = q[0] ** 2 + q[1] ** 2
    return [q[0] * v[0] + q[1] * v[1], (v[0] ** 2 + v[1] ** 2) ** 2 * square - 1]


def largest_radius(objective=None):
    """The largest circular orbit in a given time with a small engine (Bryson and Ho, 1975, section 2.5)."""
    engine = Engine(THRUST, exhaust_velocity=THRUST / FLOW)
    goal = Condition(circular, "circular")
    sought = objective or FinalRadius()
    return TransferProblem(
        1.0, State((1.0, 0.0), (0.0, 1.0)), goal, DURATION, [PointGravity(1.0)], engine, sought
    )


def spiral(share=1.0):
    """A spiral with this share of the thrust, forwards for half of the time and outwards after it."""
    mesh = uniform_mesh(100)
    s = node_fractions(mesh, scheme(4))
    radius, angle = 1 + 0.5 * s, 4 * DURATION * (1 - (1 + 0.5 * s) ** -0.5)
    out, along = (
        np.stack(pair, 1) for pair in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle)))
    )
    force = share * THRUST * (np.sqrt(0.5) * out + np.sqrt(0.5) * along)
    control = np.column_stack([force, np.full(len(s), share * THRUST)])
    ends = along[0], along[-1] / np.sqrt(1.5)
    return DiscretePath(
        mesh, 4, False, DURATION, radius[:, None] * out, control, 1 - share * FLOW * DURATION * s, *ends
    )


def test_the_answer_is_that_of_the_limit_in_fewer_iterations(monkeypatch):
    problem, guess = largest_radius(), spiral()
    ours = solve(problem, order=8, steps=14, guess=guess)
    monkeypatch.setattr(full, "is_full", lambda *given: False)
    theirs = solve(problem, order=8, steps=14, guess=guess)
    assert ours.status == theirs.status == "solved"
    assert ours.objective == pytest.approx(1.52502839, abs=2e-6)
    # the barrier of the limit keeps a little of the thrust back
    assert 0 <= ours.objective - theirs.objective < 1e-8
    assert ours.ladder[-1].iterations <= 0.8 * theirs.ladder[-1].iterations
    assert ours.problem == problem
    np.testing.assert_allclose(np.linalg.norm(ours.force, axis=1), THRUST, rtol=1e-9)


def test_a_guess_of_less_than_the_limit_is_solved_as_ever(monkeypatch):
    asked = []
    monkeypatch.setattr(full, "gains_nothing", lambda *given: asked.append(given) or True)
    assert solve(largest_radius(), order=8, steps=14, guess=spiral(0.9)).status == "solved"
    assert not asked


def test_an_answer_at_full_force_that_a_smaller_one_betters_is_left():
    """Of least fuel a guess at full force is none: the multipliers say so, and the limit is one again."""
    problem = largest_radius(Fuel())
    found = solve(problem, order=6, steps=20, guess=spiral())
    assert found.status == "solved" and found.objective < 0.5 * FLOW * DURATION


def test_a_guess_whose_force_is_reversed_is_solved_as_ever(monkeypatch):
    """A polynomial cannot be of full size on both sides of a switch and between them."""
    asked = []
    monkeypatch.setattr(full, "gains_nothing", lambda *given: asked.append(given) or True)
    guess = spiral()
    control = guess.control.copy()
    control[len(control) // 2 :, :2] *= -1
    assert solve(largest_radius(), order=8, steps=14, guess=replace(guess, control=control)).status == "solved"
    assert not asked
