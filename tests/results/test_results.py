"""A saved solution comes back to the last bit, warm-starts a solve, and a bad file is refused in one line."""

import dataclasses
import json
import os
import resource
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray

from dmoc import BoxForce, KeepOut, PointGravity, SpeedLimit, State, Time, TransferProblem, load, solve
from dmoc.basics.files import sealed
from dmoc.motion.path import Key
from dmoc.results.table import SOLUTION_FILE, to_dataset


def flyer(**changes):
    """A planar body that goes round a disc, with every kind of multiplier."""
    parts = {
        "mass": 10.0,
        "start": State((0, 0), (0, 0)),
        "goal": State((8, 1), (0, None)),
        "duration": (30.0, 50.0),
        "actuator": BoxForce(0.6),
        "constraints": [KeepOut((4, 0.2), 1.0), SpeedLimit(0.4)],
        "start_time": 7.0,
        "name": "flyer",
        "parameters": {"speed": 0.4, "center": (4, 0.2), "limit": np.float64(0.6)},
    }
    return TransferProblem(**(parts | changes))


def bang_bang():
    return TransferProblem(
        1, State((0,), (0,)), State((1,), (0,)), (0.1, 10), actuator=BoxForce(1.0), objective=Time()
    )


def infeasible():
    return TransferProblem(1.0, State((0,), (0,)), State((1,), (0,)), 0.1, actuator=BoxForce(1.0))


def orbit():
    return TransferProblem(
        1, State((1, 0), (0, 1)), State((-1.2, 0), (0, -0.9)), 4.0, effects=[PointGravity(1)]
    )


CASES = {
    "free duration, zones": (flyer, {"order": 4, "steps": 12, "options": {"ipopt.max_iter": 500}}),
    "held, least time": (bang_bang, {"steps": 20, "hold": True}),
    "order 8": (orbit, {"order": 8, "steps": 6}),
    "failed": (infeasible, {"steps": 8}),
    "graded mesh": (orbit, {"mesh": np.linspace(0, 1, 30) ** 1.5}),
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    make, arguments = CASES[request.param]
    problem = make()
    return problem, arguments, solve(problem, **arguments)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A small solution in a file."""
    path = tmp_path_factory.mktemp("saved") / "orbit.nc"
    solve(orbit(), steps=5).save(path)
    return path


def same_bits(one, other):
    return one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes()


def test_every_number_comes_back_to_the_last_bit(case, tmp_path):
    _, _, solution = case
    solution.save(tmp_path / "s.nc")
    back = load(tmp_path / "s.nc")
    for name in ("time", "end_times", "velocity", "momentum", "force", "costate", "position"):
        assert same_bits(getattr(back, name), getattr(solution, name)), name
    for field in dataclasses.fields(solution.path):
        here, there = getattr(solution.path, field.name), getattr(back.path, field.name)
        assert (
            same_bits(here, there)
            if isinstance(here, np.ndarray)
            else field.name == "multipliers" or here == there
        )
    assert list(back.path.multipliers) == list(solution.path.multipliers)
    for key, values in solution.path.multipliers.items():
        assert same_bits(values, back.path.multipliers[key]), key
    plain = ("objective", "success", "status", "message", "ladder", "worst", "tolerance", "error", "reason")
    for name in (*plain, "order", "hold", "steps", "duration", "iterations", "build_s", "solve_s"):
        assert getattr(back, name) == getattr(solution, name), name


def test_nan_and_infinity_survive(case, tmp_path):
    _, _, solution = case
    force = solution.force.copy()
    force[0, 0], force[1, 0], force[2, 0] = np.nan, np.inf, -0.0
    dataclasses.replace(solution, force=force, objective=np.inf).save(tmp_path / "s.nc")
    back = load(tmp_path / "s.nc")
    assert same_bits(back.force, force)
    assert back.objective == np.inf


def test_a_loaded_solution_is_as_good_a_guess(case, tmp_path):
    problem, arguments, solution = case
    if not solution.success:
        pytest.skip("nothing to start from")
    solution.save(tmp_path / "s.nc")
    again = solve(problem, guess=load(tmp_path / "s.nc"), **arguments)
    assert again.success
    # Of an answer from a file, what the program's own guess leads to is asked beside.
    own = sum(level.iterations for level in again.ladder if not level.question)
    assert own <= 3
    assert again.objective == pytest.approx(solution.objective, rel=1e-8)
    assert own == solve(problem, guess=solution, **arguments).iterations


def test_provenance_is_kept(tmp_path):
    solution = solve(flyer(), steps=10, options={"ipopt.max_iter": 700})
    solution.save(tmp_path / "s.nc", source_hash="sha256:1234")
    back = load(tmp_path / "s.nc")
    about = back.provenance
    assert about.problem_name == "flyer"
    assert about.parameters == {"speed": 0.4, "center": [4, 0.2], "limit": 0.6}
    assert about.start_time == 7.0
    assert about.objective_unit == "N^2 s"
    assert about.control_labels == ("x", "y") and about.control_units == ("N", "N")
    assert about.options == {"ipopt.max_iter": 700}
    assert about.source_hash == "sha256:1234"
    assert set(about.versions) == {"dmoc", "casadi", "numpy", "python"}
    assert about.created.startswith("20")


def test_saving_a_loaded_solution_again_changes_nothing(saved, tmp_path):
    load(saved).save(tmp_path / "again.nc")
    with xarray.open_dataset(saved) as one, xarray.open_dataset(tmp_path / "again.nc") as other:
        assert one.identical(other)


def test_a_file_holds_the_view_that_xarray_has_of_the_solution(case, tmp_path):
    _, _, solution = case
    solution.save(tmp_path / "s.nc", created="now")
    view = to_dataset(load(tmp_path / "s.nc"))
    with xarray.open_dataset(tmp_path / "s.nc", decode_cf=False) as data:
        assert data.identical(view) and list(data.variables) == list(view.variables)
        assert set(data.coords) == {"axis", "channel"}


def test_every_variable_has_a_unit_and_the_promised_dimensions(case):
    _, _, solution = case
    data = to_dataset(solution)
    assert all(data[name].attrs["units"] for name in data.variables)
    at = "step" if solution.hold else "node"
    wanted = {
        "time": ("node",),
        "mesh": ("end",),
        "position": ("node", "axis"),
        "velocity": ("end", "axis"),
        "momentum": ("end", "axis"),
        "force": (at, "axis"),
        "control": (at, "channel"),
        "mass": ("node",),
        "multiplier_row_dynamics": ("node", "axis"),
    }
    assert {name: data[name].dims for name in wanted} == wanted
    assert data.attrs["format_version"] == SOLUTION_FILE.version
    cost = solution.provenance.objective_unit
    assert data["multiplier_row_dynamics"].attrs["units"] == f"{cost}/(m/s)"


def test_groups_whose_names_look_alike_in_a_file_stay_apart(saved, tmp_path):
    solution = load(saved)
    twins = {Key("end", "row", "a.b"): np.ones((1, 1)), Key("end", "row", "a_b"): np.zeros((1, 1))}
    path = dataclasses.replace(solution.path, multipliers=solution.path.multipliers | twins)
    dataclasses.replace(solution, path=path).save(tmp_path / "s.nc")
    back = load(tmp_path / "s.nc").path.multipliers
    assert back[Key("end", "row", "a.b")] == 1 and back[Key("end", "row", "a_b")] == 0


def test_a_loaded_solution_has_no_problem_until_one_is_attached(saved):
    loaded = load(saved)
    assert loaded.problem is None
    with pytest.raises(ValueError, match=r"attach\(problem\)"):
        loaded.require_problem()
    problem = orbit()
    whole = loaded.attach(problem)
    assert whole.require_problem() is problem
    assert loaded.problem is None
    assert np.array_equal(whole.time, loaded.time)


@pytest.mark.parametrize(
    ("other", "word"),
    [
        (bang_bang(), "dimension"),
        (dataclasses.replace(orbit(), start_time=3.0), "start time"),
    ],
)
def test_a_problem_that_does_not_fit_is_not_attached(saved, other, word):
    with pytest.raises(ValueError, match=f"{word} is .*attach the problem that was solved"):
        load(saved).attach(other)


def refused(path, words):
    with pytest.raises(ValueError, match=words) as caught:
        load(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    assert len(message) < 400


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    refused(tmp_path / "none.nc", "does not exist; results are written by")
    refused(tmp_path, "is not a file")


@pytest.mark.parametrize("kept", [0.0, 0.0001, 0.01, 0.5, 0.99])
def test_a_truncated_file_is_refused(saved, tmp_path, kept):
    whole = saved.read_bytes()
    path = tmp_path / "cut.nc"
    path.write_bytes(whole[: int(kept * len(whole))])
    refused(path, "cut short.*copy it or write it again")


@pytest.mark.parametrize("content", [b"time,position\n0,1\n", b"CDF\x01", b"\x80\x04\x95pickle of something"])
def test_a_file_of_another_kind_is_refused(tmp_path, content):
    path = tmp_path / "other.nc"
    path.write_bytes(content)
    refused(path, "is not a result of dmoc: it is no netCDF-4 file")


def edited(saved, path, change, checksum=True):
    """A copy of a result with a changed dataset."""
    with xarray.open_dataset(saved, decode_cf=False) as dataset:
        change(dataset.load()).to_netcdf(path, engine="h5netcdf")
    if checksum:
        path.write_bytes(sealed(path.read_bytes()))
    return path


def test_a_damaged_file_is_refused_before_anything_opens_it(saved, tmp_path, monkeypatch):
    monkeypatch.setattr(h5netcdf, "File", lambda *_, **__: pytest.fail("opened"))
    whole, path, random = saved.read_bytes(), tmp_path / "damaged.nc", np.random.default_rng(0)
    # every byte of the checksum itself, then any of all
    places = [[len(whole) - 1 - i] for i in range(77)]
    places += [random.integers(len(whole), size=random.integers(1, 9)) for _ in range(40)]
    for place in places:
        content = np.frombuffer(whole, np.uint8).copy()
        content[place] ^= random.integers(1, 256, dtype=np.uint8)
        path.write_bytes(content.tobytes())
        refused(path, "is damaged: its checksum does not hold|it is no netCDF-4 file")


def test_a_file_of_the_first_format_has_no_checksum_and_loads(saved, tmp_path):
    path = edited(saved, tmp_path / "old.nc", lambda data: data.assign_attrs(format_version=1), checksum=False)
    assert same_bits(load(path).position, load(saved).position)


@pytest.mark.parametrize("lost", [1, 30, 77])
def test_a_checksum_that_is_lost_is_missed(saved, tmp_path, lost):
    path = tmp_path / "cut.nc"
    path.write_bytes(saved.read_bytes()[:-lost])
    refused(path, "it lacks its checksum|checksum does not hold")


def test_netcdf_of_someone_else_is_refused(tmp_path):
    path = tmp_path / "weather.nc"
    xarray.Dataset({"wind": ("time", np.ones(3))}).to_netcdf(path, engine="h5netcdf")
    refused(path, "is netCDF but not a result of dmoc")


def test_hdf5_of_someone_else_is_refused(tmp_path):
    path = tmp_path / "plain.h5"
    with h5py.File(path, "w") as file:
        file["numbers"] = np.ones((2, 3))
    refused(path, "not a result of dmoc")


def test_a_newer_format_is_refused(saved, tmp_path):
    path = edited(
        saved, tmp_path / "new.nc", lambda data: data.assign_attrs(format_version=SOLUTION_FILE.version + 1)
    )
    refused(path, "comes from a newer dmoc .*update dmoc")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data.drop_vars("position"), "it lacks the variable 'position'"),
        (lambda data: data.isel(node=slice(0, -1)), "has shape"),
        (lambda data: data.assign_attrs(order=3), "order must be one of"),
        (lambda data: data.assign_attrs(ladder="{"), "is damaged"),
        (lambda data: data.assign_attrs(options="__import__('os').getcwd()"), "is damaged"),
        (lambda data: data.assign(mesh=data.mesh[::-1]), "mesh"),
        (lambda data: data.assign(mass=("node", ["heavy"] * data.sizes["node"])), "is damaged"),
    ],
)
def test_a_result_with_missing_or_changed_parts_is_refused(saved, tmp_path, change, words):
    refused(edited(saved, tmp_path / "changed.nc", change), words)


def test_a_missing_attribute_is_refused(saved, tmp_path):
    def change(data):
        del data.attrs["ladder"]
        return data

    refused(edited(saved, tmp_path / "changed.nc", change), "lacks the attribute 'ladder'")


@pytest.mark.parametrize("before", [None, b"the former file"])
@pytest.mark.parametrize("moment", ["write_bytes", "fsync", "replace"])
@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_nothing_is_half_written(saved, tmp_path, monkeypatch, before, moment, error):
    solution, path = load(saved), tmp_path / "result.nc"
    if before is not None:
        path.write_bytes(before)
    complete = Path.write_bytes

    def write_and_fail(self, content):
        complete(self, content[:100])
        raise error

    def fail(*_):
        raise error

    owner, stand_in = (Path, write_and_fail) if moment == "write_bytes" else (os, fail)
    monkeypatch.setattr(owner, moment, stand_in)
    with pytest.raises(type(error)):
        solution.save(path)
    monkeypatch.undo()
    assert os.listdir(tmp_path) == ([] if before is None else ["result.nc"])
    assert before is None or path.read_bytes() == before


def test_a_full_disk_is_one_line(saved, tmp_path, capfd):
    """A limit on the size of files stands in for it. HDF5 itself would print fifty lines and crash."""
    solution, path = load(saved), tmp_path / "result.nc"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(OSError, match=r"^cannot write .*result\.nc: File too large$"):
            solution.save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == [] and capfd.readouterr() == ("", "")


def test_saving_where_nothing_can_be_written_says_so(saved, tmp_path):
    solution = load(saved)
    with pytest.raises(ValueError, match="does not exist; create it first"):
        solution.save(tmp_path / "none" / "result.nc")
    with pytest.raises(ValueError, match="it is a folder"):
        solution.save(tmp_path)


def test_a_file_is_plain_netcdf_for_others(saved):
    with xarray.open_dataset(saved) as data:
        assert data.time.attrs["units"] == "s"
        assert data.time.dtype == float
        assert list(data.axis.values) == ["x", "y"]
        assert json.loads(data.attrs["versions"])["dmoc"]
