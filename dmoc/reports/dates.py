"""Dates of a scene whose parts know them: what times and positions count from, when a path begins and ends."""

from __future__ import annotations

from typing import Any


def dates_rows(scene: Any) -> list[tuple[str, Any]]:
    """What times and positions count from, as rows of a scene in words; none where nothing knows the date."""
    from dmoc.scene.clock import clock_of

    clock = clock_of(scene)
    if clock is None:
        return []
    exact = [f"positions of {' and '.join(clock.known)}"]
    return [("dates", [clock.words(), *(clock.cautions or exact)])]


def dates_words(solution: Any) -> str:
    """Such as `from 2028-11-20 07:15 to 2029-09-13 01:02 TDB`; empty where nothing knows the date."""
    epoch = solution.provenance.epoch
    if not epoch:
        return ""
    from dmoc.planets.dates import minutes_of

    first, last = (minutes_of(epoch, float(t)) for t in (solution.time[0], solution.time[-1]))
    return f"from {first} to {last} TDB"


def dates_object(solution: Any) -> dict[str, Any]:
    """Epoch, frame, center and the dates of start and goal for JSON; empty where nothing knows the date."""
    about = solution.provenance
    if not about.epoch:
        return {}
    from dmoc.planets.dates import later

    first, last = (later(about.epoch, float(t)) for t in (solution.time[0], solution.time[-1]))
    places = {"epoch": about.epoch, "frame": about.frame, "center": about.center}
    return places | {"time_scale": "TDB", "start_date": first, "goal_date": last}
