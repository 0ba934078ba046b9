"""Tables in netCDF-4 files: written whole or not at all, sealed by a checksum, refused where damaged.

A checksum after the end of the HDF5 content is verified before anything opens the file: the HDF5 library
may hang on a damaged one. Files of format 1 have none and are read as they are. Reading takes numbers and
text from a file and runs nothing.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from dmoc.basics.files import AGAIN, as_path, is_sealed, sealed, whole_file
from dmoc.basics.records import dataclass

# An HDF5 file, and so a netCDF-4 file, begins with these bytes.
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"

# A table holds (dimensions, values, attributes) of every variable by name.
Table = dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]


@dataclass(frozen=True)
class Format:
    """A kind of file: its name and version, its description, and a sentence on the program that writes it."""

    name: str
    version: int
    words: str
    written_by: str


def write_table(path: str | os.PathLike, attributes: dict[str, Any], table: Table) -> None:
    """Write attributes and variables to a netCDF-4 file, whole or not at all."""
    import h5netcdf
    import h5py

    # HDF5 may crash where a disk is full, so the content is made in memory.
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        file.attrs.update(attributes)
        for name, (dimensions, values, about) in table.items():
            for dimension, size in zip(dimensions, values.shape, strict=True):
                if dimension not in file.dimensions:
                    file.dimensions[dimension] = size
            kind = h5py.string_dtype() if values.dtype == object else values.dtype
            file.create_variable(name, dimensions, kind, data=values).attrs.update(about)
    with whole_file(path) as temporary:
        temporary.write_bytes(sealed(content.getvalue()))


def read_table(path: str | os.PathLike, form: Format) -> tuple[dict[str, Any], Table]:
    """Attributes and variables of a file of one format.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged, of another kind or from a newer dmoc.
    """
    file = as_path(path)
    _refuse_what_is_no_netcdf(file, form)
    whole = is_sealed(file)
    facts, table = _open(file)
    _refuse_other_formats(file, facts, form)
    if facts["format_version"] > 1 and not whole:
        raise ValueError(f"{file} was cut short or changed: it lacks its checksum; {AGAIN}")
    return facts, table


@contextmanager
def damage_told(path: str | os.PathLike) -> Iterator[None]:
    """What is wrong with the content of a file that could be opened becomes a ValueError of one line."""
    try:
        yield
    except KeyError as error:
        raise ValueError(f"{path} is damaged: it lacks the attribute {error}; {AGAIN}") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{path} is damaged: {one_line(error)}; {AGAIN}") from None


def format_of(path: str | os.PathLike) -> str | None:
    """The name of the format that a file says it has, or None; ValueError if it is damaged."""
    import h5py

    try:
        is_sealed(Path(path))
        with h5py.File(path, "r") as file:
            return file.attrs.get("format")
    except OSError:
        return None


def one_line(error: Exception) -> str:
    """The message of an error on one line, short enough for a terminal."""
    text = " ".join(str(error).split())
    return text if len(text) <= 160 else text[:157] + "..."


def _refuse_what_is_no_netcdf(file: Path, form: Format) -> None:
    if not file.is_file():
        raise ValueError(f"{file} {'is not a file' if file.exists() else 'does not exist'}; {form.written_by}")
    try:
        with open(file, "rb") as stream:
            head = stream.read(len(HDF5_SIGNATURE))
    except OSError as error:
        raise ValueError(f"{file} cannot be read: {error.strerror}") from None
    # A beginning of the signature is a file that was cut short; anything else was never one.
    if len(head) < len(HDF5_SIGNATURE) and HDF5_SIGNATURE.startswith(head):
        raise ValueError(f"{file} is cut short: it holds {len(head)} bytes; {AGAIN}")
    if head != HDF5_SIGNATURE:
        raise ValueError(f"{file} is not {form.words}: it is no netCDF-4 file; {form.written_by}")


def _open(file: Path) -> tuple[dict[str, Any], Table]:
    """Attributes and variables of a netCDF file, as they were written."""
    import h5netcdf

    try:
        with h5netcdf.File(file, "r", phony_dims="access", decode_vlen_strings=True) as data:
            table = {name: (one.dimensions, one[...], dict(one.attrs)) for name, one in data.variables.items()}
            return dict(data.attrs), table
    except Exception as error:  # the layers below raise whatever they trip over
        raise ValueError(f"{file} is damaged or cut short ({one_line(error)}); {AGAIN}") from None


def _refuse_other_formats(file: Path, facts: dict[str, Any], form: Format) -> None:
    version = facts.get("format_version")
    if (facts.get("format"), form.name) == ("dmoc sweep", "dmoc solution"):
        raise ValueError(f"{file} is the result of a sweep; draw it with: dmoc plot {file}")
    if facts.get("format") != form.name or not isinstance(version, (int, np.integer)):
        raise ValueError(f"{file} is netCDF but not {form.words}; {form.written_by}")
    if version > form.version:
        raise ValueError(
            f"{file} comes from a newer dmoc (format {version}, this one reads up to {form.version}); "
            "update dmoc"
        )


def as_array(table: Table, name: str) -> np.ndarray:
    """The numbers of a variable.

    Raises
    ------
    ValueError
        If there is none of that name.
    """
    if name not in table:
        raise ValueError(f"it lacks the variable {name!r}")
    return np.array(table[name][1], float)


def prefixed(table: Table, prefix: str) -> Table:
    """A table with a prefix before all its names."""
    return {
        prefix + name: (tuple(prefix + one for one in dimensions), values, about)
        for name, (dimensions, values, about) in table.items()
    }


def unprefixed(table: Table, prefix: str) -> Table:
    """The part of a table whose names have a prefix, without it."""
    return {
        name.removeprefix(prefix): (tuple(one.removeprefix(prefix) for one in dimensions), values, about)
        for name, (dimensions, values, about) in table.items()
        if name.startswith(prefix)
    }


def plain_facts(facts: dict[str, Any]) -> str:
    """Attributes as a text of JSON, in which NumPy's numbers are plain ones."""
    return json.dumps({k: v.item() if isinstance(v, np.generic) else v for k, v in facts.items()})
