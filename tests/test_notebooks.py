"""The notebooks in docs/notebooks run from their first cell to their last, and hold no output."""

import ast
import json
import re
from pathlib import Path

import pytest

import dmoc

FOLDER = Path(dmoc.__file__).parents[1] / "docs" / "notebooks"
PAGE = (FOLDER.parent / "notebook.md").read_text()
BOOKS = sorted(FOLDER.glob("*.ipynb"))


def shown(source, names):
    """Run a cell as a notebook does; what it shows of its last line."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    value = None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    if value is None:
        return ""
    # a figure of matplotlib has the method, and no page
    return getattr(value, "_repr_html_", lambda: None)() or repr(value)


@pytest.mark.parametrize("path", BOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    cells = json.loads(path.read_text())["cells"]
    assert 5 <= len(cells) <= 8 and cells[0]["cell_type"] == "markdown"
    assert len({cell["id"] for cell in cells}) == len(cells)
    names, outputs = {"__name__": "__main__"}, []
    for cell in cells:
        if cell["cell_type"] == "code":
            assert (cell["outputs"], cell["execution_count"]) == ([], None)
            outputs.append(shown("".join(cell["source"]), names))
    text = "".join(outputs) + capsys.readouterr().out
    assert "<img" in text and not re.search(r"checks fail|nan\b", text)
    assert all(line.rstrip("\n") == line.rstrip() for cell in cells for line in cell["source"])


def test_the_page_names_them_all():
    assert len(BOOKS) == 4
    assert {path.name for path in BOOKS} == set(re.findall(r"\bnotebooks/(\w+\.ipynb)", PAGE))
