"""Axes of places in other formats: the J2000 ecliptic turned to ICRF."""

from __future__ import annotations

import numpy as np

from dmoc.planets.planet import turned

# The frame of scenes in the ecliptic, as `planet` calls it.
ECLIPTIC = "ECLIPJ2000"
# What epoch, frame and center are, and how they are given.
NEEDED = {"epoch": "the date of t = 0", "frame": "the axes", "center": "the body at the origin"}
EXAMPLES = {
    "epoch": "epoch (2028-11-20T06:00:00)",
    "frame": "frame (EME2000)",
    "center": "center (EARTH)",
}


def equatorial(vectors: np.ndarray, frame: str) -> np.ndarray:
    """Rows of 3 as they are in ICRF if they are in the ecliptic of J2000, else as they are."""
    return turned(vectors, "ecliptic", "icrf") if frame == ECLIPTIC else vectors


def missing(origin, form: str, names: tuple[str, ...]) -> None:
    """ValueError if a format needs something that neither the scene nor the caller says."""
    lacking = [name for name in names if not getattr(origin, name)]
    if lacking:
        needed, given = (_listed([kind[name] for name in lacking]) for kind in (NEEDED, EXAMPLES))
        raise ValueError(f"{form} needs {needed}, which this scene does not know: give {given}")


def _listed(words: list[str]) -> str:
    """Such as a, b and c."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
