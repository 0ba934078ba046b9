"""What missions minimise beside the objectives of transfers, and the share that a leg has in it."""

from __future__ import annotations

from typing import Any, ClassVar

from dmoc.basics.arguments import short
from dmoc.basics.records import dataclass
from dmoc.parts.actuator import Actuator
from dmoc.parts.objectives import Objective


@dataclass(frozen=True)
class DeltaV(Objective):
    """Least velocity change [m/s]: the sum of all impulses, and the integral of |F| / m over burns."""

    unit: ClassVar[str] = "m/s"
    metered: ClassVar[bool] = True

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return actuator.throttle(u) / m

    def kick(self, size: Any, mass: Any) -> Any:
        return size


@dataclass(frozen=True)
class Share(Objective):
    """What a leg adds to the objective of a mission: all but the cost at the goal."""

    whole: Objective

    def __post_init__(self) -> None:
        if self.whole.learns:
            raise ValueError("Information is an objective of one transfer, not of a mission or of a team")

    @property
    def sense(self) -> int:  # type: ignore[override]
        return self.whole.sense

    @property
    def metered(self) -> bool:  # type: ignore[override]
        return self.whole.metered

    @property
    def paid_at_goal(self) -> Objective:
        return self.whole

    def check_dimension(self, dimension: int) -> None:
        self.whole.check_dimension(dimension)

    def rate(self, actuator: Actuator, t: Any, q: Any, v: Any, u: Any, m: Any) -> Any:
        return self.whole.rate(actuator, t, q, v, u, m)

    def unit_with(self, actuator: Actuator) -> str:
        return self.whole.unit_with(actuator)

    def words(self) -> str:
        return self.whole.words()


def share_of(leg: Any, whole: Objective, actuator: Actuator) -> Share:
    """The share of a leg in the objective of a mission, whose controls have the units of an actuator.

    Raises
    ------
    ValueError
        If the leg's own objective cannot be added to that of the mission.
    """
    own = leg.objective
    if own is None:
        return Share(whole)
    if not isinstance(own, Objective):
        raise ValueError(f"objective must be a dmoc.Objective; got {short(own)}")
    facts = [(one.unit_with(actuator), "most" if one.sense < 0 else "least") for one in (own, whole)]
    if facts[0] != facts[1]:
        told = [f"{sought} of a number [{unit or '1'}]" for unit, sought in facts]
        raise ValueError(
            f"its own objective seeks the {told[0]} and that of the mission the {told[1]}, and a sum has one "
            "unit; give the leg an objective of that kind"
        )
    return Share(own)
