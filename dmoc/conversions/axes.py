"""Axes of places in other formats: the J2000 ecliptic turned to ICRF."""

from __future__ import annotations

import numpy as np

from dmoc.planets.planet import turned

# The frame of scenes in the ecliptic, as `planet` calls it.
ECLIPTIC = "ECLIPJ2000"


def equatorial(vectors: np.ndarray, frame: str) -> np.ndarray:
    """Rows of 3 as they are in ICRF if they are in the ecliptic of J2000, else as they are."""
    return turned(vectors, "ecliptic", "icrf") if frame == ECLIPTIC else vectors


def missing(origin, form: str, names: tuple[str, ...]) -> None:
    """ValueError if a format needs something that neither the scene nor the caller says."""
    words = {"epoch": "the date of t = 0", "frame": "the axes", "center": "the body at the origin"}
    for name in names:
        if not getattr(origin, name):
            raise ValueError(f"{form} needs {words[name]}, which this scene does not know: give {name}")
