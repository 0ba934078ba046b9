"""A transfer problem and a mesh become one sparse NLP: units, names, bounds, and the way back."""

from __future__ import annotations

from dataclasses import astuple, replace
from typing import Any

import numpy as np

from dmoc.assembly.blocks import Assembly, Block, Scaling
from dmoc.assembly.symbolic import assemble
from dmoc.basics.arguments import entries, flag, number, of_kind, short, whole
from dmoc.basics.memory import Shelf
from dmoc.guess.chart import Chart
from dmoc.guess.starting import starting_guess
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Stencils
from dmoc.nlp.placement import Placement
from dmoc.nlp.solving import NLP
from dmoc.nlp.stencils import stencils_of
from dmoc.nlp.units import Units, units_of
from dmoc.scene.problem import TransferProblem

# At most this many NLPs are held, to serve again for problems of the same structure, mesh and units, and so
# many of their functions, which serve on any mesh of as many steps and in any units.
MOST_HELD = 16
# An NLP of more nodes than this is not held: 16 smaller ones together take less than 100 MB.
MOST_HELD_NODES = 2000
# From so many nodes on no graph is built for a solve. With fewer, a graph is evaluated faster by more than it
# takes to build, if there are many iterations.
LEAST_STREAMED = 20_000
# The NLPs that are held in this process, by structure, mesh, units and kind of control.
_NLPS = Shelf(MOST_HELD)
# Their functions, by structure and number of steps.
_ASSEMBLIES = Shelf(MOST_HELD)


def transcribe(
    problem: TransferProblem,
    steps: int | None = None,
    order: int = 2,
    hold: bool = False,
    mesh: np.ndarray | None = None,
    guess: Any = None,
) -> NLP:
    """The NLP of a problem on a mesh.

    Parameters
    ----------
    steps : int
        Number of equal steps, at least 2; or give `mesh`.
    order : int
        2, 4, 6 or 8.
    hold : bool
        Forces constant over each step instead of one at each node.
    mesh : sequence of float
        Step ends as increasing fractions 0..1 of the duration.
    guess
        Path that fixes the units, see `TransferProblem`; the problem's own if not given.

    Raises
    ------
    ValueError
        If the mesh has fewer than 2 steps or does not increase from 0 to 1.
    """
    of_kind("problem", problem, TransferProblem)
    start = starting_guess(problem, check_mesh(steps, mesh), order, flag("hold", hold), guess)
    return transcribe_onto(problem, start, units_of(problem, start))


def transcribe_onto(
    problem: TransferProblem,
    guess: DiscretePath,
    units: Units,
    compiled: bool = False,
    chart: Chart | None = None,
    streamed: bool = False,
) -> NLP:
    """The NLP on the mesh, order and kind of control of a guess.

    If `streamed` a large one has functions with values only, without a graph: that takes a third of the time to
    build and half the memory.

    An NLP that is held serves again for a problem of the same structure, on the same mesh and in the same
    units; not one with a `chart`, whose unknowns are counted from the path that it was made for.
    """
    stencils = stencils_of(problem, guess.order, guess.hold, chart is not None)
    mesh, sizes = (
        guess.mesh.tobytes(),
        np.concatenate([*astuple(units)[:-1], units.origin], axis=None).tobytes(),
    )
    dynamics = Dynamics.of(problem)
    key = (id(stencils), mesh, sizes, guess.hold, compiled)

    nodes = len(guess.position)
    small, streamed = nodes <= MOST_HELD_NODES, streamed and nodes >= LEAST_STREAMED

    def make() -> tuple[Stencils, NLP]:
        # The stencils are held with the NLP: once they were gone, another object might get their identity.
        return stencils, _transcribed(problem, stencils, guess, units, compiled, chart, small, streamed)

    _, nlp = _NLPS.get(key, make) if small and chart is None else make()
    return replace(nlp, problem=problem, dynamics=dynamics)


def _transcribed(
    problem: TransferProblem,
    stencils: Stencils,
    guess: DiscretePath,
    units: Units,
    compiled: bool,
    chart: Chart | None,
    small: bool,
    streamed: bool,
) -> NLP:
    rule = scheme(guess.order)
    placed = Placement(problem, stencils, rule, guess.hold, guess.mesh, units, chart)
    columns, rows = placed.columns, placed.rows
    scaling = Scaling.of(placed.blocks, columns.scales(), rows.scales(), 1 / units.cost)

    def make() -> tuple[Stencils, Assembly]:
        given = placed.blocks, scaling, stencils.parameter_count, compiled
        if streamed:
            from dmoc.assembly.streamed import assemble_streamed

            return stencils, assemble_streamed(*given)
        return stencils, assemble(*given, small)

    _, assembly = _ASSEMBLIES.get((id(stencils), placed.steps, compiled), make) if small else make()
    parts = units, columns, rows, placed.row_bounds, assembly, assembly.numbers(scaling)
    return NLP(problem, Dynamics.of(problem), rule, guess.hold, guess.mesh, *parts, chart=chart)


def unassembled(problem: TransferProblem, path: DiscretePath, units: Units) -> tuple[NLP, list[Block]]:
    """The NLP on the mesh of a path, and its blocks, without the sparse derivatives that a solve needs."""
    rule, stencils = scheme(path.order), stencils_of(problem, path.order, path.hold)
    placed = Placement(problem, stencils, rule, path.hold, path.mesh, units)
    derivatives: Any = None
    layouts = placed.columns, placed.rows, placed.row_bounds
    parts = units, *layouts, derivatives, np.empty(0)
    return NLP(problem, Dynamics.of(problem), rule, path.hold, path.mesh, *parts), placed.blocks


def check_mesh(steps: int | None, mesh: Any = None) -> np.ndarray:
    """Step ends as fractions, from a number of steps or as given."""
    if mesh is None:
        return uniform_mesh(whole("steps", steps, least=2))
    ends = np.array([number("mesh", end, "-") for end in entries(mesh) or ()])
    if ends.ndim != 1 or len(ends) < 3 or ends[0] != 0 or ends[-1] != 1 or not (np.diff(ends) > 0).all():
        raise ValueError(f"mesh must be at least 3 increasing fractions from 0 to 1; got {short(mesh)}")
    return ends
