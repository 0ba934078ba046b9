"""The configuration of a body: its coordinates, the constraint between them, its kinetic energy.

A configuration is q in R^size with a constraint g(q) = 0 of size - freedom entries. The columns of the
tangent matrix Z(q), of shape (size, freedom), span the directions in which q may move: dg/dq Z = 0. Three
sizes stay apart: positions (entries of q), freedom (velocities and momenta that are reported) and controls
(entries of u, which the actuator counts).

References
----------
S. Leyendecker, S. Ober-Bloebaum, J. E. Marsden, M. Ortiz, Discrete mechanics and optimal control
for constrained systems, Optim. Control Appl. Meth. 31 (2010).
Z. R. Manchester, M. A. Peck, Quaternion variational integrators for spacecraft dynamics, J. Guid.
Control Dyn. 39 (2016).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import casadi as ca

from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import Coordinates
from dmoc.effects.base import Body

# Names of the axes of space.
AXES = "xyz"


class Configuration(ABC):
    """The coordinates of a body, or of several.

    A frozen dataclass that derives from this has these duties:

    1. Name its coordinates and velocities and say of what parts they are made: `names`, `velocity_names`,
       `coordinates`.
    2. Give the kinetic energy per unit mass: `kinetic`. Its derivatives, `inertia`, are CasADi's gradients
       unless they are overridden by shorter expressions.
    3. Where there are more coordinates than freedom: the constraint `g`, its slope `pull`, the tangent matrix
       `tangent` and, for order 2, `step_inertia`.
    4. Say what an effect sees of it, `body`, and how a force and a torque act on it, `generalised`.

    Not its business: effects, actuators, meshes and units.
    """

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """A name for each coordinate, used for rows and in result files."""

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """A name for each independent velocity."""
        return self.names

    @property
    def coordinates(self) -> Coordinates:
        """Of what parts q and the independent velocities are made."""
        return Coordinates.of_point(self.size)

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of axes of the space in which forces act."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @property
    def freedom(self) -> int:
        """Number of independent velocities, and of momenta."""
        return len(self.velocity_names)

    @property
    def surplus(self) -> int:
        """Number of coordinates beyond the velocities, as of a unit quaternion."""
        return self.size - self.freedom

    @property
    def joined(self) -> int:
        """Number of equations by which links hold it: its velocities depend on each other by as many."""
        return 0

    @property
    def conditions(self) -> int:
        """Number of entries of the constraint g: first those of unit quaternions, then those of links."""
        return self.surplus + self.joined

    @property
    def plain(self) -> bool:
        """Whether momenta are the velocities of free coordinates: those of one point mass without links."""
        return False

    @property
    def link_units(self) -> tuple[tuple[str, ...], ...]:
        """The units of the equations of each link."""
        return ()

    @property
    def reaction_units(self) -> tuple[str, ...]:
        """The units of the forces per unit mass that keep g at zero; torques keep quaternions and angles."""
        linked = [unit for link in self.link_units for unit in link]
        return ("m^2/s^2",) * self.surplus + tuple("m/s^2" if unit == "m" else "m^2/s^2" for unit in linked)

    def links_at(self, q: Any) -> Any:
        """The entries of g that belong to links."""
        return ca.SX.zeros(0)

    def opening(self, q: Any, w: Any) -> Any:
        """The rates at which links would open, C(q) w: zero where they hold."""
        return ca.SX.zeros(0)

    def bars(self, q: Any) -> Any:
        """C(q), the slope of the links along the independent velocities, shape (joined, freedom)."""
        return ca.SX(0, self.freedom)

    @abstractmethod
    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        """Kinetic energy per unit mass [J/kg]."""

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        """Derivatives of the kinetic energy in q [m/s^2] and in v [m/s]."""
        energy = self.kinetic(q, v, m)
        return ca.gradient(energy, q), ca.gradient(energy, v)

    def step_inertia(self, h: Any, q: Sequence, move: Any, m: Any) -> list:
        """Derivatives of the kinetic energy of a step of order 2 in its two nodes q, per unit mass [m/s].

        `move` is the second less the first. Asked for where there are more coordinates than freedom; a
        configuration whose rate is the same at both nodes has shorter expressions.
        """
        (moved, first), (later, last) = (self.inertia(node, move / h, m) for node in q)
        mean = 0.5 * (first + last)
        return [0.5 * h * moved - mean, 0.5 * h * later + mean]

    def g(self, q: Any) -> Any:
        """The constraint g(q) = 0; no entries where the coordinates are free."""
        return ca.SX.zeros(0)

    def pull(self, q: Any, reaction: Any) -> Any:
        """(dg/dq)' times the constraint forces `reaction`."""
        return ca.jtimes(self.g(q), q, reaction, True)

    def tangent(self, q: Any) -> Any:
        """Z(q), shape (size, freedom)."""
        return ca.DM.eye(self.size)

    def along(self, q: Any, column: Any) -> Any:
        """Z(q)' times a column of the size of q; the column itself where Z is the identity."""
        return self.tangent(q).T @ column if self.surplus else column

    def velocity(self, q: Any, w: Any) -> Any:
        """dq/dt = Z(q) w; w itself where Z is the identity."""
        return self.tangent(q) @ w if self.surplus else w

    def pieces(self) -> list[tuple[Configuration, Any, Any, float]]:
        """The configuration of each body, where its coordinates and velocities stand, its share of the mass."""
        return [(self, slice(0, self.size), slice(0, self.freedom), 1.0)]

    @abstractmethod
    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        """The body as effects see it, at a mass where its inertia hangs on it."""

    def members(self, q: Any, v: Any, m: Any) -> list[tuple[str, Body, Any]]:
        """Name, state and mass of each body; the name of an only body is empty."""
        return [("", self.body(q, v, m), m)]

    def at(self, q: Any, v: Any, m: Any) -> dict[str, Body]:
        """The bodies by their names."""
        return {name: body for name, body, _ in self.members(q, v, m)}

    def on(self, name: str, q: Any, force: Any, torque: Any) -> Any:
        """The column of the size of q by which a force [N] and a torque in body axes [N m] act on one body."""
        return self.generalised(q, force, torque)

    @abstractmethod
    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        """The column of the size of q by which forces act; None is 0.

        They are a force [N], a torque in body axes [N m] and the torques on reaction wheels [N m].
        """

    def turning_share(self, m: Any) -> Any:
        """What a torque counts per unit mass, times m: 1 where the inertia per unit mass stays the same."""
        return 1

    def shared(self, column: Any, m: Any) -> Any:
        """A column of forces per unit mass with its torques times `turning_share`."""
        return column

    def driven(self, actuator: Any, q: Any, u: Any, m: Any) -> Any:
        """What an actuator does to the coordinates per unit mass [m/s^2], [m^2/s^2]."""
        return self.shared(actuator.acts(self, q, u) / m, m)

    def rotation(self, q: Any) -> Any:
        """R(q), which turns body axes into space axes; None for a body without an attitude."""
        return None

    def accelerations(self, w: Any, force: Any, torque: Any, spun: Any, m: Any) -> Any:
        """dw/dt of one body under a force [m/s^2], a torque [m^2/s^2] and what acts on wheels [N m]."""
        raise TypeError(f"{type(self).__name__} is not one body")


@dataclass(frozen=True)
class Translation(Configuration):
    """A point mass in a space of 1 to 3 `axes`: q is its position, g has no entries, Z is the identity."""

    axes: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(AXES[: self.axes])

    @property
    def dimension(self) -> int:
        return self.axes

    @property
    def plain(self) -> bool:
        return True

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        return 0.5 * ca.dot(v, v)

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        # The gradient of v . v / 2 would be written with a multiplication for each axis.
        return 0, v

    def body(self, q: Any, v: Any, m: Any = None) -> Body:
        return Body(q, v)

    def generalised(self, q: Any, force: Any, torque: Any, spun: Any = None) -> Any:
        return force

    @property
    def before(self) -> int:
        """Number of coordinates before those of a turn, of which it has none."""
        return self.axes

    def accelerations(self, w: Any, force: Any, torque: Any, spun: Any, m: Any) -> Any:
        return force
