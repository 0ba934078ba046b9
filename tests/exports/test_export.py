"""What is exported works without dmoc, says what it is, and gives what dmoc gives."""

import errno
import hashlib
import json
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    BoxForce,
    CircularOrbit,
    Engine,
    Fuel,
    KeepIn,
    KeepOut,
    LinearDrag,
    PointGravity,
    RotatingFrame,
    SpeedLimit,
    State,
    TransferProblem,
    UniformGravity,
    export,
)
from dmoc.cli.app import main
from dmoc.exports import export as exporting
from dmoc.exports.code import write_code
from dmoc.exports.export import functions_of
from dmoc.planners.functions import all_steps, one_step
from dmoc.planners.planner import Planner
from dmoc.planners.residual import residual

FLYER = TransferProblem(
    10.0,
    State((0, 0), (0, 0)),
    State((4, 0.3), (0, 0)),
    20.0,
    actuator=BoxForce(0.8),
    constraints=[KeepOut((2.0, 0.1), 0.7), KeepIn((-1, -1), (5, np.inf)), SpeedLimit(0.6)],
)
TURNING = TransferProblem(
    2.0,
    State((0, 0), (0, 0)),
    State((1, None), (None, 0.3)),
    5.0,
    effects=[LinearDrag(0.2), RotatingFrame(0.1), UniformGravity((0, -1))],
    start_time=0.5,
)
BURNING = TransferProblem(
    1000.0,
    State((7e6, 0), (0, 7546.0)),
    CircularOrbit(7.05e6, 3.986e14, center=(0, 0)),
    5000.0,
    effects=[PointGravity(3.986e14)],
    actuator=Engine(300.0, specific_impulse=300.0, dry_mass=100.0),
    objective=Fuel(),
)
CASES = {"flyer": (FLYER, 2, 20, True), "turning": (TURNING, 4, 10, False), "burning": (BURNING, 2, 30, False)}
PLAIN = ("step", "rollout", "residual", "residual_jacobian", "cost")

# Runs where dmoc is not to be had: values in, values out.
ALONE = """
import json, sys
class NoDmoc:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "dmoc":
            raise ImportError(name)
sys.meta_path.insert(0, NoDmoc())
import casadi as ca, numpy as np
for name, (file, given) in json.load(sys.stdin).items():
    f = ca.Function.load(file) if file.endswith(".casadi") else ca.external(name, file)
    found = f(**{key: np.array(value) for key, value in given.items()})
    print(json.dumps([name, {key: np.array(ca.densify(value)).tolist() for key, value in found.items()}]))
assert "dmoc" not in sys.modules
"""


def planner_of(problem, order, steps, hold):
    return Planner.of(problem, order, steps, hold)


def functions(problem, order, steps, hold):
    return {e.function.name(): e.function for e in functions_of(planner_of(problem, order, steps, hold))}


def inputs_of(problem, made):
    """Inputs of every function that is no solver: a path near the problem's guess."""
    noise, guess = np.random.default_rng(1), {name: np.array(x) for name, x in made["nominal"]().items()}
    values = {name.removeprefix("guess_"): value for name, value in guess.items()}
    duration, start = values["duration"].item(), values["positions"][:, 0]
    size = np.linalg.norm(values["positions"][:, -1] - start)
    values["positions"] = values["positions"] + 1e-3 * size * noise.normal(size=values["positions"].shape)
    values["forces"] = 0.1 * problem.mass * size / duration**2 * noise.uniform(0, 1, values["forces"].shape)
    values |= {"position": start, "velocity": values["velocities"][:, 0], "time": problem.start_time}
    values |= {"start_velocity": values["velocities"][:, 0], "goal_velocity": values["velocities"][:, -1]}
    values |= {"time_step": duration / 50}
    if "masses" in values:
        values["masses"] = np.linspace(problem.mass, 0.99 * problem.mass, values["masses"].size)[None]
    columns = {name: made[name].size_in("forces")[1] for name in PLAIN}
    return {
        name: {arg: values[arg] for arg in made[name].name_in()}
        | {"forces": values["forces"][:, : columns[name]]}
        for name in PLAIN
    }


@pytest.fixture(scope="module", params=CASES)
def case(request, tmp_path_factory):
    """Folder of an export, the same functions as dmoc has them, and inputs for each but the solvers."""
    problem, order, steps, hold = CASES[request.param]
    folder = tmp_path_factory.mktemp("export") / request.param
    export(problem, folder, order, steps, hold)
    made = functions(problem, order, steps, hold)
    return problem, folder, made, inputs_of(problem, made)


def alone(jobs):
    """Results of {name: (file, inputs)} in a process that cannot import dmoc."""
    plain = {
        name: (str(file), {key: np.array(value).tolist() for key, value in given.items()})
        for name, (file, given) in jobs.items()
    }
    command = [sys.executable, "-I", "-c", ALONE]
    done = subprocess.run(command, input=json.dumps(plain), capture_output=True, text=True, check=True)
    return dict(json.loads(line) for line in done.stdout.splitlines())


def assert_same(found, expected, within=1e-12):
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        value = np.array(ca.densify(value))
        assert np.isfinite(value).all(), name
        np.testing.assert_allclose(
            found[name], value, rtol=0, atol=within * (1 + np.abs(value).max()), err_msg=name
        )


def compiled(folder, target, *options):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    flags = ["-std=c99", "-Wall", "-Werror", *(options or ["-O2"])]
    sources = [str(folder / name) for name in ("functions.c", "main.c") if name == "functions.c" or not options]
    subprocess.run([compiler, *flags, *sources, "-lm", "-o", str(target)], check=True, capture_output=True)
    return target


# without dmoc


def test_casadi_files_work_where_there_is_no_dmoc(case):
    _, folder, made, inputs = case
    found = alone({name: (folder / f"{name}.casadi", inputs[name]) for name in PLAIN})
    for name in PLAIN:
        assert_same(found[name], made[name](**inputs[name]))


def test_the_solver_works_where_there_is_no_dmoc(case):
    _, folder, made, _ = case
    given = made["nominal"]()
    given = {name: np.nan_to_num(np.array(value), posinf=1e6) for name, value in given.items()}
    found = alone({"solver": (folder / "solver.casadi", given)})["solver"]
    assert_same(found, made["solver"](**given), within=1e-9)
    assert np.array(found["violation"]).item() < 1e-9


def test_c_code_gives_the_same_numbers(case, tmp_path):
    _, folder, made, inputs = case
    library = compiled(folder / "c", tmp_path / "functions.so", "-shared", "-fPIC", "-O0")
    for name, found in alone({name: (library, inputs[name]) for name in PLAIN[:3]}).items():
        assert_same(found, made[name](**inputs[name]))


def test_the_example_in_c_prints_what_the_path_comes_to(case, tmp_path):
    problem, folder, made, _ = case
    run = subprocess.run(
        [compiled(folder / "c", tmp_path / "example")], capture_output=True, text=True, check=True
    )
    position, velocity, defect = (line.split(":")[1].split() for line in run.stdout.splitlines())
    push = next(line for line in (folder / "c" / "main.c").read_text().splitlines() if "push[DMOC" in line)
    force = np.array([float(x) for x in push.split("{")[1].split("}")[0].split(",")])
    inputs = {arg: made["nominal"]().get(arg, 0) for arg in made["rollout"].name_in()}
    state = {"position": problem.start.position, "velocity": problem.start.velocity}
    path = made["rollout"](
        **{**inputs, **state, "forces": np.tile(force[:, None], made["rollout"].size_in("forces")[1])}
    )
    np.testing.assert_allclose(np.array(position, float), np.array(path["positions"])[:, -1], rtol=1e-13)
    np.testing.assert_allclose(np.array(velocity, float), np.array(path["velocities"])[:, -1], rtol=1e-12)
    assert np.any(force) and float(defect[0]) < 1e-6 * np.abs(force).max()


def test_c_code_of_one_axis_compiles_without_a_warning(tmp_path):
    cart = TransferProblem(1.0, State([0], [0]), State([1], [0]), 2.0, effects=[LinearDrag(0.2)])
    export(cart, tmp_path / "cart", order=4, steps=5)
    subprocess.run([compiled(tmp_path / "cart" / "c", tmp_path / "example")], capture_output=True, check=True)


@pytest.mark.parametrize("order, hold", [(2, True), (4, False)])
def test_c_code_hardly_grows_with_the_number_of_steps(tmp_path, order, hold):
    sizes = []
    for steps in (50, 5000):
        planner = planner_of(TURNING, order, steps, hold)
        (tmp_path / f"{steps}").mkdir()
        coded = [make(planner.scene) for make in (one_step, all_steps, residual)]
        write_code(planner, coded, tmp_path / f"{steps}")
        source = (tmp_path / f"{steps}" / "functions.c").read_text()
        sizes.append(len(source))
        assert max(map(len, source.splitlines())) < 2000, "a table as long as there are steps"
    assert sizes[1] < 2.5 * sizes[0]


# the folder


def test_the_manifest_says_what_every_argument_is(case):
    problem, folder, made, _ = case
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["functions"].keys() == made.keys()
    for name, entry in manifest["functions"].items():
        f = made[name]
        for kind, names, size in (("inputs", f.name_in(), f.size_in), ("outputs", f.name_out(), f.size_out)):
            assert [(arg["name"], tuple(arg["shape"])) for arg in entry[kind]] == [(n, size(n)) for n in names]
            assert all(arg["unit"] and arg["words"] for arg in entry[kind]), name
    burns = problem.actuator.burns
    units = {arg["name"]: arg["unit"] for arg in manifest["functions"]["solver"]["inputs"]}
    assert (units["mass"], units["guess_forces"]) == ("kg", "N")
    assert units.get("actuator_exhaust_velocity") == ("m/s" if burns else None)
    order, steps, hold = next(setting for what, *setting in CASES.values() if what is problem)
    assert manifest["scheme"] == {"order": order, "steps": steps, "hold": hold, "nodes": order // 2 * steps + 1}
    assert manifest["versions"]["casadi"] == ca.__version__


def test_the_manifest_has_the_checksum_of_every_other_file(case):
    _, folder, _, _ = case
    sums = json.loads((folder / "manifest.json").read_text())["files"]
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert there == {"manifest.json", *sums}
    for name, digest in sums.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest


def test_an_export_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match=f"^cannot export to {tmp_path / 'planner'}: No space left on device$"):
        export(TransferProblem(1, State((0,), (0,)), State((1,), (0,)), 1), tmp_path / "planner", steps=4)
    assert not list(tmp_path.iterdir())


def test_an_earlier_export_is_replaced_and_nothing_else(tmp_path):
    folder = tmp_path / "out"
    assert (folder / "c" / "main.c") in export(FLYER, folder, steps=5)
    export(FLYER, folder, steps=6, c=False)
    assert json.loads((folder / "manifest.json").read_text())["scheme"]["steps"] == 6
    assert not (folder / "c").exists()
    (folder / "thesis.tex").write_text("mine")
    with pytest.raises(ValueError, match=r"thesis\.tex"):
        export(FLYER, folder, steps=5)
    assert (folder / "thesis.tex").read_text() == "mine" and (folder / "solver.casadi").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_export_that_fails_leaves_all_as_it_was(tmp_path, monkeypatch):
    export(FLYER, tmp_path / "old", steps=5)
    before = (tmp_path / "old" / "manifest.json").read_bytes()

    def fail(*arguments):
        raise RuntimeError("the disk is full")

    monkeypatch.setattr(exporting, "write_code", fail)
    for name in ("old", "new"):
        with pytest.raises(RuntimeError, match="disk"):
            export(FLYER, tmp_path / name, steps=6)
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert (tmp_path / "old" / "manifest.json").read_bytes() == before


@pytest.mark.parametrize("command", [True, False])
@pytest.mark.parametrize("size", [3000, 30_000, 100_000])
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, monkeypatch, capfd, size, command):
    """A limit on the size of files stands in for it; `Function.save` would pass over it without a word."""
    monkeypatch.chdir(tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        if command:
            with pytest.raises(SystemExit) as end:
                main(["export", "free_flyer", "out", "--steps", "20"])
            assert end.value.code == 2
            words = capfd.readouterr().err
        else:
            with pytest.raises(OSError) as caught:
                export(FLYER, "out", steps=20)
            words = f"{caught.value}\n"
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert re.fullmatch(r"(?:.*: )?cannot export to .*out: File too large\n", words)
    assert list(tmp_path.iterdir()) == []


def test_code_that_casadi_could_not_write_whole_is_told_of(tmp_path):
    planner = Planner.of(FLYER, 2, 6, False)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(OSError, match=r"functions\.c could not be written whole"):
            write_code(planner, functions_of(planner)[:3], tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_what_is_saved_is_what_casadi_saves(tmp_path):
    for exported in functions_of(Planner.of(FLYER, 2, 6, False)):
        exported.function.save(str(tmp_path / "its.casadi"))
        exporting._save(exported.function, tmp_path / "ours.casadi")
        assert (tmp_path / "ours.casadi").read_bytes() == (tmp_path / "its.casadi").read_bytes()


@pytest.mark.parametrize(
    "folder, settings, words",
    [
        ("file", {}, "it is a file"),
        ("no/such/folder", {}, "create it first"),
        (".", {}, "working folder"),
        ("out", {"steps": 1}, "at least 2"),
        ("out", {"order": 3}, "order must be"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_words(tmp_path, monkeypatch, folder, settings, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=words):
        export(FLYER, folder, **settings)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_command_line_exports(tmp_path, capsys):
    for arguments, code in ((["--steps", "5", "--no-c", "--set", "mass=12"], 0), (["--order", "5"], 2)):
        with pytest.raises(SystemExit) as end:
            main(["export", "point_to_point", str(tmp_path / "out"), *arguments])
        assert (end.value.code or 0) == code
    assert "warm_solver" in capsys.readouterr().out
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["problem"]["parameters"]["mass"] == 12
