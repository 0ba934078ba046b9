"""A transfer as another method writes it down in CasADi, and one solve of it."""

from __future__ import annotations

import re
import runpy
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.configurations.of_problem import configuration_of
from dmoc.ipopt.options import settings_for, tolerance
from dmoc.ipopt.run import make_solver, status_of
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Formulation:
    """A transfer as some other method writes it in CasADi: an NLP, and what its unknowns mean.

    A method is a function of (problem, steps) that returns one of these. Its duties are:

    1. `x`, `f`, `g`, `bounds` and `row_bounds` state the whole transfer: ends, limits, objective and
       dynamics. Nothing is added to them.
    2. Unknowns and rows are scaled by the method itself; `objective_unit` takes `f` back to SI units.
    3. `guess` is as good a start as the method can make, since it is part of what is compared.
    4. `ends` and `controls` are expressions in `x`, in SI units, whatever the unknowns are.
    5. A transfer that the method cannot state raises ValueError with a remedy.

    Derivatives, the choice of a solver, its options and tolerance, timing, and the error at the goal are
    none of its business: they are the same for all methods.

    Attributes
    ----------
    x, f, g : MX
        Unknowns, objective and rows, best scaled to be near 1.
    guess : array
        Where to start.
    bounds, row_bounds : (array, array)
        Lower and upper bounds of the unknowns and of the rows.
    objective_unit : float
        The objective in its own unit is this times f.
    ends : MX, shape (2 axes, 2)
        Position [m] and velocity [m/s] at the start and at the goal; of a body that turns its coordinates and
        its independent velocities, of shape (coordinates + velocities, 2).
    controls : MX, shape (axes, count)
        Forces [N], or the controls of the actuator, at `points` of every step, step after step; where the
        points include both ends of a step, neighbours share theirs.
    points : tuple of float
        Fractions of a step between 0 and 1, through which the force is a polynomial.
    """

    x: ca.MX
    f: ca.MX
    g: ca.MX
    guess: np.ndarray
    bounds: tuple[np.ndarray, np.ndarray]
    row_bounds: tuple[np.ndarray, np.ndarray]
    objective_unit: float
    ends: ca.MX
    controls: ca.MX
    points: tuple[float, ...]


Method = Callable[[TransferProblem, int], Formulation]


def load_methods(path: Path) -> dict[str, Method]:
    """Methods by name from a Python file, which is run: its dictionary METHODS.

    Raises
    ------
    ValueError
        If the file is not there, fails, or has no such dictionary.
    """
    if not path.is_file():
        raise ValueError(f"there is no file {path} with other methods; scripts/alternatives.py is one")
    try:
        found = runpy.run_path(str(path)).get("METHODS")
    except Exception as error:
        raise ValueError(f"{path}: {type(error).__name__}: {error}") from error
    if not isinstance(found, dict) or not found or not all(map(callable, found.values())):
        raise ValueError(
            f"{path} has no dictionary METHODS of functions (problem, steps) that give a dmoc.Formulation"
        )
    return found


def formulated(name: str, method: Method, problem: TransferProblem, steps: int) -> Formulation:
    """What a method makes of a problem; ValueError, with its name, if it fails."""
    try:
        made = method(problem, steps)
    except Exception as error:
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        raise ValueError(f"method {name!r}: {kind}{error}") from error
    if not isinstance(made, Formulation):
        raise ValueError(f"method {name!r} must return a dmoc.Formulation; it returned {type(made).__name__}")
    return made


def as_assembly(made: Formulation) -> Any:
    """A formulation in the form that `make_solver` takes; without derivatives CasADi makes its own."""
    derivatives = dict.fromkeys(("jacobian", "hessian", "gradient"))
    return SimpleNamespace(x=made.x, p=ca.MX.sym("p", 0), f=made.f, g=made.g, **derivatives)


def flown_path(problem: TransferProblem, made: Formulation, steps: int, x: ca.DM) -> tuple[DiscretePath, int]:
    """The ends and controls that a method found as a path, and its number of nodes.

    The independent integrator reads such a path: its controls are polynomials over each step.
    """
    ends, forces = (part.full() for part in ca.Function("read", [made.x], [made.ends, made.controls])(x))
    body, points = configuration_of(problem), np.array(made.points)
    n = body.size
    # where a step's last point is the first one of the next step, the two share one column of `controls`
    shared = int(points[0] == 0 and points[-1] == 1)
    at = np.arange(len(points))[:, None] + (len(points) - shared) * np.arange(steps)
    # the integrator takes a held control of any size; here it is the coefficients of the force's polynomial
    powers = np.linalg.inv(np.vander(points, increasing=True))
    control = np.einsum("pj,njk->kpn", powers, forces[:, at]).reshape(steps, -1)
    position = np.linspace(ends[:n, 0], ends[:n, 1], steps + 1)
    mass = np.full(steps + 1, problem.mass)
    duration, velocities = problem.duration_bounds[0], (ends[n:, 0], ends[n:, 1])
    parts = uniform_mesh(steps), 2, True, duration, position, control, mass, *velocities
    return DiscretePath(*parts, made_of=body.coordinates), forces.shape[1]


@dataclass(frozen=True)
class Run:
    """One solve, timed once. Its path has the goal that it believes to reach."""

    path: DiscretePath | None
    nodes: int
    objective: float
    status: str
    iterations: int
    calls: int
    seconds: float
    solve_s: float


def solve_other(problem: TransferProblem, name: str, method: Method, steps: int) -> Run:
    """A solve by another method, with the options of dmoc's own, and a tolerance that is no tighter."""
    enough = {"ipopt.tol": tolerance(uniform_mesh(steps), 1, limited=True)}

    def solve_with(options: dict[str, Any]) -> tuple[Formulation, dict, dict, list[float]]:
        times = [time.perf_counter()]
        made = formulated(name, method, problem, steps)
        degree = max(len(made.points) - 1, 1)
        settings = settings_for(problem, uniform_mesh(steps), degree)
        solver = make_solver(as_assembly(made), settings, enough | options)
        (lbx, ubx), (lbg, ubg) = made.bounds, made.row_bounds
        x0 = np.clip(made.guess, lbx, ubx)
        times.append(time.perf_counter())
        result = solver(x0=x0, lbx=lbx, ubx=ubx, lbg=lbg, ubg=ubg)
        return made, result, solver.stats(), [*times, time.perf_counter()]

    (made, result, stats, (begun, ready, done)), calls = counted(solve_with)
    path, nodes = flown_path(problem, made, steps, result["x"])
    objective, status = made.objective_unit * float(result["f"]), status_of(stats["return_status"])
    return Run(path, nodes, objective, status, int(stats["iter_count"]), calls, done - begun, done - ready)


def counted(solve_with: Callable[[dict[str, Any]], Any]) -> tuple[Any, int]:
    """What a solve gives, and how many evaluations it took on all meshes, as Ipopt prints after each."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ipopt.txt"
        print_to = {"output_file": str(file), "file_print_level": 3, "file_append": "yes"}
        found = solve_with({f"ipopt.{name}": value for name, value in print_to.items()})
        text = file.read_text() if file.exists() else ""
    return found, sum(map(int, re.findall(r"^Number of .* evaluations +=\s*(\d+)$", text, re.MULTILINE)))
