"""A flight as it was measured: times, positions, forces that were commanded; from a table of text and back."""

from __future__ import annotations

import csv
import os
import re
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from dmoc.basics.arguments import checked, short
from dmoc.basics.files import as_path, whole_file
from dmoc.basics.plain import Brief
from dmoc.basics.quaternions import QUATERNION, in_one_sign
from dmoc.basics.records import dataclass

# The columns of a table by the field they belong to; the unit of each.
COLUMNS = {
    "positions": (("x", "y", "z"), "m"),
    "velocities": (("vx", "vy", "vz"), "m/s"),
    "attitudes": (("qs", "qx", "qy", "qz"), "-"),
    "angles": (("angle",), "rad"),
    "rates": (("wx", "wy", "wz"), "rad/s"),
    "forces": (("fx", "fy", "fz"), "N"),
    "controls": ((), ""),
}
# A table must tell at least so many positions: two tell a start, a third tells something of the motion.
FEWEST = 3
# Quaternions of a table may be off unit length by the rounding of a few digits [-].
UNIT_LENGTH = 1e-3


@dataclass(frozen=True)
class Flight(Brief):
    """What was measured and commanded in a flight; NaN where a sample is missing.

    Parameters
    ----------
    times : array, shape (samples,)
        Increasing [s].
    positions : array, shape (samples, axes), optional
        Of the marker [m], one to three axes; only a body of which the attitude alone is asked has none.
    forces : array, shape (samples, controls), optional
        Commanded controls [N], each held from its time to the next, the last for no time; a missing one is that
        before it. In space axes, or as the actuator that `identify` is given takes them.
    velocities : array, shape (samples, axes), optional
        Of the marker's body [m/s].
    attitudes : array, shape (samples, 4) or (samples,), optional
        Unit quaternions from body to space, scalar first, or in the plane angles [rad].
    rates : array, shape (samples, 3), optional
        In body axes [rad/s].
    name : str

    Raises
    ------
    ValueError
        If shapes do not fit, times do not increase, or there are fewer than three positions.
    """

    times: Any
    positions: Any = None
    forces: Any = None
    velocities: Any = None
    attitudes: Any = None
    rates: Any = None
    name: str = field(default="flight", compare=False)

    def __post_init__(self) -> None:
        times = _table("times", self.times, 1)
        if len(times) < FEWEST:
            raise ValueError(f"a flight needs at least {FEWEST} samples; got {len(times)}")
        late = np.flatnonzero(~(np.diff(times) > 0))
        if not np.isfinite(times).all() or len(late):
            where = int(late[0]) + 2 if len(late) else int(np.argmin(np.isfinite(times))) + 1
            raise ValueError(
                f"times must increase [s]; sample {where}, at {times[where - 1]:g} s, not after the one before"
            )
        found: dict[str, Any] = {"times": times}
        for name in ("positions", "forces", "velocities", "rates", "attitudes"):
            given = getattr(self, name)
            if given is None:
                continue
            rows = _table(name, given, 0 if name == "attitudes" else 2)
            if len(rows) != len(times):
                raise ValueError(f"{name} has {len(rows)} samples but times has {len(times)}; give one a time")
            found[name] = rows
        checked(self, **found)
        self._check_sizes()
        seen = self.positions if self.positions is not None else self.attitudes
        count = 0 if seen is None else int(np.isfinite(seen.reshape(len(times), -1)).all(axis=1).sum())
        if count < FEWEST:
            raise ValueError(
                f"a flight needs at least {FEWEST} samples with all axes of the position; got {count}"
            )
        if self.forces is not None:
            checked(self, forces=_held(self.forces))
        if self.attitudes is not None and self.attitudes.ndim == 2:
            checked(self, attitudes=_quaternions(self.attitudes))

    def _check_sizes(self) -> None:
        axes = None if self.positions is None else self.positions.shape[1]
        if axes is not None and not 1 <= axes <= 3:
            raise ValueError(f"positions must have 1 to 3 axes [m]; got {axes}")
        for name, size in (("velocities", axes), ("rates", 3)):
            given = getattr(self, name)
            if given is not None and given.shape[1] != size:
                raise ValueError(f"{name} must have {size} axes; got {given.shape[1]}")
        if self.attitudes is not None and self.attitudes.ndim == 2 and self.attitudes.shape[1] != QUATERNION:
            raise ValueError(
                f"attitudes must be quaternions of four numbers, or angles [rad]; got {self.attitudes.shape[1]}"
            )

    @property
    def axes(self) -> int:
        """Number of axes of the position; 0 where there is none."""
        return 0 if self.positions is None else self.positions.shape[1]

    @property
    def duration(self) -> float:
        """[s]"""
        return float(self.times[-1] - self.times[0])

    @property
    def dropped(self) -> int:
        """How many samples have no position."""
        seen = self.positions if self.positions is not None else self.attitudes
        return int(len(self.times) - np.isfinite(seen.reshape(len(self.times), -1)).all(axis=1).sum())

    def save(self, path: str | os.PathLike) -> Path:
        """Write the flight as a CSV table, whole or not at all, which `read` reads back to the last bit."""
        target = as_path(path)
        names, columns = ["t"], [self.times[:, None]]
        for own, (labels, _) in COLUMNS.items():
            rows = self.attitudes if own == "angles" else getattr(self, own, None)
            if rows is None or (own in ("attitudes", "angles") and (rows.ndim == 1) != (own == "angles")):
                continue
            rows = rows.reshape(len(self.times), -1)
            many = own == "forces" and rows.shape[1] > len(labels)
            names += [f"u{i + 1}" for i in range(rows.shape[1])] if many else list(labels[: rows.shape[1]])
            columns.append(rows)
        lines = [
            ",".join("" if np.isnan(value) else repr(float(value)) for value in row)
            for row in np.hstack(columns)
        ]
        with whole_file(target) as work:
            Path(work).write_text("\n".join([",".join(names), *lines]) + "\n")
        return target

    @classmethod
    def read(cls, path: str | os.PathLike) -> Flight:
        """The flight of a CSV table.

        Its head has `t` [s] and `x`, `y`, `z` [m], and may have `vx`.. [m/s], `fx`.. [N] in space axes or
        `u1`.. for the controls of an actuator, `angle` [rad] or `qs`, `qx`, `qy`, `qz`, and `wx`.. [rad/s]. An
        empty cell is a sample that is missing; lines that begin with # say what a person should know.

        Raises
        ------
        ValueError
            With file and line, if the table cannot be read or is no flight.
        """
        file = as_path(path)
        if not file.is_file():
            raise ValueError(f"there is no flight {file}; give a CSV table")
        try:
            text = file.read_text()
        except UnicodeDecodeError:
            raise ValueError(f"{file} is no table of text (CSV)") from None
        lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
        if len(lines) < 2:
            raise ValueError(f"{file} has no samples; the first line must name columns, such as t,x,y,fx,fy")
        head = [re.sub(r"\s*[\[(].*", "", name).strip().strip("\ufeff") for name in _cells(lines[0][1])]
        places = _places(file, head)
        rows = np.array([_numbers(file, at, line, head) for at, line in lines[1:]])
        found = {name: rows[:, at] for name, at in places.items()}
        found["times"] = found["times"][:, 0]
        if "angles" in found:
            found["attitudes"] = found.pop("angles")[:, 0]
        if "controls" in found:
            found["forces"] = found.pop("controls")
        try:
            return cls(**found, name=file.stem)
        except ValueError as error:
            raise ValueError(f"{file}: {error}") from None


def _cells(line: str) -> list[str]:
    return next(csv.reader([line]))


def _places(file: Path, head: list[str]) -> dict[str, list[int]]:
    """Which columns belong to which field."""
    known = {"t": ("times", 0), "time": ("times", 0)}
    known |= {label: (own, i) for own, (labels, _) in COLUMNS.items() for i, label in enumerate(labels)}
    found: dict[str, dict[int, int]] = {}
    for at, name in enumerate(head):
        control = re.fullmatch(r"u(\d+)", name)
        own, i = ("controls", int(control[1])) if control else known.get(name, ("", 0))
        if not own:
            listed = ", ".join(["t", *(label for labels, _ in COLUMNS.values() for label in labels), "u1"])
            raise ValueError(f"{file}: no flight has a column {name!r}; the columns are {listed}")
        if i in found.setdefault(own, {}):
            raise ValueError(f"{file}: there are two columns {name!r}")
        found[own][i] = at
    if "times" not in found:
        raise ValueError(f"{file}: there is no column t with the times [s]")
    if "forces" in found and "controls" in found:
        raise ValueError(f"{file}: give forces as fx, fy, fz or as u1, u2, .., not both")
    for own, each in found.items():
        if own not in ("times", "controls") and sorted(each) != list(range(len(each))):
            raise ValueError(f"{file}: {own} leave out an axis; the columns are {', '.join(COLUMNS[own][0])}")
    return {own: [each[i] for i in sorted(each)] for own, each in found.items()}


def _numbers(file: Path, at: int, line: str, head: list[str]) -> list[float]:
    cells = _cells(line)
    if len(cells) != len(head):
        raise ValueError(f"{file}, line {at}: {len(cells)} cells under {len(head)} columns")
    found = []
    for name, cell in zip(head, cells, strict=True):
        try:
            found.append(float(cell) if cell.strip() else np.nan)
        except ValueError:
            raise ValueError(f"{file}, line {at}: {name} must be a number; got {short(cell)}") from None
    return found


def _table(name: str, value: Any, axes: int) -> np.ndarray:
    try:
        found = np.array(value, float)
    except Exception:  # whatever a user's object raises
        raise ValueError(f"{name} must be numbers; got {short(value)}") from None
    if found.ndim == 1 and axes == 2:
        found = found[:, None]
    if (axes and found.ndim != axes) or not 1 <= found.ndim <= 2:
        raise ValueError(
            f"{name} must be {'rows of numbers' if axes == 2 else 'a row of numbers'}; got {short(value)}"
        )
    if np.isinf(found).any():
        raise ValueError(f"{name} must be finite, or NaN where a sample is missing")
    return found


def _held(forces: np.ndarray) -> np.ndarray:
    """Forces with each missing one as that before it, 0 before the first."""
    known = np.where(np.isnan(forces), 0, np.arange(1, len(forces) + 1)[:, None])
    last = np.maximum.accumulate(known, axis=0)
    padded = np.vstack([np.zeros(forces.shape[1]), np.nan_to_num(forces)])
    return np.take_along_axis(padded, last, axis=0)


def _quaternions(rows: np.ndarray) -> np.ndarray:
    """Unit quaternions with continuous signs; ValueError if their lengths are not 1."""
    lengths = np.linalg.norm(rows, axis=1)
    known = np.isfinite(lengths)
    if (off := np.abs(lengths[known] - 1)).max(initial=0.0) > UNIT_LENGTH:
        raise ValueError(
            f"attitudes must be unit quaternions, scalar first; one has the length {1 + off.max():.3g} or less"
        )
    found = rows.copy()
    found[known] = in_one_sign(rows[known] / lengths[known, None])
    return found
