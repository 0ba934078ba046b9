"""Linear feedback along a path, from the factorised optimality conditions of its answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.configurations.coordinates import PLACE
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.mesh import step_nodes
from dmoc.results.solution import Outcome, Solution
from dmoc.sensitivity.flights import Flights
from dmoc.sensitivity.worth import conditions_of

# From this part of the time on the gains stay what they are [-]: to meet a fixed goal they grow without bound.
LAST = 0.9
# A way to come off the path counts as made good where less than this is left of it [-]: at a touch of a zone
# nothing is but rounding.
GONE = 1e-8


def feedback(solution: Any) -> np.ndarray:
    """Gains K of a force F + K (x - x_planned) that answers a state off the path as a new plan would.

    To first order: a prediction for another start says how force and state move with it, U and Phi; what a
    flight that is off by dx at a step end should do is that of the start which leads there, U Phi^-1 dx
    (neighbouring optimal feedback, Bryson and Ho, Applied Optimal Control, 1975, chapter 6). Limits that act go
    on to act. In the last tenth of the time gains stay as they are.

    Parameters
    ----------
    solution : Solution
        A local optimum of a transfer of one body that does not turn, with a start that is fixed.

    Returns
    -------
    array, shape (steps, axes, 2 axes)
        For each step, from position [m] and velocity [m/s] at its begin to the force that is added all through
        it [N].

    Raises
    ------
    ValueError
        If the solution is not such a one, or its conditions do not say how it moves.
    """
    flights = flights_of(solution)
    return gains_of(solution, flights) @ flights.momentum_slopes()


def flights_of(solution: Any) -> Flights:
    """The flights of a solution, or a line that says why there are none."""
    of_kind("solution", solution, Outcome)
    problem = solution.require_problem()
    if not isinstance(solution, Solution):
        raise ValueError(
            "disperse and feedback take the solution of one transfer, not that of a mission or of a team"
        )
    if not solution.optimal:
        raise ValueError(f"flights need a path that can be flown; this solve ended with {solution.status!r}")
    blocks = Dynamics.of(problem).configuration.coordinates.blocks
    if len(blocks) != 1 or blocks[0].kind != PLACE or problem.links:
        raise ValueError(
            "flights with errors are of one body that does not turn; this problem has attitudes, links or more"
        )
    solution.path.refuse_unusable("solution")
    return Flights(problem, solution.path)


def gains_of(solution: Any, flights: Flights) -> np.ndarray:
    """The gains from position and momentum per mass."""
    problem, path = solution.problem, flights.path
    if tuple(problem.actuator.labels(problem.dimension))[: flights.axes] != ("x", "y", "z")[: flights.axes]:
        raise ValueError(
            f"feedback needs an actuator whose controls are a force; got {problem.actuator.words()}"
        )
    moved, mean = _answers(solution, flights)
    _, along, _, pushed = flights.linear
    # Momenta count in lengths over the duration.
    size = np.repeat([1.0, path.duration], flights.axes)
    gains, n = np.zeros((flights.steps, flights.axes, 2 * flights.axes)), flights.axes
    phi = flights.begin_slopes[: 2 * n, : 2 * n]
    for k in range(flights.steps):
        if k and path.mesh[k] > LAST:
            gains[k] = gains[k - 1]
            continue
        gains[k] = mean[k] / size @ np.linalg.pinv(size[:, None] * phi / size, rcond=GONE) * size
        phi = along[k, : 2 * n, : 2 * n] @ phi + pushed[k, : 2 * n] @ moved[k]
    return gains


def _answers(solution: Any, flights: Flights) -> tuple[np.ndarray, np.ndarray]:
    """How the forces of each step, and their mean, move with position and velocity at the start.

    Of shapes (steps, forces x axes, 2 axes) and (steps, axes, 2 axes).
    """
    made = conditions_of(solution)
    optimum, n, path = made.optimum, flights.axes, flights.path
    sizes = np.cumsum([0, *(one.value.size for one in optimum.numbers.kept)])
    places = {
        one.name: range(first, first + one.value.size)
        for one, first in zip(optimum.numbers.kept, sizes, strict=False)
    }
    wanted = [place for name in ("start_position", "start_velocity") for place in places.get(name, ())]
    known = [one for one in optimum.numbers.kept if one.name in ("start_position", "start_velocity")]
    if len(wanted) != 2 * n or any(np.isnan(one.value).any() for one in known):
        raise ValueError(
            "feedback needs a start whose position and velocity are fixed numbers, as those of State"
        )
    changes = np.zeros((sizes[-1], 2 * n))
    changes[wanted, np.arange(2 * n)] = 1.0
    tangent, group = made.tangent(changes), optimum.program.columns["force"]
    found = []
    dynamics, rule = Dynamics.of(solution.problem), flights.rule
    at = step_nodes(flights.steps, rule)
    for column in tangent.x.T:
        # The force is linear in the controls.
        force = force_of(dynamics, replace(path, control=group.of(column * optimum.column_scales)))
        found.append(force[None] if path.hold else force[at])
    each = np.moveaxis(np.stack(found), 0, -1)
    mean = each[0] if path.hold else np.einsum("j,jknm->knm", rule.weights, each)
    return each.transpose(1, 0, 2, 3).reshape(flights.steps, -1, 2 * n), mean
