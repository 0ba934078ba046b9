"""A journal that was damaged: what is whole counts, what is not is solved again, and nothing else is lost."""

import json
import random
import warnings

import pytest
from sweep_helpers import found, write_push

from dmoc.basics.files import sealed_object
from dmoc.cli.app import main
from dmoc.sweeps.journal import JOURNAL_FORMAT, Journal, journal_of

POINTS = 4
FACTS = {"problem": "p", "vary": {"mass": [1.0, 2.0, 3.0, 4.0]}}
RECORDS = {(0, point): found(point / 3) for point in range(POINTS)}


@pytest.fixture
def out(tmp_path):
    """A result file whose journal has four points."""
    with Journal(tmp_path / "out.nc", FACTS) as journal:
        for (wave, point), record in RECORDS.items():
            journal.append(wave, point, record, f"path {point}")
    return tmp_path / "out.nc"


def opened(out):
    """The records of the journal, or the words with which it is refused; they and no other end are right."""
    try:
        with warnings.catch_warnings(action="ignore"), Journal(out, FACTS) as journal:
            for key in journal.records:
                assert journal.path_at(*key) == f"path {key[1]}"
            return journal.records
    except ValueError as error:
        assert "\n" not in str(error) and len(str(error)) < 400 and str(journal_of(out)) in str(error)
        return str(error)


def test_no_flipped_bit_changes_a_record_or_loses_another(out):
    whole = journal_of(out).read_bytes()
    head, dice = whole.index(b"\n") + 1, random.Random(1)
    for place in {*dice.sample(range(len(whole)), 200), 0, head - 1, head, len(whole) - 1}:
        broken = bytearray(whole)
        broken[place] ^= 1 << dice.randrange(8)
        journal_of(out).write_bytes(broken)
        records = opened(out)
        if place < head:
            assert isinstance(records, str) and journal_of(out).read_bytes() == broken
        else:
            # a line break that is lost joins two lines
            assert len(records) >= POINTS - 2
            assert all(RECORDS[key] == record for key, record in records.items())


ODD = [
    "1",
    "[]",
    "null",
    '"wave"',
    "{}",
    '{"wave": 0}',
    "[" * 100_000,
    '{"wave": 0, "point": "x", "record": 1}',
]


@pytest.mark.parametrize("line", [*ODD, "\udcff", json.dumps(sealed_object({"wave": 0}))])
def test_a_line_that_is_no_entry_is_passed_over_and_told(out, line):
    lines = journal_of(out).read_bytes().splitlines(keepends=True)
    lines[2] = line.encode(errors="surrogateescape") + b"\n"
    journal_of(out).write_bytes(b"".join(lines))
    with pytest.warns(UserWarning, match=r"^a line of .*out.nc.journal is damaged; .* solved again$"):
        journal = Journal(out, FACTS)
    with journal:
        assert sorted(journal.records) == [(0, 0), (0, 2), (0, 3)]
        journal.append(0, 1, RECORDS[0, 1], "path 1")
    assert opened(out) == RECORDS


@pytest.mark.parametrize(
    "head, words",
    [
        ({"format": JOURNAL_FORMAT, "version": 1, **FACTS}, "comes from another dmoc (format 1"),
        ({"format": JOURNAL_FORMAT, "version": [3], **FACTS}, "comes from another dmoc (format [3]"),
        ({"format": JOURNAL_FORMAT, "version": 2, **FACTS}, "the checksum of its first line does not hold"),
        ({"format": JOURNAL_FORMAT}, "the checksum of its first line does not hold"),
        (sealed_object({"format": JOURNAL_FORMAT, "version": 2}), "belongs to another sweep"),
    ],
)
def test_a_first_line_that_does_not_hold_is_refused_with_a_remedy(out, head, words):
    lines = journal_of(out).read_bytes().splitlines(keepends=True)
    content = b"".join([json.dumps(head).encode() + b"\n", *lines[1:]])
    journal_of(out).write_bytes(content)
    assert words in opened(out) and "--restart" in opened(out)
    assert journal_of(out).read_bytes() == content
    with Journal(out, FACTS, restart=True) as journal:
        assert journal.records == {}


@pytest.mark.slow
def test_the_command_says_so_in_a_line_and_goes_on(tmp_path, capfd, monkeypatch):
    """Of four solves the journal of a sweep that was stopped has two, one of them damaged."""
    monkeypatch.chdir(tmp_path)
    write_push(tmp_path)
    command = ["sweep", "push.py", "--vary", "mass=1,2,3", "--order", "4", "--out", "m.nc", "--workers", "1"]
    kept = []
    monkeypatch.setattr(Journal, "remove", lambda self: kept.append(self.path.read_bytes()))
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == 0
    lines = kept[0].splitlines(keepends=True)
    (tmp_path / "m.nc.journal").write_bytes(b"".join([*lines[:2], lines[2].replace(b"solved", b"sloved")]))
    (tmp_path / "made.txt").unlink()
    capfd.readouterr()
    with pytest.raises(SystemExit) as end:
        main(command)
    out, err = capfd.readouterr()
    assert end.value.code == 0 and "Solved 3 of 3" in out
    assert err.startswith("warning: a line of m.nc.journal is damaged") and err.count("\n") == 1
    assert len((tmp_path / "made.txt").read_text().splitlines()) == 3
