"""Several actuators at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import Any, ClassVar

import numpy as np

from dmoc.basics.arguments import checked, entries, of_kind
from dmoc.basics.records import dataclass
from dmoc.parts.actuator import Actuator
from dmoc.parts.outline import Jet
from dmoc.parts.rows import Row


@dataclass(frozen=True)
class Several(Actuator):
    """Several actuators at once. `TransferProblem(actuator=[...])` makes it of a list.

    Parameters
    ----------
    parts : sequence of Actuator
    """

    parts: Sequence[Actuator]
    adjustable: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        parts = entries(self.parts) or ()
        for i, part in enumerate(parts):
            of_kind(f"actuator[{i}]", part, Actuator)
            if part.burns:
                raise ValueError(f"actuator[{i}]: one of several may not burn propellant; got {part.words()}")
        checked(self, parts=parts)

    @property
    def structure(self) -> tuple:
        return type(self), *[(type(part), part.structure) for part in self.parts]

    @property
    def effort_unit(self) -> str:  # type: ignore[override]
        units = dict.fromkeys(part.effort_unit for part in self.parts)
        return " + ".join(units)

    def metered(self, dimension: int) -> Actuator:
        raise ValueError("least fuel is for a single actuator so far; minimise Effort() or Time()")

    def check_dimension(self, dimension: int) -> None:
        for part in self.parts:
            part.check_dimension(dimension)

    def size(self, dimension: int) -> int:
        return sum(part.size(dimension) for part in self.parts)

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(label for part in self.parts for label in part.labels(dimension))

    def units(self, dimension: int) -> tuple[str, ...]:
        return tuple(unit for part in self.parts for unit in part.units(dimension))

    def _places(self, dimension: int) -> list[slice]:
        """Where the controls of each part stand."""
        ends = accumulate((part.size(dimension) for part in self.parts), initial=0)
        return [slice(first, last) for first, last in pairwise(ends)]

    def _known(self, u: Any) -> list[tuple[Actuator, Any]]:
        """The parts and their controls, where the number of axes is told by the number of controls."""
        count = u.shape[-1] if isinstance(u, np.ndarray) else u.numel()
        axes = next(axes for axes in (2, 3, 1) if self.size(axes) == count)
        columns = [u[:, at] if isinstance(u, np.ndarray) else u[at] for at in self._places(axes)]
        return list(zip(self.parts, columns, strict=True))

    def jets(self) -> list[Jet]:
        # Thrusters are on bodies in space.
        pairs = zip(self.parts, self._places(3), strict=True)
        return [replace(jet, control=at.start + jet.control) for part, at in pairs for jet in part.jets()]

    def effort(self, u: Any) -> Any:
        return sum(part.effort(mine) for part, mine in self._known(u))

    def acts(self, configuration: Any, q: Any, u: Any) -> Any:
        places = zip(self.parts, self._places(configuration.dimension), strict=True)
        return sum(part.acts(configuration, q, u[at]) for part, at in places)

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        sides = [part.bounds(dimension) for part in self.parts]
        return np.concatenate([low for low, _ in sides]), np.concatenate([high for _, high in sides])

    def rows(self, u: Any) -> list[Row]:
        found = []
        for i, (part, mine) in enumerate(self._known(u)):
            found += [row._replace(name=f"{i + 1}.{row.name}") for row in part.rows(mine)]
        return found

    def force_limit(self) -> float | None:
        known = [limit for part in self.parts if (limit := part.force_limit()) is not None]
        return max(known, default=None)

    def torque_limit(self) -> float | None:
        known = [limit for part in self.parts if (limit := part.torque_limit()) is not None]
        return max(known, default=None)

    def excess(self, u: np.ndarray) -> np.ndarray:
        return np.max([part.excess(mine) for part, mine in self._known(u)], axis=0)

    def times(self, factor: float) -> Several:
        return replace(self, parts=tuple(part.times(factor) for part in self.parts))

    def needs(self, eased: Actuator) -> str:
        pairs = zip(self.parts, getattr(eased, "parts", self.parts), strict=True)
        return " and ".join(part.needs(other) for part, other in pairs if part.limited)

    def unlimited(self) -> Actuator | None:
        free = [part.unlimited() for part in self.parts]
        return None if None in free else replace(self, parts=tuple(part for part in free if part))

    def share(self, u: np.ndarray) -> float:
        return max(part.share(mine) for part, mine in self._known(u))

    def words(self) -> str:
        return "; ".join(part.words() for part in self.parts)
