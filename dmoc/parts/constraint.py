"""The base class of constraints: limits that hold all along the way."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, of_kind, vector
from dmoc.basics.docstrings import Duties
from dmoc.basics.quaternions import AXES, QUATERNION, rotated
from dmoc.effects.base import Body
from dmoc.parts.outline import Shape
from dmoc.parts.rows import Row, title


class Constraint(Duties):
    """A limit on positions or on the speed all along the path.

    A frozen dataclass that derives from this has these duties:

    1. State the limit for the optimiser, in at least one of three ways: `rows` that hold at every node,
       `speed_rows` that hold at the Gauss points of every step and at both ends, or plain `bounds` of the
       position.
    2. Say by how much given states break it, in `unit`: `excess`. The checks and the refusal of ends that
       break a constraint rest on it, so it must not be made from `rows`.
    3. Say in words what it asks: `words`.

    What follows has a default, and better answers make better messages, pictures and guesses:

    4. `violation`: what the violation of a row means in the problem's own units.
    5. `eased` and `needs`: how loose the limit would have to be, and how to say so.
    6. `outline`: its shape in a picture; without one, a picture shows the edge of where `excess` is positive.
    7. `ways_round` and `off_centre`: how a starting path gets past it.
    8. `feature`: the size of the smallest thing that a path must not step over.
    9. `clearance`: how far a place is from breaking it, which `facts` of an answer tell.

    Not its business: meshes, units, scaling and multipliers. `q`, `v` are CasADi columns of the problem's
    dimension, `u` the controls of the node or None where they are held, and fields named in `adjustable`,
    which may change from one solve to the next without a rebuild, may be symbols inside `rows`.

    A constraint with a field `point` limits that point of a body that turns in place of the centre of mass:
    `q` and `v` are then its position and velocity, in everything above. Of a system it limits the body that its
    field `on` names.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import numpy as np
    >>> from dmoc import Constraint, Row, State, TransferProblem, solve
    >>> @dataclass(frozen=True)
    ... class Ceiling(Constraint):
    ...     height: float
    ...     def rows(self, t, q, u, m):
    ...         return [Row("height", q[-1], -np.inf, self.height, "m")]
    ...     def excess(self, q, v):
    ...         return np.maximum(0.0, q[:, -1] - self.height)
    ...     def words(self):
    ...         return f"stays below {self.height:g} m"
    >>> thrown = State((0, 0), (1, 1)), State((2, 0), (1, -1))
    >>> problem = TransferProblem(1.0, *thrown, duration=2.0, constraints=[Ceiling(0.2)])
    >>> print(f"{solve(problem).position[:, 1].max():.3f} m")
    0.200 m
    """

    one_of = ("rows", "speed_rows", "bounds", "rows_of", "speed_rows_of", "rows_at", "speed_rows_at")
    unit: ClassVar[str] = "m"
    adjustable: ClassVar[tuple[str, ...]] = ()
    # Whether it looks at the attitude, so that it limits rigid bodies alone.
    turns_body: ClassVar[bool] = False
    # Whether it needs a body with a position.
    moves_body: ClassVar[bool] = True
    # The point of the body that it limits, in body axes from the centre of mass [m]; None for the centre.
    point: Any = None
    # The body of a system that it limits, by its name; an only body has an empty one.
    on: str = ""

    @property
    def structure(self) -> tuple:
        """The type and all that is built into the rows: equal for constraints that one NLP can serve."""
        return type(self), self.point is None

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the constraint has no meaning in this many dimensions."""

    def rows(self, t: Any, q: Any, u: Any, m: Any) -> list[Row]:
        """Rows that hold at every node."""
        return []

    def speed_rows(self, v: Any) -> list[Row]:
        """Rows that hold at the Gauss points of every step and at both ends."""
        return []

    def rows_at(self, t: Any, at: Mapping[str, Body], u: Any, m: Any) -> list[Row]:
        """Rows that hold at every node, of bodies by their names: of the one that it is `on` by default."""
        return self.rows_of(t, at[self.on], u, m)

    def rows_of(self, t: Any, body: Body, u: Any, m: Any) -> list[Row]:
        """Rows that hold at every node, of a body as effects see it: of its position, or of a point of it."""
        return self.rows(t, self._place_and_velocity(body)[0], u, m)

    def speed_rows_at(self, at: Mapping[str, Body]) -> list[Row]:
        """Rows that hold at the Gauss points and at both ends, of bodies by their names."""
        return self.speed_rows_of(at[self.on])

    def speed_rows_of(self, body: Body) -> list[Row]:
        """Rows that hold at the Gauss points and at both ends: of its velocity, or of that of a point of it."""
        return self.speed_rows(self._place_and_velocity(body)[1])

    def _place_and_velocity(self, body: Body) -> tuple[Any, Any]:
        """Those of the centre of mass or of the point of the body that is limited."""
        if self.point is None:
            return body.position, body.velocity
        point = self.point if isinstance(self.point, ca.SX) else ca.DM(self.point)
        # Between the nodes the interpolated quaternion is shorter than 1: R and the rate are too small by its
        # square.
        size = ca.dot(body.attitude, body.attitude)
        turned = body.rotation / size
        return body.position + turned @ point, body.velocity + turned @ ca.cross(body.rate / size, point)

    def seen_of(self, made: Any, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`seen` of coordinates and independent velocities of all bodies, made of `Coordinates`."""
        mine, moving = made.of_body(self.on)
        return self.seen(q[:, mine], v[:, moving])

    def seen(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The part of coordinates and independent velocities of its body, one row each, that `excess` takes.

        Those of the position by default, the first three of a body that turns, or those of its `point`.
        """
        if self.point is None:
            return q[:, :AXES], v[:, :AXES]
        attitude, arm = q[:, -QUATERNION:], np.broadcast_to(self.point, (len(q), AXES))
        swept = np.cross(v[:, -AXES:], arm)
        return q[:, :AXES] + rotated(attitude, arm), v[:, :AXES] + rotated(attitude, swept)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that it limits; an only body has an empty name."""
        return (self.on,)

    @property
    def subject(self) -> str:
        """Whom `words` speak of."""
        return self.on or "the body"

    def named(self, index: int) -> str:
        """What it is called in checks and messages, as the one at that place of a list: KeepOut 2 of hand."""
        return f"{type(self).__name__} {index + 1}{self.of_body}"

    def title(self, index: int) -> str:
        """The name of its rows: keep_out_2_of_hand."""
        return title(self, index) + self.row_of_body

    @property
    def row_of_body(self) -> str:
        """What the names of its rows end with."""
        return self.of_body.replace(" ", "_")

    @property
    def of_body(self) -> str:
        """What the name of a limit ends with: which body of a system it limits."""
        return f" of {self.on}" if self.on else ""

    @property
    def of_point(self) -> str:
        """What `words` end with: of which point of the body they speak."""
        if self.point is None:
            return ""
        return f" with its point ({', '.join(f'{x:g}' for x in self.point)}) m"

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        """Plain bounds of the position [m]."""
        limit = np.full(dimension, np.inf)
        return -limit, limit

    @abstractmethod
    def excess(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """By how much states of shape (count, dimension) break the limit, in `unit`; 0 where it holds."""

    def excess_at(self, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The same at times of shape (count,), for a limit that moves; `excess` by default."""
        return self.excess(q, v)

    def clearance(self, t: np.ndarray, q: np.ndarray) -> np.ndarray | None:
        """How far places are from where the limit is broken [m], negative behind it; None if that is no way."""
        return None

    @abstractmethod
    def words(self) -> str:
        """One line for a person: what the body does to keep it, as in "stays below 3 m"."""

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        """Size and unit of a row's violation for a person; `value` is its size in the row's own `unit`."""
        return value, unit or "-"

    @property
    def limits_joint(self) -> bool:
        """Whether it is a limit on where a joint is, which is seen in the coordinates of several bodies."""
        return False

    @property
    def stops(self) -> tuple[float, ...]:
        """The values at which a joint stops [`unit`]."""
        return ()

    @property
    def limits_speed(self) -> bool:
        """Whether it is a limit on the speed, which a longer duration eases."""
        return self.unit == "m/s"

    def largest_speed(self) -> float | None:
        """The speed that must not be exceeded [m/s]; None if it does not limit the speed."""
        return None

    def times(self, factor: float) -> Constraint:
        """The same constraint with a limit on the speed `factor` times as large."""
        return self

    def eased(self, slack: float) -> Constraint | None:
        """The constraint just loose enough for rows exceeded by `slack`; None if no such constraint exists."""
        return self

    def weights(self, t: np.ndarray, q: np.ndarray) -> np.ndarray | None:
        """How far its rows give way at places along a path for a slack of 1 [unit of the rows].

        None if by as much everywhere: `eased` then takes by how much, else a number that depends on the rows.
        """
        return None

    def within(self, problem: Any, entry: int) -> Any:
        """A problem with this constraint in the place of one of its own."""
        parts = [self if i == entry else part for i, part in enumerate(problem.constraints)]
        return replace(problem, constraints=parts)

    def needs(self, eased: Constraint, index: int, amount: str) -> str:
        """In words, the limit that is enough; `amount` says by how much the rows give way, with its unit."""
        return f"constraint {index}, {type(self).__name__}{self.of_body}, to give way by {amount}"

    def outline(self) -> tuple[Shape, ...]:
        """Its shapes in a picture."""
        return ()

    def on_sphere(self, times: np.ndarray, points: int) -> tuple[bool, list[np.ndarray]] | None:
        """Whether directions are kept out, and the circles on the unit sphere at some times that bound them.

        Each circle has shape (points, 3); None where it does not limit a direction.
        """
        return None

    def feature(self) -> float:
        """Size of the smallest thing that a path must not step over [m]; infinite if there is none."""
        return np.inf

    def feature_angle(self) -> float:
        """Half angle of the cone that a limit on the attitude keeps to [degrees]."""
        return 90.0

    def off_centre(self, path: np.ndarray, fractions: np.ndarray) -> np.ndarray:
        """A path, shape (nodes, dimension) [m], moved off places from which all ways round are equally long."""
        return path

    def ways_round(self, path: np.ndarray, fractions: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        """Names of the ways past it, each with the bend of the path that leads there, zero at its ends [m]."""
        return iter(())


def checked_point(part: Constraint, value: Vector | None) -> tuple[float, ...] | None:
    """A point of a body in body axes from the centre of mass [m]; None for the centre itself.

    Raises
    ------
    ValueError
        If it is not three numbers.
    """
    if value is None:
        return None
    found = vector(f"{type(part).__name__}: point", value, "m")
    if len(found) != AXES:
        raise ValueError(
            f"{type(part).__name__}: point must have three entries [m], in body axes from the centre of mass; "
            f"got {len(found)}"
        )
    return found if any(found) else None


def checked_on(part: Constraint) -> str:
    """The name of the body that a part is on.

    Raises
    ------
    ValueError
        If it is no word.
    """
    of_kind(f"{type(part).__name__}: on", part.on, str)
    return part.on
