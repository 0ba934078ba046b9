"""Least time from one orbit to another under full thrust, in the mean over revolutions."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.memory import remembered
from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem import TransferProblem
from dmoc.shots.equinoctial import Elements

# A mean over a revolution is taken over so many places of equal angles.
PLACES = 24
# The mean motion is followed in so many steps by the classical rule of Runge and Kutta.
STEPS = 16
# The size of the primer vector is rounded where it falls below this [-]; first costates have the size 1.
ROUNDED = 1e-4
# Elements sway about their mean in waves, so many a revolution at most.
WAVES = 8


@dataclass(frozen=True)
class Wave:
    """By how much elements are more than their mean, over the angle L: waves, and a shift of that angle."""

    parts: np.ndarray
    ahead: float = 0.0
    # Whether they count for the place of arrival that is looked for, and not only for where the goal is.
    pulls: bool = True

    @classmethod
    def through(cls, angles: np.ndarray, values: np.ndarray, ahead: float) -> Wave:
        """By least squares."""
        basis = np.exp(1j * np.outer(angles, np.arange(WAVES)))
        found = np.linalg.lstsq(np.hstack([basis.real, basis[:, 1:].imag]), values, rcond=None)[0]
        parts = found[:WAVES].astype(complex)
        parts[1:] -= 1j * found[WAVES:]
        return cls(parts, ahead)

    @classmethod
    def constant(cls, values: np.ndarray) -> Wave:
        """Always the same."""
        return cls(values[None].astype(complex))

    def at(self, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The values at a mean angle, and their first and second slope."""
        turning = 1j * np.arange(len(self.parts))[:, None]
        waves = np.exp(turning * (angle + self.ahead)) * self.parts
        value, slope, bend = ((turning**power * waves).real.sum(axis=0) for power in range(3))
        return value, slope, bend

    def moved(self, more: np.ndarray, ahead: float) -> Wave:
        """With values that are more by this, and the angle farther ahead."""
        return replace(self, parts=np.vstack([self.parts[0] + more, self.parts[1:]]), ahead=self.ahead + ahead)


@dataclass(frozen=True)
class Averaged:
    """The mean motion from a state under the thrust that leads to a goal in the least time.

    With costates y of the elements and the primer vector w = B' y, for the effect B of an acceleration on them,
    the thrust points along w. The mean over a revolution of

        H = y . (rate of the elements without thrust) + thrust / mass |w|

    moves elements and costates (T. N. Edelbaum, ARS Journal 31 (1961), for circles; S. Geffroy and R. Epenoy,
    Acta Astronautica 41 (1997), for ellipses). It has no fast angle, so that an optimum is found in a few
    shots whatever the number of revolutions. The mass is known, since thrust is full throughout.
    """

    problem: TransferProblem
    state: tuple[np.ndarray, np.ndarray]

    @cached_property
    def elements(self) -> Elements:
        return Elements.of(self.problem, self.state)

    @cached_property
    def numbers(self) -> tuple[float, float, float]:
        """Mass [kg], what of it burns a unit of time [kg], the largest force as the mass that it moves [kg]."""
        problem, actuator, unit = self.problem, self.problem.actuator, self.elements
        flow = float(actuator.flow(full_controls(problem))) if actuator.burns else 0.0
        return problem.mass, flow * unit.time, (actuator.force_limit() or 0.0) * unit.time / unit.speed

    @cached_property
    def first(self) -> np.ndarray:
        """The elements at the start."""
        return self.elements.found(self.state)

    def pushed(self, time: Any, mass: Any, slow: Any, angle: Any) -> tuple[Any, Any, Any]:
        """d(elements)/dt by all effects without the thrust, the effect of an acceleration, and its axes."""
        unit = self.elements
        q, v, axes = unit.state(slow, angle)
        offset = q - ca.DM(unit.center)
        pull = Dynamics.of(self.problem).acceleration(time, q, v, mass, ca.DM.zeros(unit.axes))
        disturbed = (
            axes.T @ (pull + unit.mu * offset / ca.sqrt(ca.sumsqr(offset)) ** 3) * unit.time / unit.speed
        )
        effect = unit.effect(slow, angle)
        return effect @ disturbed, effect, axes

    def _rates(self) -> tuple[ca.Function, ca.Function]:
        """(fraction, unknowns) -> rates of unknowns; these and their slopes.

        Unknowns are elements, costates and the duration.
        """
        unit, size = self.elements, self.elements.slow
        fraction, both, angle = ca.SX.sym("fraction"), ca.SX.sym("both", 2 * size + 3), ca.SX.sym("angle")
        slow, costate, duration = both[:size], both[size + 1 : -1], both[-1]
        mass, burnt, largest = self.numbers
        passed = fraction * duration
        left = mass - burnt * passed
        coasting, effect, _ = self.pushed(self.problem.start_time + passed * unit.time, left, slow, angle)
        primer = ca.sqrt(ca.sumsqr(effect.T @ costate) + ROUNDED**2)
        # Places of equal angles last so long, in parts of a revolution.
        lasts = unit.motion(slow) / unit.speed_around(slow, angle) / PLACES
        part = lasts * (ca.dot(costate, coasting) + largest / left * primer)
        part += costate[size] * unit.motion(slow) / PLACES
        rates = duration * ca.vertcat(ca.gradient(part, costate), -ca.gradient(part, slow), 0, 0)
        at, x = ca.MX.sym("at"), ca.MX.sym("x", 2 * size + 3)
        places = ca.DM(2 * np.pi * np.arange(PLACES) / PLACES).T

        def summed(*what: ca.SX) -> ca.Function:
            parts = ca.cse([ca.densify(ca.vec(one)) for one in what])
            point = ca.Function("point", [fraction, both, angle], parts).map(PLACES)
            return ca.Function("mean", [at, x], [ca.sum2(one) for one in point.call([at, x, places])])

        return summed(rates), summed(rates, ca.jacobian(rates, both))

    @cached_property
    def _held(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        """Rates, rates with their slopes, and the goal: to look them up takes longer than a call."""
        return remembered(lambda: (*self._rates(), self._goal()), "averaged", self)

    def rate(self, fraction: float, unknowns: np.ndarray) -> np.ndarray:
        """The rates of elements, costates and duration over the fraction of the duration."""
        return self._held[0](fraction, unknowns).full().ravel()

    def march(
        self, costate: np.ndarray, duration: float, sensitive: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Elements and costates after each step, and slopes of the last over first costates and duration."""
        _, slopes, _ = self._held
        x = np.concatenate([self.first, costate, [duration]])
        size = len(x)
        flow, path, h = np.eye(size)[:, len(self.first) :], [x], 1 / STEPS

        def of(fraction: float, x: np.ndarray, flow: np.ndarray) -> tuple[np.ndarray, Any]:
            if not sensitive:
                return self.rate(fraction, x), 0.0
            rate, slope = (part.full().ravel() for part in slopes(fraction, x))
            return rate, slope.reshape(size, size).T @ flow

        for step in range(STEPS):
            begin = step * h
            a, by_a = of(begin, x, flow)
            b, by_b = of(begin + h / 2, x + h / 2 * a, flow + h / 2 * by_a)
            c, by_c = of(begin + h / 2, x + h / 2 * b, flow + h / 2 * by_b)
            d, by_d = of(begin + h, x + h * c, flow + h * by_c)
            x, flow = x + h / 6 * (a + 2 * b + 2 * c + d), flow + h / 6 * (by_a + 2 * by_b + 2 * by_c + by_d)
            path.append(x)
        return np.array(path), flow

    def _goal(self) -> ca.Function:
        """(slow elements, time, multipliers) -> equations of the goal, their slopes, those of their sum."""
        unit, problem = self.elements, self.problem
        slow, time = ca.SX.sym("slow", unit.slow), ca.SX.sym("time")
        # The place on the orbit is open: any will do.
        q, v, _ = unit.state(slow, 0.0)
        rows = problem.goal.rows(time, q, v, problem.mass)
        miss = ca.vertcat(*(row.expression - row.upper for row in rows if row.lower == row.upper))
        multipliers = ca.SX.sym("multipliers", miss.numel())
        bent = ca.hessian(ca.dot(multipliers, miss), slow)[0]
        return ca.Function(
            "goal", [slow, time, multipliers], list(map(ca.densify, (miss, ca.jacobian(miss, slow), bent)))
        )

    def goal(
        self, slow: np.ndarray, duration: float, multipliers: np.ndarray | None = None
    ) -> list[np.ndarray]:
        """Equations of the goal for elements, their slopes, and the Hessian of their weighted sum."""
        rows = self._held[2]
        given = np.zeros(rows.size1_in(2)) if multipliers is None else multipliers
        miss, slopes, bent = (
            part.full() for part in rows(slow, self.problem.start_time + duration * self.elements.time, given)
        )
        return [miss.ravel(), slopes, bent]

    def shot(
        self, z: np.ndarray, wave: Wave, sensitive: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How far unknowns z are from the equations of least time, and the slopes of that and of the end.

        z are first costates, the duration and the multipliers of the goal. At the end elements with their
        `wave` meet the goal, and costates are the multipliers' sum of its slopes; that of the angle, which
        does not change, is what the wave makes of it, if it pulls. Only the direction of costates counts:
        their size is 1.
        """
        size = self.elements.slow
        duration, multipliers = z[size + 1], z[size + 2 :]
        path, flow = self.march(z[: size + 1], duration, sensitive)
        end, costate = path[-1], path[-1][size + 1 : 2 * size + 1]
        value, slope, bend = wave.at(end[size])
        miss, slopes, bent = self.goal(end[:size] + value, duration, multipliers)
        pull, bend = (wave.pulls * part for part in (slope, bend))
        size_off, angle_off = z[:size] @ z[:size] - 1, z[size] - costate @ pull
        off = np.concatenate([miss, costate - slopes.T @ multipliers, [size_off, angle_off]])
        rows, jacobian = len(miss), np.zeros((len(off), len(z)))
        ends = np.hstack([flow, np.zeros((len(flow), rows))])
        moved = ends[:size] + np.outer(slope, ends[size])
        jacobian[:rows] = slopes @ moved
        jacobian[rows : rows + size] = ends[size + 1 : 2 * size + 1] - bent @ moved
        jacobian[rows : rows + size, size + 2 :] -= slopes.T
        jacobian[-2, :size] = 2 * z[:size]
        jacobian[-1] = -pull @ ends[size + 1 : 2 * size + 1] - (costate @ bend) * ends[size]
        jacobian[-1, size] += 1
        return off, jacobian, ends


def full_controls(problem: TransferProblem) -> np.ndarray:
    """Controls of full thrust along the first axis [N]."""
    controls = np.zeros(problem.controls)
    controls[[0, *range(problem.dimension, problem.controls)]] = problem.actuator.force_limit() or 0.0
    return controls
