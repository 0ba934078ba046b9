"""A result is checked in the folder where it was made; nothing but the file it was made from is run there."""

import pytest

from dmoc import load
from dmoc.cli.app import main

PUSH = """
from dmoc import State, TransferProblem

open("ran", "a").write("once ")


def problem(duration=2.0):
    return TransferProblem(1.0, State([0], [0]), State([1], [0]), duration)
"""


@pytest.fixture
def run(capfd, tmp_path, monkeypatch):
    """Run a command line in an empty folder: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        return end.value.code or 0, out, err

    return call


@pytest.mark.parametrize("name", ["k.py", "two pushes.py", "orbit_raise.py"])
def test_a_result_finds_the_file_that_it_was_made_from(run, tmp_path, name):
    """Also one of the name of a problem in the folders: what made the result is told by its hash."""
    (tmp_path / name).write_text(PUSH)
    assert run("solve", f"./{name}", "--order", 4, "--set", "duration=3.0", "--out", "k.nc")[0] == 0
    code, out, err = run("check", "k.nc")
    assert (code, err) == (0, "") and "duration 3 s" in out and "Every check holds" in out
    assert run("plot", "k.nc") == (0, "wrote k.png\n", "")


def test_no_other_file_is_run(run, tmp_path):
    made = tmp_path / "k.py"
    made.write_text(PUSH)
    assert run("solve", "k.py", "--order", 4, "--out", "k.nc")[0] == 0
    made.write_text(PUSH + "# changed\n")
    (tmp_path / "ran").unlink()
    code, out, err = run("check", "k.nc")
    assert (code, out) == (2, "") and "give it with --problem" in err
    # neither without a hash, nor from another folder
    load("k.nc").save("bare.nc", source_hash="")
    assert run("check", "bare.nc")[0] == 2
    made.write_text(PUSH)
    for name in ("../k", str(tmp_path / "k"), "./k", "k.py", ""):
        load("k.nc").save("other.nc", problem_name=name)
        (tmp_path / "sub").mkdir(exist_ok=True)
        assert run("check", "other.nc")[0] == 2, name
    assert not (tmp_path / "ran").exists()
