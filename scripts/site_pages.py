"""What MkDocs does besides docs/: README.md becomes the home page, files that pages link to go along."""

import posixpath
import re
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
# Files beside docs/ that are pages of the site, and their names there.
BESIDE = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
LINK = re.compile(r"(?<=\]\()(?!https?:|#)([^)#\s]+)")
FORMULA = re.compile(r"^```math\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def target(link, source):
    """Where a link of a page leads in the site; `source` is the page in the repository."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
    if path in BESIDE:
        return BESIDE[path]
    return path.removeprefix("docs/") if path.startswith("docs/") else f"files/{path}"


def source_of(name):
    """The page of the site in the repository."""
    beside = {site: source for source, site in BESIDE.items()}
    return beside.get(name, f"docs/{name}")


def on_config(config):
    # Changes to what becomes a page are seen by `mkdocs serve`.
    config.watch.extend(str(ROOT / name) for name in BESIDE)
    return config


def on_files(files, config):
    for source, name in BESIDE.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    for page in list(files.documentation_pages()):
        for link in LINK.findall(page.content_string):
            name = target(link, source_of(page.src_uri))
            if name.startswith("files/") and files.get_file_from_path(name) is None:
                path = ROOT / name.removeprefix("files/")
                if path.is_file():
                    files.append(File.generated(config, name, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown, page, config, files):
    here = page.file.src_uri

    def led(match):
        return posixpath.relpath(target(match[1], source_of(here)), posixpath.dirname(here) or ".")

    def formula(match):
        return convert(match[1].strip(), display="block")

    return FORMULA.sub(formula, LINK.sub(led, markdown))
