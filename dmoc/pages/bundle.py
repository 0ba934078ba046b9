"""The JavaScript that draws in a browser: plotly.js, from the file that the Python package plotly brings."""

from __future__ import annotations

import base64
import gzip
from functools import cache
from importlib.util import find_spec
from pathlib import Path

# The place of plotly.js in the package.
INSIDE = ("package_data", "plotly.min.js")


def bundle_file() -> Path:
    """The file of plotly.js.

    Raises
    ------
    ValueError
        If plotly is not installed.
    """
    # Finding the package does not load it.
    spec = find_spec("plotly")
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        if (file := Path(folder, *INSIDE)).is_file():
            return file
    raise ValueError(
        "a page is drawn by plotly.js, which comes with plotly, and that is not installed: pip install plotly"
    )


@cache
def bundle() -> str:
    """plotly.js, packed as gzip and written in base64: a third of its size, which a browser unpacks."""
    return base64.b64encode(gzip.compress(bundle_file().read_bytes(), mtime=0)).decode()
