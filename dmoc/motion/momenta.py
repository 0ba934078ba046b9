"""Momenta of a path: the discrete Legendre transforms of its steps."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import columns
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.motion.step import step_momenta


def end_momenta(
    dynamics: Dynamics, path: DiscretePath, start_time: float, momenta: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Momenta per mass and velocities at the step ends [m/s], each of shape (steps+1, axes).

    The discrete Legendre transforms of the steps: the momentum that leaves the first node of each step
    and, at the last node of all, the momentum that arrives there. `momenta` are the `legendre_momenta` if
    they are known.
    """
    ends = slice(None, None, scheme(path.order).degree)
    if momenta is None:
        momenta = legendre_momenta(dynamics, path, start_time)
    p = along_path(dynamics, path.position[ends], np.concatenate([-momenta[0], momenta[-1][-1:]]))
    if not dynamics.depends_on_velocity:
        return p, p.copy()
    times = start_time + path.duration * path.mesh
    p = without_reactions(dynamics, times, path.position[ends], path.mass[ends], p)
    return p, columns(dynamics.velocity, times, path.position[ends].T, p.T, path.mass[ends])[0].T


def along_path(dynamics: Dynamics, position: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Z(q)' of columns of the size of q, one row a place: what moves the body and not its constraint."""
    if not dynamics.configuration.surplus:
        return rows
    return columns(dynamics.to_freedom, position.T, rows.T)[0].T


def without_reactions(
    dynamics: Dynamics, times: np.ndarray, position: np.ndarray, mass: np.ndarray, momenta: np.ndarray
) -> np.ndarray:
    """Momenta in the independent velocities, one row a place, without what the reactions of links take up."""
    if not dynamics.configuration.joined:
        return momenta
    return columns(dynamics.tangential, times, position.T, mass, momenta.T)[0].T


def velocity_along(dynamics: Dynamics, position: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """dq/dt = Z(q) w of places and independent velocities, one row each."""
    if not dynamics.configuration.surplus:
        return rates
    return columns(dynamics.to_slopes, position.T, rates.T)[0].T


def rates_along(dynamics: Dynamics, position: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Independent velocities w of dq/dt = Z(q) w, one row a place."""
    if not dynamics.configuration.surplus:
        return slopes
    # Z' dq/dt is w of a place and w / 4 of a unit quaternion, since Z = L H / 2 there.
    along = along_path(dynamics, position, slopes)
    return along * dynamics.configuration.coordinates.paced(1.0, 4.0, 1.0)


def legendre_momenta(dynamics: Dynamics, path: DiscretePath, start_time: float) -> np.ndarray:
    """P_0 .. P_s of every step of a path [m/s], shape (s+1, steps, axes)."""
    momenta = columns(legendre_function(dynamics, path.order, path.hold), *_given(path, start_time))
    return np.array([momentum.T for momentum in momenta])


def node_velocities(path: DiscretePath, ends: np.ndarray) -> np.ndarray:
    """dq/dt at every node: that at the step ends, and of a polynomial with those inside the steps."""
    rule, h = scheme(path.order), path.duration * np.diff(path.mesh)[:, None]
    at = step_nodes(len(path.mesh) - 1, rule)
    known = [*path.position[at], ends[:-1] * h, ends[1:] * h]
    velocity = np.empty_like(path.position)
    velocity[at] = np.einsum("ij,jkn->ikn", rule.hermite_slopes(), known) / h
    velocity[:: rule.degree] = ends
    return velocity


def step_matrices(dynamics: Dynamics, path: DiscretePath, start_time: float) -> np.ndarray:
    """Derivative of the one-step map in (q, p) along a path, shape (steps, 2 freedom, 2 freedom) [SI].

    By the implicit function theorem from the slopes B of the momenta: p_0 = -P_0, P_1 = .. = P_{s-1} = 0
    and p_1 = P_s are linear in the changes of all positions of the step. All are infinite if one step's
    equations have no solution.
    """
    n, s, steps = dynamics.freedom, scheme(path.order).degree, len(path.mesh) - 1
    make = partial(_legendre_slopes, dynamics, path.order, path.hold)
    function = remembered(make, "legendre slopes", dynamics, path.order, path.hold)
    given = _given(path, start_time)
    if dynamics.configuration.joined:
        given = (*given, _impulses(dynamics, path))
    slopes = columns(function, *given)[0].reshape(n * (s + 1), steps, -1).transpose(1, 0, 2)
    if dynamics.configuration.joined:
        slopes = _between_links(dynamics, path, slopes)
        n -= dynamics.configuration.joined
    # The rows p_0 = -P_0, P_1 = .. = 0 tell how all later nodes move with q_0 and p_0.
    inner, start = slopes[:, : n * s, n:], np.zeros((steps, n * s, 2 * n))
    start[:, :, :n], start[:, :n, n:] = -slopes[:, : n * s, :n], -np.eye(n)
    try:
        moves = np.linalg.solve(inner, start)
    except np.linalg.LinAlgError:  # a step so long that its equations have no one solution
        return np.full((steps, 2 * n, 2 * n), np.inf)
    # p_1 = P_s moves with q_0 itself and with the later nodes.
    last = slopes[:, n * s :]
    momenta = last[:, :, n:] @ moves
    momenta[:, :, :n] += last[:, :, :n]
    return np.concatenate([moves[:, n * (s - 1) :], momenta], axis=1)


def _given(path: DiscretePath, start_time: float) -> tuple:
    """The arguments of a function of one step for all steps of a path, side by side."""
    rule, steps = scheme(path.order), len(path.mesh) - 1
    at, origin = step_nodes(steps, rule), path.position[0]

    def stacked(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values[at[j]].T for j in range(rule.degree + 1)])

    control = path.control.T if path.hold else stacked(path.control)
    times = (start_time + path.duration * path.mesh[:-1])[None]
    lengths = path.duration * np.diff(path.mesh)[None]
    return stacked(path.position - origin), path.mass[at], control, times, lengths, origin


def _legendre_slopes(dynamics: Dynamics, order: int, hold: bool) -> ca.Function:
    """(q, m, u, t, h, origin) -> derivative of P_0 .. P_s in q, of Z'P in turns for a body that turns."""
    function, body = legendre_function(dynamics, order, hold), dynamics.configuration
    given = function.sx_in()
    momenta = function.call(given)
    if body.surplus:
        nodes = [q + given[-1] for q in ca.vertsplit(given[0], body.size)]
        along = [body.along(q, momentum) for q, momentum in zip(nodes, momenta, strict=True)]
        nodes_moved: Any = ca.diagcat(*map(body.tangent, nodes))
    else:
        nodes = [q + given[-1] for q in ca.vertsplit(given[0], body.size)]
        along, nodes_moved = list(momenta), ca.SX.eye(given[0].numel())
    if body.joined:
        impulses = ca.SX.sym("impulses", body.joined * len(nodes))
        given.append(impulses)
        pulls = zip(nodes, ca.vertsplit(impulses, body.joined), strict=True)
        along = [row - body.bars(q).T @ pull for row, (q, pull) in zip(along, pulls, strict=True)]
    slopes = ca.jacobian(ca.vertcat(*along), given[0])
    slopes = slopes @ nodes_moved if body.surplus else slopes
    return ca.Function("slopes", given, [ca.densify(slopes)])


def _impulses(dynamics: Dynamics, path: DiscretePath) -> np.ndarray:
    """Impulses of links per unit mass at the nodes of every step, stacked, one column a step."""
    rule, steps = scheme(path.order), len(path.mesh) - 1
    held = dynamics.configuration.joined
    reaction = np.zeros((len(path.position), held)) if path.reaction is None else path.reaction[:, -held:]
    weights = rule.weights[:, None] * path.duration * np.diff(path.mesh)
    parts = reaction[step_nodes(steps, rule)] * weights[:, :, None]
    return parts.transpose(0, 2, 1).reshape(-1, steps)


def _between_links(dynamics: Dynamics, path: DiscretePath, slopes: np.ndarray) -> np.ndarray:
    """Slopes of a step's momenta in an orthonormal basis of the ways in which links let each node move."""
    rule, steps = scheme(path.order), len(path.mesh) - 1
    bases = link_bases(dynamics, path.position, path.mass[0])[step_nodes(steps, rule)]
    blocks = slopes.reshape(steps, rule.degree + 1, dynamics.freedom, rule.degree + 1, dynamics.freedom)
    found = np.einsum("ikna,kinjm,jkmb->kiajb", bases, blocks, bases, optimize=True)
    size = (rule.degree + 1) * bases.shape[-1]
    return found.reshape(steps, size, size)


def link_bases(dynamics: Dynamics, position: np.ndarray, mass: float) -> np.ndarray:
    """Bases of the velocities that links let be, shape (places, freedom, freedom - joined).

    They are orthonormal in the kinetic energy, B' M B = 1, so that velocities and momenta are of one size. Each
    is turned as little as can be from the one before, so that matrices from one to the next compare.
    """
    held, root = dynamics.configuration.joined, inertia_root(dynamics, position[0], mass)
    bars = columns(dynamics.bars, position.T)[0].reshape(held, len(position), -1).transpose(1, 2, 0)
    bases = np.linalg.qr(np.linalg.solve(root, bars), mode="complete")[0][:, :, held:]
    for before, basis in pairwise(bases):
        left, _, right = np.linalg.svd(basis.T @ before)
        basis[:] = basis @ (left @ right)
    return np.linalg.solve(root.T, bases)


def inertia_root(dynamics: Dynamics, position: np.ndarray, mass: float) -> np.ndarray:
    """L with L L' = M, the inertia along the independent velocities per unit mass, the same everywhere."""
    t, q, w, m, _ = dynamics.states()
    inertia = ca.Function("inertia", [t, q, w, m], [ca.jacobian(dynamics.momentum(t, q, w, m), w)])
    return np.linalg.cholesky(inertia(0.0, position, 0.0, mass).full())


def legendre_function(dynamics: Dynamics, order: int, hold: bool) -> ca.Function:
    """(q, m, u, t, h, origin) -> P_0 .. P_s [m/s] of one step, whole: effects, kinetic energy and actuator.

    q are the s + 1 positions stacked, from `origin` [m]; u the controls of the nodes stacked, or of the step.
    """
    return remembered(partial(_legendre_function, dynamics, order, hold), "legendre", dynamics, order, hold)


def _legendre_function(dynamics: Dynamics, order: int, hold: bool) -> ca.Function:
    rule, n, body = scheme(order), dynamics.positions, dynamics.configuration
    size = dynamics.controls
    q, m = ca.SX.sym("q", n * (rule.degree + 1)), ca.SX.sym("m", rule.degree + 1)
    u = ca.SX.sym("u", size * (1 if hold else rule.degree + 1))
    t, h, origin = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("origin", n)
    nodes = ca.vertsplit(q, n)
    controls = [u[:size] if hold else u[size * j : size * (j + 1)] for j in range(rule.degree + 1)]
    push = [
        body.driven(dynamics.actuator, place + origin, control, m[j])
        for j, (place, control) in enumerate(zip(nodes, controls, strict=True))
    ]

    moving = dynamics.step_point(rule.degree)

    def point(t, r, v, m):
        return moving(t, r + origin, v, m)

    momenta = step_momenta(rule, point, t, h, nodes, ca.vertsplit(m), push, body, origin)
    return ca.Function("legendre", [q, m, u, t, h, origin], momenta, dynamics.loose)


def flow_between_links(
    dynamics: Dynamics, position: np.ndarray, velocity: np.ndarray, mass: float, flow: np.ndarray
) -> np.ndarray:
    """The flow in the ways that links let be, in bases B that turn along with them as little as they must.

    With the slope C of the links, D = d(C w)/dq and the right inverse C+ = M^-1 C' (C M^-1 C')^-1, a small
    change is dq = B e, dw = B h - C+ D B e. Along the path dq changes by A dq + dw, where A is 0 but for bodies
    that turn, and B by -C+ (D - C A) B. Since B' M B = 1, h = B' M dw.
    """
    n, held = dynamics.freedom, dynamics.configuration.joined
    q, w = ca.SX.sym("q", dynamics.positions), ca.SX.sym("w", n)
    body = dynamics.configuration
    turning = ca.jacobian(body.opening(q, w), q) @ body.tangent(q)
    both = ca.Function("bent", [q, w], [ca.densify(turning), ca.densify(body.bars(q))])
    bending, bars = (
        part.reshape(held, len(position), n).transpose(1, 0, 2)
        for part in columns(both, position.T, velocity.T)
    )
    basis, root = link_bases(dynamics, position, mass), inertia_root(dynamics, position[0], mass)
    inertia = root @ root.T
    light = np.linalg.solve(inertia, bars.transpose(0, 2, 1))
    moving = flow[:, :n, :n] @ basis
    across = -light @ np.linalg.solve(bars @ light, bending @ basis)
    turned = across + light @ np.linalg.solve(bars @ light, bars @ moving)
    back = basis.transpose(0, 2, 1) @ inertia
    bent = turned.transpose(0, 2, 1) @ inertia @ across
    stiff = back @ (flow[:, n:, :n] @ basis + flow[:, n:, n:] @ across) + bent
    damped = back @ flow[:, n:, n:] @ basis
    slid, one = back @ moving, np.broadcast_to(np.eye(n - held), stiff.shape)
    return np.concatenate([np.concatenate([slid, one], 2), np.concatenate([stiff, damped], 2)], 1)
