"""What MkDocs does besides docs/: README.md is the home page, notebooks are pages, linked files go along."""

import json
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
# A row of the gallery: name, picture and what the problem is.
ROW = re.compile(r"^\| \[(\w+)\]\((\S+\.png)\) \| ([^|]+) \|", re.MULTILINE)
FIGURE = (
    '<figure><a href="{1}"><img src="{1}" alt="{0}" loading="lazy"></a><figcaption>{0}</figcaption></figure>'
)


def target(link, source):
    """Where a link of a page leads in the site; `source` is the page in the repository."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
    if path in BESIDE:
        return BESIDE[path]
    if not path.startswith("docs/"):
        return f"files/{path}"
    return re.sub(r"\.ipynb$", ".md", path.removeprefix("docs/"))


def source_of(name):
    """The page of the site in the repository."""
    beside = {site: source for source, site in BESIDE.items()}
    return beside.get(name, f"docs/{name}")


def notebook_page(path):
    """A notebook as Markdown, without what its cells show."""
    text = f'<a href="{path.name}" download>This notebook as a file</a>\n'
    for cell in json.loads(path.read_text())["cells"]:
        source = "".join(cell["source"])
        text += f"\n{source}\n" if cell["cell_type"] == "markdown" else f"\n```python\n{source}\n```\n"
    # the title of the notebook stays the first line
    title, _, rest = text.partition("\n\n")[2].partition("\n")
    return f"{title}\n\n{text.partition(chr(10))[0]}\n{rest}"


def on_config(config):
    # Changes to what becomes a page are seen by `mkdocs serve`.
    config.watch.extend(str(ROOT / name) for name in BESIDE)
    return config


def on_files(files, config):
    for source, name in BESIDE.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    for path in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=notebook_page(path)))
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

    markdown = FORMULA.sub(formula, LINK.sub(led, markdown))
    if here == "gallery.md":
        figures = "\n".join(FIGURE.format(name, picture) for name, picture, _ in ROW.findall(markdown))
        before, head, rows = markdown.partition("| problem |")
        markdown = f'{before}<div class="pictures">\n{figures}\n</div>\n\n{head}{rows}'
    return markdown
