"""The control that is flown between the nodes of a path.

The control of a step is the polynomial through its Lobatto nodes: its integral is the impulse of the discrete
equations. Where the polynomial breaks the actuator's limit, another control of the same impulse is flown,
within the limit: the polynomial at the size of the limit, where a thrust turns at its limit; or, by which of
them keeps most of the first two moments about the middle of the step, the polynomial drawn towards its mean,
two constant pieces, the value of each node for as long as its weight or, where the direction is free, eight
pieces near the polynomial. The limits are convex sets: the mean of the node values with the scheme's weights
obeys them. No impulse is flown that is not paid for.
"""

from __future__ import annotations

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath

# The polynomial of a step is flown if it exceeds no limit by more than this part of it: on an arc where the
# control turns at its limit, a polynomial through the nodes exceeds it by less.
BREAKS = 1e-4
# Places in a step at which the polynomial is held against the limit.
LOOKED_AT = np.linspace(0.0, 1.0, 17)
# Places at which a polynomial that is drawn in is held against the limit: between them it exceeds it by less
# than a hundred-thousandth.
CLOSELY = np.linspace(0.0, 1.0, 129)
FULL = 1e-6  # a thrust is at its limit at a node if it is so by this part of it [-]
# Pieces of a step in which a thrust at its limit turns: in each its size swings by less than a thousandth of
# what it does in the whole step.
TURNING = np.linspace(0.0, 1.0, 5)
# Fractions of a step at which two constant pieces may meet.
MEETINGS = np.linspace(0.02, 0.98, 49)
HALVINGS = 21  # of the interval for how far apart the pieces may be: to a millionth
# A force of free direction has so many pieces near its polynomial, by so many projections at most: until its
# first moment is right to this part of the limit [-]. After 300 revolutions of least fuel the goal is missed by
# 0.0037 of the path, without them by 0.050, with them alone by 0.0045.
NEAREST_PIECES, PROJECTIONS, RIGHT = 8, 60, 1e-6


@dataclass(frozen=True)
class Flown:
    """The control of a path, piece by piece.

    Attributes
    ----------
    mesh : array, shape (pieces+1,)
        Ends of the pieces as fractions of the duration. A piece is a step or a part of one.
    nodes : array, shape (s+1, pieces, size)
        Controls at the Lobatto points of each piece: it is the polynomial through them.
    broken : array of bool, shape (steps,)
        Steps whose own polynomial breaks the limit of the actuator.
    """

    mesh: np.ndarray
    nodes: np.ndarray
    broken: np.ndarray

    def sampled(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Fractions of the duration and controls at so many places of each piece, its ends among them.

        Shapes (pieces * count,) and (pieces * count, size).
        """
        rule, at = scheme(2 * (len(self.nodes) - 1)), np.linspace(0.0, 1.0, count)
        values = np.einsum("pj,jkn->kpn", rule.values_at(at), self.nodes)
        fractions = self.mesh[:-1, None] + np.diff(self.mesh)[:, None] * at
        return fractions.ravel(), values.reshape(-1, values.shape[2])


def flown(dynamics: Dynamics, path: DiscretePath) -> Flown:
    """The control that is flown with the controls of a path."""
    rule, steps = scheme(path.order), len(path.mesh) - 1
    if path.hold:
        nodes = np.broadcast_to(path.control, (rule.degree + 1, *path.control.shape))
        return Flown(path.mesh, nodes, np.zeros(steps, bool))
    nodes = path.control[step_nodes(steps, rule)]
    broken = _broken(dynamics, rule, nodes)
    return Flown(path.mesh, nodes, broken) if not broken.any() else _mended(dynamics, rule, path, nodes, broken)


def _broken(dynamics: Dynamics, rule: Scheme, nodes: np.ndarray) -> np.ndarray:
    """Steps whose polynomial breaks the limit between its nodes."""
    limit = dynamics.actuator.main_limit()
    if rule.degree == 1 or limit is None:
        # A straight line between two controls within a convex limit stays within it.
        return np.zeros(nodes.shape[1], bool)
    values = np.einsum("pj,jkn->pkn", rule.values_at(LOOKED_AT), nodes)
    return _beyond(dynamics, values).max(axis=0) > BREAKS * limit


def _beyond(dynamics: Dynamics, controls: np.ndarray) -> np.ndarray:
    """By how much controls of shape (..., size) are beyond what the actuator can do [N]."""
    flat = controls.reshape(-1, controls.shape[-1])
    return dynamics.actuator.beyond(flat).reshape(controls.shape[:-1])


def _mended(
    dynamics: Dynamics, rule: Scheme, path: DiscretePath, nodes: np.ndarray, broken: np.ndarray
) -> Flown:
    """The same impulse within the limit in the steps whose polynomial breaks it, by the best way for each."""
    values, kept = nodes[:, broken], ~broken
    turns, bounds, pieces = _turning(dynamics, rule, values, path.place.shape[1])
    best, ways = np.zeros(values.shape[1], int), [(bounds, pieces)]
    if not turns.all():
        others = [_drawn_in, _two_pieces, _node_pieces]
        if dynamics.actuator.nearest(values[0]) is not None:
            others.append(_nearest)
        ways += [way(dynamics, rule, values) for way in others]
        whole = np.broadcast_to([0.0, 1.0], (values.shape[1], 2))
        wanted = _moments(rule, whole, values[:, None])
        off = [np.abs(_moments(rule, *way) - wanted).sum(axis=(0, 2)) for way in ways]
        best = np.where(turns, 0, np.argmin(off, axis=0))
    begins, found = [path.mesh[:-1][kept]], [nodes[:, kept]]
    first, length = path.mesh[:-1][broken], np.diff(path.mesh)[broken]
    for number, (bounds, pieces) in enumerate(ways):
        mine = best == number
        begins.append((first[mine] + bounds[mine, :-1].T * length[mine]).ravel())
        found.append(pieces[:, :, mine].reshape(len(pieces), -1, pieces.shape[-1]))
    order = np.argsort(np.concatenate(begins), kind="stable")
    mesh = np.append(np.concatenate(begins)[order], path.mesh[-1])
    return Flown(mesh, np.concatenate(found, axis=1)[:, order], broken)


def _moments(rule: Scheme, bounds: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """First and second moment of controls about the middle of a step, shape (2, steps, size).

    Of pieces with these `bounds`, fractions of shape (steps, pieces + 1), that are polynomials through values
    of shape (s+1, pieces, steps, size). Exact but for the second moment at order 4, to the scheme's degree.
    """
    lengths = np.diff(bounds).T
    places = bounds[:, :-1].T + rule.points[:, None, None] * lengths - 0.5
    powers = np.stack([places, places**2])
    return np.einsum("j,kn,ajkn,jkns->ans", rule.weights, lengths, powers, pieces)


def _turning(
    dynamics: Dynamics, rule: Scheme, values: np.ndarray, axes: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where a force of `axes` turns at its limit; there its polynomial, scaled to it in pieces, else the mean.

    Its impulse differs from that of the discrete equations by as little as the scheme errs, which is added to
    all of it. Where the limit would then be broken, the control is something else than a thrust that turns.
    """
    limit = dynamics.actuator.main_limit() or 0.0
    mean = np.einsum("j,jkn->kn", rule.weights, values)
    lengths = np.diff(TURNING)
    at = TURNING[:-1] + rule.points[:, None] * lengths
    pieces = np.einsum("pj,jkn->pkn", rule.values_at(at.ravel()), values).reshape(*at.shape, *mean.shape)
    sizes = np.linalg.norm(pieces[..., :axes], axis=-1, keepdims=True)
    pieces[..., :axes] *= limit / np.maximum(sizes, FULL * limit)
    pieces += mean - np.einsum("j,i,jikn->kn", rule.weights, lengths, pieces)
    inside = np.einsum("pj,jikn->pikn", rule.values_at(LOOKED_AT), pieces)
    turns = (np.abs(np.linalg.norm(values[..., :axes], axis=-1) - limit) <= FULL * limit).all(axis=0)
    turns &= _beyond(dynamics, inside).max(axis=(0, 1)) <= BREAKS * limit
    bounds = np.broadcast_to(TURNING, (len(mean), len(TURNING)))
    return turns, bounds, np.where(turns[:, None], pieces, mean)


def _drawn_in(dynamics: Dynamics, rule: Scheme, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The polynomial drawn towards its mean until it keeps the limit: nearly all of it where a thrust turns."""
    mean = np.einsum("j,jkn->kn", rule.weights, values)
    apart = np.einsum("pj,jkn->pkn", rule.values_at(CLOSELY), values) - mean
    share = _share_within(dynamics, mean, apart[:, None])[0]
    bounds = np.broadcast_to([0.0, 1.0], (len(mean), 2))
    return bounds, (mean + share[:, None] * (values - mean))[:, None]


def _two_pieces(dynamics: Dynamics, rule: Scheme, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two constant pieces that keep the first moment, or as much of it as the limit lets them: one switch."""
    mean = np.einsum("j,jkn->kn", rule.weights, values)
    moment = np.einsum("j,jkn->kn", rule.weights * (rule.points - 0.5), values)
    # Pieces that meet at tau have the mean m and the first moment d about the middle of the step if they are
    # m - 2d/tau and m + 2d/(1 - tau).
    meeting = MEETINGS[:, None, None]
    apart = np.stack([-2 * moment / meeting, 2 * moment / (1 - meeting)])
    share = _share_within(dynamics, mean, apart)
    best, every = np.argmax(share, axis=0), np.arange(len(mean))
    pieces = mean + share[best, every][:, None] * apart[:, best, every]
    bounds = np.stack([np.zeros(len(mean)), MEETINGS[best], np.ones(len(mean))], axis=1)
    return bounds, np.broadcast_to(pieces, (len(values), *pieces.shape))


def _node_pieces(dynamics: Dynamics, rule: Scheme, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The value of each node, held for as long as its weight: a coast that begins and ends within the step."""
    mean = np.einsum("j,jkn->kn", rule.weights, values)
    pieces = mean + _share_within(dynamics, mean, (values - mean)[:, None])[0][:, None] * (values - mean)
    bounds = np.append(0.0, np.cumsum(rule.weights))
    bounds[-1] = 1.0
    bounds = np.broadcast_to(bounds, (values.shape[1], len(bounds)))
    return bounds, np.broadcast_to(pieces, (len(values), *values.shape))


def _nearest(dynamics: Dynamics, rule: Scheme, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polynomial pieces near the polynomial, by projections in turn onto the limit and onto both moments."""
    ends = np.linspace(0.0, 1.0, NEAREST_PIECES + 1)
    at = (ends[:-1] + rule.points[:, None] / NEAREST_PIECES).ravel()
    weights = np.repeat(rule.weights, NEAREST_PIECES) / NEAREST_PIECES
    basis, known = (np.stack([np.ones(len(x)), np.sqrt(12) * (x - 0.5)]) for x in (at, rule.points))
    wanted = np.einsum("mj,jkn->mkn", known * rule.weights, values)
    found, left = np.einsum("pj,jkn->pkn", rule.values_at(at), values), np.arange(values.shape[1])
    for _ in range(PROJECTIONS):
        near = dynamics.actuator.nearest(found[:, left].reshape(-1, values.shape[2]))
        found[:, left] = near.reshape(len(at), -1, values.shape[2])  # type: ignore[union-attr]
        off = wanted[:, left] - np.einsum("mp,pkn->mkn", basis * weights, found[:, left])
        wrong = np.abs(off).max(axis=(0, 2)) > RIGHT * (dynamics.actuator.main_limit() or 1.0)
        found[:, left] += np.einsum("mp,mkn->pkn", basis, off * wrong[:, None])
        left = left[wrong]
    mean = wanted[0]
    pieces = (found - np.einsum("p,pkn->kn", weights, found)).reshape(-1, NEAREST_PIECES, *mean.shape)
    looked = np.einsum("pj,jikn->pikn", rule.values_at(LOOKED_AT), pieces).reshape(-1, 1, *mean.shape)
    pieces = mean + _share_within(dynamics, mean, looked)[0][:, None] * pieces
    return np.broadcast_to(ends, (len(mean), len(ends))), pieces


def _share_within(dynamics: Dynamics, mean: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """The largest part of `apart`, at most 1, by which controls can leave their mean within the limit.

    Shape of `apart` (places, ways, steps, size), of the result (ways, steps). Limits are convex, so that
    bisection finds it.
    """
    allowed = BREAKS * (dynamics.actuator.main_limit() or 0.0)

    def within(share: np.ndarray) -> np.ndarray:
        return _beyond(dynamics, mean + share[..., None] * apart).max(axis=0) <= allowed

    low, high = np.zeros(apart.shape[1:3]), np.ones(apart.shape[1:3])
    whole = within(high)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        inside = within(middle)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.where(whole, 1.0, low)
