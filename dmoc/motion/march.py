"""Forward integration by the variational scheme, the one that a solve optimises with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import flag, number, of_kind, short, whole
from dmoc.basics.numerics import columns
from dmoc.basics.plain import Brief
from dmoc.basics.records import dataclass
from dmoc.configurations.of_problem import configuration_of
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import node_fractions, step_nodes, uniform_mesh
from dmoc.motion.path import DiscretePath
from dmoc.motion.step import step_map
from dmoc.parts.actuator import told_of
from dmoc.scene.problem import TransferProblem

# A forward march is built for at most this many steps and run piece by piece: a map of 100,000 steps takes
# ten times longer to build than to run.
PIECE = 4096


@dataclass(frozen=True)
class Trajectory(Brief):
    """A path found by forward integration, at the step ends; SI units, one row an end.

    Attributes
    ----------
    time : array, shape (steps+1,)
        [s].
    position, velocity : arrays, shape (steps+1, axes)
        [m], [m/s].
    momentum : array, shape (steps+1, axes)
        dl/dv, per unit mass [m/s].
    attitude : array, shape (steps+1, 4), or None
        Unit quaternion of a rigid body, scalar first, from body to space.
    rate, spin : arrays, shape (steps+1, 3), or None
        Angular rate [rad/s] and angular momentum per unit mass [m^2/s] of a rigid body, in body axes, the
        momenta of its reaction wheels included.
    wheel_momentum : array, shape (steps+1, wheels), or None
        Angular momenta of reaction wheels about their axes [N m s].
    mass : array, shape (steps+1,)
        [kg].
    energy : array, shape (steps+1,)
        v . dl/dv - l, per unit mass [J/kg].
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    momentum: np.ndarray
    mass: np.ndarray
    energy: np.ndarray
    attitude: np.ndarray | None = None
    rate: np.ndarray | None = None
    spin: np.ndarray | None = None
    wheel_momentum: np.ndarray | None = None


def simulate(
    problem: TransferProblem,
    controls: Any = None,
    steps: int | None = None,
    order: int = 2,
    hold: bool = False,
    duration: float | None = None,
    compensated: bool = False,
) -> Trajectory:
    """Integrate a scene forward from its start with the variational scheme.

    Parameters
    ----------
    problem : TransferProblem
        Its start must be a state without free entries.
    controls : Solution or array, optional
        A solution, whose mesh, order and controls are then used, or controls of shape
        (steps*s+1, size), with hold (steps, size); nothing for a coast.
    steps, order, hold
        As in `solve`, if `controls` is not a solution.
    duration : float, optional
        [s], if it is not the problem's.
    compensated : bool
        Carry the rounding error of each addition of a step on to the next step (Kahan's sum): over a
        million explicit steps angular momentum is then kept to the last bit. Takes up to twice as long.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        If the start is not fixed, or the controls do not fit the mesh.
    """
    of_kind("problem", problem, TransferProblem)
    hold, compensated = flag("hold", hold), flag("compensated", compensated)
    dynamics = Dynamics.of(problem)
    position, velocity = problem.start.fixed()
    if np.isnan(position).any() or np.isnan(velocity).any():
        raise ValueError(f"simulate needs a start without free entries; got {problem.start.words()}")
    path = getattr(controls, "path", None)
    if path is None:
        path = _path_at_start(problem, controls, steps, order, hold, duration)
    elif path.position.shape[1:] + path.control.shape[1:] != (
        dynamics.positions,
        dynamics.controls,
    ):
        raise ValueError("the solution has another dimension or other controls than the problem")
    path.refuse_unusable("controls")
    path = replace(path, mass=node_masses(dynamics, path, problem.mass))
    time = problem.start_time + path.duration * path.mesh
    mass = path.mass[:: scheme(path.order).degree]
    momentum = dynamics.momentum(time[0], position, velocity, mass[0])
    q, p = rollout(dynamics, path, problem.start_time, position, np.array(momentum).ravel(), compensated)
    v = columns(dynamics.velocity, time, q.T, p.T, mass)[0].T
    energy = columns(dynamics.energy, time, q.T, v.T, mass)[0].ravel()
    made = dynamics.configuration.coordinates
    trajectory = Trajectory(time, q[:, made.places], v[:, made.speeds], p[:, made.speeds], mass, energy)
    if made.turns:
        attitude = np.hstack([q[:, at] for at in made.quaternions])
        turned = {"attitude": attitude, "rate": v[:, made.rates], "spin": p[:, made.rates]}
        trajectory = replace(trajectory, **turned)
    return replace(trajectory, wheel_momentum=v[:, made.spins]) if made.spins.any() else trajectory


def _path_at_start(
    problem: TransferProblem, controls: Any, steps: int | None, order: int, hold: bool, duration: float | None
) -> DiscretePath:
    """Controls on a mesh, checked, as a path that stays at the start."""
    mesh = uniform_mesh(400 if steps is None else whole("steps", steps))
    nodes = len(node_fractions(mesh, scheme(order)))
    shape = (len(mesh) - 1 if hold else nodes, problem.controls)
    try:
        given = np.zeros(shape) if controls is None else np.asarray(controls, float)
    except Exception:  # whatever a user's object raises
        raise ValueError(f"controls must be a Solution or an array of numbers; got {short(controls)}") from None
    if given.shape != shape:
        raise ValueError(f"controls must have shape {shape} on this mesh; got {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError(
            f"controls must be finite; row {int(np.argmin(np.isfinite(given).all(axis=1)))} is not"
        )
    longest = (
        problem.duration_bounds[1] if duration is None else number("duration", duration, "s", positive=True)
    )
    position, velocity = problem.start.fixed()
    mass, still = np.full(nodes, problem.mass), np.tile(position, (nodes, 1))
    made = configuration_of(problem).coordinates
    return DiscretePath(mesh, order, hold, longest, still, given, mass, velocity, velocity, made_of=made)


def node_masses(dynamics: Dynamics, path: DiscretePath, mass: float) -> np.ndarray:
    """Masses of the nodes [kg], shape (nodes,), from that at the start and the controls of a path.

    m_i = m_0 - h sum_j A_ij flow_j with the Lobatto IIIA matrix A, as in the transcription.
    """
    rule, at = scheme(path.order), step_nodes(len(path.mesh) - 1, scheme(path.order))
    masses = np.full(at[-1, -1] + 1, float(mass))
    if not dynamics.actuator.burns:
        return masses
    flow = told_of(dynamics.actuator, "flow", path.control)
    h = path.duration * np.diff(path.mesh)
    burnt = h * (rule.integral @ (np.tile(flow, (rule.degree + 1, 1)) if path.hold else flow[at]))
    before = np.concatenate([[0.0], np.cumsum(burnt[-1])])
    masses[at] -= before[:-1] + burnt
    masses[-1] = mass - before[-1]
    return masses


def rollout(
    dynamics: Dynamics,
    path: DiscretePath,
    start_time: float,
    position: np.ndarray,
    momentum: np.ndarray,
    compensated: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and momenta per mass [m/s] at the step ends, one row an end, from the start.

    Of a body that turns, the coordinates q and Z'p.

    Only the mesh, masses and controls of `path` are used, and its first position as the origin.
    """
    n, steps = dynamics.positions, len(path.mesh) - 1
    advance, inputs = _advance(dynamics, path, start_time, compensated)
    states = np.zeros((advance.numel_out(0), steps + 1))
    # Positions count from the path's first one: far from the origin their increments would lose digits.
    count_of_states = n + dynamics.freedom
    states[:count_of_states, 0] = np.concatenate([position - path.position[0], momentum])
    march = advance.mapaccum(min(steps, PIECE))
    for begin in range(0, steps, PIECE):
        count = min(PIECE, steps - begin)
        if count < PIECE and begin:
            march = advance.mapaccum(count)
        pieces = []
        for value in inputs:
            wide = value.shape[1] // steps
            pieces.append(value[:, begin * wide : (begin + count) * wide])
        states[:, begin + 1 : begin + count + 1] = march(states[:, begin], *pieces)
    return states[:n].T + path.position[0], states[n:count_of_states].T


def _advance(
    dynamics: Dynamics, path: DiscretePath, start_time: float, compensated: bool = False
) -> tuple[ca.Function, list]:
    """(state, m, u, t, h) -> the state one step later, and its inputs for all steps side by side.

    Compensated, the state is twice as long: its second half is what rounding has added so far.
    """
    rule, steps, n = scheme(path.order), len(path.mesh) - 1, dynamics.positions
    inputs = _inputs(path, start_time)
    given = [ca.MX.sym("w", value.shape[0], value.shape[1] // steps) for value in inputs]
    state = ca.MX.sym("state", n + dynamics.freedom)
    increments = step_map(dynamics, rule, path.hold)(state[:n], state[n:], *given, path.position[0])
    if compensated:
        return _compensated(state, given, ca.vertcat(*increments[:2])), inputs
    advance = ca.Function("advance", [state, *given], [state + ca.vertcat(*increments[:2])])
    # An explicit step has no root to find: as one plain expression it is three times as fast.
    explicit = rule.degree == 1 and not dynamics.depends_on_velocity
    return advance.expand() if explicit else advance, inputs


def _inputs(path: DiscretePath, start_time: float) -> list[np.ndarray]:
    """Masses, controls, begin and length of all steps, side by side."""
    rule, steps = scheme(path.order), len(path.mesh) - 1
    at = step_nodes(steps, rule)
    count = path.control.shape[1]
    control = path.control if path.hold else path.control[at.T].reshape(at.size * bool(count), count)
    times = start_time + path.duration * path.mesh[:-1]
    lengths = path.duration * np.diff(path.mesh)
    if np.array_equal(path.mesh, uniform_mesh(steps)):
        # The fractions of 20,000 equal steps differ by round-off, 1e-12 of a step: the energy would drift.
        lengths[:] = path.duration / steps
    return [path.mass[at], control.T, times[None], lengths[None]]


def _compensated(state: ca.MX, given: list, increments: ca.MX) -> ca.Function:
    """Kahan's sum of a state and its increments, by calls that CasADi cannot simplify to the plain sum."""
    a, b = ca.SX.sym("a", state.numel()), ca.SX.sym("b", state.numel())
    add = ca.Function("add", [a, b], [a + b], {"never_inline": True})
    subtract = ca.Function("subtract", [a, b], [a - b], {"never_inline": True})
    excess = ca.MX.sym("excess", state.numel())
    wanted = subtract(increments, excess)
    reached = add(state, wanted)
    left = subtract(subtract(reached, state), wanted)
    return ca.Function("advance", [ca.vertcat(state, excess), *given], [ca.vertcat(reached, left)])


def force_of(dynamics: Dynamics, path: DiscretePath) -> np.ndarray:
    """What the actuator does at the nodes of a path, or in its steps with hold, one row each.

    A force in space axes [N] and, for a rigid body, a torque in body axes [N m] behind it. A force that is
    fixed to a turning body and held over a step is that at the begin of the step.
    """
    rule = scheme(path.order)
    at = slice(0, -1, rule.degree) if path.hold else slice(None)
    return wrench_of(dynamics, path.position[at], path.control)


def wrench_of(dynamics: Dynamics, position: np.ndarray, control: np.ndarray) -> np.ndarray:
    """Force [N] and torque [N m] of controls at positions, one row each."""
    return columns(dynamics.wrench, position.T, control.T)[0].T
