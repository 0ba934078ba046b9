"""What the README shows works: each section's commands and Python, in its own order, in an empty folder."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from shown import all_is_run, endings, ends_with, play, sections

import dmoc
from dmoc.scene.problem_file import catalogue

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text()
SECTIONS = sections(TEXT)


@pytest.mark.parametrize("section", SECTIONS)
def test_what_the_readme_shows_works(section, tmp_path, monkeypatch):
    play(SECTIONS[section], tmp_path, monkeypatch)


def test_nothing_in_the_readme_is_left_out():
    all_is_run(TEXT, least=10)


# commands within a line of text, and why some of them are not run
INLINE = re.findall(r"`\./scripts/run (dmoc [^`]+|python scripts/[^`]+)`", TEXT)
ELSEWHERE = {
    "python scripts/references.py --readme": "tests/scene/test_problems.py holds every row",
    "python scripts/effects_cost.py --readme": "it writes the README; a test of the studies runs it",
    "python scripts/accuracy.py --readme": "it writes the README, in minutes",
    "python scripts/campaign.py --readme": "it writes the README; tests/verification/test_campaign.py runs it",
    "python scripts/gallery.py": "it writes the pictures; tests/scene/test_problems.py solves every problem",
}


@pytest.mark.slow
@pytest.mark.parametrize("line", [line for line in dict.fromkeys(INLINE) if line not in ELSEWHERE])
def test_commands_within_the_text_work_too(line, tmp_path):
    words = [str(ROOT / word) if word.startswith("scripts/") else word for word in shlex.split(line)[1:]]
    before = [sys.executable, "-m", "dmoc.cli"] if line.startswith("dmoc") else [sys.executable]
    ended = subprocess.run([*before, *words], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert ended.returncode == 0, ended.stderr
    assert all((tmp_path / name).stat().st_size > 1000 for name in re.findall(r"--plot (\S+)", line))


def test_the_readme_names_everything_a_problem_is_made_of():
    kinds = (
        dmoc.Boundary,
        dmoc.Effect,
        dmoc.Actuator,
        dmoc.Objective,
        dmoc.Constraint,
        dmoc.Atmosphere,
        dmoc.Shadow,
    )
    public = {name: getattr(dmoc, name) for name in dmoc.__all__}
    parts = {name for name, part in public.items() if isinstance(part, type) and issubclass(part, kinds)}
    bases = {kind.__name__ for kind in kinds} | {"Conservative", "Force", "WeightedSum"}
    bases |= {"BodyConservative", "BodyForce"}
    table = TEXT[TEXT.index("| what | names |") :].partition("\n\n")[0]
    named = set(re.findall(r"`(\w+)", table))
    assert parts - bases <= named <= set(public)


def test_what_a_limit_too_small_ends_with():
    ((command, shown),) = endings(TEXT)
    ends_with(command, shown)


def test_every_file_the_readme_names_is_there():
    named = re.findall(r"\]\((?!https?:)([^)#]+)\)", TEXT)
    named += re.findall(r"\b((?:scripts|dmoc|tests|problems)/[\w/]+\.\w+)", TEXT)
    assert named and not [name for name in named if not (ROOT / name).exists()]


@pytest.mark.parametrize("name", [name for name, _ in catalogue()])
def test_every_problem_is_in_the_gallery_and_says_what_is_known_of_its_optimum(name):
    """If not: run scripts/gallery.py; add a line to scripts/references.py, or a word below its table."""
    known = re.search(r"^## Known optima\n.*?(?=^## )", TEXT, re.MULTILINE | re.DOTALL)
    assert known
    assert f"[{name}](problems/gallery/{name}.png)" in TEXT and f"`dmoc solve {name}`" in TEXT
    assert f"`{name}`" in known[0]


def test_pictures_of_the_gallery_are_of_moderate_size():
    pictures = list((ROOT / "problems" / "gallery").glob("*.png"))
    assert len(pictures) >= 10 and max(picture.stat().st_size for picture in pictures) < 250_000
