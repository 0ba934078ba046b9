"""What every effect is: a frozen dataclass with one method, `lagrangian` or `force`.

`t` is the time [s], `q` the position [m], `v` the velocity [m/s] (CasADi columns of the problem's
dimension) and `m` the mass [kg]. Constants of an effect are baked into the graph, but for an `Unknown`:
that is a symbol there.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from dmoc.basics.docstrings import Duties, documented, first_line
from dmoc.basics.unknown import open_fields


class Part(Duties):
    """Something that can say in one line what it is, and some of whose numbers may be unknown."""

    @property
    def adjustable(self) -> tuple[str, ...]:
        """Its fields that hold an `Unknown`, which are symbols where formulas are written down."""
        return open_fields(self)

    def words(self) -> str:
        """One line for a person: what the docstring says it is, and its numbers with units."""
        name, docstring = type(self).__name__, type(self).__doc__
        summary = first_line(docstring)
        # a dataclass without a docstring has its signature there
        summary = "" if summary.startswith(f"{name}(") else summary.split(":")[0].rstrip(".")
        numbers = ", ".join([name, *self._numbers()])
        return f"{summary} ({numbers})" if summary else numbers

    def _numbers(self) -> list[str]:
        entries = documented(type(self).__doc__)
        members: tuple = fields(self) if is_dataclass(self) else ()
        return [
            f"{member.name} {_in_words(value, entries[member.name].unit if member.name in entries else '')}"
            for member in members
            if (value := getattr(self, member.name)) is not None
        ]


class Attractor(NamedTuple):
    """A point mass: gravitational parameter [m^3/s^2] and place [m], None for the origin."""

    mu: float
    center: tuple[float, ...] | None

    def place(self, dimension: int) -> np.ndarray:
        """Its place with so many axes [m]."""
        return np.zeros(dimension) if self.center is None else np.array(self.center[:dimension])


class Body(NamedTuple):
    """A body as an effect sees it, all CasADi expressions; a point mass has a position and a velocity alone.

    Attributes
    ----------
    position, velocity : column
        Of the centre of mass [m], [m/s]; without entries where the attitude alone is in the problem.
    attitude : column or None
        Unit quaternion from body to space, scalar first.
    rotation : matrix or None
        R(q), shape (3, 3), which turns body axes into space axes; a polynomial in the quaternion.
    rate : column or None
        Angular rate in body axes [rad/s].
    inertia : array, column or None
        In body axes about the centre of mass [kg m^2], shape (3, 3); for CasADi where it shrinks with the mass.
    wheels : column or None
        Angular momenta of its reaction wheels about their axes [N m s].
    """

    position: Any
    velocity: Any
    attitude: Any = None
    rotation: Any = None
    rate: Any = None
    inertia: Any = None
    wheels: Any = None


class Effect(Part):
    """Something that acts on the body. Derive from one of the four classes below, never from this.

    `Conservative` and `Force` act on its position and see its position and velocity; `BodyConservative` and
    `BodyForce` see its attitude, too, and may turn it.

    Whoever implements an effect

    1. makes it a frozen dataclass whose fields are its numbers, checked in `__post_init__`;
    2. names each field in the section Parameters of its docstring, with its unit in brackets, which is what
       `words` shows;
    3. implements one method, `lagrangian` or `force`, with CasADi operations alone, in SI units, of a column
       `q` with as many entries as the problem has dimensions;
    4. keeps that expression smooth wherever the optimiser may go, also beside the path: it is differentiated
       twice;
    5. overrides `check_dimension` where it has no meaning in one, two or three dimensions.

    Not its business: inertia (1/2 |v|^2 is there already), the actuator's force, derivatives, scaling, the
    scheme, and which other effects there are: contributions are added up.
    """

    # Whether it sees the attitude, so that it acts on rigid bodies alone.
    turns_body: ClassVar[bool] = False
    # Whether it needs the position of the body.
    moves_body: ClassVar[bool] = True
    # Whether it acts between bodies, and not on each by itself.
    joins: ClassVar[bool] = False

    def check_dimension(self, dimension: int) -> None:
        """Raise ValueError if the effect has no meaning in this many dimensions."""

    def attractor(self) -> Attractor | None:
        """The point mass that it is, around which there are orbits; None for anything else."""
        return None

    def turns_frame(self) -> bool:
        """Whether it makes the frame turn, in which orbits do not close."""
        return False

    def body_radius(self) -> float:
        """Radius of the body at the origin where it tells one [m], else 0."""
        return 0.0

    def lagrangian_of(self, t: Any, body: Body, m: Any) -> Any:
        """Contribution to the Lagrangian per unit mass [J/kg]; None where it does work instead."""
        return None

    def wrench_of(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        """Force in space axes [N] and torque about the centre of mass in body axes [N m]; None where 0."""
        return None, None

    def energy_between(self, t: Any, at: Mapping[str, Body]) -> Any:
        """Potential energy between bodies [J], by their names; None where there is none."""
        return None

    def acts_between(self, configuration: Any, t: Any, q: Any, at: Mapping[str, Body]) -> Any:
        """The column of the size of q by which it acts between bodies; None where it has an energy."""
        return None


class Conservative(Effect):
    """An effect that enters the Lagrangian and so keeps the flow symplectic.

    Whoever implements one has the duties of an `Effect`, and

    1. states a potential energy V [J] as l = -V/m [J/kg];
    2. keeps l at most quadratic in `v`: the momentum dl/dv must be linear in the velocity to be solved for it.

    Not its business: whether energy is kept. That is read from the expression: where it contains `t`, or the
    mass while propellant burns, the check of the energy is left out.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import casadi as ca
    >>> from dmoc import Conservative, State, TransferProblem, solve
    >>> @dataclass(frozen=True)
    ... class Bowl(Conservative):
    ...     '''A bowl in which a ball rolls without friction.
    ...
    ...     Parameters
    ...     ----------
    ...     steepness : float
    ...         V = 1/2 steepness m |q|^2 [1/s^2].
    ...     '''
    ...     steepness: float
    ...     def lagrangian(self, t, q, v, m):
    ...         return -0.5 * self.steepness * ca.dot(q, q)
    >>> across = State((1.0,), (0.0,)), State((-1.0,), (0.0,))
    >>> problem = TransferProblem(1.0, *across, duration=3.0, effects=[Bowl(1.0)])
    >>> print(f"{solve(problem).objective:.3f} N^2 s with {Bowl(1.0).words()}")
    0.007 N^2 s with A bowl in which a ball rolls without friction (Bowl, steepness 1 1/s^2)
    """

    @abstractmethod
    def lagrangian(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Contribution to the Lagrangian per unit mass [J/kg]; 1/2 |v|^2 is already there."""

    def lagrangian_of(self, t: Any, body: Body, m: Any) -> Any:
        return self.lagrangian(t, body.position, body.velocity, m)


class Force(Effect):
    """An effect that does work: drag, radiation pressure and the like.

    Whoever implements one has the duties of an `Effect`, and leaves what has a potential to `Conservative`:
    stated as a force, it would let the energy drift over long runs.

    Not its business: the work that is done, which is summed up along the path, and the power of the actuator.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import casadi as ca
    >>> from dmoc import Force, State, TransferProblem, solve
    >>> @dataclass(frozen=True)
    ... class QuadraticDrag(Force):
    ...     '''Air that resists with the square of the speed.
    ...
    ...     Parameters
    ...     ----------
    ...     coefficient : float
    ...         Force over squared speed [kg/m].
    ...     '''
    ...     coefficient: float
    ...     def force(self, t, q, v, m):
    ...         return -self.coefficient * ca.sqrt(ca.dot(v, v) + 1e-12) * v
    >>> along = State((0.0,), (1.0,)), State((1.0,), (1.0,))
    >>> problem = TransferProblem(1.0, *along, duration=1.0, effects=[QuadraticDrag(0.5)])
    >>> print(f"{solve(problem).objective:.3f} N^2 s, the air takes 0.5 N all along")
    0.125 N^2 s, the air takes 0.5 N all along
    """

    @abstractmethod
    def force(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Force on the body [N]."""

    def wrench_of(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        return self.force(t, body.position, body.velocity, m), None


class BodyConservative(Effect):
    """An effect on a rigid body that enters the Lagrangian: a potential of position and attitude.

    Whoever implements one has the duties of a `Conservative`. Its torque follows from the expression: none is
    written by hand. It must not depend on the rate.
    """

    turns_body: ClassVar[bool] = True

    @abstractmethod
    def lagrangian(self, t: Any, body: Body, m: Any) -> Any:
        """Contribution to the Lagrangian per unit mass [J/kg]."""

    def lagrangian_of(self, t: Any, body: Body, m: Any) -> Any:
        return self.lagrangian(t, body, m)


class BodyForce(Effect):
    """An effect on a rigid body that does work, as a force and a torque.

    Whoever implements one has the duties of a `Force`.
    """

    turns_body: ClassVar[bool] = True

    @abstractmethod
    def wrench(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        """Force in space axes [N] and torque about the centre of mass in body axes [N m]; None where 0."""

    def wrench_of(self, t: Any, body: Body, m: Any) -> tuple[Any, Any]:
        return self.wrench(t, body, m)


class Between(Effect):
    """An effect between bodies of a system, or between a body and the room.

    Whoever implements one gives `energy_between`, or `acts_between` where it does work.
    """

    joins: ClassVar[bool] = True


def _in_words(value: Any, unit: str) -> str:
    if isinstance(value, Part):
        return f"{type(value).__name__}({', '.join(value._numbers())})"
    if isinstance(value, (tuple, list)):
        entries = ", ".join(_in_words(entry, "") for entry in value[:6])
        text = f"({entries})" if len(value) <= 6 else f"({len(value)} values)"
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        text = f"{value:.10g}"
    else:
        text = getattr(value, "__name__", None) or str(value)
    return f"{text} {unit}" if unit and unit not in ("-", "1") else text
