"""Traces of plotly.js, in the plane or in space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

# Numbers on a page have so many digits: nobody sees more, and a file of all would be twice as large.
DIGITS = 6
# What is drawn in the dark grey of the pictures is drawn in the colour of the page's letters.
INK = "ink"


def trace(points: np.ndarray) -> dict[str, Any]:
    """The places of a trace, shape (points, axes)."""
    kind = {"type": "scatter3d" if points.shape[1] == 3 else "scatter", "showlegend": False}
    return kind | {axis: rounded(column) for axis, column in zip("xyz", points.T, strict=False)}


def line(points: np.ndarray, name: str, colour: str, width: float) -> dict[str, Any]:
    """A line of one colour."""
    look = {"mode": "lines", "name": name, "line": {"color": colour.lower(), "width": width}}
    return trace(points) | look | {"hoverinfo": "name" if name else "skip"}


def apart(lines: Sequence[np.ndarray]) -> np.ndarray:
    """Lines as one, with a gap behind each."""
    gap = np.full((1, lines[0].shape[1]), np.nan)
    return np.concatenate([part for one in lines for part in (one, gap)])


def rounded(values: Any) -> list[Any]:
    """Numbers for a page, nested as they are; None where one is not finite, which JSON cannot hold."""
    array = np.asarray(values, float)
    known = np.isfinite(array)
    with np.errstate(all="ignore"):
        power = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.abs(array))))
        # Zero, and what is near the least number there is, has no digits.
        short = np.where(np.isfinite(power) & known, np.round(array * power) / power, 0.0)
    found = short.astype(object)
    found[~known] = None
    return found.tolist()
