"""Forward integration of the same scheme, and an independent integrator for reference."""

from __future__ import annotations

import casadi as ca
import numpy as np

from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics, step_momenta
from dmoc.mesh import Guess, step_nodes


def end_momenta(dynamics: Dynamics, path: Guess, start_time: float) -> tuple[np.ndarray, np.ndarray]:
    """Momenta per mass and velocities at the step ends [m/s], each of shape (steps+1, axes).

    The discrete Legendre transforms of the steps: what leaves each step's first node, and at the
    end what arrives there.
    """
    rule, n = scheme(path.order), dynamics.dimension
    origin = path.position[0]
    legendre = legendre_function(dynamics, path.order, path.hold)
    steps = len(path.mesh) - 1
    at = step_nodes(steps, rule)
    times = start_time + path.duration * path.mesh
    positions = np.concatenate([(path.position[at[j]] - origin).T for j in range(at.shape[0])])
    control = (
        path.control.T if path.hold else np.concatenate([path.control[at[j]].T for j in range(at.shape[0])])
    )
    masses = path.mass[at]
    momenta = legendre(
        positions, masses, control, times[None, :-1], path.duration * np.diff(path.mesh)[None], origin
    )
    leaving, arriving = -np.array(momenta[0]), np.array(momenta[-1])
    p = np.concatenate([leaving.T, arriving[:, -1:].T])
    ends = path.position[:: rule.degree]
    v = dynamics.velocity(times[None], ends.T, p.T, path.mass[:: rule.degree][None])
    return p, np.array(v).T.reshape(-1, n)


def legendre_function(dynamics: Dynamics, order: int, hold: bool) -> ca.Function:
    """(q, m, u, t, h, origin) -> P_0 .. P_s [m/s] of one step, whole: effects, kinetic energy and actuator.

    q are the s + 1 positions stacked, from `origin` [m]; u the controls of the nodes stacked, or of the step.
    """
    rule, n = scheme(order), dynamics.dimension
    size = dynamics.actuator.size(n)
    q, m = ca.SX.sym("q", n * (rule.degree + 1)), ca.SX.sym("m", rule.degree + 1)
    u = ca.SX.sym("u", size * (1 if hold else rule.degree + 1))
    t, h, origin = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("origin", n)
    push = [
        dynamics.actuator.force(u[:size] if hold else u[size * j : size * (j + 1)]) / m[j]
        for j in range(rule.degree + 1)
    ]

    def point(t, r, v, m):
        return dynamics.point(t, r + origin, v, m)

    momenta = step_momenta(rule, point, t, h, ca.vertsplit(q, n), ca.vertsplit(m), push)
    return ca.Function("legendre", [q, m, u, t, h, origin], momenta)
