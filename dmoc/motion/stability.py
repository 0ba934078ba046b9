"""Growth of the one-step matrix against that of the exact flow, along a path and before a solve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from dmoc.basics.quaternions import angle_between
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.momenta import step_matrices
from dmoc.motion.path import DiscretePath

# A one-step matrix may grow at most this many times as much a step as the exact flow: both are frozen at the
# step and differ by the changes of the linearisation within it.
GROWTH = 1.05
# The same limit where the linearisation is constant, so that both must agree. Just past the limit of order 2,
# at h omega = 2.0001, the growth is 1.02 a step.
GROWTH_CONSTANT = 1.001
# Where the limit is passed at constant linearisation, the whole march decides: it may not grow errors by more
# than this many times as much as the exact flow, which adds nothing to what the other checks allow [-].
GROWTH_IN_ALL = 2.0
# Eigenvalues are found for every step whose h omega may exceed this: below a tenth no scheme is unstable, and
# a mesh of many steps is there almost everywhere.
NEGLIGIBLE = 0.1
# Eigenvalues are found for this many steps with the largest h omega in any case: a report tells h omega.
LOOKED_AT = 200
# A step whose h omega is below this is stable by far at any order: nothing is computed before the solve.
HARMLESS = 0.5


# A guess may turn a body by this angle in a step of each order [rad]: beyond it the scheme has solutions of its
# own that are off by degrees, and Ipopt finds them.
TURN_A_STEP = {2: np.radians(30), 4: np.radians(90), 6: np.radians(90), 8: np.radians(90)}


@dataclass(frozen=True)
class Growth:
    """The growth of errors in one step of a path, and the limit for it.

    `value` is the largest spectral radius of a one-step matrix over that of the exact flow, `frequency` the
    largest h omega, and `constant` says whether the linearisation is the same all along the path.
    """

    value: float
    limit: float
    frequency: float
    constant: bool

    @property
    def ok(self) -> bool:
        return self.value <= self.limit


def growth_along(
    dynamics: Dynamics,
    path: DiscretePath,
    start_time: float,
    velocity: np.ndarray,
    matrices: np.ndarray,
    times: int = 1,
) -> Growth:
    """Growth of the steps of a path, from its `step_matrices` and velocities at the step ends [m/s].

    The eigenvalues of a body that drifts in a turning frame are double with one eigenvector each: a scheme that
    is right splits them by the root of its error, and one of them exceeds 1. What that does to a march of a few
    hundred steps is nothing. So where the linearisation is constant and an eigenvalue is too large, the growth
    a step is that of the product of all matrices over that of the exact flow, of the path `times` over.
    """
    flow, constant = flow_matrices(dynamics, path, start_time, velocity)
    limit = GROWTH_CONSTANT if constant else GROWTH
    if not (np.isfinite(flow).all() and np.isfinite(matrices).all()):
        return Growth(np.inf, limit, np.inf, constant)
    h, fastest = path.duration * np.diff(path.mesh), _rate_bound(flow)
    reach = h * np.maximum(fastest[:-1], fastest[1:])
    chosen = reach > NEGLIGIBLE
    chosen[np.argsort(reach)[-LOOKED_AT:]] = True
    looked_at = np.flatnonzero(chosen)
    rates = np.linalg.eigvals([flow[looked_at], flow[looked_at + 1]])
    exact = np.exp(h[looked_at] * rates.real.max(axis=(0, 2)))
    ours = np.abs(np.linalg.eigvals(matrices[looked_at])).max(axis=1)
    value, frequency = float(np.max(ours / exact)), h[looked_at] * np.abs(rates).max(axis=(0, 2))
    if constant and value > limit:
        whole = np.linalg.matrix_power(reduce(lambda done, step: step @ done, matrices), times)
        grown = np.linalg.norm(whole, 2) / np.linalg.norm(_exponential(times * h.sum() * flow[0]), 2)
        if grown < GROWTH_IN_ALL:
            value = max(1.0, float(grown ** (1 / (times * len(h)))))
            limit = GROWTH_IN_ALL ** (1 / (times * len(h)))
    return Growth(value, limit, float(frequency.max()), constant)


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """exp of a matrix that may have too few eigenvectors: a series for a 2^-k-th of it, squared k times."""
    halvings = max(0, int(np.ceil(np.log2(np.linalg.norm(matrix, 2) or 1.0))) + 4)
    part, term = np.eye(len(matrix)), np.eye(len(matrix))
    for k in range(1, 12):
        term = term @ matrix / (k * 2.0**halvings)
        part = part + term
    return np.linalg.matrix_power(part, 2**halvings)


def _rate_bound(flow: np.ndarray) -> np.ndarray:
    """A bound of the rates [1/s].

    No eigenvalue of [[A, 1], [K, G]] exceeds the larger root of (x - |A|) (x - |G|) = |K|.
    """
    n = flow.shape[1] // 2
    blocks = flow[:, :n, :n], flow[:, n:, :n], flow[:, n:, n:]
    turning, stiffness, damping = (np.linalg.norm(part, axis=(1, 2)) for part in blocks)
    return 0.5 * (turning + damping + np.sqrt((turning - damping) ** 2 + 4 * stiffness))


def flow_matrices(
    dynamics: Dynamics, path: DiscretePath, start_time: float, velocity: np.ndarray
) -> tuple[np.ndarray, bool]:
    """d(q', v')/d(q, v) at the step ends, shape (steps+1, 2 freedom, 2 freedom), and whether it is constant."""
    n, ends = dynamics.freedom, slice(None, None, scheme(path.order).degree)
    function, constant = dynamics.linearised
    times = start_time + path.duration * path.mesh
    stacked = np.array(function(times[None], path.position[ends].T, velocity.T, path.mass[ends][None]))
    return stacked.reshape(2 * n, len(times), 2 * n).transpose(1, 0, 2), constant


def steps_to_turn(path: DiscretePath) -> int:
    """So many equal steps follow the turns of a path: none turns a body by more than its order allows."""
    h = path.duration * np.diff(path.mesh)
    spins = np.array([path.start_velocity, path.goal_velocity])[:, path.coordinates.rates]
    most = np.zeros(len(h))
    for q in path.attitudes:
        turned = angle_between(q[1:], q[:-1]).reshape(len(h), -1).sum(axis=1)
        most = np.maximum(most, np.maximum(turned, h * np.linalg.norm(spins, axis=1).max()))
    return int(np.ceil((most / h).max() * path.duration / TURN_A_STEP[path.order]))


def _refuse_large_turns(guess: DiscretePath) -> None:
    """Refuse a mesh whose steps turn a body too far.

    Raises
    ------
    ValueError
        With the number of steps that is enough.
    """
    steps = len(guess.mesh) - 1
    if guess.attitudes and (enough := steps_to_turn(guess)) > steps:
        most = np.degrees(TURN_A_STEP[guess.order])
        raise ValueError(
            f"{steps} steps of order {guess.order} turn the body by up to {most * enough / steps:.3g} degrees "
            f"each, and no more than {most:.0f} are followed; use at least {enough} steps"
        )


def refuse_unstable(dynamics: Dynamics, guess: DiscretePath, start_time: float, shortest: float) -> None:
    """Refuse a mesh beyond the scheme's stability limit where that is known before the solve.

    It is known where the linearisation does not depend on the state; elsewhere the check of the
    solution tells.

    Raises
    ------
    ValueError
        With h omega, the growth per step and the number of steps that is enough.
    """
    _refuse_large_turns(guess)
    longest = np.diff(guess.mesh).max()
    order, degree = guess.order, guess.order // 2
    nodes = np.linspace(0, len(guess.position) - 1, 2 * degree + 1).round().astype(int)
    # Where the linearisation is constant all steps of one length are alike: two of the longest one stand for
    # all.
    probe = replace(
        guess,
        mesh=np.array([0.0, 0.5, 1.0]),
        duration=2 * longest * shortest,
        position=guess.position[nodes],
        mass=guess.mass[nodes],
        control=np.zeros((2 if guess.hold else len(nodes), guess.control.shape[1])),
    )
    velocity = np.zeros((3, dynamics.freedom))
    flow, constant = flow_matrices(dynamics, probe, start_time, velocity)
    if not constant or longest * shortest * _rate_bound(flow).max() < HARMLESS:
        return
    matrices = step_matrices(dynamics, probe, start_time)
    # The two steps of the probe, as often as steps like the longest one make up the duration.
    times = max(1, int(np.ceil(0.5 / longest)))
    growth = growth_along(dynamics, probe, start_time, velocity, matrices, times)
    if not growth.ok:
        steps = len(guess.mesh) - 1
        enough = int(steps * growth.frequency) + 1
        raise ValueError(
            f"{steps} steps of order {order} are unstable for this scene: h omega = {growth.frequency:.3g}, "
            f"errors grow {growth.value:.3g} times a step; use at least {enough} steps"
        )
