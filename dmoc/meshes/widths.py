"""Over what |F| is rounded at zero, from mesh to mesh."""

from __future__ import annotations

import numpy as np

from dmoc.results.switches import burns_unpaid
from dmoc.scene.problem import TransferProblem

# The rounding of |F| on the coarsest mesh is this part of the largest thrust [-].
WIDEST_ROUNDING = 1e-2
# Where propellant burns that no cost counts it is this part: to burn more is then a gain, and from a narrower
# one Ipopt wanders at the node in which the thrust is reversed. Around an attractor the thrust turns instead:
# over 19 transfers in least time the wide one took 1,893 iterations, the usual one 1,688.
WIDEST_UNPAID = 0.3


def rounding_stages(
    meshes: list[np.ndarray], problem: TransferProblem
) -> list[tuple[np.ndarray, float | None]]:
    """The meshes, each with the rounding of |F| at zero: wide on the coarse ones, as asked for on the last."""
    if (rounding := problem.actuator.smoothing) is None:
        return [(mesh, None) for mesh in meshes]
    reversed_once = burns_unpaid(problem) and problem.attraction.lone is None
    widest = WIDEST_UNPAID if reversed_once else WIDEST_ROUNDING
    count = max(int(np.ceil(np.log10(widest / rounding))), 0)
    widths = [widest * 0.1**i for i in range(count)] + [rounding]
    repeated = [meshes[0]] * (len(widths) - len(meshes)) + meshes
    return list(zip(repeated, widths + [rounding] * (len(meshes) - len(widths)), strict=True))
