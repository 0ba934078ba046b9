"""The path of least time from a state to an open place on an orbit, over many revolutions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial

import casadi as ca
import numpy as np
from numpy.polynomial import chebyshev

from dmoc.basics.memory import remembered
from dmoc.basics.numerics import adams
from dmoc.basics.records import dataclass
from dmoc.scene.problem import TransferProblem
from dmoc.shots.averaged import PLACES, STEPS, Averaged, Wave

# A search ends after so many corrections, where no part of one down to this gets nearer [-], or where the
# equations hold to this [-], far better than the mean tells of the motion. One changes the duration by at most
# this part of it [-].
MOST_CORRECTIONS, SHORTEST, MET, LONGER = 25, 1e-2, 1e-9, 0.3
# The place of arrival with the shortest duration is found after so few of them, or left as it is.
FEW_CORRECTIONS = 6
# Costates along the way are a polynomial of this degree.
DEGREE = 8
# A flight follows the motion to this relative error [-], in at most so many steps.
FLIGHT_TOLERANCE, MOST_STEPS = 1e-10, 1_000_000
# The waves of the elements are seen at so many places of a revolution around the end.
SEEN = 65
# The place of arrival is looked for over so many radians before and after that of the mean motion, at so many
# places.
REACH, TRIED = 3 * np.pi, 1441
# At most so many places are tried.
MOST_PLACES = 5
# A flight meets the goal if its elements are so near [-] and its angle so near [rad]; those that do take one to
# three.
NEAR, NEAR_ANGLE, MOST_FLIGHTS = 1e-6, 1e-3, 4
# Another place than the natural one costs at least so much [-], up to where it is out of the question.
LEAST_COST, MOST_COST = 1e-3, 1e2


@dataclass(frozen=True)
class Aim:
    """Costates and a duration that lead to the goal: unknowns of `Averaged.shot`."""

    averaged: Averaged
    unknowns: np.ndarray

    @property
    def duration(self) -> float:
        """In units of time."""
        return float(self.unknowns[self.averaged.elements.slow + 1])

    @cached_property
    def path(self) -> np.ndarray:
        """Elements, costates and duration after each step of the mean motion."""
        return self.averaged.march(self.unknowns[: len(self.averaged.first)], self.duration)[0]

    def flight(self, fractions: np.ndarray) -> np.ndarray:
        """The elements of the motion itself under thrust along the mean costates, one column a place."""
        motion, _ = remembered(partial(_motion, self.averaged), "averaged flight", self.averaged)
        march = adams(motion, fractions, FLIGHT_TOLERANCE, MOST_STEPS)
        return march(x0=self.averaged.first, p=self._given)["xf"].full()

    def along(self, fractions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Positions [m], velocities [m/s], forces [N] and masses [kg] at fractions of the duration."""
        _, seen = remembered(partial(_motion, self.averaged), "averaged flight", self.averaged)
        position, velocity, force = (
            part.full().T for part in seen(fractions[None], self.flight(fractions), self._given)
        )
        mass, burnt, _ = self.averaged.numbers
        return position, velocity, force, mass - burnt * self.duration * fractions

    @property
    def _given(self) -> np.ndarray:
        count = len(self.averaged.first)
        places = np.linspace(-1.0, 1.0, STEPS + 1)
        parts = chebyshev.chebfit(places, self.path[:, count : 2 * count], DEGREE)
        return np.append(parts.ravel("F"), self.duration)


def least_time(problem: TransferProblem, state: tuple) -> tuple[float, Callable] | None:
    """The least time from a state to the goal, many revolutions away [s], and the path; None if none is found.

    The path gives positions [m], velocities [m/s], forces [N] and masses [kg], a row for each of the fractions
    of the duration that it is asked for. It meets the goal but for a millionth, and is an optimum but for the
    square of the thrust over gravity.
    """
    parts = problem.start, problem.goal, problem.effects, problem.actuator, problem.mass, problem.start_time
    found = remembered(partial(_aimed, Averaged(problem, state)), "soonest", *parts, *state)[0]
    return None if found is None else (found.duration * found.averaged.elements.time, found.along)


def _aimed(averaged: Averaged) -> tuple[Aim | None]:
    """The aim whose flight meets the goal at the best place within some revolutions.

    Elements sway about their mean: around an oblate body the place where one arrives makes a difference of a
    hundredth of the duration.
    """
    first = _first_aim(averaged)
    aim = (
        None if first is None else _corrected(averaged, first, Wave.constant(np.zeros(averaged.elements.slow)))
    )
    if aim is None:
        return (None,)
    try:
        wave = _waves(aim)
        mean = Wave.constant(wave.parts[0].real)
        middle = _corrected(averaged, aim.unknowns, mean) or aim
        for place in _best_places(middle, wave):
            still = _corrected(averaged, middle.unknowns, Wave.constant(wave.at(place)[0]))
            found = None if still is None else _on_waves(still, replace(wave, pulls=False))
            if found is not None:
                return (_on_waves(found, wave, FEW_CORRECTIONS) or found,)
    except RuntimeError:
        # The body falls into the attractor.
        return (None,)
    return (middle,)


def _on_waves(begin: Aim, wave: Wave, most: int = MOST_CORRECTIONS) -> Aim | None:
    """The aim whose flight meets the goal where elements sway, from one that is near; None if there is none."""
    averaged, size, found = begin.averaged, begin.averaged.elements.slow, None
    for _ in range(MOST_FLIGHTS):
        aim = _corrected(averaged, (found or begin).unknowns, wave, most)
        if aim is None:
            break
        found, end, last = aim, aim.path[-1], aim.flight(np.array([0.0, 1.0]))[:, -1]
        more, late = last[:size] - end[:size] - wave.at(end[size])[0], last[size] - end[size] - wave.ahead
        wave = wave.moved(more, late)
        if np.abs(more).max() < NEAR and abs(late) < NEAR_ANGLE:
            break
    return found


def _first_aim(averaged: Averaged) -> np.ndarray | None:
    """Unknowns of a small change from the start to the nearest state of the goal, whatever that leaves open."""
    problem, unit, size = averaged.problem, averaged.elements, averaged.elements.slow
    goal = unit.found(problem.goal.estimate(problem.start_time, averaged.state))[:size]
    change, middle = goal - averaged.first[:size], 0.5 * (goal + averaged.first[:size])
    if not np.any(change):
        return None
    angles = 2 * np.pi * np.arange(PLACES) / PLACES
    effects = np.stack([np.array(ca.DM(unit.effect(ca.DM(middle), angle)))[:size] for angle in angles])
    lasts = np.array([float(1 / unit.speed_around(middle, angle)) for angle in angles])
    lasts /= lasts.sum()
    # The direction is that of the least effort, the duration what full thrust takes along it.
    costate = np.linalg.solve(np.einsum("k,kij,klj->il", lasts, effects, effects), change)
    costate /= np.linalg.norm(costate)
    mass, _, largest = averaged.numbers
    duration = costate @ change / (lasts @ np.linalg.norm(costate @ effects, axis=1)) * mass / largest
    _, slopes, _ = averaged.goal(goal, duration)
    return np.concatenate([costate, [0.0, duration], np.linalg.lstsq(slopes.T, costate, rcond=None)[0]])


def _corrected(
    averaged: Averaged, unknowns: np.ndarray, wave: Wave, most: int = MOST_CORRECTIONS
) -> Aim | None:
    """The aim that meets the equations with a wave, by Newton's method from near it; None if none is found."""
    z, place = unknowns, averaged.elements.slow + 1
    for _ in range(most):
        off, jacobian, _ = averaged.shot(z, wave)
        size = np.linalg.norm(off)
        if size < MET:
            return Aim(averaged, z)
        if not np.isfinite(jacobian).all():
            return None
        inverse = np.linalg.pinv(jacobian, 1e-12)
        change, scales = -inverse @ off, np.ones(len(z))
        scales[place] /= z[place]
        share = min(1.0, LONGER * z[place] / (abs(change[place]) or 1.0))
        # A step is judged by the correction that it leaves (P. Deuflhard, 2004): equations differ in size.
        judged = scales[:, None] * inverse
        before = np.linalg.norm(judged @ off)
        while True:
            after = np.linalg.norm(judged @ averaged.shot(z + share * change, wave, False)[0])
            if after < (1 - 0.1 * share) * before:
                break
            share *= 0.5
            if share < SHORTEST:
                return None
        z = z + share * change
    return None


def _waves(aim: Aim) -> Wave:
    """By how much the elements of a flight are more than their mean, over a revolution around the end."""
    averaged, size, end = aim.averaged, aim.averaged.elements.slow, aim.path[-1]
    turn = 2 * np.pi / float(averaged.elements.motion(end[:size])) / aim.duration
    seen = np.linspace(1 - 0.5 * turn, 1 + 0.5 * turn, SEEN)
    flown = aim.flight(np.append(0.0, seen))[:, 1:].T
    drift = np.outer(seen - 1, averaged.rate(1.0, end)[:size])
    return Wave.through(
        flown[:, size], flown[:, :size] - end[:size] - drift, flown[SEEN // 2, size] - end[size]
    )


def _best_places(aim: Aim, wave: Wave) -> np.ndarray:
    """Mean angles of arrival from where the duration grows both ways, the shortest first.

    To first order, a shift of the goal by what the waves are at a place changes the duration and the place
    where the mean motion arrives; to arrive elsewhere takes a costate of the angle, and grows with the square.
    """
    averaged, size, end = aim.averaged, aim.averaged.elements.slow, aim.path[-1]
    mean = wave.parts[0].real
    _, jacobian, ends = averaged.shot(aim.unknowns, Wave.constant(mean))
    slopes = averaged.goal(end[:size] + mean, aim.duration)[1]
    shifted = -np.linalg.lstsq(jacobian, np.eye(len(jacobian))[:, : len(slopes)] @ slopes, rcond=1e-12)[0]
    away = np.linspace(-REACH, REACH, TRIED)
    values = np.stack([wave.at(end[size] + angle)[0] - mean for angle in away])
    later, natural = values @ shifted[size + 1], values @ (ends[size] @ shifted)
    jacobian[-1] = ends[size]
    costate = np.linalg.lstsq(jacobian, np.eye(len(jacobian))[-1], rcond=1e-13)[0][size]
    gain = end[size + 1 : 2 * size + 1] @ averaged.rate(1.0, end)[:size] / aim.duration
    total = later + 0.5 * np.clip(abs(costate / gain), LEAST_COST, MOST_COST) * (away - natural) ** 2
    inside = np.flatnonzero((total[1:-1] <= total[:-2]) & (total[1:-1] < total[2:])) + 1
    return end[size] + away[inside[np.argsort(total[inside])]][:MOST_PLACES]


def _motion(averaged: Averaged) -> tuple[dict, ca.Function]:
    """The motion of the elements under full thrust along given costates; what is seen of it on the way."""
    unit, problem, count = averaged.elements, averaged.problem, len(averaged.first)
    fraction, both = ca.SX.sym("fraction"), ca.SX.sym("both", count)
    given = ca.SX.sym("given", (DEGREE + 1) * count + 1)
    parts, duration = ca.reshape(given[:-1], DEGREE + 1, count), given[-1]
    place = 2 * fraction - 1
    terms = [ca.SX(1), place]
    while len(terms) <= DEGREE:
        terms.append(2 * place * terms[-1] - terms[-2])
    slow, angle, (mass, burnt, largest) = both[:-1], both[-1], averaged.numbers
    left = mass - burnt * fraction * duration
    coasting, effect, axes = averaged.pushed(
        problem.start_time + fraction * duration * unit.time, left, slow, angle
    )
    primer = effect.T @ (parts.T @ ca.vertcat(*terms))
    push = primer / ca.sqrt(ca.sumsqr(primer) + np.finfo(float).eps)
    rate = coasting + largest / left * effect @ push
    rate[-1] += unit.speed_around(slow, angle)
    position, velocity, _ = unit.state(slow, angle)
    force = (problem.actuator.force_limit() or 0.0) * axes @ push
    seen = ca.Function("seen", [fraction, both, given], [position, velocity, force])
    return {"t": fraction, "x": both, "p": given, "ode": ca.cse(duration * rate)}, seen
