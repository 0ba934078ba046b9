"""Zones and links that tell no shape of their own, as functions of the place that change sign at their edge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.links.holonomic import Holonomic
from dmoc.parts.constraint import Constraint
from dmoc.results.solution import Solution


@dataclass(frozen=True)
class Region:
    """A region or the surface of a link: name in a legend, whether it is a link, its function of places [m].

    `values` takes places of shape (count, axes): a zone is where it is positive, a link where it is zero.
    """

    name: str
    held: bool
    values: Callable[[np.ndarray], np.ndarray]


def regions(solution: Solution) -> list[Region]:
    """Limits on positions and links in the plane or in space that tell no shape of theirs."""
    if solution.problem is None or solution.dimension < 2:
        return []
    zones = [_zone(one) for one in solution.problem.constraints if _is_unshaped(one)]
    links = [_link(one, solution.dimension) for one in solution.problem.links]
    return [*zones, *(one for one in links if one is not None)]


def _is_unshaped(zone: Constraint) -> bool:
    of_place = not (zone.limits_speed or zone.limits_joint or zone.turns_body)
    # A zone that moves has no one place.
    still = type(zone).excess_at is Constraint.excess_at
    return of_place and still and not zone.outline()


def _zone(zone: Constraint) -> Region:
    """Where a body at rest breaks the limit."""
    return Region(
        f"forbidden by {type(zone).__name__}", False, lambda places: zone.excess(places, np.zeros_like(places))
    )


def _link(link: Holonomic, dimension: int) -> Region | None:
    function = link.level(dimension)
    if function is None:
        return None
    return Region(
        f"held by {type(link).__name__}", True, lambda places: np.asarray(function(places.T), float).ravel()
    )
