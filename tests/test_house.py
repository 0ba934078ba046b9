"""The house rules of dmoc/, as scripts/house.py counts them; and that it counts right."""

import importlib.util
from pathlib import Path

import pytest

import dmoc

ROOT = Path(dmoc.__file__).parent
SCRIPT = ROOT.parent / "scripts" / "house.py"
LINES_OF_A_FOLDER, FILES_OF_A_FOLDER, LINES_OF_A_FILE, LINES_OF_A_FUNCTION = 2200, 11, 300, 60


def load():
    spec = importlib.util.spec_from_file_location("house", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


house = load()


@pytest.fixture(scope="module")
def files():
    return house.read(ROOT)


def test_no_folder_is_too_large(files):
    """One can know a folder: what is in it, and why it stands there."""
    sizes = house.folders(files)
    assert len(sizes) > 5
    for folder, (lines, count) in sizes.items():
        assert lines <= LINES_OF_A_FOLDER, f"{folder} has {lines} lines"
        assert count <= FILES_OF_A_FOLDER, f"{folder} has {count} files"


def test_no_file_is_too_long(files):
    assert {str(file.path): file.lines for file in files if file.lines > LINES_OF_A_FILE} == {}


def test_no_function_is_too_long(files):
    lengths = house.functions(files)
    assert {name: lines for name, lines in lengths.items() if lines > LINES_OF_A_FUNCTION} == {}


def test_no_modules_import_each_other_in_a_circle(files):
    assert house.circles(house.imports(files)) == set()


def test_only_the_scene_and_its_parts_ask_what_a_part_is(files):
    """Whoever asks has to be told of every part that is new; what a part does, its methods say."""
    assert house.strangers(files) == []


SMALL = {
    "__init__.py": "from small.top import go\n",
    "effects/__init__.py": "",
    "effects/base.py": "class Effect: ...\nclass Spring(Effect): ...\nclass Odd(Effect, ABC): ...\n",
    "effects/use.py": "from small.effects.base import Spring\nisinstance(1, Spring)\n",
    "top.py": '''\
"""Two lines

of three."""
from small import low  # last
def go(x):
    """One line."""
    from small.effects import use
    if isinstance(x, (int, base.Spring)) or isinstance(x, Odd):
        return UNIT
UNIT, TABLE = 1, {}
TABLE[low] = 2
''',
    "low.py": "import small.left\nUNIT: int = 2\nmatch UNIT:\n    case Spring():\n        _x = 1\n",
    "left.py": "from small.right import a\n_x = 1\n",
    "right.py": "import small.left as left\n_x = 1\n",
}


@pytest.fixture
def small(tmp_path):
    """A package of which everything is known."""
    for name, text in SMALL.items():
        path = tmp_path / "small" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return house.read(tmp_path / "small")


def test_sizes_are_counted_right(small):
    assert house.folders(small) == {"effects": (5, 2), ".": (11 + 5 + 2 + 2, 4)}
    assert house.functions(small) == {"top.py:5 go": 4}
    top = next(file for file in small if file.module == "small.top")
    assert house.comments(top) == 1
    assert [house.docstring(node) for node in (top.tree, top.tree.body[2])] == [3, 1]


def test_imports_are_followed_right(small):
    graph = house.imports(small)
    assert graph["small.top"] == {"small.low", "small.effects.use"} and "small" not in graph
    assert house.circles(graph) == {frozenset({"small.left", "small.right"})}
    assert house.chain(graph) == ["small.top", "small.low", "small.left", "small.right"]


def test_who_asks_for_a_part_is_found(small):
    """At home one may ask; an abstract part anybody may ask for."""
    assert house.parts(small) == {"Spring": {Path("effects/base.py")}}
    assert house.strangers(small) == ["low.py:4 Spring", "top.py:8 Spring"]


def test_names_that_stand_twice_are_found(small):
    assert house.shared(small) == {
        "UNIT": ["small.low", "small.top"],
        "_x": ["small.left", "small.right"],
    }


def test_the_table_is_printed(tmp_path, small, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["house.py", str(tmp_path / "small"), "--names"])
    house.main()
    shown = capsys.readouterr().out
    assert "names in several modules      2, 1 of them public" in shown
    assert "UNIT: small.low, small.top" in shown and "low.py:4 Spring" in shown
