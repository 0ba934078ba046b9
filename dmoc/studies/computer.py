"""What this computer has: versions, linear solvers that Ipopt can load, a C compiler, and how fast it is."""

from __future__ import annotations

import platform
import re
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from statistics import median

from dmoc.assembly.compiled import compiler, folder, usable_cores
from dmoc.basics.memory import forget
from dmoc.basics.records import dataclass
from dmoc.scene.problem_file import load_problem
from dmoc.solver.solve import solve

PACKAGES = ("dmoc", "casadi", "numpy", "scipy", "matplotlib", "xarray", "h5netcdf", "h5py", "typer", "rich")
LINEAR_SOLVERS = ("mumps", "ma27", "ma57", "ma77", "ma86", "ma97", "pardiso", "pardisomkl", "spral", "wsmp")
BENCHMARK, MESHES = "orbit_raise", ((2, 400), (8, 25))

# A library that fails to load writes to the terminal, and a broken one may end its process: try it in another.
PROBE = """
import sys
import casadi as ca
x = ca.MX.sym("x", 2)
nlp = {"x": x, "f": ca.sumsqr(x), "g": x[0] + x[1]}
solver = ca.nlpsol("probe", "ipopt", nlp, {"ipopt.linear_solver": sys.argv[1], "print_time": False})
found = solver(x0=[3, 0], lbg=1, ubg=1)["x"]
sys.exit(not (solver.stats()["success"] and float(ca.norm_inf(found - 0.5)) < 1e-6))
"""


@dataclass(frozen=True)
class Linear:
    """A linear solver that was tried in Ipopt, and what Ipopt calls it and itself."""

    name: str
    works: bool
    full_name: str = ""
    ipopt: str = ""


@dataclass(frozen=True)
class Timing:
    """Medians of several solves on one mesh [s]."""

    order: int
    steps: int
    build_s: float
    solve_s: float
    runs: int


@dataclass(frozen=True)
class Findings:
    """What `examine` found; `compiler` and `folder`, that of machine code, are None where there is none."""

    versions: dict[str, str]
    system: str
    cores: int
    compiler: str | None
    folder: str | None
    linear_solvers: tuple[Linear, ...]
    timings: tuple[Timing, ...]


def examine(seconds: float = 5.0) -> Findings:
    """Look at this computer; the benchmark takes about `seconds` [s]."""
    solvers = tuple(try_linear_solver(name) for name in LINEAR_SOLVERS)
    known = {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES}
    known["ipopt"] = next((solver.ipopt for solver in solvers if solver.ipopt), "not known")
    share = seconds / len(MESHES)
    return Findings(
        versions=known,
        system=f"{platform.system()} {platform.machine()}",
        cores=usable_cores(),
        compiler=compiler(),
        folder=folder(),
        linear_solvers=solvers,
        timings=tuple(benchmark(order, steps, share) for order, steps in MESHES) if seconds else (),
    )


def try_linear_solver(name: str) -> Linear:
    """Solve a tiny problem with a linear solver, in a process of its own."""
    command = [sys.executable, "-c", PROBE, name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=30)
    except subprocess.TimeoutExpired:
        return Linear(name, False)
    told = re.search(r"Ipopt version (\S+?), running with linear solver (.+?)\.?$", done.stdout, re.MULTILINE)
    if done.returncode or not told:
        return Linear(name, False)
    return Linear(name, True, told[2], told[1])


def benchmark(order: int, steps: int, seconds: float) -> Timing:
    """Solve one problem on one mesh again and again for so long [s], three times at least."""
    case = load_problem(BENCHMARK).make()
    found: list[tuple[float, float]] = []
    end = time.monotonic() + seconds
    while len(found) < 3 or time.monotonic() < end:
        forget()
        solution = solve(case, order=order, steps=steps).raise_for_status()
        found.append((solution.build_s, solution.solve_s))
    build, spent = zip(*found, strict=True)
    return Timing(order, steps, median(build), median(spent), len(found))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
