"""What is minimised."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from dmoc.actuators import Actuator


class Objective(ABC):
    """The integral of `running` over time plus `terminal` at the goal.

    A user's own objective overrides either. `u` are the controls, for a force actuator the force [N].
    """

    unit: ClassVar[str] = ""
    metered: ClassVar[bool] = False
    adjustable: ClassVar[tuple[str, ...]] = ()

    def running(self, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        """Cost per second."""
        return 0

    def terminal(self, t: Any, q: Any, v: Any, m: Any) -> Any:
        """Cost of the state at the goal."""
        return 0

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        """Cost per second where it depends on what the actuator makes of its controls."""
        return self.running(t, q, v, u, m)

    def unit_with(self, actuator: Actuator) -> str:
        """The unit of the objective with this actuator."""
        return self.unit

    def words(self) -> str:
        """One line for a person."""
        return (type(self).__doc__ or type(self).__name__).strip().splitlines()[0]


@dataclass(frozen=True)
class Effort(Objective):
    """Least effort: 1/2 integral of |F|^2 dt [N^2 s]."""

    unit: ClassVar[str] = "N^2 s"

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        force = actuator.force(u)
        return 0.5 * ca.dot(force, force)


@dataclass(frozen=True)
class Fuel(Objective):
    """Least fuel: the propellant burnt [kg], or without an exhaust velocity the integral of |F| dt [N s]."""

    unit: ClassVar[str] = "kg"
    metered: ClassVar[bool] = True

    def unit_with(self, actuator: Actuator) -> str:
        return "kg" if actuator.burns else "N s"

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return actuator.flow(u) if actuator.burns else actuator.throttle(u)


@dataclass(frozen=True)
class Time(Objective):
    """Least time: the duration [s]. Needs a limited force and a duration given as (shortest, longest)."""

    unit: ClassVar[str] = "s"

    def running(self, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return 1.0
