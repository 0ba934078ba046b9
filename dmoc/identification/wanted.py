"""The numbers that a flight is asked for: which they are, what they are thought to be, where they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from dmoc.basics.docstrings import documented
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import Unknown, at, is_unknown, with_field
from dmoc.parts.rows import title

AXES = ("x", "y", "z")
# A number that is thought to be 0 and has no standard deviation counts in units of this.
SIZE = 1.0


@dataclass(frozen=True)
class Wanted:
    """One unknown number.

    Attributes
    ----------
    name, unit : str
    value : float
        What it is thought to be.
    sigma : float or None
        Standard deviation of that belief; None if nothing is known.
    kind : str
        "mass", "exhaust" velocity; "scene" for other numbers of the equations of motion; or of what ties them
        to the flight: "offset", "strength", "turn", "delay"; "center" is both, and "tilt" is of the scene.
    index : int
        Which axis, control or turn it is.
    changed : callable or None
        The scene with another value of it.
    """

    name: str
    unit: str
    value: float
    sigma: float | None
    kind: str
    index: int = 0
    changed: Callable[[Any, float], Any] | None = None

    @property
    def inverse(self) -> bool:
        """Whether 1 over it is what is solved for, in which the equations are linear."""
        return self.kind in ("mass", "exhaust")

    @property
    def begin(self) -> float:
        """The unknown of the optimisation to begin with."""
        return 1 / self.value if self.inverse else self.value

    @property
    def scale(self) -> float:
        return abs(self.begin) or self.sigma or SIZE


def of_vector(kind: str, value: Any, unit: str, labels: tuple[str, ...], size: int) -> list[Wanted]:
    """The unknown entries of an offset, a strength or a turn: a number or one an axis."""
    entries = value if isinstance(value, tuple) else (value,)
    if len(entries) != size:
        raise ValueError(f"{kind} must have {size} entries here [{unit}]; got {len(entries)}")
    return [
        Wanted(f"{kind}.{labels[i]}" if size > 1 else kind, unit, float(one), one.sigma, kind, i)
        for i, one in enumerate(entries)
        if is_unknown(one)
    ]


def of_effects(problem: Any) -> Iterator[Wanted]:
    """The unknown constants of the effects of a problem."""
    for place, effect in enumerate(problem.effects):
        for field in effect.adjustable:
            value, (inside, _, last) = at(effect, field), field.rpartition(".")
            owner = at(effect, inside) if inside else effect
            known = documented(type(owner).__doc__)
            unit = known[last].unit if last in known else ""
            name = f"{title(effect, place)}_{field.replace('.', '_')}"
            several = isinstance(value, tuple)
            for i, one in enumerate(value if several else (value,)):
                if is_unknown(one):
                    label = f"{name}.{AXES[i] if len(value) <= 3 else i}" if several else name
                    changed = partial(_effect_changed, place, field, i if several else None)
                    yield Wanted(label, unit, float(one), one.sigma, "scene", i, changed)


def _effect_changed(place: int, field: str, entry: int | None, problem: Any, value: float) -> Any:
    effect, effects = problem.effects[place], problem.effects
    now: Any = Unknown(value)
    if entry is not None:
        before = at(effect, field)
        now = (*before[:entry], now, *before[entry + 1 :])
    return with_field(
        problem, "effects", (*effects[:place], with_field(effect, field, now), *effects[place + 1 :])
    )


def of_inertia(problem: Any, inertia: Any) -> Iterator[Wanted]:
    """The unknown principal moments of inertia."""
    for i, one in enumerate(inertia if isinstance(inertia, tuple) else ()):
        if is_unknown(one):
            changed = partial(_inertia_changed, i)
            yield Wanted(f"inertia.{AXES[i]}", "kg m^2", float(one), one.sigma, "scene", i, changed)


def _inertia_changed(i: int, problem: Any, value: float) -> Any:
    rows = [list(row) for row in problem.inertia]
    rows[i][i] = Unknown(value)
    return with_field(problem, "inertia", tuple(map(tuple, rows)))


def exhaust_changed(problem: Any, value: float) -> Any:
    """The scene whose propellant leaves at another speed."""
    return with_field(problem, "actuator", with_field(problem.actuator, "exhaust_velocity", Unknown(value)))


def tilt_axes(direction: Any) -> tuple[int, int]:
    """The two body axes that a direction points along least."""
    first, second = sorted(np.argsort(np.abs(direction), kind="stable")[:2].tolist())
    return first, second


def tilted(row: int, axis: int, problem: Any, value: float) -> Any:
    """The scene in which so much is added to the direction of a thruster along a body axis."""
    ways = [list(way) for way in problem.actuator.directions]
    ways[row][axis] = float(ways[row][axis]) + value
    opened = tuple(tuple(Unknown(x) for x in way) for way in ways)
    return with_field(problem, "actuator", with_field(problem.actuator, "directions", opened))


def of_tilt(problem: Any, tilt: tuple, labels: tuple[str, ...]) -> tuple[Any, list[Wanted]]:
    """The scene with thrusters turned as they are thought to be, and what of it is unknown."""
    if not (any(tilt) or any(map(is_unknown, tilt))):
        return problem, []
    found, stated = [], problem.actuator.directions
    for k, one in enumerate(tilt):
        row, axis = k // 2, tilt_axes(stated[k // 2])[k % 2]
        problem = tilted(row, axis, problem, float(one))
        if is_unknown(one):
            name, changed = f"tilt.{labels[row]}.{AXES[axis]}", partial(_retilted, row, axis, float(one))
            found.append(Wanted(name, "-", float(one), one.sigma, "tilt", k, changed))
    return problem, found


def _retilted(row: int, axis: int, before: float, problem: Any, value: float) -> Any:
    return tilted(row, axis, problem, value - before)


def center_changed(i: int, problem: Any, value: float) -> Any:
    """The scene whose centre of mass lies elsewhere along a body axis: thrusters move the other way."""
    actuator = problem.actuator
    shift = value * np.eye(3)[i]
    moved = tuple(tuple(Unknown(x) for x in np.array(row) - shift) for row in actuator.positions)
    return with_field(problem, "actuator", with_field(actuator, "positions", moved))
