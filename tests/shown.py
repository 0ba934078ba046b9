"""What the tests of pages share: a page's commands and Python blocks, and how they are run."""

import re
import shlex
import subprocess
import sys

COMMAND = r"^ {4}\./scripts/run dmoc (?P<command>[^\n]*)$"
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
    names = {"__name__": "shown"}
    for part in parts(text):
        if part["command"]:
            run(part["command"], folder)
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


def endings(text):
    """Commands within a text that a last line is shown of, and that line."""
    return re.findall(r"`dmoc (solve [^`]+)` ends\s+with\n\n {4}([^\n]+)", text)


def ends_with(command, shown):
    ended = subprocess.run(
        [sys.executable, "-m", "dmoc.cli", *shlex.split(command)], capture_output=True, text=True
    )
    assert ended.returncode == 3 and " ".join(ended.stdout.split()).endswith(shown), ended.stdout


def all_is_run(text, least):
    """Every fenced block and every line with a command is a part of a section."""
    blocks = text.count("```python")
    commands = re.findall(r"^\s*\./scripts/run\s+dmoc", text, re.MULTILINE)
    assert text.count("```") == 2 * blocks
    assert sum(len(parts(part)) for part in sections(text).values()) == blocks + len(commands) > least
