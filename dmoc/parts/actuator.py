"""The base class of actuators: how controls become a force, and which controls are allowed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, entries
from dmoc.basics.digits import up
from dmoc.basics.docstrings import Duties
from dmoc.basics.memory import remembered
from dmoc.basics.numerics import columns
from dmoc.parts.constraint import Constraint
from dmoc.parts.outline import Jet
from dmoc.parts.rows import Row


class Actuator(Duties):
    """Controls u of one node and the force they make. A force actuator's controls are its force [N].

    A frozen dataclass that derives from this has these duties, each with a default that suits a free force:

    1. Say how many controls a node has, what they are called and in which unit: `size`, `labels`, `units`.
    2. Make the force of them: `force`.
    3. State the limits for the optimiser: `bounds` of single controls, and `rows` for all other limits.
    4. Say by how much given controls break the limits: `excess`. The checks rest on it.
    5. Where it burns propellant or costs fuel: `throttle`, `flow`, `burns`, `metered`.
    6. Name its limit and how it gives way: `force_limit`, `times`, `eased`, `needs`, `violation`.
    7. Say in words what it is: `words`.

    Not its business: meshes, units, where the body goes. Fields named in `adjustable` may change from one
    solve to the next without a rebuild; inside `force` and `rows` they may be symbols.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import casadi as ca
    >>> import numpy as np
    >>> from dmoc import Actuator, State, Time, TransferProblem, UniformGravity, solve
    >>> @dataclass(frozen=True)
    ... class Lift(Actuator):
    ...     limit: float
    ...     def size(self, dimension):
    ...         return 1
    ...     def labels(self, dimension):
    ...         return ("lift",)
    ...     def force(self, u):
    ...         return ca.vertcat(0, u)
    ...     def bounds(self, dimension):
    ...         return np.zeros(1), np.full(1, self.limit)
    ...     def force_limit(self):
    ...         return self.limit
    ...     def words(self):
    ...         return f"a force upwards of at most {self.limit:g} N"
    >>> floors = State((0, 0), (0, 0)), State((0, 4), (0, 0))
    >>> gravity = [UniformGravity((0, -1.0))]
    >>> problem = TransferProblem(1.0, *floors, (1.0, 9.0), gravity, Lift(2.0), Time())
    >>> print(f"{solve(problem).duration:.3f} s")
    4.000 s
    """

    adjustable: ClassVar[tuple[str, ...]] = ()
    # The mass cannot fall below this [kg].
    dry_mass: float = 0.0
    # A throttle among the controls equals |F|, rounded at zero over this part of the largest thrust [-];
    # None for an actuator without such a throttle.
    smoothing: float | None = None
    # What becomes of the inertia of a body that turns while it burns: "scaled" with the mass, or "constant".
    inertia_law: str = "scaled"
    # Whether it is off for parts of a usual transfer: pictures then shade the times when it is on.
    coasts: ClassVar[bool] = False
    # Whether it acts on rigid bodies alone.
    turns_body: ClassVar[bool] = False
    # Whether it needs a body with a position.
    moves_body: ClassVar[bool] = True
    # The unit of what `Effort` gives with it.
    effort_unit: ClassVar[str] = "N^2 s"
    # The unit of what `Fuel` gives with it where it burns nothing.
    meter_unit: ClassVar[str] = "N s"
    # Pictures label the line at the force limit with this.
    limit_label: ClassVar[str] = "limit"

    @property
    def structure(self) -> tuple:
        """The type and all that is built into the rows: equal for actuators that one NLP can serve."""
        return (type(self),)

    @property
    def burns(self) -> bool:
        """Whether it uses propellant, so that the mass changes."""
        return False

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the actuator has no meaning in this many dimensions."""

    def size(self, dimension: int) -> int:
        """Number of controls at a node."""
        return dimension

    def labels(self, dimension: int) -> tuple[str, ...]:
        """A name for each control, used in row names and result files."""
        return tuple("xyz"[:dimension])

    def units(self, dimension: int) -> tuple[str, ...]:
        """The unit of each control."""
        return ("N",) * self.size(dimension)

    def force(self, u: Any) -> Any:
        """Force on the body [N] made by the controls."""
        return u

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        """Force in space axes [N] and torque about the centre of mass in body axes [N m]; None where 0.

        `rotation` is R(q), which turns body axes into space axes; None for a point mass.
        """
        return self.force(u), None

    @property
    def bodies(self) -> tuple[str, ...] | None:
        """The names of the bodies on which it acts; None where it acts on the only one."""
        return None

    @property
    def wheel_axes(self) -> tuple[tuple[float, ...], ...]:
        """The axes of the reaction wheels that it turns, unit vectors in body axes; none by default."""
        return ()

    @property
    def own_limits(self) -> tuple[Constraint, ...]:
        """Limits on the motion that belong to it, such as on the momenta of wheels."""
        return ()

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        """The column of the size of q by which it acts on a configuration [N], [N m]."""
        force, torque = self.wrench(configuration.rotation(q), u)
        return configuration.generalised(q, force, torque, self.spun(u))

    def jets(self) -> list[Jet]:
        """The thrusters that it fires, as pictures show them; none by default."""
        return []

    def spun(self, u: Any) -> Any:
        """Torques on the reaction wheels [N m]; None where there are none."""
        return None

    def effort(self, u: Any) -> Any:
        """The square that `Effort` integrates: of the force or, where it turns the body, of all controls."""
        force = self.force(u)
        return ca.dot(force, force)

    def torque_limit(self) -> float | None:
        """The largest torque [N m] about one axis, or None if there is no limit or no torque."""
        return None

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits of the controls."""
        limit = np.full(self.size(dimension), np.inf)
        return -limit, limit

    def rows(self, u: Any) -> list[Row]:
        """Further limits that are not plain bounds, dimensionless."""
        return []

    def throttle(self, u: Any) -> Any:
        """Magnitude of the thrust that costs propellant [N]; None where it is not among the controls."""
        return None

    def flow(self, u: Any) -> Any:
        """Propellant burnt [kg/s]; None where the mass does not change."""
        return None

    def metered(self, dimension: int) -> Actuator:
        """The same actuator with the magnitude of its force among the controls, which least fuel needs."""
        raise ValueError(
            f"least fuel with {type(self).__name__} has no optimum: impulses without limit cost least; "
            "use BallForce(limit), BoxForce(limit) or Engine(max_thrust, ...); a leg without a force is a Coast"
        )

    def force_limit(self) -> float | None:
        """The largest force [N] along one axis, or None if there is no limit."""
        return None

    @property
    def limited(self) -> bool:
        """Whether its force or torque has a limit."""
        return self.force_limit() is not None or self.torque_limit() is not None

    def turning_limit(self) -> float | None:
        """About the torque by which it turns a body when it does its best [N m]; None if there is no limit."""
        return self.torque_limit()

    @property
    def turns_every_way(self) -> bool:
        """Whether it can turn a body about every axis."""
        return True

    def main_limit(self) -> float | None:
        """Its force limit [N] or, where it makes no force or a free one, its torque limit [N m]."""
        return self.torque_limit() if self.force_limit() is None else self.force_limit()

    @property
    def limit_unit(self) -> str:
        """The unit of `main_limit` and of what `excess` gives."""
        return "N" if self.torque_limit() is None or self.force_limit() is not None else "N m"

    def excess(self, u: np.ndarray) -> np.ndarray:
        """By how much the controls, shape (count, size), break the limits [`limit_unit`]; 0 where they hold."""
        lower, upper = self.bounds(u.shape[1])
        return np.maximum(0.0, np.maximum(lower - u, u - upper)).max(axis=1, initial=0.0)

    def times(self, factor: float) -> Actuator:
        """The same actuator with limits `factor` times as large."""
        return self

    def eased(self, slack: float) -> Actuator:
        """The actuator whose limits are just enough where dimensionless rows are exceeded by `slack` [-]."""
        return self.times(1 + slack)

    def needs(self, eased: Actuator) -> str:
        """In words, the limit of `eased`, which is enough, and the limit of this actuator, which was given."""
        given = self.force_limit() or 1.0
        return limit_told(self.limit_words, given, (eased.force_limit() or 0.0) / given, "N")

    @property
    def limit_words(self) -> str:
        """The name of its limit in messages."""
        return "force limit"

    def unlimited(self) -> Actuator | None:
        """A free force with the same controls; None where the controls are not the force itself."""
        return None

    def share(self, u: np.ndarray) -> float:
        """The largest of the controls, shape (count, size), over its limit [-]."""
        return float(np.abs(u).max(initial=0.0)) / (self.force_limit() or np.inf)

    def violation(self, value: float, unit: str) -> tuple[float, str]:
        """Size and unit of a row's violation for a person; `value` is its size in the row's own `unit`."""
        return value * (self.force_limit() or 1.0), "N"

    def limit_names(self, dimension: int) -> tuple[tuple[str, str], ...]:
        """What it does at the lower and the upper side of each of its limits, "" where there is none.

        Empty for an actuator that cannot be told to keep to a limit; see `kept`.
        """
        return ()

    def kept(self, sides: Sequence[int]) -> Actuator:
        """The actuator that keeps exactly to some `limit_names`: -1 the lower one, 1 the upper, 0 none."""
        raise ValueError(f"{type(self).__name__} has no limits to keep to")

    @property
    def throughout(self) -> Actuator | None:
        """The one that acts with its largest force throughout, in any direction; None where there is none."""
        return None

    def beyond(self, u: np.ndarray) -> np.ndarray:
        """By how much controls between nodes are beyond what it can do [N], shape (count,).

        Between nodes a control need not keep what ties its entries together, such as a throttle to a force.
        """
        return self.excess(u)

    def nearest(self, u: np.ndarray) -> np.ndarray | None:
        """Controls between nodes within what it can do, near the given ones of shape (count, size).

        None where it does not tell.
        """
        return None

    def words(self) -> str:
        """One line for a person."""
        return "any force, without a limit"


def told_of(actuator: Actuator, what: str, controls: np.ndarray) -> np.ndarray:
    """The "throttle" [N] or the "flow" [kg/s] of controls, one row each, shape (count,)."""

    def written() -> ca.Function:
        u = ca.SX.sym("u", controls.shape[1])
        return ca.Function(what, [u], [ca.densify(getattr(actuator, what)(u))])

    return columns(remembered(written, what, actuator, controls.shape[1]), controls.T)[0].ravel()


def limit_told(name: str, given: float | Vector, factor: float, unit: str) -> str:
    """The limit `factor` times the one given, which is enough, and the one given, in words.

    Where axes or thrusters have limits of their own all of them are told.
    """
    had = entries(given) or (given,)
    needed = [up(factor * float(value)) for value in had]
    if len(set(had)) == 1:
        return f"a {name} of {needed[0]} {unit} (you gave {float(had[0]):g} {unit})"
    listed = ", ".join(f"{float(value):g}" for value in had)
    return f"{name}s of ({', '.join(needed)}) {unit} (you gave ({listed}) {unit})"
