"""The discrete equations: one step, the momenta at its ends, the one-step map. All per unit mass.

One step of length h carries positions q_0 .. q_s at the Lobatto points c_j, with weights w_j and
derivative matrix D (`lobatto`). With l the Lagrangian per unit mass and F the forces that do work:

    v_i = 1/h sum_j D_ij q_j                                   velocities of the step
    P_j = sum_i w_i D_ij dl/dv_i + h w_j (dl/dq_j + F_j / m_j)

-P_0 is the momentum that leaves node 0, P_s the momentum that arrives at node s, P_j = 0 between.
For s = 1 the rows P_s (of one step) + P_0 (of the next) divided by -h/m are equation (16) of M. Ekal,
Derivation of a discrete variational integrator for rigid body translational motion,

    (x_k - x_{k-1}) - (x_{k+1} - x_k) + h^2/m f_k = 0.

Held forces g act with h w_j g on node j of their step.

References
----------
J. E. Marsden, M. West, Discrete mechanics and variational integrators, Acta Numerica 10 (2001).
S. Leyendecker, S. Ober-Bloebaum, J. E. Marsden, M. Ortiz, Discrete mechanics and optimal control
for constrained systems, Optim. Control Appl. Meth. 31 (2010).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.configurations.acting import kinetic_at_nodes
from dmoc.configurations.base import Configuration
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme


def step_velocities(scheme: Scheme, h, q: Sequence) -> list:
    """v_i = 1/h sum_j D_ij q_j, from displacements: no digits are lost far from the origin."""
    moves = [position - q[0] for position in q[1:]]
    return [weighted(row[1:], moves) / h for row in scheme.derivative]


def step_momenta(
    scheme: Scheme,
    point: Callable,
    t0,
    h,
    q: Sequence,
    m: Sequence,
    push: Sequence,
    body: Configuration | None = None,
    origin: Any = 0,
    v: Sequence | None = None,
) -> list:
    """P_0 .. P_s of one step [m/s].

    Parameters
    ----------
    point : Function
        (t, q, v, m) -> dl/dq, dl/dv, F/m; see `point_function` and, for a body, `Dynamics.step_point`.
    t0, h : scalar
        Start and length of the step [s].
    q : list of columns
        Positions at the s + 1 nodes [m].
    m : list of scalars
        Masses there [kg].
    push : list of columns
        Actuator force per mass there [m/s^2].
    body : Configuration, optional
        A point mass if not given.
    origin : column
        Where the positions count from.
    v : list of columns, optional
        The velocities of the step, if they are known; `step_velocities` if not given.
    """
    v = step_velocities(scheme, h, q) if v is None else v
    at = [point(t0 + c * h, *state) for c, state in zip(scheme.points, zip(q, v, m, strict=True), strict=True)]
    acted = [h * w * (dldq + f + u) for w, (dldq, _, f), u in zip(scheme.weights, at, push, strict=True)]
    if body is not None and not kinetic_at_nodes(body, scheme.degree):
        inertial = body.step_inertia(h, [place + origin for place in q], q[1] - q[0], m[0])
        slopes = [dldv for _, dldv, _ in at]
        return [
            moved + weighted(scheme.weights * scheme.derivative[:, j], slopes) + acted[j]
            for j, moved in enumerate(inertial)
        ]
    # dl/dv of a place is v plus the momentum that effects add. The sum over v is one constant matrix times the
    # displacements; the second part is zero for most effects.
    inertia = scheme.derivative.T * scheme.weights @ scheme.derivative
    moves = [position - q[0] for position in q[1:]]
    if body is not None and body.surplus:
        places = ca.DM(body.coordinates.places.astype(float))
        v, moves = [velocity * places for velocity in v], [move * places for move in moves]
    added = [dldv - velocity for (_, dldv, _), velocity in zip(at, v, strict=True)]
    return [
        weighted(inertia[j, 1:], moves) / h
        + weighted(scheme.weights * scheme.derivative[:, j], added)
        + acted[j]
        for j in range(scheme.degree + 1)
    ]


def step_map(dynamics: Dynamics, scheme: Scheme, hold: bool = False) -> ca.Function:
    """The one-step map, as increments so that a caller can add them up without losing digits.

    (q, p, m, u, t, h, origin) -> (dq, dp, v): position from `origin` [m], momentum per mass [m/s],
    node masses [kg] (s+1), controls (size, s+1) or with hold (size), time [s], step [s], origin [m].
    `v` are the velocities of the step at its nodes (dimension, s+1). Explicit at order 2 where no
    effect looks at the velocity, Newton's method down to round-off elsewhere.
    """
    return remembered(partial(_step_map, dynamics, scheme, hold), "step", dynamics, scheme.order, hold)


def _step_map(dynamics: Dynamics, scheme: Scheme, hold: bool) -> ca.Function:
    n, s, body = dynamics.positions, scheme.degree, dynamics.configuration
    q, origin = (ca.SX.sym(name, n) for name in ("q", "origin"))
    p = ca.SX.sym("p", dynamics.freedom)
    t, h, masses = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("m", s + 1)
    # Without a control the columns of none are not told apart when steps are mapped, so there are none.
    u = ca.SX.sym("u", dynamics.controls, (1 if hold else s + 1) * (dynamics.controls > 0))
    # Unknown numbers are further inputs, behind all others.
    given = [q, p, masses, u, t, h, origin, *dynamics.unknowns]
    names = ["q", "p", "m", "u", "t", "h", "origin", *[f"c{i}" for i in range(len(dynamics.unknowns))]]
    m = ca.vertsplit(masses)

    def point(t, r, v, m):
        return dynamics.point(t, r + origin, v, m)

    def push(positions: Sequence) -> list:
        controls = [u[:, 0 if hold else j] if dynamics.controls else u for j in range(s + 1)]
        at = [(positions[j] + origin, controls[j], m[j]) for j in range(s + 1)]
        return [body.driven(dynamics.actuator, place, control, mass) for place, control, mass in at]

    rate = dynamics.velocity(t, q + origin, p, m[0])
    velocity = body.velocity(q + origin, rate)
    dldq, _, force = point(t, q, velocity, m[0])
    kick = dldq + force + push([q] * (s + 1))[0]
    if s == 1 and not dynamics.depends_on_velocity:
        moved = [h * (p + 0.5 * h * kick)]
        increments = _increments(scheme, point, t, h, q, moved, m, push([q, *[q + move for move in moved]]))
        return ca.Function("step", given, increments, names, ["dq", "dp", "v"])
    first, speed = _first_guess(dynamics, scheme, h, (p, velocity, kick))
    y = ca.SX.sym("y", n * s + body.joined * s)
    # The impulses of links at the nodes of the step but the last, over the speeds that momenta are divided by.
    held = ca.vertsplit(y[n * s :], body.joined) if body.joined else []
    moves = [h * speed * y[n * j : n * (j + 1)] for j in range(s)]
    nodes = [q, *[q + move for move in moves]]
    moving = dynamics.step_point(s)
    momenta = step_momenta(
        scheme, lambda t, r, v, m: moving(t, r + origin, v, m), t, h, nodes, m, push(nodes), body, origin
    )
    rows = ca.Function(
        "rows", [y, *given], [_rows(dynamics, (p, speed), [r + origin for r in nodes], momenta, held)]
    )
    # Convergence is quadratic: once a Newton step is below 1e-11 the next one is below round-off. The size of
    # the rows decides nothing.
    settings = {"abstol": 1e-300, "abstolStep": 1e-11, "max_iter": 30, "error_on_fail": False}
    newton = ca.rootfinder("newton", "fast_newton", rows, settings)
    start = ca.Function("start", given, [first])
    if body.conditions:
        arrived = body.along(nodes[-1] + origin, momenta[-1])
        if body.joined:
            arrived = dynamics.tangential(t + h, nodes[-1] + origin, m[-1], arrived)
        last = [moves[-1], arrived - p]
        increments = [*last, ca.horzcat(*step_velocities(scheme, h, nodes))]
    else:
        increments = _increments(scheme, point, t, h, q, moves, m, push(nodes))
    finish = ca.Function("finish", [y, *given], increments)
    arguments = [ca.MX.sym(name, *a.shape) for name, a in zip(names, given, strict=True)]
    root = newton(start(*arguments), *arguments)
    return ca.Function("step", arguments, finish(root, *arguments), names, ["dq", "dp", "v"])


def _first_guess(dynamics: Dynamics, scheme: Scheme, h: Any, state: tuple) -> tuple[Any, Any]:
    """The unknowns of one step for Newton's method to start from, and the speeds that they are divided by.

    The unknowns are displacements over h times a typical speed, which makes them of order 1 in every scene;
    1e-300 keeps that speed above zero for a body at rest that nothing pushes.
    """
    p, velocity, kick = state
    links = ca.SX.zeros(dynamics.configuration.joined * scheme.degree)
    if not dynamics.configuration.surplus:
        speed = ca.sqrt(ca.dot(velocity, velocity) + ca.dot(p, p) + h**2 * ca.dot(kick, kick) + 1e-300)
        moves = [c * (velocity + 0.5 * c * h * kick) / speed for c in scheme.points[1:]]
        return ca.vertcat(*moves, links), speed
    places = dynamics.configuration.coordinates.places
    along = velocity * ca.DM(places.astype(float))
    linear = ca.sqrt(ca.dot(along, along) + 1e-300)
    # A body that turns by more than a radian a step leaves the scheme, so a quaternion changes by less than 1.
    speed = ca.vertcat(
        *[linear + ca.norm_2(h * kick * ca.DM(places.astype(float))) if place else 1 / h for place in places]
    )
    return ca.vertcat(*[c * velocity / speed for c in scheme.points[1:]], links), speed


def _rows(dynamics: Dynamics, start: tuple, nodes: Sequence, momenta: Sequence, held: Sequence) -> Any:
    """The equations of one step: Z' P_0 + p = 0 and, at the later nodes but the last, Z' P_j = 0; and g = 0.

    `start` is p and the speed that the rows of a point mass are divided by, `held` the impulses of links at the
    nodes but the last, which act along the slopes of g.
    """
    body, (p, speed) = dynamics.configuration, start
    if not body.conditions:
        return ca.vertcat(momenta[0] + p, *momenta[1:-1]) / speed
    # Momenta of places are divided by their speed; those of attitudes need no scale for Newton's method.
    rows = [body.along(q, momentum) for q, momentum in zip(nodes[:-1], momenta[:-1], strict=True)]
    rows[0] = rows[0] + p
    if not body.surplus:
        rows = [row / speed for row in rows]
    if body.joined:
        rows = [row - body.bars(q).T @ impulse for row, q, impulse in zip(rows, nodes, held, strict=False)]
    return ca.vertcat(*rows, *[body.g(q) for q in nodes[1:]])


def _increments(scheme: Scheme, point, t, h, q, moves: Sequence, m: Sequence, push: Sequence) -> list:
    """dq, dp, v from the displacements of the nodes; dp is the impulse h sum_j w_j (dl/dq_j + F_j / m_j)."""
    v = [weighted(row[1:], moves) / h for row in scheme.derivative]
    positions = [q, *[q + move for move in moves]]
    at = [
        point(t + c * h, *state)
        for c, state in zip(scheme.points, zip(positions, v, m, strict=True), strict=True)
    ]
    accelerations = [dldq + force + thrust for (dldq, _, force), thrust in zip(at, push, strict=True)]
    return [moves[-1], h * weighted(scheme.weights, accelerations), ca.horzcat(*v)]


def weighted(weights: np.ndarray, terms: Sequence) -> Any:
    """sum_i weights_i terms_i, leaving out weights that are zero."""
    kept = [(float(weight), term) for weight, term in zip(weights, terms, strict=True) if weight != 0]
    if len(kept) > 1 and all(isinstance(term, ca.SX) and term.is_column() for _, term in kept):
        # CasADi adds up many columns at once in less time.
        return ca.horzcat(*[term for _, term in kept]) @ ca.DM([weight for weight, _ in kept])
    return sum((weight * term for weight, term in kept), 0)
