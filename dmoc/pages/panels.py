"""Panels over time for a page: those of the pictures, read back as numbers, names and colours."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import StepPatch

from dmoc.pages.traces import INK, rounded
from dmoc.plots.style import DARK, LIMIT

# Marks of matplotlib by their names in plotly.js; other marks are dots.
SYMBOLS = {"o": "circle-open", "*": "star", "D": "diamond-open", "^": "triangle-up", "v": "triangle-down"}
SYMBOLS |= {".": "circle", "s": "square", "X": "x", "P": "cross"}
# Lines of matplotlib by their names in plotly.js.
DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot", "None": "none", "": "none", " ": "none"}
# Letters that matplotlib writes as commands, and its subscripts and exponents, in HTML.
LETTERS = {r"\omega": "\u03c9", r"\,": " ", "-": "\u2212"}


def read(draw: Any, *given: Any) -> dict[str, Any]:
    """A panel that `draw(axes, *given)` draws, for the page."""
    axes = Figure().add_subplot()
    draw(axes, *given)
    return read_axes(axes)


def read_axes(axes: Any) -> dict[str, Any]:
    """A panel of a picture for the page: title, labels, curves, bands and marks.

    A curve is {name, x, y, colour, dash, width}; `fixed` are levels such as limits, over all of the panel;
    `bands` times at which something is on; `marks` single times.
    """
    found: dict[str, Any] = {"title": plain(axes.get_title(loc="left") or axes.get_title())}
    found |= {"label": plain(axes.get_ylabel()), "below": plain(axes.get_xlabel())}
    found |= {"curves": [], "bands": [], "marks": [], "fixed": []}
    for line in axes.get_lines():
        _add_line(found, axes, line)
    for stairs in (patch for patch in axes.patches if isinstance(patch, StepPatch)):
        values, edges, _ = stairs.get_data()
        look = {"colour": _colour(stairs.get_edgecolor()), "dash": DASHES[str(stairs.get_linestyle())]}
        values = np.append(values, values[-1])
        found["curves"].append(_curve(stairs, edges, values, look) | {"steps": True})
    for drawn in axes.collections:
        _add_collection(found, axes, drawn)
    found["range"], found["reach"] = rounded(axes.get_ylim()), rounded(axes.get_xlim())
    return found


def _add_line(found: dict[str, Any], axes: Any, line: Line2D) -> None:
    x, y = (np.asarray(side, float) for side in line.get_data())
    if line.get_transform() == axes.get_yaxis_transform(which="grid"):
        found["fixed"].append({"name": _name(line), "y": rounded(y)[0], "colour": _colour(line.get_color())})
    elif line.get_transform() == axes.get_xaxis_transform(which="grid"):
        found["marks"].append(rounded(x)[0])
    elif not len(x):
        # A limit that is told in the legend alone.
        found["fixed"].append({"name": _name(line), "y": None, "colour": _colour(line.get_color())})
    else:
        look: dict[str, Any] = {"colour": _colour(line.get_color()), "dash": DASHES[str(line.get_linestyle())]}
        look |= {"width": line.get_linewidth(), "faint": line.get_alpha() or 1.0}
        if (symbol := SYMBOLS.get(str(line.get_marker()))) is not None:
            look |= {"marker": True, "symbol": symbol}
        if look["dash"] == "none":
            look["colour"] = _colour(line.get_markeredgecolor())
        if (gap := line.get_gapcolor()) is not None:
            look["gap"] = _colour(gap)
        found["curves"].append(_curve(line, x, y, look))


def _add_collection(found: dict[str, Any], axes: Any, drawn: Any) -> None:
    if isinstance(drawn, LineCollection):
        for segment in drawn.get_segments():
            look = {"colour": _colour(drawn.get_color()[0]), "dash": "dash", "width": LIMIT["linewidth"]}
            x, y = np.asarray(segment).T
            found["curves"].append(_curve(drawn, x, y, look))
    elif isinstance(drawn, PolyCollection):
        for path in drawn.get_paths():
            x, y = np.asarray(path.vertices).T
            if drawn.get_transform() == axes.transData:
                look = {"colour": _colour(drawn.get_facecolor()[0]), "dash": "none", "fill": True}
                found["curves"].append(_curve(drawn, x, y, look))
            else:
                found["bands"].append(rounded([x.min(), x.max()]))


def _curve(artist: Any, x: np.ndarray, y: np.ndarray, look: dict[str, Any]) -> dict[str, Any]:
    return {"name": _name(artist), "x": rounded(x), "y": rounded(y), **look}


def _name(artist: Any) -> str:
    """What the legend of a picture calls it; nothing where it has no place there."""
    label = str(artist.get_label())
    return "" if label.startswith("_") else plain(label)


def _colour(colour: Any) -> str:
    found = to_hex(colour)
    return INK if found == to_hex(DARK) else found


def plain(words: str) -> str:
    """Words of a picture in HTML, with formulas such as $F_x$ and $10^{5}$."""
    return re.sub(r"\$(.*?)\$", lambda found: _formula(found[1]), words).replace("\n", " ")


def _formula(words: str) -> str:
    for letters, letter in LETTERS.items():
        words = words.replace(letters, letter)
    words = re.sub(r"_(\w|\{.*?\})", lambda found: f"<sub>{found[1].strip('{}')}</sub>", words)
    return re.sub(r"\^(\w|\{.*?\})", lambda found: f"<sup>{found[1].strip('{}')}</sup>", words)
