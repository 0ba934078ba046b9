"""What the tests of pages share: a page's commands and Python blocks, and how they are run."""

import re
import shlex
import subprocess
import sys

COMMAND = r"^ {4}(?:\./scripts/run )?dmoc (?P<command>[^\n]*)$"
BLOCK = r"(?P<before>[^\n]*)\n\n```python\n(?P<source>.*?)^```$"


def parts(text):
    """Commands and Python blocks in their order."""
    return [match.groupdict() for match in re.finditer(f"{COMMAND}|{BLOCK}", text, re.MULTILINE | re.DOTALL)]


def sections(text):
    """Those sections of a page by their titles that have something to run."""
    every = {part.splitlines()[0]: part for part in re.split(r"^## ", text, flags=re.MULTILINE)}
    return {title: part for title, part in every.items() if parts(part)}


def play(text, folder, monkeypatch):
    """Run all there is in a text, in its order and in a folder; the names that its Python has then."""
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    names = {"__name__": "shown", "printed": {}}
    for part in parts(text):
        if command := part["command"]:
            # a command that is shown in two spellings is run once
            if command not in names["printed"]:
                names["printed"][command] = run(command, folder)
            continue
        if saved := re.search(r"Save this as\s`(\S+)`", part["before"]):
            (folder / saved[1]).write_text(part["source"])
            # another test may have had a file of this name
            monkeypatch.delitem(sys.modules, saved[1].removesuffix(".py"), raising=False)
        exec(part["source"], names)
    return names


def run(line, folder):
    command = [sys.executable, "-m", "dmoc.cli", *shlex.split(line, comments=True)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (ended.returncode, ended.stderr) == (0, ""), f"{line}\n{ended.stdout}{ended.stderr}"
    for written in re.findall(r"--(?:out|plot) (\S+)", line):
        assert (folder / written).stat().st_size > 1000, line
    return ended.stdout


def endings(text):
    """Commands within a text that a last line is shown of, and that line."""
    return re.findall(r"`dmoc (solve [^`]+)` ends\s+with\n\n {4}([^\n]+)", text)


def ends_with(command, shown):
    ended = subprocess.run(
        [sys.executable, "-m", "dmoc.cli", *shlex.split(command)], capture_output=True, text=True
    )
    assert ended.returncode == 3 and " ".join(ended.stdout.split()).endswith(shown), ended.stdout


def all_is_run(text):
    """Every fenced block of Python and every line with a command is a part of a section; how many there are."""
    fences = re.findall(r"^```(\w*)$", text, re.MULTILINE)
    blocks = fences.count("python")
    commands = re.findall(r"^[ \t]+(?:\./scripts/run )?dmoc \w", text, re.MULTILINE)
    assert set(fences) <= {"", "python", "math"} and 2 * fences.count("") == len(fences)
    assert sum(len(parts(part)) for part in sections(text).values()) == blocks + len(commands)
    return blocks + len(commands)
