"""The flight of one body with errors in its start, its force and its mass, for many samples at once."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.march import force_of
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath
from dmoc.motion.step import step_map
from dmoc.parts.forces import FreeForce
from dmoc.parts.objectives import Effort
from dmoc.scene.problem import TransferProblem

# So many flights are flown by one call: their states at all nodes are in memory at once.
AT_ONCE = 256


@dataclass(frozen=True)
class Flights:
    """Flights of the forces of a solution, on its own mesh, by the scheme that it was optimised with.

    An error is a column: position [m], velocity [m/s], force (relative), turn of the force about each axis of
    space (of the plane one) [rad], mass (relative to that at the start). Those of force, turn and mass are the
    same all the way. A further force along each axis [N] may be another one in each step. Propellant burns as
    planned.
    """

    problem: TransferProblem
    path: DiscretePath
    gains: np.ndarray | None = None

    @property
    def axes(self) -> int:
        return self.path.position.shape[1]

    @property
    def turns(self) -> int:
        """In how many ways the force may be turned."""
        return {1: 0, 2: 1, 3: 3}[self.axes]

    @property
    def parts(self) -> dict[str, int]:
        """The parts of an error and their sizes."""
        n = self.axes
        return {"position": n, "velocity": n, "force": 1, "pointing": self.turns, "mass": 1}

    @property
    def size(self) -> int:
        return sum(self.parts.values())

    @property
    def rule(self) -> Scheme:
        return scheme(self.path.order)

    @property
    def free(self) -> Dynamics:
        """The dynamics with a force that comes as it is."""
        plain = replace(self.problem, actuator=FreeForce(), objective=Effort(), constraints=())
        return Dynamics.of(plain)

    def flown(self, errors: np.ndarray, noise: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s] at all nodes, shape (samples, nodes, axes).

        The noise has shape (samples, steps, axes).
        """
        march, inputs = self._march()
        begin = self._begin()
        found = []
        for first in range(0, len(errors), AT_ONCE):
            some = errors[first : first + AT_ONCE]
            states = begin.map(len(some))(some.T).full()
            shared, own = list(range(1, 1 + len(inputs))), np.zeros((self.axes, self.steps))
            if noise is None:
                shared.append(1 + len(inputs))
            else:
                own = noise[first : first + AT_ONCE].reshape(-1, self.axes).T
            _, moved, speeds = march.map("flights", "serial", len(some), shared, [])(states, *inputs, own)
            found.append([self._by_sample(part.full(), len(some)) for part in (moved, speeds)])
        moved, speeds = (np.concatenate(part) for part in zip(*found, strict=True))
        start = (
            errors[:, None, : self.axes],
            self.path.start_velocity + errors[:, None, self.axes : 2 * self.axes],
        )
        position = np.concatenate([start[0], moved], axis=1) + self.path.position[0]
        return position, np.concatenate([start[1], speeds], axis=1)

    @property
    def steps(self) -> int:
        return len(self.path.mesh) - 1

    @cached_property
    def linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """States at the step ends of the planned path, and each step's slopes by state, noise and forces.

        Of shapes (steps+1, state), then (steps, state, ..): state, axes, and forces x axes.
        """
        march, inputs = self._march()
        step, steps, still = self._step(), self.steps, np.zeros((self.axes, self.steps))
        states = np.zeros((self._state, steps + 1))
        states[:, :1] = self._begin()(np.zeros(self.size)).full()
        states[:, 1:] = march(states[:, 0], *inputs, still)[0].full()
        given = [ca.MX.sym(f"w{i}", *step.size_in(i)) for i in range(step.n_in())]
        after = step(*given)[0]
        slopes = [ca.densify(ca.jacobian(after, one)) for one in (given[0], given[-1], given[2])]
        found = ca.Function("jacobian", given, slopes).map(steps)(states[:, :-1], *inputs, still)
        return states.T, *(part.full().reshape(self._state, steps, -1).transpose(1, 0, 2) for part in found)

    @cached_property
    def begin_slopes(self) -> np.ndarray:
        """Derivatives of the state at the start by an error."""
        first = ca.MX.sym("e", self.size)
        slopes = ca.Function("start", [first], [ca.densify(ca.jacobian(self._begin()(first), first))])
        return slopes(np.zeros(self.size)).full()

    def process(self, sigma: float) -> np.ndarray:
        """Covariance of positions and velocities by noise of the force, (steps+1, 2 axes, 2 axes).

        P <- A P A' + sigma^2 B B' with the Jacobians A and B of each step by its state and by its noise.
        """
        states, along, across, _ = self.linear
        found = [np.zeros((self._state, self._state))]
        for a, b in zip(along, across, strict=True):
            found.append(a @ found[-1] @ a.T + sigma**2 * (b @ b.T))
        seen = self._of_velocity(states.T)
        return seen @ np.array(found) @ seen.transpose(0, 2, 1)

    def slopes(self) -> np.ndarray:
        """Derivatives of positions and velocities at the step ends by an error, (steps+1, 2 axes, size).

        The product of the Jacobians of all steps up to there, each at the planned path.
        """
        states, along, *_ = self.linear
        # S_(k+1) = A_k S_k, as P_(k+1) = A_k P_k A_k' for the covariance of a state that holds the errors too.
        found = [self.begin_slopes]
        for a in along:
            found.append(a @ found[-1])
        return self._of_velocity(states.T) @ np.array(found)

    def with_feedback(self, gains: np.ndarray) -> Flights:
        """The same flights, whose force answers how far they are off the plan at the begin of each step."""
        return replace(self, gains=gains)

    def momentum_slopes(self) -> np.ndarray:
        """Derivatives of position and momentum per mass by position and velocity at the begin of each step."""
        n, states = self.axes, self.linear[0]
        back = self._of_velocity(states.T)[:-1, :, : 2 * n]
        return np.linalg.inv(back)

    @property
    def _state(self) -> int:
        """Position from the start, momentum per mass and the errors that last."""
        return self.size

    def _of_velocity(self, states: np.ndarray) -> np.ndarray:
        """Derivatives of position and velocity by a state at the step ends."""
        n, dynamics, path = self.axes, self.free, self.path
        state, t, m = ca.SX.sym("state", self._state), ca.SX.sym("t"), ca.SX.sym("m")
        mass = m + path.mass[0] * state[-1]
        speed = dynamics.velocity(t, state[:n] + path.position[0], state[n : 2 * n], mass)
        both = ca.jacobian(ca.vertcat(state[:n], speed), state)
        made = ca.Function("by_state", [state, t, m], [ca.densify(both)])
        times = self.problem.start_time + path.duration * path.mesh
        found = made(states, times[None], path.mass[:: self.rule.degree][None]).full()
        return found.reshape(2 * n, len(times), self._state).transpose(1, 0, 2)

    def _by_sample(self, values: np.ndarray, samples: int) -> np.ndarray:
        """(axes x nodes of a step, samples x steps) -> (samples, nodes but the first, axes)."""
        n, s = self.axes, self.rule.degree
        steps = len(self.path.mesh) - 1
        return values.reshape(s, n, samples, steps).transpose(2, 3, 0, 1).reshape(samples, steps * s, n)

    def _begin(self) -> ca.Function:
        """The state at the start of a flight, from its error."""
        n, path, dynamics = self.axes, self.path, self.free
        error = ca.SX.sym("error", self.size)
        place, speed = path.position[0] + error[:n], path.start_velocity + error[n : 2 * n]
        mass = path.mass[0] * (1 + error[-1])
        momentum = dynamics.momentum(self.problem.start_time, place, speed, mass)
        return ca.Function("begin", [error], [ca.vertcat(error[:n], momentum, error[2 * n :])])

    def _march(self) -> tuple[ca.Function, list[np.ndarray]]:
        """All steps of a flight, and their inputs side by side."""
        path, steps = self.path, len(self.path.mesh) - 1
        at = step_nodes(steps, self.rule)
        force = force_of(Dynamics.of(self.problem), path)
        if not path.hold:
            force = force[at.T].reshape(at.size, self.axes)
        times = self.problem.start_time + path.duration * path.mesh[:-1]
        inputs = [path.mass[at], force.T, times[None], path.duration * np.diff(path.mesh)[None]]
        if self.gains is not None:
            planned = replace(self, gains=None).linear[0][:-1, : 2 * self.axes]
            inputs += [planned.T, self.gains.transpose(1, 0, 2).reshape(self.axes, -1)]
        return self._step().mapaccum("flight", steps), inputs

    def _step(self) -> ca.Function:
        """(state, masses, forces, t, h, noise) -> the state after a step, moves and velocities at its nodes.

        With feedback the planned position and momentum and the gains stand before the noise.
        """
        n, rule, path = self.axes, self.rule, self.path
        state = ca.MX.sym("state", self._state)
        masses = ca.MX.sym("masses", rule.degree + 1)
        forces = ca.MX.sym("forces", n, 1 if path.hold else rule.degree + 1)
        t, h, noise = ca.MX.sym("t"), ca.MX.sym("h"), ca.MX.sym("noise", n)
        ends = np.cumsum([0, *self.parts.values()]).tolist()
        r, p, push, turn, heavier = ca.vertsplit(state, ends)
        dynamics = self.free
        answers = []
        if self.gains is not None:
            answers = [ca.MX.sym("planned", 2 * n), ca.MX.sym("gains", n, 2 * n)]
            more = answers[1] @ (ca.vertcat(r, p) - answers[0])
            commanded = forces + ca.repmat(more, 1, forces.shape[1])
        else:
            commanded = forces
        exerted = (1 + push) * (_turned(turn, n) @ commanded) + ca.repmat(noise, 1, forces.shape[1])
        dq, dp, v = step_map(dynamics, rule, path.hold)(
            r, p, masses + path.mass[0] * heavier, exerted, t, h, path.position[0]
        )
        # The position within a step is a polynomial whose slope is known at all nodes.
        inner = [r + h * (v @ ca.DM(row)) for row in rule.integral[1:-1]]
        moved = ca.vertcat(*inner, r + dq)
        # At the end of a step the velocity is that of the momentum, as everywhere in dmoc.
        last = masses[-1] + path.mass[0] * heavier
        speed = dynamics.velocity(t + h, path.position[0] + r + dq, p + dp, last)
        speeds = ca.vertcat(ca.vec(v[:, 1:-1]), speed)
        made = ca.Function(
            "step",
            [state, masses, forces, t, h, *answers, noise],
            [ca.vertcat(r + dq, p + dp, state[2 * n :]), moved, speeds],
        )
        return made.expand() if rule.degree == 1 and not dynamics.depends_on_velocity else made


def _turned(turn: Any, axes: int) -> Any:
    """The rotation by a small turn [rad]; in space that of Cayley, which is right to its third power."""
    if axes == 1:
        return ca.MX.eye(1)
    if axes == 2:
        cos, sin = ca.cos(turn), ca.sin(turn)
        return ca.vertcat(ca.horzcat(cos, -sin), ca.horzcat(sin, cos))
    cross = ca.skew(turn)
    return ca.MX.eye(3) + (cross + cross @ cross / 2) / (1 + ca.dot(turn, turn) / 4)
