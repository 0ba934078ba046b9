"""The date of t = 0 and the frame of a scene, where a part of it knows them, as a `planet` does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

from dmoc.basics.arguments import both_ends, entries


class Clock(NamedTuple):
    """What the positions and the times of a scene count from.

    Attributes
    ----------
    epoch : str
        ISO text of t = 0, in barycentric dynamical time (TDB).
    frame : str
        Axes of the positions, as files call them: ECLIPJ2000 or ICRF.
    center : str
        The body at the origin; empty where the legs of a mission have several.
    known : tuple of str
        Each body with what its positions are from.
    cautions : tuple of str
        What a user should know of positions that are approximate.
    """

    epoch: str
    frame: str
    center: str
    known: tuple[str, ...]
    cautions: tuple[str, ...]

    def words(self) -> str:
        """Such as `2028-11-20T00:00:00 TDB at t = 0, frame ECLIPJ2000, origin sun`."""
        origin = f", origin {self.center}" if self.center else ""
        return f"{self.epoch} TDB at t = 0, frame {self.frame}{origin}"


def clock_of(scene: Any) -> Clock | None:
    """The clock of a transfer, a mission or a team; None where no part knows the date.

    Raises
    ------
    ValueError
        If two parts count from different dates or in different frames, or the tables of some end too early.
    """
    known = list(dict.fromkeys(_dated(_parts(scene))))
    if not known:
        return None
    first = known[0]
    # The legs of a mission may count from several origins, where a `Frame` leads from one to the next.
    alike = ["epoch", "frame"] + ["center"] * (not hasattr(scene, "plan"))
    for other in known:
        for fact in alike:
            mine, its = getattr(first, fact), getattr(other, fact)
            if mine != its:
                raise ValueError(
                    f"{first.body} has the {fact} {mine} and {other.body} {its}; give all planets of a scene "
                    f"one {fact}"
                )
        _check_span(other, *_times(scene))
    centers = {one.center for one in known}
    rough = [one.title for one in known if one.rough]
    told = f"positions of {' and '.join(dict.fromkeys(rough))} are approximate: "
    cautions = {told + one.remedy: None for one in known if one.rough}
    return Clock(
        first.epoch,
        first.frame_name,
        centers.pop() if len(centers) == 1 else "",
        tuple(dict.fromkeys(one.title for one in known)),
        tuple(cautions),
    )


def dates_of(scene: Any) -> dict[str, Any]:
    """Epoch, frame and center of a scene, by the names of `Provenance`; empty where no part knows them."""
    clock = clock_of(scene)
    return {} if clock is None else {"epoch": clock.epoch, "frame": clock.frame, "center": clock.center}


def cautions_of(scene: Any) -> tuple[str, ...]:
    """What a user should know of positions in a scene that are approximate."""
    clock = clock_of(scene)
    return () if clock is None else clock.cautions


def _parts(scene: Any) -> list[Any]:
    """The parts of a scene that may hold the motion of a body."""
    if hasattr(scene, "together"):
        return [part for one in scene.members for part in _parts(one)]
    # Where every leg has effects of its own, nobody has looked at those of the mission: one may stand alone.
    several = [entries(part) or (part,) for part in (scene.effects, scene.constraints)]
    return [scene.start, scene.goal, *several[0], *several[1], *getattr(scene, "legs", ())]


def _dated(parts: Any) -> Iterator[Any]:
    """The motions with a date among the parts and in their fields."""
    for part in parts:
        if hasattr(part, "epoch") and hasattr(part, "span"):
            yield part
        elif isinstance(part, (tuple, list)):
            yield from _dated(one for one in part if not isinstance(one, (int, float, str)))
        elif is_dataclass(part) and not isinstance(part, type):
            yield from _dated(getattr(part, field.name) for field in fields(part))


def _times(scene: Any) -> tuple[float, float]:
    """The earliest and the latest time of a scene [s]."""
    earliest, latest = both_ends(scene.start_time)
    return earliest, latest + scene.duration_bounds[1]


def _check_span(motion: Any, earliest: float, latest: float) -> None:
    first, last = motion.span
    slack, needed = 1e-9 * (last - first), latest - min(first, earliest)
    if earliest < first - slack or latest > last + slack:
        raise ValueError(
            f"the table of {motion.body} is from {first:g} to {last:g} s, but the scene may be from "
            f"{earliest:g} to {latest:g} s; give planet() another start or a duration of {needed:g} s"
        )
