"""Imports flow one way, from folder to folder: each may import those before it, and nothing after."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import dmoc

ROOT = Path(dmoc.__file__).parent

# from the ground up; folders on one line do not know each other
LAYERS = [
    ["basics"],
    ["effects"],
    ["planets"],
    ["configurations"],
    ["parts"],
    ["bodies", "links"],
    ["ends"],
    ["legs"],
    ["scene"],
    ["motion"],
    ["shots"],
    ["guess", "results", "flights"],
    ["ipopt"],
    ["assembly"],
    ["nlp"],
    ["meshes"],
    ["diagnosis"],
    ["rungs"],
    ["checks"],
    ["solver"],
    ["chains"],
    ["missions"],
    ["teams"],
    ["phases"],
    ["structure"],
    ["planners"],
    ["sensitivity", "identification"],
    ["studies", "sweeps", "exports", "conversions", "answers"],
    ["surroundings"],
    ["plots", "reports"],
    ["charts", "films"],
    ["pages"],
    ["notebook"],
    ["cli"],
]
FLOOR = {folder: floor for floor, folders in enumerate(LAYERS) for folder in folders}
FILES = [file for file in sorted(ROOT.rglob("*.py")) if file.parent != ROOT]


def name_of(file):
    """dmoc/effects/gravity.py: effects.gravity; dmoc/effects/__init__.py: effects."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(file): file for file in FILES}


def inside(module, names):
    """Modules of dmoc that `from module import names` reaches, through the package's own table too."""
    module = module.removeprefix("dmoc").removeprefix(".")
    found = set()
    for name in names:
        longer = f"{module}.{name}".removeprefix(".")
        if longer in MODULES:
            found.add(longer)
        elif module:
            found.add(module)
        elif name in dmoc._homes():
            found.add(dmoc._homes()[name].removeprefix("dmoc."))
    return found


def imported(source):
    """Modules of dmoc that a source imports anywhere, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {
                alias.name.removeprefix("dmoc.") for alias in node.names if alias.name.startswith("dmoc.")
            }
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "write dmoc.folder.name: a relative import hides where it comes from"
            if node.module.split(".")[0] == "dmoc":
                found |= inside(node.module, [alias.name for alias in node.names])
    return found


@pytest.mark.parametrize("module", MODULES)
def test_a_folder_imports_only_folders_below_it(module):
    own = module.split(".")[0]
    assert own in FLOOR, f"give dmoc/{own} its place in LAYERS"
    for other in imported(MODULES[module].read_text()):
        home = other.split(".")[0]
        assert home == own or FLOOR[home] < FLOOR[own], f"{module} imports dmoc.{other}, against the flow"


def test_no_files_import_each_other_in_a_circle():
    """Taking away files that import nothing else of what is left, nothing is left."""
    left = {
        module: imported(file.read_text()) - ({module} if file.name == "__init__.py" else set())
        for module, file in MODULES.items()
    }
    while leaves := [module for module, needs in left.items() if not needs & left.keys()]:
        for module in leaves:
            del left[module]
    assert not left, f"these import each other in a circle: {sorted(left)}"


@pytest.mark.parametrize(
    "source, found",
    [
        ("from dmoc.solver.solve import solve", {"solver.solve"}),
        ("import dmoc.solver.solve as s", {"solver.solve"}),
        ("from dmoc import solve", {"structure.front"}),
        ("from dmoc import solver", {"solver"}),
        ("def f():\n    from dmoc.effects import gravity, Spring", {"effects.gravity", "effects"}),
        ("import numpy\nfrom dmoc import __version__", set()),
    ],
)
def test_every_way_to_import_is_seen(source, found):
    assert imported(source) == found


def test_the_front_loads_nothing_heavy():
    """`dmoc --help` answers before CasADi, SciPy, matplotlib and xarray are loaded."""
    script = (
        "import sys, dmoc, dmoc.cli.app, dmoc.scene.problem_file, dmoc.reports.words\n"
        "print(*sorted({'casadi', 'scipy', 'matplotlib', 'xarray'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


# What a plain solve from the command line loads beside the standard library, and what for.
WHY = {
    "numpy": "arrays",
    "casadi": "the functions, their derivatives, Ipopt",
    "swig_runtime_data": "what the classes of CasADi share",
    "typer": "reads the command line",
    "annotated_doc": "Typer loads it",
    "shellingham": "Typer loads it",
    "rich": "tables and colours",
    "dmoc_problem_free_flyer": "the problem file",
}
# The same of dmoc's own folders, those that the statement and the solve of any transfer need left out.
WHY_FOLDERS = {
    "answers": "the answer in numbers",
    "bodies": "the base of controls, which those of a body that turns are told from",
    "checks": "the checks",
    "diagnosis": "the words for a failure, whether an answer goes the wrong way round; no search for a cause",
    "links": "the base of constraints between bodies, which others are told from",
    "reports": "the tables",
    "results": "the answer; neither files of it nor their format",
    "structure": "`dmoc.solve`, which takes transfers, missions and teams",
}
NEEDED = (
    """cli basics effects configurations parts ends scene motion guess ipopt assembly nlp meshes rungs solver"""
)
UNUSED = """hashlib _hashlib tempfile secrets json dmoc.basics.files dmoc.results.netcdf dmoc.results.table
dmoc.assembly.compiled dmoc.assembly.streamed dmoc.diagnosis.search dmoc.diagnosis.elastic rich.live"""


def test_all_that_a_plain_solve_loads_has_its_reason():
    script = (
        "import atexit, sys\nknown = set(sys.modules)\nfrom dmoc.cli import main\n"
        "atexit.register(lambda: print(*set(sys.modules) - known, file=sys.stderr))\n"
        "main(['solve', 'free_flyer'])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    loaded = set(done.stderr.split())
    foreign = {name.split(".")[0] for name in loaded} - sys.stdlib_module_names
    roots = {name.rstrip("0123456789") for name in foreign}
    assert roots <= {"dmoc", *WHY} and {"numpy", "casadi", "typer", "rich"} <= roots
    folders = {name.split(".")[1] for name in loaded if name.startswith("dmoc.")}
    assert folders == set(NEEDED.split()) | WHY_FOLDERS.keys()
    assert not loaded & set(UNUSED.split())


def test_the_command_line_ends_without_a_search_for_rings():
    """Python's own searches, after every 700 new objects and at its end, take a sixth of a small solve."""
    script = (
        "import atexit, gc\nfrom dmoc.cli import main\n"
        "state = lambda: (gc.get_freeze_count() > 10_000, gc.get_threshold()[0] > 10_000, gc.isenabled())\n"
        "atexit.register(lambda: print(*state()))\n"
        "main(['list'])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "True True True"


TEAMS = ["dmoc.scene.team", "dmoc.legs.together", "dmoc.teams.program", "dmoc.teams.solution"]
HEAVY = ["scipy", "matplotlib", "xarray", "pandas", "h5py", "pydantic"]


@pytest.mark.parametrize(
    "arguments, unused",
    [
        # force-free, coasts, a spiral to an orbit, an orbit that winds, three bodies
        ("free_flyer", [*HEAVY, "dmoc.links.joints", "dmoc.links.along", "dmoc.guess.turning", *TEAMS]),
        ("two_body_fuel", HEAVY),
        ("leo_raise --order 4", HEAVY),
        ("dionysus --json", [*HEAVY, "rich.console"]),
        ("halo_transfer --json", [*HEAVY, "rich.console"]),
    ],
)
def test_a_solve_loads_what_it_uses(arguments, unused):
    """SciPy alone takes longer to load than a small problem to solve."""
    script = (
        "import atexit, sys\nfrom dmoc.cli.app import main\n"
        f"atexit.register(lambda: print(*sorted(set({unused}) & sys.modules.keys()), file=sys.stderr))\n"
        f"main({['solve', *arguments.split()]})"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr.split()) == (0, [])


def test_checking_a_file_loads_no_xarray(tmp_path):
    """It brings pandas along; together they take as long as all the rest of `dmoc check`."""
    script = (
        "import sys\nfrom dmoc.cli.app import main\n"
        "try:\n    main(['solve', 'point_to_point', '--out', 'p.nc', '--quiet'])\nexcept SystemExit: pass\n"
        "try:\n    main(['check', 'p.nc'])\nfinally:\n"
        "    print(*sorted({'xarray', 'pandas', 'dask'} & sys.modules.keys()), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr.split()) == (0, []) and "check" in done.stdout


def test_a_public_name_is_never_hidden_by_a_module_of_that_name():
    """Importing a submodule binds its name on the package, over the function of the same name."""
    import dmoc

    modules = {path.name for path in ROOT.iterdir()}
    assert not modules & set(dmoc.__all__)


def test_every_import_of_the_package_is_a_public_name():
    """They are found by their words, for speed; a parser of Python finds the same."""
    tree = ast.parse((ROOT / "__init__.py").read_text())
    listed = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    homes = {alias.name: node.module for node in listed for alias in node.names}
    assert dmoc._homes() == {name: home for name, home in homes.items() if home.startswith("dmoc.")}
