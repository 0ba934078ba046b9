"""An answer at any time, also between its nodes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.digits import lasting
from dmoc.basics.quaternions import conjugate, normalised
from dmoc.basics.quaternions import times as product
from dmoc.configurations.coordinates import ATTITUDE, Coordinates
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.flown import flown
from dmoc.motion.lobatto import scheme
from dmoc.motion.march import wrench_of
from dmoc.motion.mesh import step_nodes
from dmoc.motion.path import DiscretePath

# A time may be so far beyond the ends [-], as a part of the latest time and the duration: rounding alone.
NEAR = 1e-12


@dataclass(frozen=True, eq=False)
class Moment:
    """An answer at some times: what `Solution.at` gives. Arrays begin with the shape of the times asked for.

    Attributes
    ----------
    time : array
        [s].
    position, velocity, force : arrays, shape (..., axes)
        [m], [m/s], [N]; of a system those of all bodies, see `of`.
    mass : array
        [kg].
    attitude : array, shape (..., 4), or None
        Of a body that turns: unit quaternion from body to space, scalar first.
    rate, torque : arrays, shape (..., 3), or None
        Of a body that turns, in body axes [rad/s], [N m].
    wheel_momentum : array, shape (..., wheels), or None
        Of its reaction wheels [N m s].
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    mass: np.ndarray
    attitude: np.ndarray | None
    rate: np.ndarray | None
    torque: np.ndarray | None
    wheel_momentum: np.ndarray | None
    made_of: Coordinates

    def __repr__(self) -> str:
        """One line, or how many times."""
        if self.time.ndim:
            return f"Moment of {self.time.size} times, {self.made_of.axes} axes"
        told = {"position": "m", "velocity": "m/s", "force": "N"} if self.position.size else {}
        parts = [f"{name} {_numbers(getattr(self, name))} {unit}" for name, unit in told.items()]
        if self.attitude is not None:
            parts.append(f"attitude {_numbers(self.attitude)}, rate {_numbers(self.rate)} rad/s")
        return f"Moment at {lasting(float(self.time), 6)}: {', '.join(parts)}, mass {self.mass:.6g} kg"

    def of(self, body: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position [m], velocity [m/s] and force [N] of one body of a system.

        Raises
        ------
        ValueError
            If no body has this name.
        """
        places, speeds = named_body(self.made_of, body)
        mine, moving = places[self.made_of.places], speeds[self.made_of.speeds]
        return self.position[..., mine], self.velocity[..., moving], self.force[..., moving]


def named_body(made: Coordinates, body: str) -> tuple[np.ndarray, np.ndarray]:
    """Which coordinates and which velocities are those of a body.

    Raises
    ------
    ValueError
        If no body has this name.
    """
    names = list(dict.fromkeys(block.body for block in made.blocks))
    if body not in names:
        raise ValueError(f"no body is called {body!r}; there are {', '.join(map(repr, names))}")
    return made.of_body(body)


def moment(solution: Any, t: Any) -> Moment:
    """`Solution.at`."""
    times = checked_times(solution, t)
    # Of no time at all the moment has the shape of that of one.
    found = sampled(solution, times.ravel() if times.size else solution.time[:1])
    return shaped(found, times.shape)


def moment_of_legs(solution: Any, t: Any) -> Moment:
    """`MissionSolution.at`: each time in the leg that it lies in, that of a joint in the leg behind it."""
    times = checked_times(solution, t)
    flat = times.ravel()
    begins = [leg.provenance.start_time for leg in solution.legs[1:]]
    which = np.searchsorted(begins, flat, side="right")
    parts = [(which == i, sampled(solution.legs[i], flat[which == i])) for i in np.unique(which)]
    if not parts:
        return moment(solution.legs[0], times)
    found: dict[str, Any] = {}
    for field in fields(Moment):
        first = getattr(parts[0][1], field.name)
        if isinstance(first, np.ndarray):
            found[field.name] = np.empty((len(flat), *first.shape[1:]))
            for mine, part in parts:
                found[field.name][mine] = getattr(part, field.name)
    return shaped(replace(parts[0][1], **found), times.shape)


def checked_times(solution: Any, t: Any) -> np.ndarray:
    """Times as an array.

    Raises
    ------
    ValueError
        If they are no numbers, or one lies outside the span of the solution.
    """
    try:
        times = np.asarray(t, float)
    except (TypeError, ValueError):
        raise ValueError(f"t must be a time [s] or an array of times; got {short(t)}") from None
    first, last = solution.time[0], solution.time[-1]
    spare = NEAR * (last - first + abs(first) + abs(last))
    if not ((times >= first - spare) & (times <= last + spare)).all():
        wrong = times[~((times >= first - spare) & (times <= last + spare))].flat[0]
        raise ValueError(f"the solution goes from {first:g} s to {last:g} s; it says nothing of {wrong:g} s")
    return times


def shaped(found: Moment, shape: tuple[int, ...]) -> Moment:
    """A moment whose arrays have this shape in place of their first axis."""
    arrays = {field.name: getattr(found, field.name) for field in fields(Moment)}
    count = int(np.prod(shape))
    moved: dict[str, Any] = {
        name: values[:count].reshape((*shape, *values.shape[1:]))
        for name, values in arrays.items()
        if isinstance(values, np.ndarray)
    }
    return replace(found, **moved)


def sampled(solution: Any, times: np.ndarray) -> Moment:
    """A solution at times within its span, shape (count,)."""
    path, made = solution.path, solution.path.coordinates
    fractions = np.clip((times - solution.provenance.start_time) / path.duration, 0.0, 1.0)
    q, motions = moving(solution, fractions)
    force, torque = _pushed(solution, fractions, q)
    return Moment(
        times,
        q[:, made.places],
        motions[:, made.speeds],
        force,
        through_nodes(path, path.mass[:, None], fractions)[:, 0],
        np.hstack([q[:, at] for at in made.quaternions]) if made.turns else None,
        motions[:, made.rates] if made.turns else None,
        torque,
        motions[:, made.spins] if made.spins.any() else None,
        made,
    )


def moving(solution: Any, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and independent velocities at fractions of the duration, one row each.

    Inside a step they are those of the polynomial of degree s + 2 that has the positions of its s + 1 nodes
    and the velocities at both of its ends (Birkhoff, 1906): at order 2 the cubic of Hermite.
    """
    path, made, rule = solution.path, solution.path.coordinates, scheme(solution.path.order)
    ends = path.position[:: rule.degree]
    independent = np.empty((len(ends), made.motions.size))
    for mask, values in (
        (made.speeds, solution.velocity),
        (made.rates, solution.rate),
        (made.spins, solution.wheel_momentum),
    ):
        if mask.any():
            independent[:, mask] = values
    slopes = _slopes(made, ends, independent)
    step, inside, length = step_places(path, fractions)
    at = step_nodes(len(path.mesh) - 1, rule)[:, step]
    origin = path.position[at[0]]
    known = [*(path.position[at] - origin), slopes[step] * length, slopes[step + 1] * length]
    values, rates = _birkhoff(rule.points, inside)
    q = origin + np.einsum("kj,jkn->kn", values, known)
    dq = np.einsum("kj,jkn->kn", rates, known) / length
    for place in made.quaternions:
        size = np.linalg.norm(q[:, place], axis=1, keepdims=True)
        q[:, place], dq[:, place] = normalised(q[:, place]), dq[:, place] / size
    return q, _motions(made, q, dq)


def step_places(path: DiscretePath, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The step of each time, how far into it as a fraction of it, and its length [s], shape (count, 1)."""
    step = np.clip(np.searchsorted(path.mesh, fractions, side="right") - 1, 0, len(path.mesh) - 2)
    length = np.diff(path.mesh)[step]
    return step, (fractions - path.mesh[step]) / length, (path.duration * length)[:, None]


def _birkhoff(points: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (count, s+3) to values and slopes from those at the points and the slopes at both ends."""
    powers = np.arange(len(points) + 2)

    def rows(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return at[:, None] ** powers, powers * at[:, None] ** np.maximum(powers - 1, 0)

    values, slopes = rows(points)
    inverse = np.linalg.inv(np.vstack([values, slopes[[0, -1]]]))
    found, changing = rows(inside)
    return found @ inverse, changing @ inverse


def _slopes(made: Coordinates, q: np.ndarray, independent: np.ndarray) -> np.ndarray:
    """dq/dt of independent velocities."""
    parts = zip(made.blocks, made.cut(q), made.parted(independent), strict=True)
    return np.hstack(
        [0.5 * product(at, _pure(rate)) if block.kind == ATTITUDE else rate for block, at, rate in parts]
    )


def _motions(made: Coordinates, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Independent velocities of dq/dt."""
    parts = zip(made.blocks, made.cut(q), made.cut(dq), strict=True)
    return np.hstack(
        [
            2 * product(conjugate(at), slope)[:, 1:] if block.kind == ATTITUDE else slope
            for block, at, slope in parts
        ]
    )


def _pure(rate: np.ndarray) -> np.ndarray:
    """Rates as quaternions without a scalar."""
    return np.hstack([np.zeros((len(rate), 1)), rate])


def through_nodes(path: DiscretePath, values: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """The polynomial of each step through values at its nodes."""
    rule = scheme(path.order)
    step, inside, _ = step_places(path, fractions)
    nodes = values[step_nodes(len(path.mesh) - 1, rule)[:, step]]
    return np.einsum("kj,jkn->kn", rule.values_at(inside), nodes)


def _pushed(solution: Any, fractions: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Force and torque of the control that is flown; without a problem, of the polynomial of node values."""
    path, made = solution.path, solution.path.coordinates
    if path.hold:
        step = step_places(path, fractions)[0]
        return solution.force[step], None if solution.torque is None else solution.torque[step]
    if solution.problem is None:
        force = through_nodes(path, solution.force, fractions)
        return force, None if solution.torque is None else through_nodes(path, solution.torque, fractions)
    dynamics = Dynamics.of(solution.problem)
    known, rule = flown(dynamics, path), scheme(path.order)
    piece = np.clip(np.searchsorted(known.mesh, fractions, side="right") - 1, 0, len(known.mesh) - 2)
    inside = (fractions - known.mesh[piece]) / np.diff(known.mesh)[piece]
    control = np.einsum("kj,jkn->kn", rule.values_at(inside), known.nodes[:, piece])
    wrench = wrench_of(dynamics, q, control)
    return wrench[:, made.speeds], wrench[:, made.rates] if made.turns else None


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in np.ravel(values)) + ")"
