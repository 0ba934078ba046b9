"""A figure shows the path, the force, the speed and the ledger, and what limits them."""

import dataclasses
import os
import warnings

import numpy as np
import pytest

from dmoc import (
    J2,
    ApproachCone,
    BallForce,
    BoxForce,
    Conservative,
    Effort,
    Engine,
    FinalMass,
    Fuel,
    KeepIn,
    KeepOut,
    LinearDrag,
    Nozzles,
    PointGravity,
    SpeedLimit,
    State,
    Time,
    TransferProblem,
    UniformGravity,
    load,
    solve,
    three_body,
)
from dmoc.checks.verification import Check, Report
from dmoc.plots.page import figure, save_figure
from dmoc.plots.style import readable, within_steps

PNG = b"\x89PNG\r\n\x1a\n"


def line(**changes):
    parts = {"actuator": BoxForce(1.0), "objective": Time()}
    return TransferProblem(1, State((0,), (0,)), State((1,), (0,)), (0.1, 10), **(parts | changes))


def orbit(**changes):
    parts = {"effects": [PointGravity(1)]}
    return TransferProblem(1, State((1, 0), (0, 1)), State((-1.2, 0), (0, -0.9)), 4.0, **(parts | changes))


def room(**changes):
    parts = {
        "actuator": BallForce(1.2),
        "constraints": [KeepOut((4, 0), 1.5), KeepIn((-1, -3), (9, np.inf)), SpeedLimit(0.35)],
        "name": "living_room",
    }
    return TransferProblem(10.0, State((0, 0), (0, 0)), State((8, 1), (0, 0)), 40.0, **(parts | changes))


def flyer():
    zones = [KeepOut(center, 1.0) for center in [(2, 0.2, 0.2), (4.2, 0.9, 0.4), (6, 0.4, 1)]]
    zones.append(KeepIn((-1, -3, -3), (9, 3, 3)))
    ends = State((0, 0, 0), (0, 0, 0)), State((8, 1, 1), (0, 0, 0))
    return TransferProblem(10.0, *ends, 40.0, actuator=BoxForce((0.6, 0.6, 0.5)), constraints=zones)


CASES = {
    "1-D held": (line, {"steps": 12, "hold": True}),
    "1-D": (line, {"steps": 12}),
    "2-D order 8": (orbit, {"order": 8, "steps": 6}),
    "2-D held": (room, {"steps": 12, "hold": True}),
    "3-D": (flyer, {"order": 4, "steps": 12}),
}
SOLVED: dict = {}


def solved(name):
    if name not in SOLVED:
        make, arguments = CASES[name]
        SOLVED[name] = solve(make(), **arguments)
    return SOLVED[name]


def panels(solution, report=None):
    page = figure(solution, report)
    return dict(zip(("path", "force", "speed", "ledger"), page.axes, strict=True))


def labels(axes):
    """What the panel's legend names."""
    return [text.get_text().replace("\n", " ") for text in axes.get_legend().get_texts()]


def levels(axes, label):
    """Heights of the horizontal lines of that name."""
    return sorted(
        artist.get_ydata()[0] for artist in axes.lines if artist.get_label().replace("\n", " ") == label
    )


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("loaded", [False, True])
def test_every_kind_of_solution_makes_a_picture(name, loaded, tmp_path):
    solution = solved(name)
    if loaded:
        solution.save(tmp_path / "s.nc")
        solution = load(tmp_path / "s.nc")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save_figure(solution, tmp_path / "s.png")
    content = (tmp_path / "s.png").read_bytes()
    assert content.startswith(PNG)
    assert len(content) > 20_000


@pytest.mark.parametrize(("suffix", "start"), [(".pdf", b"%PDF"), (".svg", b"<?xml"), (".PNG", PNG)])
def test_the_suffix_decides_the_format(tmp_path, suffix, start):
    path = tmp_path / f"picture{suffix}"
    save_figure(solved("1-D"), path)
    assert path.read_bytes().startswith(start)


@pytest.mark.parametrize("name", ["picture.bmp", "picture"])
def test_an_unknown_suffix_is_refused(tmp_path, name):
    with pytest.raises(ValueError, match=r"must end in \.png, \.pdf, \.svg"):
        save_figure(solved("1-D"), tmp_path / name)
    assert not os.listdir(tmp_path)


def test_no_half_a_picture_is_left(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    def fail(self, path, **_):
        path.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(OSError, match="disk full"):
        save_figure(solved("1-D"), tmp_path / "s.png")
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("name", CASES)
def test_all_axes_have_units_and_no_text_is_small(name):
    for axes in figure(solved(name)).axes:
        assert axes.get_ylabel().endswith("]")
        assert not axes.get_xlabel() or axes.get_xlabel().endswith("]")
        texts = [
            axes.yaxis.label,
            *axes.get_xticklabels(),
            *axes.get_yticklabels(),
            *axes.get_legend().get_texts(),
        ]
        assert min(text.get_fontsize() for text in texts) >= 10


@pytest.mark.parametrize("name", ["2-D order 8", "2-D held", "3-D"])
def test_nothing_overlaps(name):
    """Panels, titles, legends and the texts of the page keep clear of one another."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    page = figure(solved(name))
    renderer = FigureCanvasAgg(page).get_renderer()
    page.draw_without_rendering()
    time_panels = [axes.get_tightbbox(renderer) for axes in page.axes[1:]]
    path = page.axes[0].get_tightbbox(renderer)
    texts = [page._suptitle.get_window_extent(renderer), page._supxlabel.get_window_extent(renderer)]
    if name == "3-D":
        texts.append(page.axes[0].zaxis.label.get_window_extent(renderer))
    for i, box in enumerate(time_panels):
        assert not box.overlaps(path)
        assert not any(box.overlaps(other) for other in (*time_panels[:i], *texts))


def test_the_path_is_drawn_with_its_ends():
    solution = solved("2-D order 8")
    axes = panels(solution)["path"]
    assert {"path", "start", "goal", "attractor", "step ends"} <= set(labels(axes))
    marks = {artist.get_label(): artist.get_xydata() for artist in axes.lines}
    assert marks["start"] == pytest.approx(np.array([[1.0, 0.0]]))
    assert marks["goal"] == pytest.approx(np.array([[-1.2, 0.0]]))
    assert marks["attractor"] == pytest.approx(np.array([[0.0, 0.0]]))
    assert axes.get_aspect() == 1.0


def test_a_path_of_high_order_is_smooth_and_goes_through_every_node():
    solution = solved("2-D order 8")
    times, path = within_steps(solution, solution.position)
    assert len(path) > 5 * len(solution.position)
    assert np.all(np.diff(times) >= 0)
    turns = np.diff(path, axis=0)
    turns = turns[np.linalg.norm(turns, axis=1) > 1e-9]
    directions = np.unwrap(np.arctan2(turns[:, 1], turns[:, 0]))
    assert np.abs(np.diff(directions)).max() < 0.1
    from scipy.interpolate import CubicSpline

    once = np.append(np.diff(times) > 0, True)
    assert CubicSpline(times[once], path[once])(solution.time) == pytest.approx(solution.position, abs=1e-4)


def test_at_order_2_the_path_is_the_chords():
    solution = solved("2-D held")
    assert np.array_equal(within_steps(solution, solution.position)[1], solution.position)


def test_limits_and_zones_are_drawn():
    solution = solve(room(), steps=12)
    drawn = panels(solution)
    assert levels(drawn["force"], "limit") == [1.2]
    assert levels(drawn["speed"], "limit") == [0.35]
    disc = next(patch for patch in drawn["path"].patches if patch.get_gid() == "keep-out zone")
    assert disc.center == (4.0, 0.0) and disc.radius == 1.5
    assert {"keep-out zone", "keep-in zone"} <= set(labels(drawn["path"]))
    assert figure(solution).get_suptitle().startswith("living room: least effort")


def test_zones_in_space_and_limits_of_each_axis_are_drawn():
    drawn = panels(solved("3-D"))
    spheres = [shape for shape in drawn["path"].collections if shape.get_gid() == "keep-out zone"]
    assert len(spheres) == 3
    assert {"keep-out zone", "projection"} <= set(labels(drawn["path"]))
    assert levels(drawn["force"], "limit of $F_x$, $F_y$") == [-0.6, 0.6]
    assert levels(drawn["force"], "limit of $F_z$") == [-0.5, 0.5]
    assert {"$F_x$", "$F_y$", "$F_z$", "$|F|$"} <= set(labels(drawn["force"]))


def test_on_a_line_zones_are_bands():
    zones = [KeepOut((3.0,), 1.0), KeepIn((-0.5,), (np.inf,))]
    axes = panels(solve(line(constraints=zones), steps=8))["path"]
    assert {"keep-out zone", "keep-in zone", "position"} <= set(labels(axes))
    assert levels(axes, "keep-in zone") == [-0.5]
    assert axes.get_ylabel() == "x [m]" and axes.get_xlabel() == "time [s]"


def test_held_forces_are_steps():
    from matplotlib.patches import StepPatch

    held = panels(solved("1-D held"))["force"]
    steps = [patch for patch in held.patches if isinstance(patch, StepPatch)]
    assert len(steps) == 1
    assert steps[0].get_data().values == pytest.approx(solved("1-D held").force[:, 0])
    assert "held" in held.get_title(loc="left")
    assert not [p for p in panels(solved("1-D"))["force"].patches if isinstance(p, StepPatch)]


def test_a_loaded_solution_has_no_zones_until_its_problem_is_attached(tmp_path):
    solution = solved("2-D held")
    solution.save(tmp_path / "s.nc")
    loaded = load(tmp_path / "s.nc")
    bare, whole = panels(loaded), panels(loaded.attach(room()))
    assert not bare["path"].patches and "limit" not in labels(bare["force"])
    assert "problem not attached" in figure(loaded).get_supxlabel()
    assert "keep-out zone" in labels(whole["path"]) and "limit" in labels(whole["force"])


def test_energy_gained_is_the_work_done():
    for name in ("1-D held", "2-D order 8", "3-D"):
        axes = panels(solved(name))["ledger"]
        gained, work = (curve.get_ydata() for curve in axes.lines[:2])
        assert labels(axes) == ["energy gained", "work of the force"]
        assert work == pytest.approx(gained, abs=1e-3 * np.abs(gained).max())
        assert gained[0] == 0.0


def test_effects_that_do_work_are_in_the_ledger():
    axes = panels(solve(room(effects=[LinearDrag(0.5)]), steps=100))["ledger"]
    curves = {curve.get_label().replace("\n", " "): curve.get_ydata() for curve in axes.lines}
    assert curves["work of the effects"][-1] < 0
    assert curves["sum of work"] == pytest.approx(curves["energy gained"], abs=1e-3)


@dataclasses.dataclass(frozen=True)
class Shaken(Conservative):
    """A uniform field that swings, so that energy is not to be balanced."""

    def lagrangian(self, t, q, v, m):
        import casadi as ca

        return 0.01 * ca.sin(t) * q[0]


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
def test_where_energy_is_not_kept_momentum_is_shown_and_where_it_came_from(hold):
    """Force and effects together give what the body gained, to rounding; the force alone does not."""
    axes = panels(solve(room(effects=[Shaken()]), steps=20, hold=hold))["ledger"]
    assert "Momentum" in axes.get_title(loc="left")
    curves = {curve.get_gid(): curve.get_ydata() for curve in axes.lines if curve.get_gid()}
    for axis in "xy":
        gained = curves[f"{axis} gained"]
        assert curves[f"{axis} from force\nand effects"] == pytest.approx(gained, abs=1e-9)
    assert np.abs(curves["x from the\nforce"] - curves["x gained"]).max() > 1e-3


@pytest.mark.parametrize("hold", [False, True], ids=["nodal", "held"])
def test_where_mass_burns_away_energy_per_mass_is_the_work(hold):
    engine = Engine(0.15, exhaust_velocity=1.0, dry_mass=0.5)
    scene = orbit(actuator=engine, objective=Fuel(), effects=[PointGravity(1), LinearDrag(0.01)])
    solution = solve(scene, order=2, steps=200, hold=hold).raise_for_status()
    axes = panels(solution)["ledger"]
    assert "per mass" in axes.get_title(loc="left") and axes.get_ylabel() == "energy [J/kg]"
    curves = {curve.get_label().replace("\n", " "): curve.get_ydata() for curve in axes.lines}
    change = np.diff(0.5 * np.sum(solution.velocity[[0, -1]] ** 2, axis=1) - 1 / np.array([1.0, 1.2]))
    assert curves["energy gained"][-1] == pytest.approx(change[0], abs=1e-9)
    assert curves["sum of work"] == pytest.approx(curves["energy gained"], abs=1e-3)
    assert curves["work of the effects"][-1] < 0 < curves["work of the force"][-1]
    assert "final mass" in figure(solution).get_suptitle()
    kept = solve(
        dataclasses.replace(scene, objective=FinalMass()), order=2, steps=200, hold=hold
    ).raise_for_status()
    assert figure(kept).get_suptitle().count("final mass") == 1


def test_a_loaded_engine_without_its_problem_shows_momentum(tmp_path):
    engine = Engine(1.2, exhaust_velocity=100.0, dry_mass=5.0)
    solve(room(actuator=engine, objective=Fuel(), constraints=()), steps=20, hold=True).save(tmp_path / "s.nc")
    axes = panels(load(tmp_path / "s.nc"))["ledger"]
    curves = {curve.get_gid(): curve.get_ydata() for curve in axes.lines if curve.get_gid()}
    for axis in "xy":
        assert curves[f"{axis} from the\nforce"] == pytest.approx(curves[f"{axis} gained"], abs=1e-3)


def test_burns_are_marked_on_the_path_and_over_time():
    thrust = {"actuator": Nozzles([(1,)], 3.0), "objective": Fuel(), "effects": [UniformGravity([-1.5])]}
    lander = TransferProblem(1.0, State([10], [-2]), State([0], [0]), (0.5, 20.0), **thrust)
    drawn = panels(solve(lander, steps=50))
    for name in ("force", "speed", "ledger"):
        (shade,) = [s for s in drawn[name].collections if s.get_gid() == "engine on"]
        (times,) = [path.vertices[:, 0] for path in shade.get_paths()]
        # the switch and the landing (Meditch 1964), to a step
        assert (times.min(), times.max()) == pytest.approx((1.4154, 4.1641), abs=4.2 / 50)
    assert "engine on" in labels(drawn["path"])
    assert "engine on" not in labels(panels(solved("2-D order 8"))["path"])


def test_an_approach_cone_is_drawn_from_its_tip_around_the_path():
    for n, pieces in ((2, 2), (3, 5)):
        start, goal = State((-50, *[5] * (n - 1)), [0] * n), State([0] * n, [0] * n)
        cone = ApproachCone([0] * n, (-1, *[0] * (n - 1)), np.radians(20))
        axes = panels(solve(TransferProblem(1.0, start, goal, 9.0, constraints=[cone]), steps=10))["path"]
        edges = [np.array(a.get_data_3d() if n == 3 else a.get_data()) for a in axes.lines
                 if a.get_label() == "approach cone"]  # fmt: skip
        assert len(edges) == pieces and "approach cone" in labels(axes)
        for edge in edges:
            across = np.linalg.norm(edge[1:], axis=0)
            assert across == pytest.approx(-np.tan(np.radians(20)) * edge[0], abs=1e-9)


def test_an_attractor_whose_radius_is_known_is_drawn_in_its_size():
    effects = [PointGravity(1), J2(1.0, 0.8, 1e-3)]
    axes = panels(solve(orbit(effects=effects), steps=50))["path"]
    (disc,) = [patch for patch in axes.patches if patch.get_gid() == "attractor"]
    assert disc.center == (0.0, 0.0) and disc.radius == 0.8 and "attractor" in labels(axes)


def test_both_bodies_of_the_three_body_problem_are_drawn_where_they_are_in_view():
    still = (0.0, 0.0, 0.0)
    across = TransferProblem(
        1.0, State((0.2, 0.3, 0), still), State((1.2, 0.1, 0), still), 3.0, three_body(0.1)
    )
    axes = panels(solve(across, steps=50))["path"]
    marks = [np.ravel(a.get_data_3d()) for a in axes.lines if a.get_label() == "attractor"]
    assert np.array(marks) == pytest.approx(np.array([[-0.1, 0, 0], [0.9, 0, 0]]))


def test_a_wide_room_has_a_wide_panel():
    """Limits of a room are limits of the picture, and equal scales leave no empty half page."""
    zones = [KeepIn((-1, -3), (40, 3)), KeepOut((20, 4), 3.0)]
    corridor = TransferProblem(1.0, State((0, 0), (0, 0)), State((39, 0), (0, 0)), 9.0, constraints=zones)
    page = figure(solve(corridor, steps=20))
    page.draw_without_rendering()
    boxes = [axes.get_position() for axes in page.axes]
    assert boxes[0].width > 0.6 and all(box.y1 < boxes[0].y0 for box in boxes[1:])
    assert max(np.abs(page.axes[0].get_ylim())) < 7


def test_a_limit_far_above_the_force_does_not_flatten_its_curve():
    solution = solve(orbit(actuator=BallForce(5.0)), steps=50)
    axes = panels(solution)["force"]
    assert not levels(axes, "limit") and "limit 5 N" in labels(axes)
    assert axes.get_ylim()[1] < 3 * np.linalg.norm(solution.force, axis=1).max()


def test_speeds_that_hardly_change_fill_their_panel():
    assert panels(solved("1-D"))["speed"].get_ylim()[0] == 0
    low, high = panels(solved("2-D order 8"))["speed"].get_ylim()
    speed = np.linalg.norm(solved("2-D order 8").velocity, axis=1)
    assert high - low < 1.5 * np.ptp(speed)


def test_on_a_line_the_velocity_is_drawn_with_its_sign():
    """Up and down again; limits of the speed stand on both sides."""
    back = TransferProblem(
        1.0, State([0], [1.0]), State([0], [-1.5]), 6.0, constraints=[SpeedLimit(2.0)], name="back"
    )
    solution = solve(back, steps=20)
    axes = panels(solution)["speed"]
    (curve,) = [line for line in axes.lines if line.get_label() == "velocity"]
    assert curve.get_ydata() == pytest.approx(solution.velocity[:, 0])
    assert levels(axes, "limit") == [-2.0, 2.0]
    assert axes.get_ylabel() == "velocity [m/s]" and axes.get_title("left") == "Velocity"
    forth = panels(solved("1-D"))["speed"]
    assert forth.get_ylim()[0] == 0 and forth.get_ylabel() == "velocity [m/s]"


def test_a_speed_is_a_smooth_curve_on_few_steps():
    """Between nodes it is the speed of the answer there, not a straight line."""
    solution = solve(orbit(), order=8, steps=4)
    (curve,) = [line for line in panels(solution)["speed"].lines if line.get_label() == "speed"]
    times, speed = curve.get_data()
    assert len(times) > 100
    np.testing.assert_allclose(speed, np.linalg.norm(solution.at(times).velocity, axis=1), rtol=1e-12)


def test_nozzles_are_limited_one_by_one():
    nozzles = Nozzles([(1, 0), (-1, 0), (0, 1), (0, -1)], 1.5)
    solution = solve(room(actuator=nozzles, constraints=()), steps=10)
    assert levels(panels(solution)["force"], "limit of a nozzle") == [1.5]


def test_the_page_tells_what_failed():
    failed = solve(
        TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 0.1, actuator=BoxForce(1.0)), steps=8
    )
    page = figure(failed)
    assert "NOT SOLVED (infeasible)" in page.get_suptitle()
    checks = [Check("residual", 2.0, 1.0, "N", False), Check("bounds", 0.0, 1.0, "m", True)]
    assert "checks failed: residual" in figure(failed, Report(tuple(checks), 0.1)).get_supxlabel()
    good = Report((Check("residual", 0.5, 1.0, "N", True),), 0.1)
    assert "all 1 checks hold" in figure(solved("1-D"), good).get_supxlabel()


@pytest.mark.parametrize("name", ["2-D held", "3-D"])
@pytest.mark.parametrize("lost", [slice(3, 4), slice(None)])
def test_an_iterate_that_is_not_finite_is_still_drawn(name, lost, tmp_path):
    solution = solved(name)
    position = solution.position.copy()
    position[lost] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        broken = dataclasses.replace(solution, path=dataclasses.replace(solution.path, position=position))
        save_figure(broken, tmp_path / "s.png")
    assert (tmp_path / "s.png").read_bytes().startswith(PNG)


def test_far_walls_and_large_zones_do_not_hide_the_path():
    zones = [KeepOut((4, -1000.0), 999.0), KeepIn((-1e4, -1e4), (1e4, 1e4))]
    page = figure(solve(room(constraints=zones), steps=12))
    page.draw_without_rendering()
    left, right = page.axes[0].get_xlim()
    assert right - left < 40


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (7e6, "m", (1e3, "km")),
        (8.0, "m", (1.0, "m")),
        (7500.0, "m/s", (1.0, "m/s")),
        (2e-4, "N", (1e-3, "mN")),
        (2e5, "s", (3600.0, "h")),
        (9e6, "s", (86400.0, "days")),
        (0.0, "J", (1.0, "J")),
        (np.nan, "m", (1.0, "m")),
    ],
)
def test_units_read_well(value, unit, expected):
    assert readable(np.array([0.0, -value]), unit) == expected


def test_the_title_has_times_in_the_unit_of_their_axis():
    week = 7 * 86400.0
    scene = {"actuator": BoxForce(1.0), "start": State((0,), (0,)), "goal": State((0.25 * week**2,), (0,))}
    titles = []
    for objective, duration in ((Effort(), 1.5 * week), (Time(), (0.1 * week, 2 * week))):
        problem = TransferProblem(1, duration=duration, objective=objective, **scene)
        page = figure(solve(problem, steps=20).raise_for_status())
        assert page.axes[-1].get_xlabel() == "time [days]"
        titles.append(page.get_suptitle())
    assert titles[0].endswith(", duration 10.5 days")
    assert titles[1] == "least time 7 days"
