"""A sweep is drawn as a curve, a map or a cloud, with what failed marked, and time against expense."""

import numpy as np
import pytest
import xarray
from sweep_helpers import FAILED, found, plan_of

import dmoc
from dmoc.charts.front import pareto
from dmoc.charts.sweep import save_sweep, sweep_figure
from dmoc.cli.app import main
from dmoc.scene.problem_file import Parameter
from dmoc.sweeps.data import is_sweep, read_sweep, sweep_dataset, write_sweep
from dmoc.sweeps.plan import Plan


def picture(plan, value, **more):
    """A dataset whose objective is a function of the point; None where it failed."""
    records = []
    for point in range(plan.size):
        objective = value(plan.at(point))
        solved = found(objective) if objective is not None else FAILED
        records.append(
            solved | {"objective_unit": "N^2 s", "effort": objective, "duration": 1.0, "propellant": 0.0}
        )
        records[-1] |= {name: function(plan.at(point)) for name, function in more.items()}
    return sweep_dataset(plan, records, {"problem": "a_push", "settings": "{}"})


def test_one_parameter_is_a_curve_with_failures_marked(tmp_path):
    data = picture(plan_of(9), lambda at: None if at["p0"] < 3 else 1 + (at["p0"] - 5) ** 2)
    (axes,) = sweep_figure(data).axes
    by_label = {line.get_label(): line for line in axes.get_lines()}
    assert np.nanmin(by_label["solved"].get_ydata()) == 1 and len(by_label["not solved"].get_xdata()) == 3
    assert axes.get_ylabel() == "effort [N\u00b2 s]"


def test_a_sample_of_one_parameter_is_a_curve_in_order():
    data = picture(plan_of(8, sampled=True), lambda at: None if at["p0"] > 6 else 1 + at["p0"] ** 2)
    (axes,) = sweep_figure(data).axes
    by_label = {line.get_label(): line for line in axes.get_lines()}
    x, y = by_label["solved"].get_data()
    assert (np.diff(x) > 0).all() and (np.diff(y[np.isfinite(y)]) > 0).all()
    assert len(by_label["not solved"].get_xdata()) == np.isnan(y).sum()


def test_two_parameters_are_a_map_with_failures_hatched(tmp_path):
    def effort(at):
        return None if at["p0"] + at["p1"] < 2 else 1 + at["p0"] + 2 * at["p1"]

    data = picture(plan_of(6, 5), effort, duration=lambda at: 10 - at["p0"])
    page = sweep_figure(data)
    hatched = [c for c in page.axes[0].collections if c.get_label() == "not solved"]
    assert len(hatched[0].get_paths()) == 3 and hatched[0].get_hatch()
    assert page.axes[1].get_title("left") == "Time against effort"
    for suffix in (".png", ".svg"):
        save_sweep(data, tmp_path / f"map{suffix}")
        assert (tmp_path / f"map{suffix}").stat().st_size > 1000
    three = picture(plan_of(4, 4, 3), lambda at: 1 + at["p0"] + at["p1"] + at["p2"])
    assert "the best over p2" in sweep_figure(three).axes[0].get_title("left")
    sample = picture(plan_of(9, 9, sampled=True), lambda at: 1 + at["p0"])
    assert sweep_figure(sample).axes[0].get_xlabel() == "p0"
    assert sweep_figure(picture(plan_of(4, 4), lambda at: None)).axes


@pytest.mark.parametrize(("across", "up"), [(7, 6), (20, 6), (20, 14)])
def test_contours_bear_numbers_where_these_do_not_overlap(across, up):
    """Wherever there are numbers, no two of them share ink: on the steepest side of a map."""
    page = sweep_figure(picture(plan_of(across, up), lambda at: 1 + at["p0"] ** 2 + at["p1"] ** 4))
    page.draw_without_rendering()
    boxes = [text.get_window_extent() for text in page.axes[0].texts]
    assert bool(boxes) == (min(across, up) >= 12)
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def stretched(*axes, sampled=False):
    """Parameters p0, p1, ... whose values are these."""
    values = tuple(np.asarray(axis) for axis in axes)
    parameters = tuple(Parameter(f"p{i}", 1.0) for i in range(len(values)))
    return Plan(parameters, values, sampled)


EQUAL_FACTORS, EQUAL_STEPS = np.geomspace(1.0, 1000.0, 7), np.linspace(1.0, 1000.0, 7)


@pytest.mark.parametrize(
    ("values", "scale"),
    [
        (EQUAL_FACTORS, "log"),
        ([1.0, 2.0, 5.0, 10.0, 20.0, 50.0], "log"),
        (EQUAL_STEPS, "linear"),
        ([-1.0, 1.0, 10.0, 100.0], "linear"),
        ([0.0, 1.0, 10.0, 100.0], "linear"),
        (np.geomspace(10.0, 20.0, 7), "linear"),
        ([1.0, 1000.0], "linear"),
    ],
)
def test_values_at_equal_factors_have_a_logarithmic_axis(values, scale):
    (axes,) = sweep_figure(picture(stretched(values), lambda at: 1 + at["p0"] ** 2)).axes
    assert axes.get_xscale() == scale
    if scale == "log":
        axes.figure.draw_without_rendering()
        assert {"10", "1"} <= {text.get_text() for text in axes.get_xticklabels()}


def test_the_cells_of_a_logarithmic_map_have_equal_widths():
    data = picture(stretched(EQUAL_FACTORS, EQUAL_STEPS), lambda at: None if at["p0"] < 2 else 1 + at["p0"])
    axes = sweep_figure(data).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    mesh = next(one for one in axes.collections if hasattr(one, "get_coordinates"))
    places = mesh.get_coordinates()
    assert np.allclose(np.diff(np.log(places[0, :, 0])), np.log(1000) / 6)
    assert np.allclose(np.diff(places[:, 0, 1]), 999 / 6)
    hatched = [c for c in axes.collections if c.get_label() == "not solved"]
    assert hatched[0].get_paths()[0].vertices[:, 0].min() == pytest.approx(places[0, 0, 0])


def test_the_front_is_what_no_other_beats_in_both():
    x, y = np.random.default_rng(0).random((2, 200))
    front = set(pareto(x, y).tolist())
    for i in range(200):
        beaten = np.any((x <= x[i]) & (y <= y[i]) & ((x < x[i]) | (y < y[i])))
        assert (i in front) != beaten
    assert list(pareto(np.array([1.0, 1.0, 2.0]), np.array([3.0, 3.0, 3.0]))) == [0]


def test_dmoc_plot_knows_a_sweep(tmp_path, capfd):
    write_sweep(picture(plan_of(4), lambda at: 1 + at["p0"]), tmp_path / "out.nc")
    with pytest.raises(SystemExit) as end:
        main(["plot", str(tmp_path / "out.nc")])
    assert not end.value.code and "out.png" in capfd.readouterr().out
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")


def test_other_files_are_told_apart(tmp_path):
    cut, other, text = (tmp_path / name for name in ("cut.nc", "other.nc", "text.nc"))
    cut.write_bytes(b"\x89HDF\r\n\x1a\n")
    text.write_text("no netCDF\n")
    xarray.Dataset().to_netcdf(other, engine="h5netcdf")
    assert not any(map(is_sweep, (cut, other, text, tmp_path / "none.nc")))
    for path, words in (
        (cut, "damaged"),
        (other, "not the result of a sweep"),
        (tmp_path / "none.nc", "not exist"),
    ):
        with pytest.raises(ValueError, match=words):
            read_sweep(path)
    write_sweep(picture(plan_of(4), lambda at: 1 + at["p0"]), tmp_path / "sweep.nc")
    with pytest.raises(ValueError, match=r"result of a sweep; draw it with: dmoc plot"):
        dmoc.load(tmp_path / "sweep.nc")


def test_a_damaged_sweep_is_refused_before_anything_opens_it(tmp_path, capfd):
    path = tmp_path / "out.nc"
    write_sweep(picture(plan_of(4), lambda at: 1 + at["p0"]), path)
    whole, random = path.read_bytes(), np.random.default_rng(0)
    for place in random.integers(len(whole), size=40):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 255]) + whole[place + 1 :])
        for reader in (read_sweep, is_sweep):
            with pytest.raises(ValueError, match="is damaged: its checksum does not hold"):
                reader(path)
    with pytest.raises(SystemExit) as end:
        main(["plot", str(path)])
    assert end.value.code == 2
    assert len(capfd.readouterr().err.splitlines()) == 1
    path.write_bytes(whole)
    assert read_sweep(path).identical(picture(plan_of(4), lambda at: 1 + at["p0"]))


def test_a_sweep_of_the_first_format_has_no_checksum_and_loads(tmp_path):
    path, data = tmp_path / "out.nc", picture(plan_of(4), lambda at: 1 + at["p0"])
    data.assign_attrs(format_version=1).to_netcdf(path, engine="h5netcdf")
    assert is_sweep(path) and read_sweep(path).sizes == data.sizes
    data.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(ValueError, match="lacks its checksum"):
        read_sweep(path)
