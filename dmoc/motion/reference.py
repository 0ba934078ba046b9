"""An independent integrator, which knows the equations of motion but not the variational scheme."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import coefficients
from dmoc.basics.quaternions import conjugate, rotation_vectors
from dmoc.basics.quaternions import times as multiplied
from dmoc.configurations.coordinates import ATTITUDE, Coordinates
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.path import DiscretePath
from dmoc.motion.scales import least_extent, path_scales
from dmoc.motion.step import weighted

# It gives up if the steps of a path need more parts than this in all: such a path runs into a singularity.
MOST_PARTS = 1_000_000
# It may miss the goal by this part of the path [-] where no tolerance is asked for: coarse meshes miss by more.
MISSED = 1e-2


def goal_miss(dynamics: Dynamics, path: DiscretePath, start_time: float) -> tuple[np.ndarray, np.ndarray]:
    """By how much `reference` misses the goal of a path and its velocity there, one entry a freedom.

    Places in [m], attitudes as small turns about the body axes [rad]; speeds [m/s] and rates [rad/s].
    """
    # A motion that cannot be integrated gives NaN, which no limit lets pass.
    with np.errstate(invalid="ignore"):
        q, v = reference(dynamics, path, start_time, path.start_velocity)
        return apart(path.coordinates, q, path.position[-1]), v - path.goal_velocity


def apart(made_of: Coordinates, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The differences of coordinates, of attitudes as rotation vectors [rad]; of shape (..., freedom)."""
    parts = zip(made_of.blocks, made_of.cut(one), made_of.cut(other), strict=True)
    return np.concatenate(
        [
            rotation_vectors(multiplied(conjugate(b), a)) if kind == ATTITUDE else a - b
            for (kind, *_), a, b in parts
        ],
        axis=-1,
    )


def reference(
    dynamics: Dynamics, path: DiscretePath, start_time: float, velocity: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and velocity [m/s] at the goal by DOP853, from the start with the path's controls.

    Dormand and Prince's Runge-Kutta method of order 8 with the coefficients and the error estimate of
    SciPy, on the equations of motion: it knows nothing of the scheme. The control is the one that is flown
    (`dmoc.motion.flown`), with hold the held value; the integrator restarts wherever its derivatives jump,
    and cuts pieces in parts until its error is below 1e-11. A body turns by Euler's equations and
    dq/dt = q o (0, w) / 2, whose quaternion may leave the unit sphere by the integrator's error.

    Returns
    -------
    position, velocity : arrays
        NaN where the motion cannot be integrated.
    """
    control, mesh = _control_powers(dynamics, path)
    n, steps = dynamics.positions, len(mesh) - 1
    start = np.concatenate([np.zeros(n), velocity, path.mass[:1]])
    march_one = remembered(partial(_dop853, dynamics, control.shape[0]), "dop853", dynamics, control.shape[0])
    given = march_one.mx_in()[:-2]
    constants = path.position[0], _tolerances(dynamics, path, velocity, control)
    advance = ca.Function("advance", given, march_one(*given, *constants))
    parts = np.ones(steps, int)
    while parts.sum() <= MOST_PARTS:
        owner = np.repeat(np.arange(steps), parts)
        share = 1 / parts[owner]
        # The i-th part of a step begins at i times its share of the step.
        begin = (np.arange(len(owner)) - (np.cumsum(parts) - parts)[owner]) * share
        h = path.duration * np.diff(mesh)[owner]
        times = start_time + path.duration * mesh[:-1][owner]
        march = advance.mapaccum(len(owner))
        states, errors = march(start, control[:, owner], times[None], h[None], begin[None], share[None])
        worst = np.zeros(steps)
        np.maximum.at(worst, owner, errors.full().ravel())
        if not np.isfinite(worst).all():
            break
        if worst.max() <= 1:
            end = states.full()[:, -1]
            return path.position[0] + end[:n], end[n:-1]
        # The error of order 8 falls with the 8th power of the number of parts, hence the root; a tenth for
        # safety.
        parts = parts * np.where(worst > 1, np.ceil(np.clip(1.1 * worst**0.125, 2, 64)), 1).astype(int)
    return np.full(n, np.nan), np.full(dynamics.freedom, np.nan)


def _control_powers(dynamics: Dynamics, path: DiscretePath) -> tuple[np.ndarray, np.ndarray]:
    """Controls of every piece as a polynomial in its fraction, shape (size (s+1), pieces), and their mesh."""
    if not path.control.shape[1]:
        return np.zeros((1, len(path.mesh) - 1)), path.mesh
    if path.hold:
        return path.control.T, path.mesh
    known = flown(dynamics, path)
    to_powers = np.linalg.inv(np.vander(scheme(path.order).points, increasing=True))
    powers = np.einsum("pj,jkn->pnk", to_powers, known.nodes)
    return powers.reshape(-1, powers.shape[2]), known.mesh


def _tolerances(
    dynamics: Dynamics, path: DiscretePath, velocity: np.ndarray, control: np.ndarray
) -> np.ndarray:
    """Absolute errors [m], [m/s], [kg] that the integrator may make: 1e-12 of extent, speed and mass."""
    n, duration = path.position.shape[1], path.duration
    if path.attitudes:
        mass, pieces = path.mass[0], dynamics.configuration.pieces()
        moments = [(share * mass, getattr(part, "moments", None)) for part, _, _, share in pieces]
        scales = path_scales(path, max(least_extent(*one) for one in moments))
        units = path.coordinates.sized(scales.extent, 1.0, scales.momentum * path.duration)
        return 1e-12 * np.concatenate([units, scales.velocities, path.mass[:1]])
    thrust = np.abs(control).max(initial=0.0) / path.mass.min()
    # A body held in place has no extent: a thousandth of where the thrust alone would take it stands in.
    extent = max(np.ptp(path.position, axis=0).max(), 1e-3 * thrust * duration**2) or 1.0
    speed = max(extent / duration, np.abs(velocity).max())
    return 1e-12 * np.concatenate([np.repeat([extent, speed], n), path.mass[:1]])


def _dop853(dynamics: Dynamics, size: int) -> ca.Function:
    """(state, control, t, h, begin, share, origin, tolerances) -> state after that part of a step, error.

    The error is in units of its tolerance. The state is position from `origin`, velocity and mass;
    `control` the coefficients of `_control_powers`; a part is `share` of a step of length h [s] that
    starts at t [s], from the fraction `begin` on.
    """
    places, rows, *weights = coefficients()
    n, count = dynamics.positions, dynamics.controls
    states = n + dynamics.freedom + 1
    state, powers = ca.SX.sym("state", states), ca.SX.sym("control", size)
    t, h, begin, share = (ca.SX.sym(name) for name in ("t", "h", "begin", "share"))
    origin, tolerances = ca.SX.sym("origin", n), ca.SX.sym("tolerances", states)

    # What is written down once costs less than what Python writes at every stage.
    fraction, y = ca.SX.sym("fraction"), ca.SX.sym("y", states)
    degrees = range(size // count if count else 0)
    u = sum((powers[count * p : count * (p + 1)] * fraction**p for p in degrees), ca.SX.zeros(count))
    q, v, flow = y[:n] + origin, y[n:-1], dynamics.actuator.flow(u)
    push = dynamics.acceleration(t + fraction * h, q, v, y[-1], dynamics.wrench(q, u))
    moves = ca.vertcat(dynamics.configuration.velocity(q, v), push, 0 if flow is None else -flow)
    rates = ca.Function("rates", [fraction, y, powers, t, h, origin], [moves])

    def rate(fraction, y):
        return rates(fraction, y, powers, t, h, origin)

    length = share * h
    slopes: list[ca.SX] = []
    for place, row in zip(places, rows, strict=True):
        moved = weighted(row[: len(slopes)], slopes)
        slopes.append(rate(begin + place * share, state + length * moved))
    after = state + length * weighted(weights[0], slopes)
    slopes.append(rate(begin + share, after))
    scale = tolerances + 1e-11 * ca.fmax(ca.fabs(state), ca.fabs(after))
    third, fifth = (ca.sumsqr(weighted(row, slopes) / scale) for row in weights[1:])
    # SciPy's combination of both estimates; 1e-300 avoids 0 / 0 where nothing moves.
    error = length * fifth / ca.sqrt((fifth + 0.01 * third) * state.numel() + 1e-300)
    return ca.Function("dop853", [state, powers, t, h, begin, share, origin, tolerances], [after, error])
