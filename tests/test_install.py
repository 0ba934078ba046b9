"""A wheel and an sdist are built and installed as users do: the program works in an empty folder."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BUILD = "import sys; from setuptools import build_meta as b; print(getattr(b, sys.argv[1])(sys.argv[2]))"


def ran(*command, folder, **more):
    ended = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True, **more)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def built(what, folder):
    """The archive that the build backend makes of a copy of what is checked out."""
    source = folder / "source"
    if not source.exists():
        for name in ("dmoc", "problems"):
            shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "README.md"):
            shutil.copy(ROOT / name, source)
    name = ran(sys.executable, "-c", BUILD, what, folder, folder=source).split()[-1]
    return folder / name


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("install")


@pytest.fixture(scope="module")
def program(folder):
    """The program from the wheel, in an environment of its own whose other packages are those of the tests."""
    wheel = built("build_wheel", folder)
    place = folder / "environment"
    venv.create(place, symlinks=True)
    scripts = place / ("Scripts" if os.name == "nt" else "bin")
    ran(
        sys.executable,
        "-m",
        "pip",
        "--python",
        scripts / "python",
        "install",
        "--no-deps",
        wheel,
        folder=folder,
    )
    (packages,) = place.rglob("site-packages")
    # This line does not follow the links in that folder that lead to the checked out package.
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return scripts / "dmoc"


def test_the_wheel_has_all_modules_and_problems(folder, program):
    (wheel,) = folder.glob("*.whl")
    inside = set(zipfile.ZipFile(wheel).namelist())
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "dmoc").rglob("*.py")}
    problems = {f"dmoc/problems/{path.name}" for path in (ROOT / "problems").glob("*.py")}
    assert modules | problems | {"dmoc/py.typed"} <= inside
    assert all(name.startswith(("dmoc/", "dmoc-")) for name in inside)


def test_what_was_installed_works_in_an_empty_folder(program, tmp_path):
    where = ran(program.with_name("python"), "-c", "import dmoc; print(dmoc.__file__)", folder=tmp_path)
    assert "environment" in where
    assert "free_flyer" in ran(program, "list", folder=tmp_path)
    assert "Every check holds" in " ".join(ran(program, "solve", "free_flyer", folder=tmp_path).split())
    assert "casadi" in ran(program, "doctor", folder=tmp_path)


def test_the_source_archive_builds_what_the_sources_build(folder, program):
    with tarfile.open(built("build_sdist", folder)) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {str(path.relative_to(ROOT)) for path in (ROOT / "dmoc").rglob("*.py")}
    assert wanted | {"problems/free_flyer.py", "pyproject.toml", "README.md", "dmoc/py.typed"} <= inside


def test_a_problem_is_copied_to_start_from(tmp_path):
    command = [sys.executable, "-m", "dmoc.cli"]
    said = ran(*command, "new", "mine", "--from", "orbit_raise", folder=tmp_path)
    assert "dmoc solve mine.py" in " ".join(said.split())
    assert (tmp_path / "mine.py").read_bytes() == (ROOT / "problems" / "orbit_raise.py").read_bytes()
    assert "Every check holds" in " ".join(ran(*command, "solve", "mine.py", folder=tmp_path).split())
    (tmp_path / "mine.py").write_text("mine = 1\n")
    for words, told in (
        (["mine"], "mine.py is there already"),
        (["other", "--from", "nothing"], "there is no problem 'nothing'"),
        (["a/b"], "is no name for a problem file"),
    ):
        ended = subprocess.run([*command, "new", *words], cwd=tmp_path, capture_output=True, text=True)
        assert ended.returncode == 2 and told in ended.stderr and ended.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.glob("*.py")] == ["mine.py"]
    assert (tmp_path / "mine.py").read_text() == "mine = 1\n"
