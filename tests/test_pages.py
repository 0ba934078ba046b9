"""What README and the pages of docs/ show works: all of a page, in its order, in an empty folder."""

import re
import shlex
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
import typer
from shown import all_is_run, endings, ends_with, parts, play, sections

import dmoc
from dmoc.cli.app import app
from dmoc.scene.problem_file import catalogue

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = {path.stem: path.read_text() for path in [README, *sorted((ROOT / "docs").glob("*.md"))]}
ALL = "\n".join(PAGES.values())
# tests/test_docs.py plays docs/extending.md, and looks at what comes out
SHOWN = {page: text for page, text in PAGES.items() if page not in ("README", "extending") and parts(text)}
FRONT = sections(PAGES["README"])
COMMANDS, SCENE = "Two commands", "A scene in ten lines"
# Some pages need a package that comes with an extra; whoever runs the tests without has none of it.
NEEDED = {"report": "plotly", "effects": "pymsis"}


def of_page(name):
    package = NEEDED.get(name)
    missing = package is not None and find_spec(package) is None
    return pytest.param(name, marks=pytest.mark.skipif(missing, reason=f"{package} is not installed"))


@pytest.mark.parametrize("page", [of_page(page) for page in SHOWN])
def test_what_a_page_shows_works(page, tmp_path, monkeypatch):
    play(SHOWN[page], tmp_path, monkeypatch)


@pytest.mark.parametrize("section", [section for section in FRONT if section not in (COMMANDS, SCENE)])
def test_what_the_front_page_shows_works(section, tmp_path, monkeypatch):
    play(FRONT[section], tmp_path, monkeypatch)


def shape(text):
    """Words without their numbers."""
    return re.sub(r"\d[\d.]*(e[-+]\d+)?", "#", " ".join(text.split()))


def test_the_first_commands_end_as_the_front_page_says(tmp_path, monkeypatch):
    printed = play(FRONT[COMMANDS], tmp_path, monkeypatch)["printed"]
    (shown,) = re.findall(r"^ {4}(Solved,.*?\n.*?)$", PAGES["README"], re.MULTILINE)
    assert shape(shown) in shape(printed["solve free_flyer"])


def test_the_first_scene_has_the_numbers_of_the_front_page(tmp_path, monkeypatch):
    names = play(FRONT[SCENE], tmp_path, monkeypatch)
    effort, force = map(
        float, re.search(r"effort of ([\d.]+) N² s, its\s+largest force is ([\d.]+) N", ALL).groups()
    )
    assert names["solution"].objective == pytest.approx(effort, abs=0.06)
    assert names["solution"].facts()["peak force"].value == pytest.approx(force, abs=0.06)


def test_nothing_on_the_pages_is_left_out():
    assert sum(all_is_run(text) for text in PAGES.values()) > 40


# Scripts within a line of text, and why some of them are not run.
SCRIPTS = re.findall(r"`\./scripts/run (python scripts/[^`]+)`", ALL)
ELSEWHERE = {
    "python scripts/references.py --write": "tests/scene/test_problems.py holds every row",
    "python scripts/effects_cost.py --write": "it writes the page; a test of the studies runs it",
    "python scripts/accuracy.py --write": "it writes the page, in minutes",
    "python scripts/benchmark.py --peers --write": "likewise; tests/studies/test_peers.py runs its parts",
    "python scripts/campaign.py --each 50 --journal campaign.jsonl --write": "it takes an hour",
    "python scripts/identification.py": "it takes minutes and the extra study; tests hold what it shows",
    "python scripts/gallery.py": "it writes the pictures; tests/scene/test_problems.py solves every problem",
}
# Commands within a line of text that name all they need; those of the gallery are run by the tests of problems.
INLINE = re.findall(r"`(?:\./scripts/run )?(dmoc [^`]+)`", ALL.replace(PAGES["gallery"], ""))
WHOLE = [line for line in INLINE if re.match(r"dmoc (solve|study|sweep) \w+ --", line) and ".nc " not in line]
SLOW = [line for line in dict.fromkeys(SCRIPTS + WHOLE) if line not in ELSEWHERE]


@pytest.mark.slow
@pytest.mark.parametrize("line", SLOW)
def test_commands_within_the_text_work_too(line, tmp_path):
    words = [str(ROOT / word) if word.startswith("scripts/") else word for word in shlex.split(line)[1:]]
    before = [sys.executable, "-m", "dmoc.cli"] if line.startswith("dmoc") else [sys.executable]
    ended = subprocess.run([*before, *words], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert ended.returncode == 0 or line in {f"dmoc {one}" for one, _ in endings(ALL)}, ended.stderr
    assert all((tmp_path / name).stat().st_size > 1000 for name in re.findall(r"--plot (\S+)", line))


@cache
def commands():
    return typer.main.get_command(app)


@pytest.mark.parametrize("line", sorted(set(INLINE)))
def test_commands_within_the_text_are_ones_that_dmoc_has(line):
    verb, *words = [word for word in shlex.split(line)[1:] if word != "..."] or ["--help"]
    program = commands()
    if verb.startswith("-"):
        assert verb in {"--help", "--version", "--install-completion"}
        return
    known = {name for option in program.commands[verb].params for name in option.opts} | {"--help"}
    assert {word for word in words if word.startswith("--")} <= known


def test_the_first_problem_names_everything_a_problem_is_made_of():
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
    named_parts = {name for name, part in public.items() if isinstance(part, type) and issubclass(part, kinds)}
    bases = {kind.__name__ for kind in kinds} | {"Conservative", "Force", "WeightedSum"}
    bases |= {"BodyConservative", "BodyForce"}
    page = PAGES["first_problem"]
    table = page[page.index("| what | names |") :].partition("\n\n")[0]
    named = set(re.findall(r"`(\w+)", table))
    assert named_parts - bases <= named <= set(public)


def test_what_a_limit_too_small_ends_with():
    ((command, shown),) = endings(PAGES["failures"])
    ends_with(command, shown)


@pytest.mark.parametrize("page", [*PAGES, "CHANGELOG", "CONTRIBUTING"])
def test_every_file_that_a_page_names_is_there(page):
    path = ROOT / f"{page}.md" if page.isupper() else ROOT / "docs" / f"{page}.md"
    text = path.read_text()
    linked = re.findall(r"\]\((?!https?:|#)([^)#]+)", text)
    named = re.findall(r"\b((?:scripts|dmoc|tests|problems)/[\w/]+\.\w+)", text)
    assert not [name for name in linked if not (path.parent / name).exists()]
    assert not [name for name in named if not (ROOT / name).exists()]


@pytest.mark.parametrize("name", [name for name, _ in catalogue()])
def test_every_problem_is_in_the_gallery_and_says_what_is_known_of_its_optimum(name):
    """If not: run scripts/gallery.py; add a line to scripts/references.py, or a word below its table."""
    page = PAGES["gallery"]
    assert f"[{name}](../problems/gallery/{name}.png)" in page and f"`dmoc solve {name}`" in page
    assert f"`{name}`" in PAGES["references"]


def test_pictures_of_the_gallery_are_of_moderate_size():
    pictures = list((ROOT / "problems" / "gallery").glob("*.png"))
    assert len(pictures) >= 10 and max(picture.stat().st_size for picture in pictures) < 250_000


def test_the_front_page_is_short():
    assert len(PAGES["README"].split()) <= 1250


def test_every_page_is_in_the_table_of_contents():
    """If not: add a line to the nav of mkdocs.yml."""
    nav = (ROOT / "mkdocs.yml").read_text().partition("\nnav:\n")[2]
    pages = {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")}
    assert not [page for page in pages if f"- {page}\n" not in nav]
