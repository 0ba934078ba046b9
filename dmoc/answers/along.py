"""The least of something along an answer, between its nodes too, and integrals along it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import wrench_of
from dmoc.results.moments import moving, through_nodes

# Each gap between two nodes is looked at in so many places, then the least place is looked at closely: four
# times in so many places between its neighbours, which comes to a millionth of a gap.
PLACES, CLOSELY, ROUNDS = 8, 33, 4
# Integrals are by Gauss's rule with so many points, exact for polynomials of degree 15 [-].
RULE = np.polynomial.legendre.leggauss(8)
POINTS, WEIGHTS = 0.5 * (RULE[0] + 1), 0.5 * RULE[1]
# A force is looked at in so many places of a piece for where it is largest and least.
LOOKED_AT = np.linspace(0.0, 1.0, 17)


def least(solution: Any, value: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> tuple[float, float]:
    """The least of value(times, coordinates) along the way, and its time [s]."""
    path, begin = solution.path, solution.provenance.start_time

    def at(fractions: np.ndarray) -> tuple[float, int]:
        found = value(begin + path.duration * fractions, moving(solution, fractions)[0])
        return float(found.min()), int(np.argmin(found))

    gaps = len(path.position) - 1
    fractions = np.interp(np.arange(PLACES * gaps + 1) / PLACES, np.arange(gaps + 1), path.fractions)
    for _ in range(ROUNDS + 1):
        lowest, place = at(fractions)
        middle = fractions[place]
        fractions = np.linspace(
            fractions[max(place - 1, 0)], fractions[min(place + 1, len(fractions) - 1)], CLOSELY
        )
    return lowest, begin + path.duration * middle


def swept(solution: Any, center: np.ndarray) -> float:
    """The angle that the direction from a centre sweeps along the way, back and forth added up [rad].

    The integral of |r x v| / r^2, in the plane with its sign: there a way back is taken off.
    """
    path, made = solution.path, solution.path.coordinates
    length = np.diff(path.mesh)
    fractions = path.mesh[:-1, None] + length[:, None] * POINTS
    q, motions = moving(solution, fractions.ravel())
    r, v = q[:, made.places] - center, motions[:, made.speeds]
    if r.shape[1] == 2:
        turning = r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]
    else:
        turning = np.linalg.norm(np.cross(r, v), axis=1)
    rate = (turning / np.sum(r * r, axis=1)).reshape(fractions.shape)
    return float(abs(path.duration * (length @ rate @ WEIGHTS)))


def pushes(solution: Any) -> tuple[float, float, float]:
    """Velocity change [m/s], largest force [N] and largest torque [N m] of the control that is flown.

    The velocity change is the integral of |F| / m. Each piece of the control is cut where the force in it is
    least, where it may turn about, and integrated by Gauss's rule on both sides.
    """
    path, made = solution.path, solution.path.coordinates
    dynamics = Dynamics.of(solution.problem)
    known, rule = flown(dynamics, path), scheme(path.order)
    lengths = np.diff(known.mesh)
    # Where the body is matters to what is fixed to one that turns.
    anywhere = not dynamics.wrench.jac_sparsity(0, 0).nnz()

    def wrench(inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fractions of the duration, and what the actuator does there, at such fractions of the pieces."""
        values = rule.values_at(inside.ravel()).reshape(*inside.shape, -1)
        control = np.einsum("kpj,jkn->kpn", values, known.nodes)
        fractions = np.clip(known.mesh[:-1, None] + lengths[:, None] * inside, 0.0, 1.0)
        places = path.position[:1] if anywhere else moving(solution, fractions.ravel())[0]
        found = wrench_of(dynamics, places, control.reshape(fractions.size, -1))
        return fractions, found.reshape(*fractions.shape, -1)

    looked = wrench(np.broadcast_to(LOOKED_AT, (len(lengths), len(LOOKED_AT))))[1]
    size, torque = (np.linalg.norm(looked[..., mask], axis=2) for mask in (made.speeds, made.rates))
    cut = _least_place(looked[..., made.speeds])[:, None]
    inside = np.hstack([cut * POINTS, cut + (1 - cut) * POINTS])
    weights = np.hstack([cut * WEIGHTS, (1 - cut) * WEIGHTS]) * lengths[:, None]
    fractions, acting = wrench(inside)
    mass = through_nodes(path, path.mass[:, None], fractions.ravel()).reshape(fractions.shape)
    change = path.duration * float(np.sum(weights * np.linalg.norm(acting[..., made.speeds], axis=2) / mass))
    return change, float(size.max(initial=0.0)), float(torque.max(initial=0.0))


def _least_place(force: np.ndarray) -> np.ndarray:
    """Where in each piece a force of shape (pieces, places, axes) is least, on the chords between them."""
    pieces = np.arange(len(force))
    near = np.clip(np.argmin(np.sum(force**2, axis=2), axis=1), 1, len(LOOKED_AT) - 2)
    found, smallest = LOOKED_AT[near], np.full(len(force), np.inf)
    for first in (near - 1, near):
        begin, way = force[pieces, first], force[pieces, first + 1] - force[pieces, first]
        square = np.sum(way * way, axis=1)
        share = np.clip(-np.sum(begin * way, axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
        here = np.sum((begin + share[:, None] * way) ** 2, axis=1)
        better = here < smallest
        found = np.where(better, LOOKED_AT[first] + share * (LOOKED_AT[1] - LOOKED_AT[0]), found)
        smallest = np.where(better, here, smallest)
    return found
