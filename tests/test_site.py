"""The site of the documentation builds without a warning, and holds what it should."""

import os
import re
import subprocess
import sys
from html import unescape
from pathlib import Path

import pytest

import dmoc

ROOT = Path(dmoc.__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    # the packages come with the tests; whoever runs them without has no site to look at
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", folder]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1", "DISABLE_MKDOCS_2_WARNING": "true"}
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=quiet)
    assert (ended.returncode, ended.stdout + ended.stderr) == (0, "")
    return folder


def test_it_builds_without_a_warning(site):
    assert (site / "index.html").exists()


def test_what_pages_link_to_is_in_the_site(site):
    """Files beside docs/, too: pictures, problem files, notebooks."""
    seen = 0
    for page in site.rglob("*.html"):
        for link in re.findall(r'(?:src|href)="(?!https?:|data:|mailto:|#)([^"#?]+)', page.read_text()):
            if page.name != "404.html":
                assert (page.parent / unescape(link)).exists(), f"{page.name}: {link}"
                seen += 1
    assert seen > 1000


def test_it_loads_nothing_from_elsewhere(site):
    for page in site.rglob("*.html"):
        text = page.read_text()
        assert not re.findall(r'<(?:script|img|iframe)[^>]*src="https?:', text), page
        assert not re.findall(r'<link[^>]*rel="(?:stylesheet|preconnect)"[^>]*href="https?:', text), page


def test_formulas_are_mathml(site):
    text = (site / "mathematics.html").read_text()
    assert text.count("<math") >= 5 and "language-math" not in text


def test_every_public_name_has_its_place_among_the_names():
    """If not: add a line  ::: dmoc.NAME  to a page of docs/api."""
    named = [
        name
        for page in (ROOT / "docs" / "api").glob("*.md")
        for name in re.findall(r"^::: dmoc\.(\w+)", page.read_text(), re.MULTILINE)
    ]
    assert sorted(named) == sorted(dmoc.__all__)
