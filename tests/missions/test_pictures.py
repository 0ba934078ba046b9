"""The page of a mission: legs, joints, impulses, and what is drawn over time."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from dmoc import (
    BallForce,
    CircularOrbit,
    Coast,
    DeltaV,
    Drop,
    Engine,
    FinalHeight,
    Impulse,
    KeepOut,
    Leg,
    Mission,
    Orbit,
    PointGravity,
    State,
    UniformGravity,
    Via,
    load,
    solve,
    verify,
)
from dmoc.plots.lanes import LEG_COLOURS, looks_of
from dmoc.plots.page import figure, save_figure
from dmoc.plots.sheet import ON_DARK
from dmoc.plots.team import BODY_COLOURS


def hohmann():
    ends = CircularOrbit(1.0, mu=1.0, center=(0, 0)), CircularOrbit(2.0, mu=1.0)
    legs = [Impulse(), Coast((1, 60)), Impulse()]
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV())


def plane_change():
    ends = Orbit(1.0, a=1.0, e=0.0, i=0.0), Orbit(1.0, a=2.0, e=0.0, i=0.5, raan=0.0)
    legs = [Impulse(), Coast((1, 60)), Impulse(), Coast((1, 60)), Impulse()]
    return Mission(1.0, *ends, legs, [PointGravity(1.0)], objective=DeltaV())


def turn():
    ends = State((0, 0), (1, 0)), State((2, 1), (None, None))
    return Mission(1.0, *ends, [Coast(1.0), Impulse(), Coast(1.0)], objective=DeltaV())


def gates():
    legs = [Leg((0.1, 1.9)), Via((1, 1)), Leg((0.1, 1.9), constraints=[KeepOut((1, 0.5), 0.3)], name="home")]
    ends = State((0, 0), (0, 0)), State((2, 0), (0, 0))
    return Mission(1.0, *ends, legs, duration=2.0, actuator=BallForce(15.0), name="two_gates")


def rocket():
    lower = Engine(200.0, exhaust_velocity=50.0, min_thrust=200.0)
    upper = Engine(10.0, exhaust_velocity=60.0, min_thrust=10.0)
    return Mission(
        mass=10.0,
        start=State((0.0,), (0.0,)),
        goal=State((None,), (None,)),
        legs=[
            Leg(2.0, actuator=lower, name="lower"),
            Drop(1.0),
            Leg(1.0, actuator=upper, name="upper"),
            Coast(1),
        ],
        effects=[UniformGravity((-1.0,))],
        objective=FinalHeight(),
    )


SOLVED: dict = {}


def solved(make):
    if make not in SOLVED:
        SOLVED[make] = solve(make())
    return SOLVED[make]


def drawn(make):
    page = figure(solved(make))
    return {axes.get_title("left"): axes for axes in page.axes}


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def line(axes, label):
    return next(line for line in axes.lines if line.get_label() == label)


def curves(axes, count):
    """The curves of the legs, in their order."""
    found = [line for line in axes.lines if line.get_color() in LEG_COLOURS and len(line.get_xdata()) > 2]
    assert len(found) == count
    return found


@pytest.mark.parametrize(
    ("make", "titles"),
    [
        (hohmann, ["Path", "Length of the primer vector", "Speed"]),
        (plane_change, ["Path", "Length of the primer vector", "Speed"]),
        (gates, ["Path", "Force of the actuators", "Speed"]),
        (rocket, ["Position", "Force of the actuators", "Velocity", "Mass"]),
    ],
)
def test_the_page_has_a_lane_for_all_that_a_mission_has(make, titles, tmp_path):
    assert list(drawn(make)) == titles
    save_figure(solved(make), tmp_path / "page.png", dpi=20)
    assert (tmp_path / "page.png").stat().st_size > 1000


def test_impulses_stand_on_the_path_and_at_a_primer_of_one():
    path, primer = drawn(hohmann)["Path"], drawn(hohmann)["Length of the primer vector"]
    solution = solved(hohmann)
    arrows = next(one for one in path.collections if one.get_gid() == "impulse")
    kicks = np.array([kick.change for kick in solution.impulses])
    assert pytest.approx(np.array([kick.position for kick in solution.impulses])) == arrows.XY
    both = np.array([arrows.U, arrows.V]).T
    assert both / kicks == pytest.approx(np.full((2, 2), both[0, 0] / kicks[0, 0]))
    assert "impulse, longest 0.1547 m/s" in legend(path)
    marks = [line for line in primer.lines if line.get_label() == "impulse"]
    assert [mark.get_ydata()[0] for mark in marks] == pytest.approx([1.0, 1.0], abs=1e-5)
    assert [mark.get_xdata()[0] for mark in marks] == pytest.approx([0.0, solution.duration])
    assert line(primer, "above it another\nwould help").get_ydata()[0] == 1.0


def test_legs_have_colours_and_names_and_meet_at_marked_joints():
    panels, solution = drawn(gates), solved(gates)
    assert legend(panels["Speed"]) == ["leg 1", "home"]
    first, second = curves(panels["Path"], 2)
    assert first.get_color() != second.get_color()
    assert [one.get_color() for one in curves(panels["Speed"], 2)] == [first.get_color(), second.get_color()]
    joint = np.ravel(line(panels["Path"], "joint").get_data())
    assert joint == pytest.approx([1, 1]) and joint == pytest.approx(first.get_xydata()[-1])
    # A zone of the second leg alone is drawn, too.
    assert "keep-out zone" in legend(panels["Path"])
    assert figure(solution).get_suptitle() == "two gates: least effort 15 N\u00b2 s, duration 2 s"


def test_speed_jumps_at_an_impulse_and_mass_where_a_stage_is_dropped():
    first, second = (curve.get_ydata() for curve in curves(drawn(turn)["Speed"], 2))
    assert first[-1] == pytest.approx(1.0) and second[0] == pytest.approx(np.sqrt(2.0))
    lower, upper, _ = (curve.get_ydata() for curve in curves(drawn(rocket)["Mass"], 3))
    assert lower[-1] - upper[0] == pytest.approx(1.0)
    low, high = drawn(rocket)["Mass"].get_xlim()
    assert low < 0 and high > 4.0


def test_many_alike_legs_share_a_name():
    leg = solved(gates).legs[0]
    names = ["burn 1", "coast 2", "burn 3", "coast 4", "burn 5", "coast 6", "burn 7"]
    legs = [replace(leg, provenance=replace(leg.provenance, problem_name=name)) for name in names]
    looks = looks_of(legs)
    assert [look.label for look in looks] == ["burn", "coast"] * 3 + ["burn"]
    assert len({look.style["color"] for look in looks}) == 2
    assert [look.label for look in looks_of(legs[:3])] == names[:3]


def test_a_page_tells_of_checks_and_can_do_without_the_mission(tmp_path):
    report = verify(solved(hohmann))
    assert figure(solved(hohmann), report).get_supxlabel().endswith("all 9 checks hold")
    solved(hohmann).save(tmp_path / "flight.nc")
    page = figure(load(tmp_path / "flight.nc"))
    assert "problem not attached" in page.get_supxlabel()
    assert legend(page.axes[-1]) == ["coast 1"]


def test_legs_and_bodies_have_colours_that_differ_on_a_dark_background_too():
    for palette in (LEG_COLOURS, BODY_COLOURS):
        turned = [to_rgb(ON_DARK.get(colour.lower(), colour)) for colour in palette]
        apart = [np.abs(np.subtract(one, other)).max() for one, other in combinations(turned, 2)]
        assert min(apart) > 0.25


def test_a_limit_is_drawn_in_all_legs_that_have_it():
    """Legs pull with 3.5 N and with 1 N below one limit of 6 N."""
    legs = [Leg(1.0), Via((1, 0)), Leg(4.0)]
    ends = {"start": State((0, 0), (0, 0)), "goal": State((1.8, 0), (0, 0))}
    mission = Mission(mass=1.0, **ends, legs=legs, actuator=BallForce(6.0))
    page = figure(solve(mission, order=4, steps=4))
    (forces,) = [axes for axes in page.axes if "Force" in axes.get_title(loc="left")]
    limits = [line for line in forces.collections if line.get_label() == "limit"]
    assert [np.ptp(line.get_segments()[0][:, 0]) for line in limits] == pytest.approx([1.0, 4.0])
