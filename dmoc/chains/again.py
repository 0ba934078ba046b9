"""Kernels and sparse functions of missions, made once in this process for all that have the same."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import casadi as ca

from dmoc.assembly.blocks import Assembly, Block, Scaling
from dmoc.assembly.kernel import Kernel, kernel
from dmoc.assembly.symbolic import assemble
from dmoc.basics.memory import Shelf, remembered
from dmoc.nlp.transcription import MOST_HELD

# The functions that are held, by the kernels of the blocks and the places that they are mapped to.
_ASSEMBLIES = Shelf(MOST_HELD)


def kernel_again(
    name: str, variables: ca.SX, data: ca.SX, parameters: ca.SX, rows: ca.SX, cost: ca.SX
) -> Kernel:
    """As `kernel`; of the same expressions the one of before: to compare them takes a tenth of the time."""
    parts = variables, data, parameters, rows, cost
    written = ca.Function(name, list(parts[:3]), list(parts[3:])).serialize()
    return remembered(lambda: kernel(name, *parts), "kernel", name, written)


def assembled_again(
    blocks: Sequence[Block], scaling: Scaling, parameter_count: int, compiled: bool
) -> Assembly:
    """The functions of blocks, with the scaling as parameters; of the same blocks those of before."""
    places = hashlib.blake2b()
    for block in blocks:
        places.update(block.columns.tobytes())
        places.update(block.targets.tobytes())
    shapes = tuple((*block.columns.shape, *block.targets.shape, block.first) for block in blocks)
    kernels = tuple(block.kernel for block in blocks)
    sizes = len(scaling.columns), len(scaling.rows), parameter_count, compiled
    key = tuple(map(id, kernels)), shapes, sizes, places.hexdigest()

    def make() -> tuple[tuple[Kernel, ...], Assembly]:
        # The kernels are held with it: once they were gone, others might get their addresses.
        return kernels, assemble(blocks, scaling, parameter_count, compiled, parametric=True)

    return _ASSEMBLIES.get(key, make)[1]
