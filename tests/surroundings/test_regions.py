"""Zones and links that tell no shape of their own are found from their own functions, in pictures and pages."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from dmoc import Constraint, Holonomic, KeepOut, Rod, SpeedLimit, State, Surface, TransferProblem, solve
from dmoc.pages.scenery import scenery_traces
from dmoc.parts.rows import Row
from dmoc.plots.page import figure
from dmoc.surroundings.levels import level_surface
from dmoc.surroundings.regions import regions
from dmoc.surroundings.view import view_of

CORNER = np.array([1.3, 1.1, 1.2])


@dataclass(frozen=True)
class Egg(Constraint):
    """A ball that tells no outline."""

    center: tuple
    radius: float

    def rows(self, t, q, u, m):
        return [Row("egg", ca.norm_2(q - ca.DM(self.center)), self.radius, np.inf, "m")]

    def excess(self, q, v):
        return np.maximum(0.0, self.radius - np.linalg.norm(q - self.center, axis=1))

    def words(self):
        return "stays out of an egg"


@dataclass(frozen=True)
class Rolling(Egg):
    """One that moves, so that it has no one place."""

    def excess_at(self, t, q, v):
        return self.excess(q - t[:, None], v)


@dataclass(frozen=True)
class Floor(Holonomic):
    def g(self, q):
        return q[-1]


@dataclass(frozen=True)
class Rail(Holonomic):
    """Two numbers: a line in space."""

    def g(self, q):
        return q[1:]


def still(*place):
    return State(place, (0.0,) * len(place))


def flight(dimension=3, **parts):
    past = still(*(-2, 0.2, 0.1)[:dimension]), still(*(2, 0.2, 0)[:dimension])
    return TransferProblem(1.0, *past, 4.0, **parts)


def ball(places):
    return 1.0 - np.linalg.norm(places, axis=1)


def clipped(places):
    """The same without a sign outside."""
    return np.maximum(0.0, ball(places))


@pytest.mark.parametrize("values", [ball, clipped, lambda places: -ball(places)])
def test_a_level_surface_lies_where_the_sign_changes_and_is_closed(values):
    places, triangles = level_surface(values, -CORNER, CORNER)
    assert np.abs(ball(places)).max() < 1e-4
    corners = places[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(across, axis=1).sum()
    # a polyhedron inside a ball is smaller than it, by the square of its edges
    assert 0.99 * 4 * np.pi < area < 4 * np.pi
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


@pytest.mark.parametrize("sign", [1.0, -1.0, np.nan])
def test_no_surface_where_there_is_one_sign(sign):
    places, triangles = level_surface(lambda at: np.full(len(at), sign), -CORNER, CORNER)
    assert places.shape == (0, 3) and triangles.shape == (0, 3)


def test_only_what_has_a_place_and_no_shape_is_a_region():
    shaped = [KeepOut((0, 1, 0), 0.3), SpeedLimit(9.0), Rolling((0, 1, 0), 0.3)]
    problem = flight(constraints=[*shaped, Egg((0, 0, 0), 0.5)], links=[])
    (egg,) = regions(solve(problem, steps=20))
    assert egg.name == "forbidden by Egg" and not egg.held
    assert list(egg.values(np.array([[0.0, 0, 0], [0, 0.6, 0]])) > 0) == [True, False]


@pytest.mark.parametrize(
    ("link", "name"),
    [
        (Surface(lambda q: q[2] - 0.1 * q[0]), "held by Surface"),
        (Floor(), "held by Floor"),
        (Rail(), None),
        (Rod((0, 0, 0), 1.0), None),
        (Rod("a", 1.0, on="b"), None),
    ],
)
def test_a_link_of_one_number_has_a_level(link, name):
    level = link.level(3)
    assert (level is None) == (name is None)
    if name == "held by Surface":
        assert float(level([2.0, 5.0, 0.5])) == pytest.approx(0.3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_pictures_and_pages_show_it(dimension):
    problem = flight(dimension, constraints=[Egg((0,) * dimension, 0.5)])
    solution = solve(problem, steps=20)
    axes = figure(solution).axes[0]
    assert "forbidden by Egg" in [text.get_text() for text in axes.get_legend().texts]
    assert any(drawn.get_gid() == "forbidden by Egg" for drawn in axes.collections)
    view = view_of(solution, solution.position)
    # it lies near as a whole, and so it is seen as a whole
    assert (view[0] < -0.5).all() and (view[1] > 0.5).all()
    (trace,) = scenery_traces(solution, view, 2.0)
    assert trace["name"] == "forbidden by Egg"
    places = np.array([trace[axis] for axis in "xyz"[:dimension]], float).T
    away = np.linalg.norm(places[np.isfinite(places).all(axis=1)], axis=1)
    # in units of 2 m
    assert away == pytest.approx(np.full(len(away), 0.25), abs=1e-2)
    if dimension == 3:
        assert trace["type"] == "mesh3d" and np.array([trace[i] for i in "ijk"]).max() == len(places) - 1


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_surface_of_a_link_is_drawn(dimension):
    ends = (still(-1, 0), still(1, 0)) if dimension == 2 else (still(-1, 0, 0), still(1, 1, 0))
    solution = solve(TransferProblem(1.0, *ends, 2.0, links=[Floor()]), steps=10)
    axes = figure(solution).axes[0]
    assert any(drawn.get_gid() == "held by Floor" for drawn in axes.collections)
    view = -np.ones(dimension), 2 * np.ones(dimension)
    (trace,) = scenery_traces(solution, view, 1.0)
    height = np.array([float(value) for value in trace["xyz"[dimension - 1]] if value is not None])
    assert trace["name"] == "held by Floor" and np.abs(height).max() < 5e-3
