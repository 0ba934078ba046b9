"""The configuration of a body: its coordinates, the constraint between them, its kinetic energy.

A configuration is q in R^size with a constraint g(q) = 0 of size - freedom entries. The columns of the
tangent matrix Z(q), of shape (size, freedom), span the directions in which q may move: dg/dq Z = 0. Three
sizes stay apart: positions (entries of q), freedom (velocities and momenta that are reported) and controls
(entries of u, which the actuator counts).

References
----------
S. Leyendecker, S. Ober-Bloebaum, J. E. Marsden, M. Ortiz, Discrete mechanics and optimal control
for constrained systems, Optim. Control Appl. Meth. 31 (2010).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import casadi as ca

# Names of the axes of space.
AXES = "xyz"


class Configuration(ABC):
    """The coordinates of a body, or of several.

    A frozen dataclass that derives from this has these duties:

    1. Name its coordinates and say how free they are: `names`, `freedom`.
    2. Give the kinetic energy per unit mass: `kinetic`. Its derivatives, `inertia`, are CasADi's gradients
       unless they are overridden by shorter expressions.
    3. Where there are more coordinates than freedom: the constraint `g` and the tangent matrix `tangent`.

    Not its business: effects, actuators, meshes and units.
    """

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """A name for each coordinate, used for rows and in result files."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @property
    @abstractmethod
    def freedom(self) -> int:
        """Number of independent velocities, and of momenta."""

    @abstractmethod
    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        """Kinetic energy per unit mass [J/kg]."""

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        """Derivatives of the kinetic energy in q [m/s^2] and in v [m/s]."""
        energy = self.kinetic(q, v, m)
        return ca.gradient(energy, q), ca.gradient(energy, v)

    def g(self, q: Any) -> Any:
        """The constraint g(q) = 0; no entries where the coordinates are free."""
        return ca.SX.zeros(0)

    def tangent(self, q: Any) -> Any:
        """Z(q), shape (size, freedom)."""
        return ca.DM.eye(self.size)


@dataclass(frozen=True)
class Translation(Configuration):
    """A point mass in a space of 1 to 3 `axes`: q is its position, g has no entries, Z is the identity."""

    axes: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(AXES[: self.axes])

    @property
    def freedom(self) -> int:
        return self.axes

    def kinetic(self, q: Any, v: Any, m: Any) -> Any:
        return 0.5 * ca.dot(v, v)

    def inertia(self, q: Any, v: Any, m: Any) -> tuple[Any, Any]:
        # The gradient of v . v / 2 would be written with a multiplication for each axis.
        return 0, v
