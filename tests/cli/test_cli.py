"""The command line keeps its promises: exit codes, one JSON object, one line for every bad input."""

import json
import os
import re
import subprocess
import sys
import textwrap

import pytest

import dmoc
from dmoc.cli.app import main
from dmoc.scene.problem_file import load_problem

FIGURES = ("objective", "duration", "final_mass", "order", "steps", "nodes", "iterations")
WORDS = ("problem", "success", "status", "message", "worst", "warnings")
KEYS = [*WORDS, *FIGURES, "build_s", "solve_s", "verify_s", "accuracy", "checks", "facts"]

PUSH = """
    \"\"\"A push.\"\"\"
    from dmoc import {names}State, TransferProblem

    def problem(duration: float = 2.0, mass: float = 1.0):
        \"\"\"The push.

        Parameters
        ----------
        duration : float [s]
            Time of the push.
        mass : float [kg]
            Mass of the cart.
        \"\"\"
        {before}
        return TransferProblem(mass, State([0], [0]), State([1], [0]), duration{more})
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty working folder with its own problems/."""
    (tmp_path / "problems").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capfd):
    """Run a command line: exit code, stdout, stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return end.value.code or 0, out, err

    return call


def write(folder, name, names="", before="pass", more=""):
    path = folder / "problems" / f"{name}.py"
    path.write_text(textwrap.dedent(PUSH.format(names=names, before=before, more=more)))
    return path


def refused(answer, *words):
    """Exit code 2, nothing on stdout, one line on stderr with these words."""
    code, out, err = answer
    assert (code, out) == (2, ""), err
    assert err.startswith("error: ") and err.count("\n") == 1 and "Traceback" not in err
    for word in words:
        assert word in err
    return True


def test_a_solved_problem_exits_0_and_says_so(run):
    code, out, err = run("solve", "free_flyer")
    assert (code, err) == (0, "")
    for word in ("a local optimum", "Every check holds", "effort 0.8623", "N^2 s", "residual", "reference"):
        assert word in out


def test_json_is_one_object_with_the_promised_keys(run):
    code, out, err = run("solve", "point_to_point", "--json", "--order", 4, "--steps", 10)
    found = json.loads(out)
    assert (code, err, list(found)) == (0, "", KEYS)
    assert found["problem"] == "point_to_point" and found["success"] is True
    assert (found["order"], found["steps"], found["nodes"], found["final_mass"]) == (4, 10, 21, 1.0)
    assert (found["message"], found["worst"]) == ("a local optimum", [])
    assert found["objective"] == pytest.approx(0.75 / 13, rel=1e-9)
    assert {"residual", "rollout", "reference", "ledger", "bounds", "optimality", "stability"} == set(
        found["checks"]
    )
    for check in found["checks"].values():
        assert set(check) == {"value", "limit", "unit", "ok"} and check["ok"] is True


def test_an_answer_is_told_in_numbers(run):
    code, out, _ = run("solve", "orbit_raise", "--order", "4", "--steps", "40")
    told = out[out.index("The answer in numbers") :].splitlines()
    assert (
        code == 0 and told[1].startswith("velocity change     0.1871 m/s") and told[7].startswith("Solved, a ")
    )
    assert [line.split("  ")[0] for line in told[2:6]] == [
        "peak",
        "closest approach",
        "orbit at the start",
        "orbit at the goal",
    ]
    code, out, _ = run("solve", "orbit_raise", "--order", "4", "--steps", "40", "--json")
    facts = json.loads(out)["facts"]
    assert facts["velocity change"] == {"value": pytest.approx(0.1871, rel=1e-3), "unit": "m/s"}
    assert facts["goal a"] == {"value": pytest.approx(1.5), "unit": "m"}


def test_json_stays_pure_when_the_problem_file_prints(run, folder):
    write(folder, "chatty", before="print('hello')")
    code, out, err = run("solve", "chatty", "--json")
    assert (code, err) == (0, "hello\n")
    assert json.loads(out)["success"] is True


def test_numbers_that_are_not_finite_become_null():
    from dmoc.checks.verification import Check, Report
    from dmoc.reports.as_json import as_text, solve_object
    from dmoc.results.facts import Provenance

    class Diverged:
        problem = type("Problem", (), {"name": "p"})
        success, status, warnings, order, steps, iterations = False, "diverging", (), 2, 4, 7
        message, worst = "start elsewhere", (("goal.x", float("nan"), "m"),)
        objective, duration, final_mass = float("nan"), float("inf"), 1.0
        build_s, solve_s, position, error = 0.1, 0.2, [0] * 5, None
        provenance = Provenance()

        def require_problem(self):
            return self.problem

    report = Report((Check("residual", float("inf"), float("nan"), "N", False),), 0.3)
    found = json.loads(as_text(solve_object(Diverged(), report)))
    assert found["objective"] is None and found["duration"] is None
    assert found["worst"] == [{"row": "goal.x", "violation": None, "unit": "m"}]
    assert found["checks"]["residual"] == {"value": None, "limit": None, "unit": "N", "ok": False}


def test_a_failed_solve_exits_3_names_the_worst_rows_and_what_to_try(run, folder):
    # 1 m in 2 s at 1 kg needs 1 N
    write(folder, "weak", names="BoxForce, ", more=", actuator=BoxForce(0.5)")
    code, out, _ = run("solve", "weak", "--steps", 20)
    assert code == 3
    assert "Not solved" in out and "What to try: " in out and re.search(r"dynamics\[\d+\]\.x +\d", out)
    said = re.search("What to try: (.*)[.]$", " ".join(out.split()))[1]
    code, out, _ = run("solve", "weak", "--steps", 20, "--json")
    found = json.loads(out)
    assert (code, list(found), found["success"], found["checks"]) == (3, KEYS, False, {})
    assert found["message"] == said and "a force limit of " in said
    assert re.fullmatch(r"dynamics\[\d+\]\.x", found["worst"][0]["row"]) and found["worst"][0]["unit"] == "N"
    sizes = [row["violation"] for row in found["worst"]]
    assert sizes == sorted(sizes, reverse=True) and sizes[0] > 0.01
    assert found["status"] != "solved" and found["duration"] == 2.0 and found["nodes"] == 21


def test_the_worst_rows_of_each_unit_are_shown_largest_first(run):
    code, out, _ = run("solve", "free_flyer", "--steps", 100, "--set", "duration=10")
    assert code == 3 and out.startswith("Meshes, coarse to fine\n")
    sizes = [float(size) for size in re.findall(r"^dynamics\[\d+\]\.[xyz] +(\S+) N *$", out, re.M)]
    assert len(sizes) > 5 and sizes == sorted(sizes, reverse=True) and sizes[0] > sizes[-1]


def test_a_check_that_fails_exits_4(run):
    # twelve steps are too few for one and a half revolutions
    code, out, _ = run("solve", "orbit_raise", "--steps", 12)
    assert code == 4 and "Checks that fail: " in out and "reference" in out and "FAILS" in out
    code, out, _ = run("solve", "orbit_raise", "--steps", 12, "--json")
    found = json.loads(out)
    assert code == 4 and found["success"] is True and found["checks"]["reference"]["ok"] is False


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["solve", "free_flier"], ["'free_flier'", "did you mean free_flyer?"]),
        (["solve", "qqq"], ["'qqq'", "bang_bang, ", " drone_hop, "]),
        (["solve", "./nowhere.py"], ["./nowhere.py"]),
        (["solve", "free_flyer", "--set", "mas=3"], ["'mas'", "did you mean mass?", "duration, mass, limit"]),
        (["solve", "free_flyer", "--set", "mass"], ["'mass'", "name=value"]),
        (["solve", "free_flyer", "--set", "mass=abc"], ["mass", "'abc'", "literal"]),
        (["solve", "free_flyer", "--set", "mass='x'"], ["mass", "float", "10.0", "'x'"]),
        (["solve", "free_flyer", "--set", "mass=True"], ["mass", "float", "True"]),
        (["solve", "free_flyer", "--set", "mass=1", "--set", "mass=2"], ["mass", "twice"]),
        (
            ["solve", "free_flyer", "--set", "mass=-3"],
            ["free_flyer.py, line ", "TransferProblem", "[kg]", "-3"],
        ),
        (["solve", "free_flyer", "--order", "3"], ["2, 4, 6, 8", "3"]),
        (["solve", "free_flyer", "--steps", "1"], ["steps", "at least 2", "1"]),
        (["solve", "free_flyer", "--tol", "-1"], ["tol"]),
        (["solve", "free_flyer", "--out", "no/such/x.nc"], ["no/such", "create it"]),
        (["solve", "free_flyer", "--plot", "no/such/x.png"], ["no/such"]),
        (["solve", "free_flyer", "--plot", "x.gif"], ["x.gif", ".png"]),
        (["solve", "free_flyer", "--guess", "nothing.nc"], ["nothing.nc"]),
        (["simulate", "free_flyer", "--steps", "0"], ["steps", "0"]),
        (["simulate", "free_flyer", "--order", "5"], ["order", "5"]),
        (["simulate", "free_flyer", "--controls", "nothing.nc"], ["nothing.nc"]),
        (["simulate", "free_flyer", "--controls", "nothing.nc", "--steps", "9"], ["--controls", "--steps"]),
        (["check", "nothing.nc"], ["nothing.nc"]),
        (["plot", "nothing.nc"], ["nothing.nc"]),
        (["show", "free_flyer", "--set", "radius=-1"], ["radius", "[m]", "-1"]),
        (["solve"], ["PROBLEM"]),
        (["solve", "free_flyer", "--stepz", "3"], ["--stepz", "--steps"]),
        (["bogus"], ["bogus"]),
    ],
)
def test_bad_input_is_one_line_and_exit_2(run, folder, arguments, words):
    assert refused(run(*arguments), *words)
    assert [path.name for path in folder.rglob("*")] == ["problems"]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("x = 1\n", ["no function problem()"]),
        ("def problem():\n    return 3\n", ["must return a dmoc.TransferProblem", "3"]),
        ("def problem(mass):\n    pass\n", ["'mass'", "default"]),
        ("import nowhere\n", ["line 1 (import nowhere)", "ModuleNotFoundError"]),
        ("def problem(:\n", ["line 1 (def problem(:)", "SyntaxError"]),
        ("def half(x):\n    return x / 0\n\n\ndef problem():\n    return half(1)\n", ["line 2 (return x / 0)"]),
        ("import sys\n\nsys.exit(0)\n", ["line 3 (sys.exit(0))", "SystemExit"]),
    ],
)
def test_a_broken_problem_file_is_named_with_its_own_line(run, folder, source, words):
    (folder / "problems" / "broken.py").write_text(source)
    for verb in ("solve", "show", "simulate"):
        assert refused(run(verb, "broken"), "problems/broken.py", *words)


def test_list_names_every_file_and_runs_none(run, folder):
    (folder / "problems" / "mine.py").write_text(
        '"""My own."""\nraise SystemExit\n\n\ndef problem():\n    pass\n'
    )
    (folder / "problems" / "torn.py").write_text("def problem(:\n")
    code, out, err = run("list")
    assert (code, err) == (0, "")
    assert re.search(r"mine +My own\.", out) and re.search(r"torn +\(not valid Python", out)
    assert re.search(r"free_flyer +Fly a free-flying robot", out)


def test_a_name_is_looked_for_in_the_working_folder_first(run, folder):
    write(folder, "free_flyer")
    code, out, _ = run("show", "free_flyer")
    assert code == 0 and "A push." in out


def test_show_says_the_scene_its_parameters_and_the_size(run):
    code, out, err = run("show", "drone_hop", "--set", "mass=1.25")
    assert (code, err) == (0, "")
    out = " ".join(out.split())  # lines fold where the terminal is narrow
    for word in ("1.25 kg", "(12, 5, 6) m", "3 s", "at most 15 N", "1/2 integral of |F|^2 dt [N^2 s]"):
        assert word in out
    assert "LinearDrag, coefficient 0.3 N s/m" in out
    assert "UniformGravity, acceleration (0, 0, -9.81) m/s^2" in out
    assert re.search(r"limit +15 +N +Largest thrust\.", out)
    assert "2412 unknowns" in out and "order 2, 400 steps" in out


def test_show_gives_the_size_of_what_a_solve_without_options_solves(run):
    """A body that turns has another default order, and many revolutions have one of their own."""
    _, out, _ = run("show", "reorientation")
    assert "1614 unknowns" in out and "order 4, 100 steps" in out
    _, out, _ = run("show", "geo_raise")
    assert "order 6, 400 steps" in out


def test_words_of_effects_that_have_none():
    from dataclasses import dataclass

    from dmoc import Force, PointGravity
    from dmoc.reports.words import effect_words

    @dataclass(frozen=True)
    class Wind(Force):
        speed: tuple

        def force(self, t, q, v, m):
            return 0 * v

    assert effect_words(Wind((3, 0.5))) == "Wind, speed (3, 0.5)"
    assert effect_words(PointGravity(2.5)) == "Attraction by a point or a sphere (PointGravity, mu 2.5 m^3/s^2)"


def test_set_changes_the_problem(run):
    _, out, _ = run("solve", "point_to_point", "--set", "goal=(0, 2)", "--set", "duration=4", "--json")
    found = json.loads(out)
    assert found["duration"] == 4 and found["objective"] == pytest.approx(6 * 4 / 64, rel=1e-3)


def test_quiet_prints_one_line(run):
    code, out, err = run("solve", "bang_bang", "--quiet")
    assert (
        (code, err) == (0, "")
        and out.startswith("Solved, a local optimum: time 2 s (")
        and out.count("\n") == 1
    )
    assert "residual" not in out


def test_saved_solutions_are_checked_drawn_simulated_and_started_from(run, folder):
    code, out, _ = run("solve", "drone_hop", "--set", "mass=0.9", "--out", "hop.nc", "--plot", "hop.png")
    assert code == 0 and "wrote hop.nc" in out and "wrote hop.png" in out
    assert (folder / "hop.png").stat().st_size > 1000
    code, out, err = run("check", "hop.nc")
    assert (code, err) == (0, "") and "Every check holds" in out
    code, out, _ = run("plot", "hop.nc", "--out", "again.svg")
    assert code == 0 and (folder / "again.svg").exists()
    code, out, _ = run("simulate", "drone_hop", "--set", "mass=0.9", "--controls", "hop.nc")
    assert code == 0 and re.search(r"final position +\(12, 5, 6\) m", out)
    _, out, _ = run("solve", "drone_hop", "--set", "mass=0.9", "--guess", "hop.nc")
    # from there few iterations are left; beside them the program's own guess is tried on a coarse mesh
    assert re.search(r"^ +2 +400 +[1-3] ", out, re.M)
    assert re.search(r"^ +2 +100 +\d+ ", out, re.M)


def test_check_finds_a_spoiled_solution(run, folder):
    from dmoc import load, solve

    file = load_problem("point_to_point")
    solve(file.make(), steps=20).save("good.nc", source_hash=file.source_hash)
    spoiled = load("good.nc")
    spoiled.path.position[5] += 0.01
    spoiled.save("spoiled.nc")
    assert run("check", "good.nc")[0] == 0
    code, out, _ = run("check", "spoiled.nc", "--json")
    assert code == 4 and json.loads(out)["checks"]["residual"]["ok"] is False


def test_check_warns_when_the_problem_file_has_changed(run, folder):
    path = write(folder, "push")
    assert run("solve", "push", "--out", "push.nc")[0] == 0
    assert run("check", "push.nc")[2] == ""
    path.write_text(path.read_text() + "\n# changed\n")
    code, _, err = run("check", "push.nc")
    assert code == 0 and err.startswith("warning: problems/push.py ") and err.count("\n") == 1
    path.rename(folder / "moved.py")
    assert refused(run("check", "push.nc"), "'push'", "--problem")
    assert run("check", "push.nc", "--problem", "moved.py")[0] == 0


def test_what_was_saved_from_python_is_checked_without_a_warning(run, folder):
    write(folder, "push")
    dmoc.solve(load_problem("push").make(), steps=20).save("push.nc")
    code, _, err = run("check", "push.nc", "--problem", folder / "problems/push.py")
    assert (code, err) == (0, "")


def test_a_file_never_chooses_what_is_run(run, folder):
    from dmoc import load

    write(folder, "push")
    assert run("solve", "push", "--out", "push.nc")[0] == 0
    (folder / "evil.py").write_text("open('ran', 'w').close()\n")
    for name in ("evil.py", "../evil", "./evil.py", str(folder / "evil.py")):
        load("push.nc").save("evil.nc", problem_name=name)
        assert refused(run("check", "evil.nc"), "no problem file", "--problem")
    assert not (folder / "ran").exists()


def test_plot_goes_without_the_problem_file(run, folder):
    path = write(folder, "push")
    assert run("solve", "push", "--out", "push.nc")[0] == 0
    path.unlink()
    code, out, err = run("plot", "push.nc")
    assert code == 0 and "wrote push.png" in out and err.startswith("warning: ")


def test_simulate_coasts_and_says_how_energy_drifts(run):
    code, out, err = run("simulate", "orbit_raise", "--order", 8, "--steps", 100)
    assert (code, err) == (0, "")
    drift = float(re.search(r"energy drift +(\S+) J/kg", out)[1])
    assert drift < 1e-10
    assert "energy change" in run("simulate", "drone_hop")[1]


def test_a_terminal_sees_one_live_line_and_a_pipe_sees_none():
    """On a terminal the iterations are redrawn on one line of stderr; stdout stays the same."""
    command = [sys.executable, "-m", "dmoc.cli", "solve", "free_flyer"]
    piped = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert piped.stderr == ""
    ours, theirs = os.openpty()
    with open(ours, "rb", buffering=0) as terminal:
        shown = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, text=True, timeout=60)
        os.close(theirs)
        drawn = terminal.read(65536).decode()
    assert shown.returncode == 0 and shown.stdout.count("\n") == piped.stdout.count("\n")
    assert re.search(r"order 2, 100 steps, iteration \d+: objective \S+ N\^2 s, worst keep_out_\d", drawn)
    assert "Warning" not in drawn and drawn.count("\n") <= 1


@pytest.mark.parametrize("seconds", [0.0, 1.5])
def test_an_interrupt_exits_130(folder, seconds):
    """At once while the problem is made; inside a solve with the best iterate, which is then shown."""
    kill = f"import os, threading; threading.Timer({seconds}, os.kill, (os.getpid(), 2)).start()"
    source = load_problem("free_flyer").path.read_text()
    (folder / "problems" / "late.py").write_text(f"{kill}\n{source}")
    command = [sys.executable, "-m", "dmoc.cli", "solve", "late", "--order", "8", "--steps", "12800", "--json"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 130
    assert ended.stderr.splitlines()[-1] == "interrupted"
    if ended.stdout:
        shown = json.loads(ended.stdout)
        assert (shown["success"], shown["status"]) == (False, "stopped")


@pytest.mark.parametrize("arguments", [["--help"], ["solve", "--help"], ["list"]])
def test_help_and_list_do_not_load_the_libraries(arguments):
    program = f"""
        import sys
        from dmoc.cli.app import main
        try:
            main({arguments!r})
        except SystemExit as end:
            assert not end.code, end.code
        heavy = {{"casadi", "matplotlib", "scipy", "xarray", "numpy"}} & set(sys.modules)
        assert not heavy, heavy
    """
    ended = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize(
    "verb",
    [
        "list",
        "new",
        "show",
        "solve",
        "effects",
        "simulate",
        "check",
        "plot",
        "animate",
        "export",
        "stability",
        "study",
        "sweep",
        "doctor",
    ],
)
def test_every_verb_has_an_example(run, verb):
    code, out, _ = run(verb, "--help")
    assert code == 0 and f"Example: dmoc {verb}" in out


def test_switches_take_no_value_and_errors_point_to_the_verb(run):
    _, out, _ = run("solve", "--help")
    assert re.search(r"--steps +<int>", out) and re.search(r"--hold +Keep forces", out)
    assert run("solve", "free_flyer", "--oder", 4)[2].endswith("(dmoc solve --help)\n")
    assert run("--oder")[2].endswith("(dmoc --help)\n")
    assert run("--version") == (0, f"dmoc {dmoc.__version__}\n", "")


def test_a_result_never_takes_the_place_of_anything_else(run, folder):
    write(folder, "push")
    file = folder / "problems" / "push.py"
    before = file.read_text()
    code, _, err = run("solve", "push", "--out", file)
    assert (code, err.count("\n")) == (2, 1) and "no result" in err and file.read_text() == before
    for _ in range(2):
        assert run("solve", "push", "--steps", 10, "--out", "push.nc")[0] in (0, 4)


def test_without_arguments_it_helps(run):
    code, out, _ = run()
    assert code == 0 and "solve" in out and "Exit codes" in out


def test_a_shell_completes_the_names_of_problems(tmp_path):
    program = "import sys; sys.argv[0] = 'dmoc'; from dmoc.cli.app import main; main()"
    asked = {"_DMOC_COMPLETE": "complete_bash", "COMP_WORDS": "dmoc solve free", "COMP_CWORD": "2"}
    ended = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=dict(os.environ) | asked,
    )
    assert ended.stdout.split() == ["free_flyer"], ended.stderr


def test_what_was_stopped_is_not_solved_when_it_is_checked_later(run, tmp_path):
    file = load_problem("orbit_raise")
    stopped = dmoc.solve(file.make(), progress=lambda *told: True)
    assert stopped.status == "stopped"
    stopped.save(tmp_path / "half.nc", source_hash=file.source_hash)
    code, out, err = run("check", tmp_path / "half.nc")
    assert (code, err) == (3, "") and "Not solved: stopped" in out


def test_no_number_is_cut_on_a_terminal_of_eighty_columns(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = run("solve", "orbit_raise", "--tol", "1e-6")
    assert code == 0 and max(map(len, out.splitlines())) <= 80
    assert re.search(r"0\.0016903\d{3}", out) and "…" not in out


def test_an_answer_names_its_objective_in_words_and_once(run):
    code, out, _ = run("solve", "dionysus", "--quiet")
    assert code == 0 and re.match(r"Solved, a local optimum: final mass \S+ kg, duration", out)
    assert out.count("final mass") == 1
