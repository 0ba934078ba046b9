"""A path on a mesh, guessed or solved, and how it is carried from one mesh to another."""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmoc.basics.arguments import LARGEST, number
from dmoc.basics.numerics import cubic_spline
from dmoc.basics.plain import Brief
from dmoc.basics.quaternions import angle_between, normalised, times
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import ATTITUDE, Coordinates
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.mesh import node_fractions


class Key(NamedTuple):
    """The name of a group of multipliers, which belong to rows ("row") or to unknowns ("column").

    `kind` says what their index counts, as in the layout of the NLP: "smooth", "node", "control", "step",
    "between" or "end".
    """

    kind: str
    side: str
    group: str

    def __str__(self) -> str:
        return ":".join(self)

    @classmethod
    def parse(cls, text: str) -> Key:
        """The key that a result file holds as text."""
        return cls(*text.split(":", 2))


# The group of rows for the masses at the inner nodes of steps.
INNER_MASSES = "mass_inside"
# The costates have this key: the multipliers of the discrete Euler-Lagrange equations.
COSTATE = Key("smooth", "row", "dynamics")
# The multipliers of an actuator's rows have this key, such as those that tie a throttle to the force.
ACTUATOR_ROWS = Key("control", "row", "actuator")
# The multiplier of the limits on a free duration has this key: the derivative of the objective by it.
DURATION = Key("end", "column", "duration")
# The multipliers of the bounds on positions have this key, such as those of a box to stay in.
POSITION_BOUNDS = Key("node", "column", "position")


@dataclass(frozen=True)
class DiscretePath(Brief):
    """A path on a mesh, good enough to start from: SI units, one row a node.

    Attributes
    ----------
    mesh : array, shape (steps+1,)
        Step ends as fractions of the duration.
    position, control, mass : arrays, shape (nodes, ...)
        Coordinates q, places in [m] and attitudes as unit quaternions, the actuator's units, [kg]; with hold
        the controls are one row a step.
    start_velocity, goal_velocity : arrays
        [m/s], and rates in body axes [rad/s].
    multipliers : dict
        Costates and bound multipliers by group, densities in time; empty for a plain guess.
    made_of : Coordinates, optional
        Of what parts q is made; of one place in space if not given.
    reaction : array, shape (nodes, entries), optional
        Forces of the constraint g(q) = 0 per unit mass; 0 if not given.
    """

    mesh: np.ndarray
    order: int
    hold: bool
    duration: float
    position: np.ndarray
    control: np.ndarray
    mass: np.ndarray
    start_velocity: np.ndarray
    goal_velocity: np.ndarray
    multipliers: dict[Key, np.ndarray] = field(default_factory=dict)
    made_of: Coordinates | None = None
    reaction: np.ndarray | None = None

    @property
    def coordinates(self) -> Coordinates:
        """Of what parts q is made."""
        return self.made_of or Coordinates.of_point(self.position.shape[1])

    @property
    def place(self) -> np.ndarray:
        """The coordinates that are places in space [m], shape (nodes, axes)."""
        return self.position[:, self.made_of.places] if self.made_of else self.position

    def place_of(self, constraint: Any) -> np.ndarray:
        """The place that a constraint limits [m], shape (nodes, axes): the centre of mass or a point."""
        if constraint.point is None and not constraint.on:
            return self.place
        made, still = self.coordinates, np.zeros((len(self.position), self.coordinates.motions.size))
        return constraint.seen_of(made, self.position, still)[0]

    def moved(self, bend: np.ndarray, on: str = "") -> DiscretePath:
        """The path with the place of a body moved by a bend, shape (nodes, axes) [m]."""
        position, made = self.position.copy(), self.coordinates
        position[:, made.places & made.of_body(on)[0]] += bend
        return replace(self, position=position)

    @property
    def attitudes(self) -> list[np.ndarray]:
        """The unit quaternions of each body that turns, shape (nodes, 4) each."""
        return [self.position[:, at] for at in self.coordinates.quaternions]

    @property
    def diagonal(self) -> float:
        """Diagonal of the box around the path [m]."""
        return float(np.linalg.norm(np.ptp(self.place, axis=0)))

    @property
    def turn(self) -> float:
        """The largest angle that a body is turned by from the start [rad]."""
        return max((float(angle_between(q[:1], q).max()) for q in self.attitudes), default=0.0)

    @property
    def largest_turn(self) -> float:
        """The largest angle between the attitudes of neighbouring nodes, of one sign of q [rad]."""
        cosines = [np.sum(q[1:] * q[:-1], axis=1).min() for q in self.attitudes]
        return 2 * float(np.arccos(np.clip(min(cosines, default=1.0), -1.0, 1.0)))

    @cached_property
    def fractions(self) -> np.ndarray:
        """Fractions of the duration at the nodes, shape (nodes,)."""
        return node_fractions(self.mesh, scheme(self.order))

    def refuse_unusable(self, name: str) -> None:
        """Raise a ValueError if no solve or simulation can start here; `name` says whose path it is.

        Every number must be finite and not too large, durations and masses positive: the last iterate of a
        failed solve may be otherwise.
        """
        number(f"{name}: its duration", self.duration, "s", positive=True)
        for what, values, unit in (
            ("position", self.position, "m"),
            ("control", self.control, ""),
            ("mass", self.mass, "kg"),
            ("start velocity", self.start_velocity, "m/s"),
            ("goal velocity", self.goal_velocity, "m/s"),
            *((f"multiplier {key}", each, "") for key, each in self.multipliers.items()),
        ):
            wrong = ~(np.abs(values) <= LARGEST) | ((values <= 0) if what == "mass" else False)
            if wrong.any():
                place = np.unravel_index(np.argmax(wrong), values.shape)
                where = f"{name}: its {what} at {', '.join(map(str, place))}"
                number(where, float(values[place]), unit, positive=what == "mass")

    def onto(self, mesh: np.ndarray, order: int, hold: bool) -> DiscretePath:
        """The same path on another mesh, order and kind of control."""
        if order == self.order and hold == self.hold and np.array_equal(mesh, self.mesh):
            return self
        old, new = self.fractions, node_fractions(mesh, scheme(order))
        middles, old_middles = 0.5 * (mesh[1:] + mesh[:-1]), 0.5 * (self.mesh[1:] + self.mesh[:-1])
        old_control = old_middles if self.hold else old
        new_control = middles if hold else new
        ends = tuple(
            self._slope(place, velocity) * self.duration
            for place, velocity in ((0, self.start_velocity), (-1, self.goal_velocity))
        )
        # The path must stay smooth, since its second differences are the forces.
        position = self._interpolated(old, new, ends)
        # Ends are often fixed numbers of the problem, to the last bit.
        position[0], position[-1] = self.position[0], self.position[-1]
        places = {
            "node": (old, new),
            "step": (old_middles, middles),
            "between": (old_middles, middles),
            "control": (old_control, new_control),
        }
        return replace(
            self,
            mesh=mesh,
            order=order,
            hold=hold,
            position=position,
            control=_between(old_control, self.control, new_control),
            mass=np.interp(new, old, self.mass),
            multipliers=self._carried(mesh, order, places),
            reaction=None if self.reaction is None else _between(old, self.reaction, new),
        )

    def _slope(self, place: int, velocity: np.ndarray) -> np.ndarray:
        """dq/dt at a node from the independent velocities there."""
        made, moving = self.coordinates, self.coordinates.parted(velocity)
        slopes = [
            0.5 * times(at, np.append(0.0, rate)) if kind == ATTITUDE else rate
            for (kind, *_), at, rate in zip(made.blocks, made.cut(self.position[place]), moving, strict=True)
        ]
        return np.concatenate(slopes)

    def _interpolated(self, old: np.ndarray, new: np.ndarray, ends: tuple) -> np.ndarray:
        """Positions at other fractions; attitudes stay unit quaternions."""
        position = cubic_spline(old, self.position, ends)(new)
        for at in self.coordinates.quaternions:
            position[:, at] = normalised(position[:, at])
        return position

    def _carried(self, mesh: np.ndarray, order: int, places: dict) -> dict[Key, np.ndarray]:
        """The multipliers on another mesh and order."""
        found = {}
        for key, value in self.multipliers.items():
            if key.kind == "smooth":
                found[key] = cubic_spline(places["node"][0], value)(places["node"][1])
            elif key.kind == "step" and order != self.order:
                found[key] = _within_steps(key, value, (self.mesh, scheme(self.order)), (mesh, scheme(order)))
            elif key.kind in places:
                found[key] = _between(places[key.kind][0], value, places[key.kind][1])
            else:
                found[key] = value
        return {key: value for key, value in found.items() if value.size}


def _within_steps(
    key: Key, value: np.ndarray, old: tuple[np.ndarray, Scheme], new: tuple[np.ndarray, Scheme]
) -> np.ndarray:
    """Multipliers of rows that stand within steps, whose number depends on the order, at another order.

    Rows are at the inner nodes of a step (masses) or at its Gauss points (limits on the speed). What is
    carried is the density, a multiplier over the weight of its point.
    """
    (old_mesh, before), (new_mesh, after) = old, new
    points, weights = zip(*(_points_within(key, rule) for rule in (before, after)), strict=True)
    steps, rows = len(value), value.shape[1] // max(len(points[0]), 1)
    if not rows or not len(points[1]):
        return np.empty((len(new_mesh) - 1, 0))
    density = value.reshape(steps, -1, rows) / weights[0][:, None]
    at = [
        (mesh[:-1, None] + np.diff(mesh)[:, None] * inner).ravel()
        for mesh, inner in zip((old_mesh, new_mesh), points, strict=True)
    ]
    moved = _between(at[0], density.reshape(-1, rows), at[1]).reshape(len(new_mesh) - 1, -1, rows)
    return (moved * weights[1][:, None]).reshape(len(new_mesh) - 1, -1)


def _points_within(key: Key, rule: Scheme) -> tuple[np.ndarray, np.ndarray]:
    """Places of rows within a step of length 1, and their weights."""
    if key.group == INNER_MASSES:
        return rule.points[1:-1], rule.weights[1:-1]
    return rule.gauss_points(), rule.gauss_weights()


def _between(old: np.ndarray, values: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Linear interpolation of every column: never beyond the values it is made from."""
    columns = [np.interp(new, old, column) for column in values.T]
    return np.stack(columns, axis=1) if columns else np.empty((len(new), 0))
