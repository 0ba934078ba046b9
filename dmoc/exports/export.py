"""Take the functions of a problem elsewhere: CasADi files, C code, and a manifest that says what is what."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca

from dmoc.basics.arguments import flag, of_kind
from dmoc.basics.files import as_path, json_object, sealed_object, unsealed_object
from dmoc.configurations.coordinates import PLACE
from dmoc.exports.code import write_code, write_mission_code
from dmoc.exports.manifest import EXPORT_FORMAT, EXPORT_VERSION, about_mission, about_transfer, manifest, plain
from dmoc.exports.readme import mission_readme, readme
from dmoc.meshes.choices import DEFAULT_STEPS
from dmoc.motion.lobatto import scheme
from dmoc.planners import functions as export_functions
from dmoc.planners import planner as export_solver
from dmoc.planners import residual as export_residual
from dmoc.planners import sensitive
from dmoc.planners.mission import MissionPlanner
from dmoc.planners.phased import PhasedPlanner
from dmoc.planners.planner import Planner
from dmoc.planners.team import TeamPlanner
from dmoc.planners.terms import Exported
from dmoc.planners.whole import coded, mission_functions
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem
from dmoc.scene.team import Team
from dmoc.sensitivity.exported import prediction
from dmoc.solver.solve import check_numerics

# The remedy that is told where a folder holds what an export must not take the place of.
MOVE = "name a new folder, or move what is there"


def export(
    problem: TransferProblem | Mission | Team,
    folder: str | os.PathLike,
    order: int | None = None,
    steps: int | None = None,
    hold: bool = False,
    c: bool = True,
    guess: Any = None,
    options: dict[str, Any] | None = None,
) -> list[Path]:
    """Write the functions of a problem to a folder: all arguments named and in SI units.

    `step` (the one-step map), `rollout` (all steps), `residual` (the discrete Euler-Lagrange equations of a
    path [N]), `residual_jacobian`, `cost`, `solver` and `warm_solver` (Ipopt with states, mass, limits, times
    and a guess as inputs) and `nominal` (the problem's own inputs of the solver) become `.casadi` files that
    CasADi alone loads, in Python, C++, MATLAB or Octave; step, rollout and residual become C code too.
    `manifest.json` has shape, unit and meaning of every argument, the checksum of every file and its own.

    An `nlpsol` has no status output. The solver's outputs `largest_residual` [N] and `violation` [-] say
    whether a plan can be flown; whether it is an optimum, `solver.stats()["return_status"]` says, also after
    loading. Where it fails, `residual` [N] and `violations_...` [-] say: the defect at every node, and each
    bound and row in the shape of its multipliers.

    `worth` gives the derivatives of the objective by all numbers, from a plan and its multipliers as the solver
    gives them; `covariance`, of a body that does not turn, how errors at the start and of forces spread along a
    plan; and `predict`, where the guess is an optimal Solution on the same mesh, the plan for other numbers to
    first order. An `Unknown` of an effect is an argument of them, of the solver and of the cost.

    A body that turns has an `attitude` (a unit quaternion from body axes to space axes, scalar first) and a
    `rate` [rad/s] in body axes beside position and velocity; where its attitude is all there is, no argument is
    a place. Its residual is a force [N], a torque in body axes [N m] and q.q - 1, with a largest of each;
    `largest_turn` [rad] between neighbouring nodes is far below pi/2 in a plan that is right. The solver takes
    either sign of an attitude. What is no argument, such as the inertia, is fixed.

    Of a mission each leg has its `step` and `rollout`, named with the leg behind; `residual`, `cost` and the
    solvers are those of the whole, with the unknowns of all legs, impulses and flybys as arguments by name. It
    stands on the meshes of `guess`, or on those from which a solve begins. Best is a solution: the exported
    solver has no rounding of impulses that falls step by step, and from a poor guess it may fail. Of a team it
    is the same with a body in the place of each leg; the distances that bodies keep are fixed.

    A `.casadi` file is code: CasADi runs what it holds, and solver plug-ins that it names. Load one only if
    you trust where it comes from. dmoc itself never loads one.

    Parameters
    ----------
    problem : TransferProblem, Mission or Team
    folder : path
        Made by this call; if it is there, it must be empty or hold an earlier export as it was written and
        nothing else.
        It is written whole or not at all.
    order : int, optional
        2, 4, 6 or 8; 2 if not given, of a mission as it is solved or as its guess is.
    steps : int, optional
        Equal steps, at least 2; 400, 100, 50, 32 at orders 2, 4, 6, 8 if not given. Of a mission the steps of
        each leg, equal or as the guess has them.
    hold : bool
        Forces constant over each step.
    c : bool
        Whether to write C code.
    guess : optional
        Where the solver starts from, as in `solve`. A Solution is best: `nominal` then holds a plan that
        `warm_solver` can go on from at once. The exported solver has one mesh, no ladder of coarser ones.
    options : dict, optional
        CasADi `nlpsol` options of both solvers, for example {"ipopt.max_wall_time": 0.5}, or where an
        objective that is 1e-6 of itself too large is good enough {"ipopt.tol": 1e-8}: a warm start of twelve
        thrusters then takes a quarter less time. With {"jit": True, "compiler": "shell"} CasADi compiles all
        functions of the NLP by gcc whenever a solver is loaded, in seconds; a warm start of twelve thrusters at
        order 4 with 40 steps then takes 0.65 of the time.

    Returns
    -------
    list of Path
        The files, the manifest first.

    Raises
    ------
    ValueError
        If a number has no meaning, the scheme is unstable with these steps, or the folder holds anything else.
    """
    problem = getattr(problem, "alone", None) or problem
    kind: Any = Mission if hasattr(problem, "joints") else TransferProblem
    kind = Team if hasattr(problem, "together") else kind
    of_kind("problem", problem, kind)
    if problem.objective.learns:
        raise ValueError("a plan with Information has no exported functions; export it with another objective")
    hold, c = flag("hold", hold), flag("c", c)
    target = _checked_folder(as_path(folder))
    of_team = PhasedPlanner if getattr(problem, "phased", False) else TeamPlanner
    made = {Mission: partial(_of_mission, MissionPlanner), Team: partial(_of_mission, of_team)}
    made_of = made.get(kind, _of_transfer)
    functions, count, about, words, write = made_of(problem, (order, steps, hold, guess), options, c)
    with _whole_folder(target) as work:
        for exported in functions:
            _save(exported.function, work / f"{exported.function.name()}.casadi")
        if c:
            (work / "c").mkdir()
            write(functions[:count], work / "c")
        (work / "README.md").write_text(words)
        files = sorted(path.relative_to(work) for path in work.rglob("*") if path.is_file())
        sums = {file.as_posix(): hashlib.sha256((work / file).read_bytes()).hexdigest() for file in files}
        entries = json.loads(json.dumps(manifest(about, functions, count * c, sums), default=plain))
        (work / "manifest.json").write_text(json.dumps(sealed_object(entries), indent=1) + "\n")
    return [target / "manifest.json", *(target / file for file in files)]


class _Contents(NamedTuple):
    """Functions, how many of them can be C code, what the manifest and the readme say, and how C is written."""

    functions: list[Exported]
    in_c: int
    about: dict[str, Any]
    words: str
    write: Callable[[Sequence[Exported], Path], None]


def _of_transfer(problem: Any, numerics: tuple, options: dict[str, Any] | None, c: bool) -> _Contents:
    order, steps, hold, guess = numerics
    order = 2 if order is None else order
    steps = DEFAULT_STEPS[scheme(order).order] if steps is None else steps
    planner = Planner.of(problem, order, steps, hold, guess)
    words, write = readme(planner.scene, c), partial(write_code, planner)
    return _Contents(functions_of(planner, options, guess), 3, about_transfer(planner), words, write)


def _of_mission(
    kind: type[MissionPlanner], problem: Any, numerics: tuple, options: dict[str, Any] | None, c: bool
) -> _Contents:
    order, steps, hold, _ = numerics
    check_numerics(order, steps, None, hold, options, None, None)
    planner = kind.of(problem, *numerics)
    functions, write = mission_functions(planner, options), partial(write_mission_code, planner)
    return _Contents(functions, coded(planner), about_mission(planner), mission_readme(planner, c), write)


def functions_of(planner: Planner, options: dict[str, Any] | None = None, guess: Any = None) -> list[Exported]:
    """All functions of an export; the first three can become C code."""
    scene = planner.scene
    return [
        export_functions.one_step(scene),
        export_functions.all_steps(scene),
        export_residual.residual(scene),
        export_residual.residual_jacobian(scene),
        export_solver.cost(planner),
        export_solver.solver(planner, options, warm=False),
        export_solver.solver(planner, options, warm=True),
        export_solver.nominal(planner),
        *_near(planner, guess),
    ]


def _near(planner: Planner, guess: Any) -> list[Exported]:
    """What an answer is worth, how errors spread along it, and at a solution the plan for other numbers."""
    scene, found = planner.scene, [sensitive.worth(planner)]
    blocks = scene.dynamics.configuration.coordinates.blocks
    if len(blocks) == 1 and blocks[0].kind == PLACE and not scene.dynamics.configuration.conditions:
        found.append(sensitive.covariance(scene))
    if (
        getattr(guess, "optimal", False)
        and guess.problem is not None
        and guess.path.mesh.size == scene.steps + 1
    ):
        with suppress(ValueError):
            # A degenerate answer does not say how it moves.
            found.append(prediction(planner, guess))
    return found


def _save(function: ca.Function, file: Path) -> None:
    """What `Function.save` writes: that one does not say when the disk is full."""
    content = ca.StringSerializer()
    content.pack(function)
    file.write_bytes(content.encode().encode())


def _checked_folder(folder: Path) -> Path:
    """The folder, or ValueError if an export must not take its place."""
    target = folder.resolve()
    if not target.parent.is_dir():
        raise ValueError(f"cannot export to {folder}: there is no folder {target.parent}; create it first")
    if not target.exists():
        return target
    if not target.is_dir():
        raise ValueError(f"cannot export to {folder}: it is a file; name a new folder")
    if target == Path.cwd():
        raise ValueError(f"cannot export to {folder}: it is the working folder; name a new folder in it")
    there = {path.relative_to(target).as_posix() for path in target.rglob("*") if not path.is_dir()}
    before = _exported_before(target, there)
    if foreign := sorted(there - before.keys() - {"manifest.json"}):
        raise ValueError(
            f"cannot export to {folder}: it holds what no earlier export wrote, such as {foreign[0]}; {MOVE}"
        )
    for name, checksum in before.items():
        if name in there and hashlib.sha256((target / name).read_bytes()).hexdigest() != checksum:
            raise ValueError(f"cannot export to {folder}: {name} was changed since it was exported; {MOVE}")
    return target


def _exported_before(folder: Path, there: set[str]) -> dict[str, str]:
    """The files of an earlier export in a folder, by checksum; ValueError if the manifest is damaged."""
    if "manifest.json" not in there:
        return {}
    text = (folder / "manifest.json").read_bytes()
    listed = json_object(text) or {}
    version, files = listed.get("format_version"), listed.get("files")
    whole = version == 1 or unsealed_object(text) is not None
    if listed.get("format") != EXPORT_FORMAT or not isinstance(files, dict):
        raise ValueError(f"cannot export to {folder}: its manifest.json is no manifest of an export; {MOVE}")
    if isinstance(version, int) and version > EXPORT_VERSION and whole:
        raise ValueError(
            f"cannot export to {folder}: the export there comes from a newer dmoc (format {version}, "
            f"this one reads up to {EXPORT_VERSION}); {MOVE}"
        )
    if not whole:
        raise ValueError(
            f"cannot export to {folder}: its manifest.json is damaged, its checksum does not hold; {MOVE}"
        )
    return files


@contextmanager
def _whole_folder(target: Path) -> Iterator[Path]:
    """A temporary folder beside `target`, which takes its place once the block has ended without an error."""
    work = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    old = work.with_name(f"{work.name}.old")
    try:
        work.mkdir()
        yield work
        if target.exists():
            os.replace(target, old)
        try:
            os.replace(work, target)
        except BaseException:
            if old.exists():
                os.replace(old, target)
            raise
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        raise OSError(f"cannot export to {target}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
