"""What type checkers and editors see of dmoc: every public name with its signature, and no other name."""

import inspect
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import dmoc

ROOT = Path(dmoc.__file__).parents[1]

RIGHT = """\
import numpy as np

import dmoc
from dmoc import BallForce, Effort, KeepOut, PointGravity, State, Time, TransferProblem, solve, verify

problem = TransferProblem(
    mass=1.0,
    start=State([1, 0], [None, None]),
    goal=State(np.array([2.0, 0.0]), None),
    duration=(1.0, 9.0),
    effects=[PointGravity(1.0)],
    actuator=BallForce(0.5),
    objective=Effort() + 0.1 * Time(),
    constraints=[KeepOut((1.5, 0.5), 0.1)],
)
solution = solve(problem, order=4, steps=20).raise_for_status()
height: float = solution.position[-1].max() + solution.objective
good: bool = verify(solution).ok
reveal_type(dmoc.solve)
"""

# a line with a mistake, and what the type checker says of it
WRONG = {
    "dmoc.solve(problem, odrer=4)": 'Unexpected keyword argument "odrer" for overloaded function "solve"',
    "# of the same line": 'No overload variant of "solve" matches argument types "TransferProblem", "int"',
    "dmoc.solve(problem, order='four')": 'No overload variant of "solve" matches argument types',
    "dmoc.solve(problem).objectiv": '"Solution" has no attribute "objectiv"',
    "dmoc.slove(problem)": 'Module has no attribute "slove"',
    "dmoc.State((0.0, 0.0), 'fast')": 'Argument 2 to "State" has incompatible type "str"',
    "dmoc.PointGravity(mu=1.0, centre=(0.0, 0.0))": 'Unexpected keyword argument "centre" for "PointGravity"',
}

# reading these takes mypy three times as long as all the rest, and no type of theirs reaches a user
SETTINGS = """\
[mypy]
cache_dir = cache
check_untyped_defs = true
[mypy-casadi.*,distributed.*,h5netcdf.*,h5py.*,matplotlib.*,rich.*,scipy.*,typer.*,xarray.*]
follow_imports = skip
follow_imports_for_stubs = true
"""


def mypy(folder, *files):
    """What mypy says of a user's files, line by line, as (file, words); it finds dmoc as if installed."""
    (folder / "mypy.ini").write_text(SETTINGS)
    command = [sys.executable, "-m", "mypy", "--config-file=mypy.ini", *files]
    there = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=folder, env=there, capture_output=True, text=True)
    said = re.findall(r"^(?:.*/)?([^/]+?):\d+: (.+)$", done.stdout, re.MULTILINE)
    assert said and not done.stderr, done.stdout + done.stderr
    return said


def test_a_type_checker_knows_what_is_right_and_what_is_wrong(tmp_path):
    """Problem files and a user's program pass; each misspelt or wrong argument is named, and nothing else."""
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text("import dmoc\nfrom right import problem\n\n" + "\n".join(WRONG))
    said = mypy(tmp_path, "right.py", "wrong.py", *sorted(map(str, ROOT.glob("problems/*.py"))))
    (revealed,) = (words for _, words in said if "Revealed type" in words)
    assert "def (problem: dmoc.scene.problem.TransferProblem, order: int | None =" in revealed
    assert "-> dmoc.results.solution.Solution, def (problem: " in revealed
    errors = [(file, words) for file, words in said if words.startswith("error: ")]
    for (file, words), expected in zip(errors, WRONG.values(), strict=True):
        assert file == "wrong.py" and words.startswith(f"error: {expected}")


def test_the_marker_that_makes_type_checkers_look_is_shipped():
    shipped = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    assert "py.typed" in shipped["dmoc"] and (ROOT / "dmoc" / "py.typed").exists()


def functions(public):
    """The public function, or those a public class has from dmoc, with their names."""
    if inspect.isfunction(public):
        return {public.__name__: public}
    found = {}
    for base in public.__mro__:
        for name, member in vars(base).items() if base.__module__.startswith("dmoc") else ():
            inner = getattr(member, "fget", None) or getattr(member, "func", None) or member
            inner = inspect.unwrap(getattr(inner, "__func__", inner))
            private = name.startswith("_") and not name.endswith("__")
            # what dataclasses and named tuples add by themselves stands in no file of dmoc
            if inspect.isfunction(inner) and not private and str(ROOT) in inner.__code__.co_filename:
                found[f"{base.__name__}.{name}"] = inner
    return found


@pytest.mark.parametrize("name", dmoc.__all__)
def test_everything_public_is_annotated(name):
    for place, function in functions(getattr(dmoc, name)).items():
        signature = inspect.signature(function)
        given = {one.name: one.annotation for one in signature.parameters.values()}
        if not place.endswith(".__init__"):
            given["return"] = signature.return_annotation
        bare = {one for one, words in given.items() if words is inspect.Parameter.empty}
        assert not bare - {"self", "cls"}, f"{place} ({function.__module__}): annotate {bare}"


def test_names_are_found_in_a_zip_file_too(tmp_path):
    """They are read from the source of the package, wherever its loader has it."""
    with zipfile.ZipFile(tmp_path / "dmoc.zip", "w") as archive:
        for file in (ROOT / "dmoc").rglob("*.py"):
            archive.write(file, file.relative_to(ROOT))
    script = "import dmoc; from dmoc import *; print(dmoc.__file__, len(dmoc.__all__), State.__module__)"
    there = os.environ | {"PYTHONPATH": str(tmp_path / "dmoc.zip")}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, env=there, capture_output=True, text=True, check=True)
    file, count, home = done.stdout.split()
    assert Path(file).parent.parent == tmp_path / "dmoc.zip"
    assert (int(count), home) == (len(dmoc.__all__), dmoc.State.__module__)
