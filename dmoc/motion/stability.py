"""Growth of the one-step matrix against that of the exact flow, along a path and before a solve."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from itertools import pairwise

import numpy as np

from dmoc.basics.numerics import columns
from dmoc.basics.quaternions import angle_between
from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.momenta import (
    flow_between_links,
    node_velocities,
    rates_along,
    step_matrices,
    velocity_along,
)
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
# Steps whose h omega is below this are not looked at for the least number of steps that is stable.
SLOWEST = 0.02
# The least number of steps that is stable is looked for among so many, and then among so many near the last
# one that is not: an interval of stability that is narrower than one part in forty is passed over.
COUNTED = 300
# A step whose h omega is below this is stable by far at any order: nothing is computed before the solve.
HARMLESS = 0.5
# What finds a mesh that is fine enough for the checks, too.
OPEN = "--tol 1e-4 (in Python tol=1e-4) finds as many as the accuracy needs"
# A guess may turn a body by this angle in a step of each order [rad]: beyond it the scheme has solutions of its
# own that are off by degrees, and Ipopt finds them.
TURN_A_STEP = {2: np.radians(30), 4: np.radians(90), 6: np.radians(120), 8: np.radians(180)}

# An exponential of a matrix is that of its part of this number, a Cayley transform, to the same power.
SQUARED = 64


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
) -> Growth:
    """Growth of the steps of a path, from its `step_matrices` and velocities at the step ends [m/s].

    The eigenvalues of a body that drifts in a turning frame are double with one eigenvector each: a scheme that
    is right splits them by the root of its error, and one of them exceeds 1. What that does to a march of a few
    hundred steps is nothing. So where the linearisation is constant and an eigenvalue is too large, the growth
    a step is that of the product of all matrices over that of the exact flow.
    """
    flow, constant = flow_matrices(dynamics, path, start_time, velocity), dynamics.linearised[1]
    limit = GROWTH_CONSTANT if constant else GROWTH
    if not (np.isfinite(flow).all() and np.isfinite(matrices).all()):
        return Growth(np.inf, limit, np.inf, constant)
    h, fastest = path.duration * np.diff(path.mesh), _rate_bound(flow)
    reach = h * np.maximum(fastest[:-1], fastest[1:])
    chosen = reach > NEGLIGIBLE
    chosen[np.argsort(reach)[-LOOKED_AT:]] = True
    # What links hold has another inertia in every place: its flow changes within a step.
    held = bool(dynamics.configuration.joined)
    whole = _radius_of_flow(dynamics, path, start_time, velocity) if held else np.zeros(len(h))
    growth, frequency = _growths(flow, matrices, h, np.flatnonzero(chosen), whole)
    value = float(growth.max())
    if constant and value > limit and (grown := _grown(matrices, flow[0], float(h.sum()), 1)) < GROWTH_IN_ALL:
        value, limit = max(1.0, grown ** (1 / len(h))), GROWTH_IN_ALL ** (1 / len(h))
    return Growth(value, limit, float(frequency.max()), constant)


def _grown(matrices: np.ndarray, flow: np.ndarray, duration: float, times: int) -> float:
    """Growth of so many marches of some steps, which take `duration` [s], over that of the exact flow."""
    whole = np.linalg.matrix_power(reduce(lambda done, step: step @ done, matrices), times)
    grown = np.linalg.norm(whole, 2) / np.linalg.norm(_exponential(times * duration * flow), 2)
    return float(np.nan_to_num(grown, nan=np.inf))


def _growths(
    flow: np.ndarray, matrices: np.ndarray, h: np.ndarray, looked_at: np.ndarray, whole: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Growth and h omega of some steps of lengths h [s]; the radius of the flow is at least `whole`."""
    rates = np.linalg.eigvals([flow[looked_at], flow[looked_at + 1]])
    exact = np.exp(h[looked_at] * rates.real.max(axis=(0, 2)))
    exact = np.maximum(exact, whole[looked_at])
    ours = np.abs(np.linalg.eigvals(matrices[looked_at])).max(axis=1)
    return ours / exact, h[looked_at] * np.abs(rates).max(axis=(0, 2))


def _radius_of_flow(
    dynamics: Dynamics, path: DiscretePath, start_time: float, velocity: np.ndarray
) -> np.ndarray:
    """Spectral radius of the flow under the controls over every step, in pieces from node to node."""
    rule, at, n = scheme(path.order), step_nodes(len(path.mesh) - 1, scheme(path.order)), dynamics.freedom
    ends = velocity_along(dynamics, path.position[:: rule.degree], velocity)
    rates = rates_along(dynamics, path.position, node_velocities(path, ends))
    times = start_time + path.duration * path.fractions
    controls = path.control
    if path.hold:
        controls = controls[np.minimum(np.arange(len(times)) // rule.degree, len(controls) - 1)]
    given = times, path.position.T, rates.T, path.mass, controls.T
    flow = (
        columns(dynamics.linearised_under_thrust, *given)[0]
        .reshape(2 * n, len(times), 2 * n)
        .transpose(1, 0, 2)
    )
    flow = flow_between_links(dynamics, path.position, rates, path.mass[0], flow)
    one, whole = np.eye(flow.shape[1]), np.eye(flow.shape[1])
    for first, last in pairwise(at):
        part = ((times[last] - times[first]) / SQUARED)[:, None, None] * 0.5 * (flow[first] + flow[last])
        piece = np.linalg.solve(one - 0.5 * part, one + 0.5 * part)
        whole = np.linalg.matrix_power(piece, SQUARED) @ whole
    return np.abs(np.linalg.eigvals(whole)).max(axis=1)


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
) -> np.ndarray:
    """d(q', v')/d(q, v) at the step ends, shape (steps+1, 2 freedom, 2 freedom)."""
    n, ends = dynamics.freedom, slice(None, None, scheme(path.order).degree)
    times = start_time + path.duration * path.mesh
    stacked = columns(dynamics.linearised[0], times, path.position[ends].T, velocity.T, path.mass[ends])[0]
    flow = stacked.reshape(2 * n, len(times), 2 * n).transpose(1, 0, 2)
    if dynamics.configuration.joined:
        flow = flow_between_links(dynamics, path.position[ends], velocity, path.mass[0], flow)
    return flow


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
            f"each, and no more than {most:.0f} are followed; {enough} equal steps do not; {OPEN}"
        )


def refuse_unstable(
    dynamics: Dynamics, guess: DiscretePath, start_time: float, bounds: tuple[float, float]
) -> None:
    """Refuse a mesh beyond the scheme's stability limit where that is known before the solve.

    It is known where the linearisation does not depend on the state; elsewhere the check of the
    solution tells. `bounds` are the shortest and the longest duration [s].

    Raises
    ------
    ValueError
        With h omega, the growth per step, and from which number of steps on there is none.
    """
    _refuse_large_turns(guess)
    longest = np.diff(guess.mesh).max()
    counts = np.array([np.ceil(1 / longest)])
    growth = _constant_growth(dynamics, guess, start_time, np.array([longest * bounds[0]]), counts)
    if growth is None or growth[0][0] <= GROWTH_CONSTANT:
        return
    steps, (enough, _) = len(guess.mesh) - 1, stable_from(dynamics, guess, start_time, bounds[1])
    raise ValueError(
        f"{steps} steps of order {guess.order} are unstable for this scene: h omega = {growth[1][0]:.3g}, "
        f"errors grow {growth[0][0]:.3g} times a step; from {enough} equal steps on they do not; {OPEN}"
    )


def stable_from(
    dynamics: Dynamics, guess: DiscretePath, start_time: float, duration: float, steps: int = 1
) -> tuple[int, float]:
    """From how many equal steps on a scheme is stable, and the angle [rad] of the fastest motion in that time.

    Both are 0 where they are not known before the solve, or where so many `steps` are harmless.
    """
    tried = _constant_growth(dynamics, guess, start_time, np.array([duration / steps]), np.array([steps]))
    if tried is None:
        return 0, 0.0
    # The number of steps is at least h omega over that of the slowest growth that is looked at.
    last, angle = 0.0, steps * float(tried[1][0])
    counts = np.geomspace(1.0, max(angle / SLOWEST, 2.0), COUNTED)
    for _ in range(2):
        counts = np.unique(np.ceil(counts))
        found = _constant_growth(dynamics, guess, start_time, duration / counts, counts)
        unstable = np.flatnonzero(found[0] > GROWTH_CONSTANT) if found else np.empty(0, int)
        if not len(unstable):
            break
        last, above = counts[unstable[-1]], counts[min(unstable[-1] + 1, len(counts) - 1)]
        counts = np.linspace(last, above, COUNTED)
    return int(last) + 1, angle


def _constant_growth(
    dynamics: Dynamics, guess: DiscretePath, start_time: float, lengths: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Growth and h omega of steps of these lengths [s]; None where motion is not linear, or slow for all.

    Where so many `times` of a step together grow no more than the motion does, its growth counts as 1.
    """
    if not dynamics.linearised[1]:
        return None
    nodes = np.linspace(0, len(guess.position) - 1, guess.order // 2 * len(lengths) + 1).round().astype(int)
    ends = np.append(0.0, np.cumsum(lengths))
    # Where the linearisation is constant all steps of one length are alike: one of each length stands for all.
    probe = replace(
        guess,
        mesh=ends / ends[-1],
        duration=float(ends[-1]),
        position=guess.position[nodes],
        mass=guess.mass[nodes],
        control=np.zeros((len(lengths) if guess.hold else len(nodes), guess.control.shape[1])),
    )
    flow = flow_matrices(dynamics, probe, start_time, np.zeros((len(ends), dynamics.freedom)))
    if not np.isfinite(flow).all() or lengths.max() * _rate_bound(flow).max() < HARMLESS:
        return None
    matrices = step_matrices(dynamics, probe, start_time)
    matrices = np.where(np.isfinite(matrices), matrices, 1e100)
    growth, frequency = _growths(flow, matrices, lengths, np.arange(len(lengths)), np.zeros(len(lengths)))
    for i in np.flatnonzero(growth > GROWTH_CONSTANT):
        if _grown(matrices[i][None], flow[0], float(lengths[i]), int(times[i])) < GROWTH_IN_ALL:
            growth[i] = 1.0
    return growth, frequency
