"""The command line ends in one line, whenever it is interrupted and whatever its output is connected to."""

import subprocess
import sys

import pytest

from dmoc import load

INTERRUPTED_AT = """
import os, signal, sys

class Press:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Press())
from dmoc.cli import main
main({arguments!r})
"""


@pytest.mark.parametrize("module", ["dmoc.cli.app", "typer", "dmoc.cli.sweep", "numpy", "casadi"])
@pytest.mark.parametrize("verb", ["show", "solve"])
def test_an_interrupt_while_it_is_being_loaded_is_one_line(module, verb):
    program = INTERRUPTED_AT.format(module=module, arguments=[verb, "orbit_raise"])
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "interrupted\n")


def test_what_comes_before_that_is_soon_over():
    """Until `main` runs Python itself would print a traceback: so it must load next to nothing before."""
    program = "import sys; known = set(sys.modules); import dmoc.cli; print(*set(sys.modules) - known)"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert {"dmoc", "dmoc.cli"} <= set(ended.stdout.split())
    assert not {"typer", "numpy", "ast", "inspect", "dmoc.cli.app", "dmoc.cli.options"} & set(
        ended.stdout.split()
    )


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_stream_that_is_closed_leads_nowhere(closed, tmp_path):
    """What the solver's libraries print must not come into the file that would be opened in its place."""
    command = f"{sys.executable} -m dmoc.cli solve point_to_point --order 4 --steps 10 --out answer.nc {closed}"
    ended = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ("Every check holds" in ended.stdout) == (closed in ("<&-", "2>&-"))
    assert load(tmp_path / "answer.nc").steps == 10


@pytest.mark.parametrize("arguments", ["list", "show point_to_point", "nonsense", "--help", "solve qqq"])
def test_every_verb_keeps_its_exit_code_without_an_output(arguments):
    command = f"{sys.executable} -m dmoc.cli {arguments}"
    codes = [
        subprocess.run(f"{command} {closed}", shell=True, capture_output=True, timeout=60).returncode
        for closed in ("", ">&-", ">&- 2>&-")
    ]
    assert codes == [2 if arguments in ("nonsense", "solve qqq") else 0] * 3
