"""Imports flow one way: problem, transcription, solver, solution, then what is judged, shown and saved.

A new module must be added to `MAY_IMPORT` with what it may import, and nothing more. Names in capitals stand
for groups of modules. Imports inside functions count too.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import dmoc

ROOT = Path(dmoc.__file__).parent

GROUPS = {
    "BASICS": "checks docstrings files kept layout lobatto rows",
    "EFFECTS": "effects effects.base effects.gravity effects.atmosphere effects.radiation effects.frames "
    "effects.motion effects.third_body",
    "PARTS": "actuators engines objectives constraints boundary elements orbits",
    "NLP": "problem mechanics mesh assembly formulas blocks guess transcription ipopt",
    "MOTION": "momenta reference simulation stability",
    "ANSWER": "solution results climb refine solver",
    "VERDICT": "case limits optimality verification",
}

MAY_IMPORT = {
    "__init__": "",  # names are imported on first use
    # numbers and words that know nothing of the rest
    "checks": "",
    "docstrings": "",
    "files": "checks",
    "cache": "",
    "compiled": "cache",
    "kept": "cache",
    "layout": "",
    "lobatto": "checks",
    "rows": "",
    "splines": "",
    "adams": "",
    # what acts, what pushes, what is minimised, what is forbidden, where it starts and ends
    "effects.base": "docstrings",
    "effects.gravity": "checks effects.base",
    "effects.motion": "checks effects.base",
    "effects.atmosphere": "checks effects.base effects.motion",
    "effects.radiation": "checks effects.base effects.motion",
    "effects.third_body": "checks effects.base effects.motion",
    "effects.frames": "checks effects.base effects.gravity",
    "effects": "EFFECTS",
    "actuators": "checks rows engines",  # engines: a limited force can be metered, see ALLOWED_CYCLES
    "engines": "actuators checks rows",
    "objectives": "actuators checks",
    "constraints": "checks rows",
    "boundary": "checks effects.motion rows",
    "elements": "rows",
    "orbits": "boundary checks elements rows",
    "problem": "actuators boundary checks constraints effects.base effects.motion objectives rows",
    # the discrete equations, which know nothing of a transfer
    "mechanics": "actuators effects.base kept lobatto",
    "mesh": "lobatto splines",
    "assembly": "compiled",
    # motion forward in time; the guess and the refinement may use it
    "reference": "kept lobatto mechanics mesh",
    "momenta": "kept lobatto mechanics mesh",
    "simulation": "checks kept lobatto mechanics mesh problem",
    "stability": "lobatto mechanics mesh momenta",
    # the way from a problem to a solution
    "spiral": "adams kept splines",
    "coasting": "EFFECTS adams boundary kept mechanics problem spiral",
    "tube": "coasting constraints guess mesh problem",
    "default_path": "coasting mechanics problem",
    "guess": "BASICS coasting default_path constraints mechanics mesh momenta problem",
    "formulas": "BASICS assembly mechanics problem",
    "blocks": "BASICS assembly formulas mesh problem",
    "transcription": "BASICS assembly blocks guess mechanics mesh problem",
    "ipopt": "BASICS mesh problem transcription",
    "solution": "BASICS mesh problem results",  # results: save and load, see ALLOWED_CYCLES
    "results": "BASICS mesh problem solution",
    "relaxation": "BASICS NLP",
    "limit_words": "PARTS problem",
    "diagnose": "BASICS PARTS NLP limit_words relaxation",
    "faults": "BASICS PARTS EFFECTS NLP",
    "climb": "BASICS NLP MOTION solution diagnose faults tube",
    "refine": "BASICS NLP MOTION solution climb",
    "solver": "BASICS NLP MOTION solution climb coasting refine",
    # what is judged: never with the solver's own words
    "case": "BASICS mechanics mesh momenta problem simulation solution",
    "limits": "BASICS case mechanics",
    "optimality": "BASICS NLP case",
    "verification": "BASICS NLP MOTION solution case limits optimality",
    # what is shown: nothing above knows of it
    "library": "docstrings problem",
    "formulation": "ipopt mesh problem",
    "starts": "BASICS NLP MOTION climb coasting constraints solver",
    "influence": "BASICS EFFECTS PARTS NLP MOTION solution",
    "doctor": "cache compiled kept library solver",
    "report_tables": "EFFECTS doctor influence report solution starts",
    "study": "BASICS NLP MOTION ANSWER formulation kept",
    "long_run": "BASICS EFFECTS PARTS mechanics problem",
    "marching": "BASICS EFFECTS PARTS long_run mechanics problem simulation",
    "plot_study": "files plot plot_style study",
    "plot_stability": "long_run marching plot_study plot_style",
    "report_study": "files study",
    "sweep_worker": "BASICS mesh problem solution solver verification library",
    "sweep_plan": "library",
    "sweep_journal": "",
    "sweep_pool": "sweep_worker",
    "sweep_second": "sweep_plan",
    "sweep_loop": "sweep_journal sweep_plan sweep_pool sweep_second sweep_worker",
    "sweep_data": "files sweep_plan",
    "sweeping": "__init__ library sweep_data sweep_journal sweep_loop sweep_plan sweep_pool sweep_worker",
    # what leaves the package
    "export_functions": "BASICS mechanics problem",
    "export_residual": "export_functions momenta",
    "export_numbers": "BASICS problem transcription export_functions",
    "export_solver": "BASICS NLP stability export_functions export_residual export_numbers",
    "export_code": "export_functions export_solver",
    "exporting": "__init__ BASICS NLP solver export_functions export_residual export_solver export_code",
    "plot_style": "BASICS mesh solution",
    "plot_scene": "BASICS EFFECTS PARTS solution plot_style",
    "plot_path": "BASICS PARTS solution plot_scene plot_style",
    "plot_ledger": "BASICS EFFECTS mechanics mesh momenta solution plot_style",
    "plot": "BASICS PARTS solution verification plot_ledger plot_path plot_style",
    "plot_front": "plot_style sweep_data sweep_plan",
    "plot_sweep": "files plot_front plot_style sweep_data",
    "report": "BASICS EFFECTS PARTS NLP MOTION ANSWER VERDICT library",
    "report_json": "solution verification",
    "cli_parts": "__init__ files library plot report report_json report_tables results solution starts "
    "verification",
    "stability_command": "cli_parts long_run marching plot_stability plot_study report report_json",
    "study_command": "cli_parts formulation library plot_study report report_json report_study study",
    "sweep_command": "cli_parts library report sweeping sweep_data sweep_journal sweep_loop sweep_plan",
    "cli": "__init__ BASICS EFFECTS PARTS NLP MOTION ANSWER VERDICT library plot report influence starts "
    "report_tables plot_sweep sweep_data sweep_command exporting cli_parts doctor stability_command "
    "study_command",
}

# one of each pair imports the other inside a function, when it is asked for
ALLOWED_CYCLES = {("actuators", "engines"), ("solution", "results")}

FILES = sorted(ROOT.rglob("*.py"))


def name_of(file):
    """dmoc/effects/gravity.py: effects.gravity; dmoc/effects/__init__.py: effects."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


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
        elif name != "__version__":
            found.add(dmoc._HOME_OF[name].removeprefix("dmoc."))
    return found


def imported(source):
    """Modules of dmoc that a source imports anywhere."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == "dmoc":
                    found.add(alias.name.removeprefix("dmoc").removeprefix(".") or "__init__")
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "write dmoc.name: a relative import hides where it comes from"
            if node.module.split(".")[0] == "dmoc":
                found |= inside(node.module, [alias.name for alias in node.names])
    return found


def allowed(module):
    words = MAY_IMPORT[module].split()
    return {name for word in words for name in GROUPS.get(word, word).split()} - {module}


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_what_the_table_lets_it(module):
    assert module in MAY_IMPORT, f"add dmoc/{module} to MAY_IMPORT, with what it may import"
    beyond = imported(MODULES[module].read_text()) - allowed(module)
    assert not beyond, f"{module} imports {', '.join(sorted(beyond))}, against the flow"


def test_the_table_itself_flows_one_way():
    """Taking away modules that import nothing else of what is left, nothing is left."""
    names = {name for module in MAY_IMPORT for name in allowed(module)}
    assert names <= MAY_IMPORT.keys(), f"not in the table: {names - MAY_IMPORT.keys()}"
    left = {
        module: allowed(module) - {"effects" if module.startswith("effects.") else ""} for module in MAY_IMPORT
    }
    for back, forth in ALLOWED_CYCLES:
        left[back] = left[back] - {forth}
    while leaves := [module for module, needs in left.items() if not needs & left.keys()]:
        for module in leaves:
            del left[module]
    assert not left, f"these import each other in a circle: {sorted(left)}"


@pytest.mark.parametrize(
    "source, found",
    [
        ("from dmoc.solver import solve", {"solver"}),
        ("import dmoc.solver as s", {"solver"}),
        ("from dmoc import solve", {"solver"}),
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
        "import sys, dmoc, dmoc.cli, dmoc.library, dmoc.report\n"
        "print(*sorted({'casadi', 'scipy', 'matplotlib', 'xarray'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


HEAVY = ["scipy", "matplotlib", "xarray", "pandas", "h5py"]


@pytest.mark.parametrize(
    "arguments, unused",
    [
        # force-free, coasts, a spiral to an orbit, an orbit that winds, three bodies
        ("free_flyer", HEAVY),
        ("two_body_fuel", HEAVY),
        ("leo_raise --order 4", HEAVY),
        ("dionysus --json", [*HEAVY, "rich.console"]),
        ("halo_transfer --json", [*HEAVY, "rich.console"]),
    ],
)
def test_a_solve_loads_what_it_uses(arguments, unused):
    """SciPy alone takes longer to load than a small problem to solve."""
    script = (
        "import atexit, sys\nfrom dmoc.cli import main\n"
        f"atexit.register(lambda: print(*sorted(set({unused}) & sys.modules.keys()), file=sys.stderr))\n"
        f"main({['solve', *arguments.split()]})"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr.split()) == (0, [])


def test_checking_a_file_loads_no_xarray(tmp_path):
    """It brings pandas along; together they take as long as all the rest of `dmoc check`."""
    script = (
        "import sys\nfrom dmoc.cli import main\n"
        "try:\n    main(['solve', 'point_to_point', '--out', 'p.nc', '--quiet'])\nexcept SystemExit: pass\n"
        "try:\n    main(['check', 'p.nc'])\nfinally:\n"
        "    print(*sorted({'xarray', 'pandas', 'dask'} & sys.modules.keys()), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr.split()) == (0, []) and "check" in done.stdout


def test_a_public_name_is_never_hidden_by_a_module_of_that_name():
    """Importing a submodule binds its name on the package, over the function of the same name."""
    import dmoc

    modules = {path.stem for path in ROOT.glob("*.py")} | {"effects"}
    assert not modules & set(dmoc.__all__)
