"""Problem files that are damaged, or none at all: one line with the file and its place, nothing else."""

import os
import random

import pytest

from dmoc.scene.problem_file import catalogue, find, load_problem

SOURCE = find("drone_hop").read_bytes()


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A problem file in the working folder's own problems/."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "problems").mkdir()
    return tmp_path / "problems" / "mine.py"


def made(name="mine"):
    """The problem of a file, or the words with which it is refused; there is no third end."""
    try:
        return load_problem(name).make()
    except ValueError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 500 and "mine.py" in text, text
        return text


def test_flipped_bits_and_cuts_give_a_problem_or_a_line(file):
    dice, refused = random.Random(3), 0
    for place in dice.sample(range(len(SOURCE)), 120):
        broken = bytearray(SOURCE)
        broken[place] ^= 1 << dice.randrange(8)
        file.write_bytes(broken if place % 4 else SOURCE[:place])
        refused += isinstance(made(), str)
        assert "mine" in dict(catalogue())
    assert refused > 40


ODD = {
    "nothing": b"",
    "zeros": b"\0" * 50,
    "every byte": bytes(range(256)),
    "too deep for the parser": b"x=" + b"-" * 200_000 + b"1",
    "brackets": b"(" * 5000 + b")" * 5000,
    "another alphabet": "a = 'é'".encode("latin1"),
    "an unknown alphabet": b"# -*- coding: foo -*-\n" + SOURCE,
    "a class": b"class problem: pass",
    "no signature": b"problem = int",
    "a false signature": b"class P:\n  __signature__ = 3\n  def __call__(s): return 3\nproblem = P()",
    "a docstring that is a number": b"__doc__ = 3\ndef problem(): return 3",
    "an end": b"exit(0)",
    "an exception of no kind": b"raise BaseException('x')",
    "an end of a generator": b"raise GeneratorExit",
    "a long message": b"raise ValueError('a\\nb\\n' * 1000)",
    "no bottom": b"def f(): f()\nf()",
    "more than memory": b"x = 'a' * 10**15",
}


@pytest.mark.parametrize("content", ODD.values(), ids=ODD.keys())
def test_what_is_no_problem_is_refused_in_a_line(file, content):
    file.write_bytes(content)
    assert isinstance(made(), str)
    assert "mine" in dict(catalogue())


def test_ctrl_c_while_a_file_runs_is_no_fault_of_the_file(file):
    file.write_bytes(b"raise KeyboardInterrupt")
    with pytest.raises(KeyboardInterrupt):
        load_problem("mine")


@pytest.mark.parametrize("kind", ["a folder", "a link to nowhere", "a pipe"])
def test_what_is_no_file_is_not_listed_and_not_waited_for(file, kind):
    {
        "a folder": file.mkdir,
        "a link to nowhere": lambda: file.symlink_to("no"),
        "a pipe": lambda: os.mkfifo(file),
    }[kind]()
    assert "mine" not in dict(catalogue())
    for name in ("mine", "problems/mine.py"):
        with pytest.raises(ValueError, match="there is no problem"):
            load_problem(name)


def test_a_file_that_may_not_be_read_is_named(file, monkeypatch):
    file.write_bytes(SOURCE)

    def forbidden(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(file), "read_bytes", forbidden)
    assert made() == "problems/mine.py cannot be read: Permission denied; see who may read it"
    assert "cannot be read" in dict(catalogue())["mine"]


def test_a_name_that_is_too_long_is_refused(file):
    with pytest.raises(ValueError, match="too long for a file"):
        load_problem("a" * 300 + ".py")
