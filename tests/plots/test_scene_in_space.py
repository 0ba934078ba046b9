"""A scene in space lies on its page, with numbers beside their labels; bodies have colours of their own."""

from itertools import product

import numpy as np
import pytest

from dmoc import CircularOrbit, PointGravity, State, TransferProblem, solve, three_body
from dmoc.plots.page import figure
from dmoc.plots.path import _columns as columns_of
from dmoc.plots.style import ATTRACTOR, BODIES
from dmoc.plots.surroundings import colour_of

EARTH, SUN = 3.986004418e14, 1.32712440018e20


def raised(tilt, radius=7e6, mu=EARTH):
    """From a circle to a wider one, whose planes differ by an angle [rad]."""
    speed = (mu / radius) ** 0.5
    start = State((radius, 0, 0), (0, speed * np.cos(tilt), speed * np.sin(tilt)))
    goal = CircularOrbit(1.3 * radius, mu=mu, normal=(0, 0, 1))
    lasts = 8.0 * radius / speed
    return TransferProblem(500.0, start, goal, lasts, effects=[PointGravity(mu)])


def drawn(problem):
    page = figure(solve(problem, steps=40, order=4))
    page.draw_without_rendering()
    return page, page.axes[0]


def corners(page, axes):
    """The corners of the box [px]."""
    from mpl_toolkits.mplot3d import proj3d

    ends = axes.get_xlim(), axes.get_ylim(), axes.get_zlim()
    x, y, _ = proj3d.proj_transform(*np.transpose(list(product(*ends))), axes.get_proj())
    return axes.transData.transform(np.stack([x, y], axis=1))


@pytest.mark.parametrize("tilt", [0.01, 0.3, 1.3])
def test_the_whole_box_is_on_the_page(tilt):
    page, axes = drawn(raised(tilt))
    places = corners(page, axes)
    # with a little room for the width of its lines [px]
    assert (places >= 5).all() and (places <= np.array(page.bbox.size) - 5).all()
    # and it is not small there
    assert np.ptp(places[:, 0]) > 0.25 * page.bbox.width


@pytest.mark.parametrize(
    ("tilt", "radius", "mu"), [(0.01, 1.5e11, SUN), (0.3, 2.4e7, EARTH), (1.3, 6e6, EARTH)]
)
def test_the_label_of_an_axis_stands_beside_its_numbers(tilt, radius, mu):
    """No power of ten is printed on its own: it is part of the label."""
    _, axes = drawn(raised(tilt, radius, mu))
    every = axes.xaxis, axes.yaxis, axes.zaxis
    assert not any(axis.get_offset_text().get_text() for axis in every)
    # the boxes of the other two labels, which are turned, tell little
    texts = [axes.zaxis.get_label()]
    for axis in every:
        low, high = sorted(axis.get_view_interval())
        texts += [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    # letters do not fill the box of their line
    boxes = [(text.get_text(), text.get_window_extent().padded(-2)) for text in texts]
    assert not [(a, b) for i, (a, one) in enumerate(boxes) for b, other in boxes[:i] if one.overlaps(other)]
    names = [axis.get_label().get_text() for axis in every]
    unit = {1.5e11: "au", 2.4e7: "$10^{4}$ km", 6e6: "km"}[radius]
    assert names == [f"{name} [{unit}]" for name in "xyz"]


def test_known_bodies_have_their_colours():
    assert colour_of(PointGravity(EARTH)) == BODIES[3.986004e14] == "#56B4E9"
    assert colour_of(PointGravity(4.9048695e12)) == BODIES[4.902800e12]
    masses = [effect for effect in three_body(0.012150585) if hasattr(effect, "mu")]
    assert sorted(map(colour_of, masses)) == sorted((BODIES[0.98785], BODIES[0.01215]))
    assert colour_of(PointGravity(SUN)) == colour_of(PointGravity(1.0)) == ATTRACTOR
    _, axes = drawn(raised(0.3))
    (mark,) = [artist for artist in axes.lines if artist.get_label() == "attractor"]
    assert mark.get_markerfacecolor() == "#56B4E9"


def test_a_legend_is_no_wider_than_its_panel():
    """Nine entries are 3, 2, 2 and 2 in four columns: too wide with two long ones at both ends."""
    labels = ["way of the goal", "path", "start", "goal", "body x", "body y", "body z", "keep-out zone"]
    assert columns_of([*labels, "force, longest 0.2503 N"]) == 3
    assert columns_of(["path", "start", "goal", "attractor"]) == 4
