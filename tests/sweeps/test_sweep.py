"""A sweep solves every point, keeps what it has whatever happens, and says what became of each."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest
from sweep_helpers import Here, found, same, write_push

import dmoc
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem
from dmoc.sweeps import sweep as sweeping
from dmoc.sweeps.data import COLUMNS, is_sweep, read_sweep, result
from dmoc.sweeps.journal import journal_of
from dmoc.sweeps.worker import Task, pack, solve_point, unpack


@pytest.fixture
def push(tmp_path, monkeypatch):
    """A problem file in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    return write_push(tmp_path)


@pytest.fixture
def here(monkeypatch):
    """Sweeps without processes of their own."""
    pool = Here()
    monkeypatch.setattr(sweeping, "_pool", lambda workers, scheduler: pool)
    return pool


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    return end.value.code or 0


def made(push):
    """(process, mass, threads) of every problem that was made."""
    lines = push.with_name("made.txt").read_text().split("\n")[:-1]
    return [(int(pid), float(mass), threads) for pid, mass, threads in map(str.split, lines)]


@pytest.mark.parametrize(
    "words, arguments",
    [
        ("no parameter 'lenght'", {"vary": {"lenght": "1:2:3"}}),
        ("'8:20' is not of the form", {"vary": {"mass": "8:20"}}),
        ("not of the form start:stop in a sample", {"vary": {"mass": "1:2:3"}, "sample": 4}),
        ("neither start:stop:count nor values", {"vary": {"mass": "1,heavy"}}),
        ("same value more than once", {"vary": {"mass": "1,2,1"}}),
        ("must run over finite numbers", {"vary": {"mass": [1.0, float("nan")]}}),
        ("whole number of at least 1", {"vary": {"mass": "1:2:0.5"}}),
        ("at most 1000000", {"vary": {"mass": "1:2:2000", "limit": "1:2:2000"}}),
        ("both varied and set", {"vary": {"mass": "1:2:3"}, "settings": {"mass": 1.0}}),
        ("must be sobol or latin", {"vary": {"mass": "1:2"}, "sample": 4, "method": "random"}),
        ("must go up", {"vary": {"mass": "2:1"}, "sample": 4}),
        ("nothing is varied", {"vary": {}}),
        ("leave out follow", {"vary": {"mass": "1:2"}, "sample": 4, "follow": True}),
        ("at least 1; got 0", {"vary": {"mass": "1:2:3"}, "workers": 0}),
        ("there is no folder", {"vary": {"mass": "1:2:3"}, "out": "nowhere/out.nc"}),
    ],
)
def test_what_has_no_meaning_is_refused_before_anything_is_solved(push, here, words, arguments):
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        dmoc.sweep(push, **({"out": "out.nc"} | arguments))
    assert here.tasks == [] and not list(push.parent.glob("out*"))


def test_bad_input_is_one_line_and_exit_2(push, here, capfd):
    for arguments in (
        ["--vary", "mass"],
        ["--vary", "mass=1,2", "--vary", "mass=3"],
        ["--vary", "weight=1:2:3"],
        ["--vary", "mass=1,2", "--out", str(push)],
    ):
        assert run("sweep", push, "--out", "out.nc", *arguments) == 2
        out, err = capfd.readouterr()
        assert out == "" and err.startswith("error: ") and err.count("\n") == 1
    # the problem itself refuses every point
    assert run("sweep", push, "--vary", "mass=-3,-2", "--out", "out.nc") == 2
    out, err = capfd.readouterr()
    assert "every point was refused" in err and "mass" in err and err.count("\n") == 1
    assert not list(push.parent.glob("out*"))


def test_a_journal_of_another_sweep_is_refused_by_name(push, here):
    begun = {"vary": {"mass": "1:2:3"}, "out": "out.nc", "steps": 8}
    here.width = lambda: 1
    here.function = lambda task: (found(1), "") if task.values["mass"] < 2 else 1 / 0
    with pytest.raises(ZeroDivisionError):
        dmoc.sweep(push, **begun)
    kept = journal_of("out.nc").read_bytes()
    for words, change in (
        ("mass was 1.0, 1.5, 2.0 and is now 1.0, 2.0", {"vary": {"mass": "1,2"}}),
        ("limit was not given and is now 1.0, 2.0", {"vary": {"mass": "1:2:3", "limit": "1,2"}}),
        ("steps was 8 and is now 9", {"steps": 9}),
        ("limit was not given and is now 2.0", {"settings": {"limit": 2.0}}),
        ("follow was False and is now True", {"follow": True}),
    ):
        with pytest.raises(ValueError, match=words) as error:
            dmoc.sweep(push, **(begun | change))
        assert "--restart" in str(error.value) and "another --out" in str(error.value)
    push.write_text(push.read_text() + "\n# changed\n")
    with pytest.raises(ValueError, match="the problem file has changed"):
        dmoc.sweep(push, **begun)
    assert journal_of("out.nc").read_bytes() == kept
    here.function = lambda task: 1 / 0
    with pytest.raises(ZeroDivisionError):
        dmoc.sweep(push, **begun, restart=True)
    assert not journal_of("out.nc").exists(), "with nothing in it, it is only in the way"
    here.function = solve_point
    assert result(dmoc.sweep(push, **begun), "success").all()


def test_the_file_has_what_was_swept_as_dimensions_and_failures_as_data(push, here):
    data = dmoc.sweep(
        push, {"mass": [1, 4], "duration": "2,4"}, "out.nc", order=4, steps=8, settings={"limit": 3.0}
    )
    held = read_sweep("out.nc")
    assert is_sweep("out.nc") and held.identical(data) and not journal_of("out.nc").exists()
    assert dict(held.sizes) == {"mass": 2, "duration": 2}
    assert (held.mass.attrs["units"], held.duration.attrs["units"]) == ("kg", "s")
    assert held.mass.attrs["long_name"] == "Mass of the cart."
    assert {name.removeprefix("found_") for name in held.data_vars} == set(COLUMNS) and "found_duration" in held
    assert held.objective.attrs["units"] == "N^2 s" and held.found_duration.attrs["units"] == "s"
    # 4 kg over 1 m in 2 s need 4 N, full force forward and back
    assert held.status.values.tolist() == [["solved", "solved"], ["infeasible", "solved"]]
    assert held.success.dtype == bool and held.success.values.tolist() == [[True, True], [False, True]]
    assert np.isnan(held.objective.values[1, 0]) and "4 N" in str(held.message.values[1, 0])
    for mass, duration in ((1, 2), (1, 4), (4, 4)):
        point = held.sel(mass=mass, duration=duration)
        exact = 6 * mass**2 / duration**3
        assert point.objective.item() == pytest.approx(exact, rel=1e-9)
        assert point.effort.item() == pytest.approx(exact, rel=1e-9)
        assert point.found_duration == duration and point.final_mass == mass and point.propellant == 0
        assert point.checks_hold and point.failed_check == "" and point.iterations > 0 and point.steps == 8


def test_every_answer_is_flown_with_errors(push, here):
    """As `disperse` flies it; a longer push carries an error of the velocity further."""
    errors = {"start": (0.01, 0.02), "samples": 200, "seed": 4}
    data = dmoc.sweep(push, {"duration": [2, 4]}, "out.nc", order=4, steps=8, errors=errors)
    for i, duration in enumerate((2, 4)):
        answer = dmoc.solve(load_problem(push).make(duration=duration), order=4, steps=8)
        (_, away, fast), *_ = [one for one in dmoc.disperse(answer, **errors).miss if one[0] == 0.95]
        assert (data.miss.values[i], data.miss_speed.values[i]) == pytest.approx((away, fast), rel=1e-9)
    assert data.miss.values[1] > 1.5 * data.miss.values[0] and (data.broken.values == 0).all()
    assert data.miss.attrs["units"] == "m" and '"samples": 200' in data.attrs["errors"]
    assert read_sweep("out.nc").identical(data)
    with pytest.raises(ValueError, match="no error is called 'wind'; there are start, force"):
        dmoc.sweep(push, {"duration": [2, 4]}, "out.nc", errors={"wind": 1.0})
    with pytest.raises(ValueError, match="every point was refused, the first with: force must not be"):
        dmoc.sweep(push, {"duration": [2, 4]}, "bad.nc", order=4, steps=8, errors={"force": -1.0})


def test_a_point_whose_time_is_over_is_data_and_no_answer(push, here, capfd):
    data = dmoc.sweep(str(push), {"mass": "1:2:2"}, "map.nc", time_limit=1e-9)
    assert not data["success"].any() and all("time limit of 1e-09 s" in one for one in data["message"].values)
    assert data.attrs["time_limit"] == 1e-9
    assert run("sweep", push, "--vary", "mass=1:2:2", "--time-limit", "0", "--out", "n.nc") == 2
    assert "time_limit must be" in capfd.readouterr().err
    assert run("sweep", push, "--vary", "mass=1:2:2", "--time-limit", "60", "--out", "n.nc") == 0


def test_a_sample_has_its_points_along_one_dimension(push, here):
    data = dmoc.sweep(push, {"duration": (3, 8), "mass": "1:2"}, "out.nc", sample=5, order=4, steps=6)
    assert dict(data.sizes) == {"sample": 5} and data.mass.dims == ("sample",)
    exact = 6 * data.mass.values**2 / data.duration.values**3
    assert data.objective.values == pytest.approx(exact, rel=1e-9)
    assert (data.attrs["method"], data.attrs["seed"], data.attrs["order"]) == ("sobol", 0, 4)


def test_a_failed_check_is_named_and_exits_4(here, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("sweep", "orbit_raise", "--vary", "mass=1,2", "--steps", 12, "--out", "out.nc") == 4
    data = read_sweep("out.nc")
    assert data.success.all() and not data.checks_hold.any()
    assert set(data.failed_check.values) <= {"reference", "ledger", "stability"} and (data.failed_by > 1).all()


def test_a_path_survives_the_journal_to_the_last_bit():
    path = dmoc.solve(load_problem("bang_bang").make(), steps=20).path
    again = unpack(pack(path))
    for name in ("mesh", "position", "control", "mass", "start_velocity", "goal_velocity"):
        assert np.array_equal(getattr(path, name), getattr(again, name))
    assert (path.order, path.hold, path.duration) == (again.order, again.hold, again.duration)
    assert path.multipliers.keys() == again.multipliers.keys() and path.multipliers
    assert all(np.array_equal(path.multipliers[name], again.multipliers[name]) for name in path.multipliers)


def test_a_neighbour_saves_iterations_and_finds_the_same_optimum():
    file = load_problem("drone_hop")
    numerics = {"order": 2, "steps": 100, "tol": None, "hold": False}
    task = Task(str(file.path), file.source_hash, {"mass": 0.95}, numerics)
    cold, _ = solve_point(task)
    _, path = solve_point(Task(str(file.path), file.source_hash, {"mass": 1.0}, numerics))
    warm, _ = solve_point(Task(str(file.path), file.source_hash, {"mass": 0.95}, numerics, path))
    assert warm["from_neighbour"] and not cold["from_neighbour"]
    assert warm["objective"] == pytest.approx(cold["objective"], rel=1e-8)
    assert warm["iterations"] <= 0.7 * cold["iterations"]


def test_a_problem_file_that_is_another_now_ends_the_sweep(push):
    with pytest.raises(ValueError, match="has changed since the sweep began"):
        solve_point(Task(str(push), "another hash", {}, {}))


@pytest.mark.slow
def test_a_worker_that_dies_loses_its_point_alone(push):
    before = dict(os.environ)
    vary = {"mass": [1.0, 2.0, 3.0, 4.0, 5.0]}
    data = dmoc.sweep(push, vary, "out.nc", order=4, steps=8, settings={"deadly": 2.0}, workers=2)
    assert data.status.values.tolist() == ["solved", "worker died"] + ["solved"] * 3
    assert np.isnan(data.objective.values[1]) and "twice" in str(data.message.values[1])
    who = made(push)
    assert sum(mass == 2 for _, mass, _ in who) == 2
    assert os.getpid() not in {pid for pid, _, _ in who} and {threads for _, _, threads in who} == {"1"}
    assert dict(os.environ) == before


def start(push, *more):
    command = [sys.executable, "-m", "dmoc.cli", "sweep", str(push), "--vary", "mass=1:6:6", "--steps", "8"]
    settings = ["--set", "nap=0.15", "--out", "out.nc", "--workers", "2", *more]
    return subprocess.Popen(
        command + settings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def lines():
    journal = journal_of("out.nc")
    return journal.read_bytes().count(b"\n") - 1 if journal.exists() else 0


def alive(pid):
    with suppress(ProcessLookupError):
        os.kill(pid, 0)
        return open(f"/proc/{pid}/stat").read().split()[2] != "Z" if os.path.exists("/proc") else True
    return False


def test_a_killed_sweep_goes_on_where_it_was_and_ends_the_same(push):
    process = start(push)
    wait_for(lambda: lines() >= 2)
    process.kill()
    process.communicate()
    workers = {pid for pid, _, _ in made(push)}
    wait_for(lambda: not any(map(alive, workers)))
    kept, before = lines(), len(made(push))
    with open(journal_of("out.nc"), "ab") as journal:
        journal.write(b'{"wave": 0, "point": 5, "rec')
    arguments = {"vary": {"mass": "1:6:6"}, "steps": 8, "settings": {"nap": 0.15}, "workers": 1}
    tries = []
    data = dmoc.sweep(push, out="out.nc", **arguments, progress=lambda *now: tries.append(now))
    assert tries[0][0] >= kept >= 2 and not journal_of("out.nc").exists()
    # the last call is before the last solve
    assert len(made(push)) - before == tries[-1][1] - kept
    whole = dmoc.sweep(push, out="whole.nc", **arguments)
    assert same(data, whole) and same(read_sweep("out.nc"), read_sweep("whole.nc"))


def test_ctrl_c_keeps_the_journal_and_says_how_to_go_on(push):
    process = start(push)
    wait_for(lambda: lines() >= 2)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130 and out == "" and not os.path.exists("out.nc")
    assert "out.nc.journal; give the same command again to go on" in err and err.endswith("interrupted\n")
    assert "Traceback" not in err and lines() >= 2
    wait_for(lambda: not any(alive(pid) for pid, _, _ in made(push)))


def test_unsolved_points_exit_3_and_are_counted(push, here, capfd):
    common = ["--order", 4, "--steps", 8, "--out", "out.nc"]
    assert run("sweep", push, "--vary", "mass=1,3,50", *common) == 3
    out, err = capfd.readouterr()
    assert err == "" and "1 not solved, infeasible: " in out
    assert "Solved 2 of 3 points; 1 not solved" in out and "wrote out.nc" in out
    assert run("sweep", push, "--vary", "mass=1,3", *common, "-q") == 0
    assert capfd.readouterr().out == "Solved 2 of 2 points.\n"


@pytest.fixture
def cluster(monkeypatch):
    """A scheduler and two worker processes on this machine; what dies once is not tried by themselves again."""
    distributed, dask = pytest.importorskip("distributed"), pytest.importorskip("dask")
    quiet = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.nanny.pre-spawn-environ.OMP_NUM_THREADS": 1,
    }
    with (
        dask.config.set(quiet),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
        ) as made,
    ):
        yield made


@pytest.mark.slow
def test_the_workers_of_a_scheduler_do_the_same(push, cluster):
    vary, numerics = {"mass": [1.0, 2.0, 3.0]}, {"order": 4, "steps": 8}
    data = dmoc.sweep(push, vary, "far.nc", **numerics, scheduler=cluster.scheduler_address)
    assert data.objective.values == pytest.approx(6 * data.mass.values**2 / 64, rel=1e-9)
    assert os.getpid() not in {pid for pid, _, _ in made(push)}
    with pytest.raises(ValueError, match="has its own workers"):
        dmoc.sweep(push, vary, "far.nc", scheduler=cluster.scheduler_address, workers=2)


@pytest.mark.slow
def test_a_worker_of_a_scheduler_that_dies_loses_its_point_alone(push, cluster):
    more = {"order": 4, "steps": 8, "settings": {"deadly": 3.0}}
    vary = {"mass": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}
    data = dmoc.sweep(push, vary, "far.nc", **more, scheduler=cluster.scheduler_address)
    assert data.status.values.tolist() == ["solved", "solved", "worker died", "solved", "solved", "solved"]
    assert same(data, dmoc.sweep(push, vary, "near.nc", **more, workers=1))


def test_a_scheduler_that_is_not_there_is_one_line(push, monkeypatch, capfd):
    pytest.importorskip("distributed")
    monkeypatch.setattr("dmoc.sweeps.pool.ANSWER_WITHIN_S", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        assert run("sweep", push, "--vary", "mass=1,2", "--out", "out.nc", "--scheduler", address) == 2
        err = capfd.readouterr().err
        assert err.startswith(f"error: no scheduler answers at {address}") and err.count("\n") == 1


@pytest.mark.slow
def test_second_looks_find_better_optima_on_real_transfers(tmp_path):
    """Along 8 to 20 s the revolutions change; each point ends at the same optimum from either side."""
    follow = dmoc.sweep("orbit_raise", {"duration": "8:20:25"}, tmp_path / "follow.nc", follow=True)
    cold = dmoc.sweep("orbit_raise", {"duration": "8:20:25"}, tmp_path / "cold.nc")
    assert follow.objective.values == pytest.approx(cold.objective.values, rel=1e-6)


@pytest.mark.slow
def test_killed_again_and_again_it_ends_the_same(push):
    for _ in range(20):
        process = start(push)
        seen = lines()
        wait_for(lambda process=process, seen=seen: lines() >= seen + 2 or process.poll() is not None)
        process.kill()
        process.communicate()
        if os.path.exists("out.nc"):
            break
    settings = {"nap": 0.15}
    whole = dmoc.sweep(push, {"mass": "1:6:6"}, "whole.nc", steps=8, settings=settings)
    assert same(read_sweep("out.nc"), whole)


@pytest.mark.slow
def test_a_script_that_forgot_its_guard_is_told_so(push):
    script = push.with_name("script.py")
    script.write_text('import dmoc\ndmoc.sweep("push.py", {"mass": "1:3:3"}, "out.nc")\n')
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and 'below if __name__ == "__main__":' in done.stderr.splitlines()[-1]
    assert not journal_of("out.nc").exists()
