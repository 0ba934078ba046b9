"""The base of what pushes: how controls become a force, and which controls are allowed."""

from __future__ import annotations

from abc import ABC
from typing import Any, ClassVar

import numpy as np

from dmoc.scene.rows import Row


class Actuator(ABC):
    """Controls u of one node and the force they make. A force actuator's controls are its force [N].

    Fields named in `adjustable` may change from one solve to the next without a rebuild; inside
    `force` and `rows` they may be symbols.
    """

    adjustable: ClassVar[tuple[str, ...]] = ()
    # least mass [kg], and the rounding of |F| at zero where a throttle is tied to it [-]
    dry_mass: float = 0.0
    smoothing: float | None = None

    @property
    def structure(self) -> tuple:
        """What cannot change in a re-solve: two actuators with the same structure have the same rows."""
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

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits of the controls."""
        limit = np.full(self.size(dimension), np.inf)
        return -limit, limit

    def rows(self, u: Any) -> list[Row]:
        """Further limits that are not plain bounds, dimensionless."""
        return []

    def throttle(self, u: Any) -> Any:
        """Magnitude of the thrust that costs propellant [N]; None where the controls do not tell."""
        return None

    def flow(self, u: Any) -> Any:
        """Propellant burnt [kg/s]; None where the mass does not change."""
        return None

    def metered(self, dimension: int) -> Actuator:
        """The same actuator with the magnitude of its force among the controls, which least fuel needs."""
        raise ValueError(
            f"least fuel with {type(self).__name__} has no optimum: impulses without limit cost least; "
            "use BallForce(limit), BoxForce(limit) or Engine(max_thrust, ...)"
        )

    def force_limit(self) -> float | None:
        """The largest force [N] along one axis, or None if there is no limit."""
        return None

    def excess(self, u: np.ndarray) -> np.ndarray:
        """By how much the controls, shape (count, size), break the limits [N]; 0 where they hold."""
        lower, upper = self.bounds(u.shape[1])
        return np.maximum(0.0, np.maximum(lower - u, u - upper)).max(axis=1, initial=0.0)

    def words(self) -> str:
        """One line for a person."""
        return "any force, without a limit"
