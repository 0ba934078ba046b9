"""The journal of a sweep: one line of JSON a finished point, on the disk before the next is begun.

A sweep that is killed at any moment loses the points under way and nothing else. The first line
says what sweep it is. Every line has a checksum: the point of a line that was cut short or changed is
solved again, and the other lines count.
"""

from __future__ import annotations

import json
import os
import warnings
from pathlib import Path
from types import TracebackType
from typing import Any

from dmoc.basics.files import json_object, sealed_object, unsealed_object
from dmoc.basics.plain import finite

# The first line of a journal names this format: a file that does not is never written over.
JOURNAL_FORMAT = "dmoc sweep journal"
# The version of the lines: those of version 1 had no checksum.
JOURNAL_VERSION = 2
# A journal is named like the result file, with this at the end.
SUFFIX = ".journal"
# The remedy that is told where a journal belongs to another sweep.
KEPT = "give --restart to begin anew, or another --out"

try:
    import fcntl
except ImportError:  # not there on Windows, where nothing then guards against two sweeps into one file
    fcntl = None  # type: ignore[assignment]


class Journal:
    """Records of the points that are done, by (wave, point); wave 0 is the first try.

    Parameters
    ----------
    out : path
        The result file; the journal stands beside it.
    facts : dict
        What sweep it is.
    restart : bool
        Forget a journal that is there.

    Raises
    ------
    ValueError
        If the journal that is there belongs to another sweep, its first line is damaged, or another process
        writes to it.

    Warns
    -----
    UserWarning
        If lines are damaged, whose points have to be solved again.
    """

    def __init__(self, out: str | os.PathLike, facts: dict[str, Any], restart: bool = False):
        self.path = journal_of(out)
        self.records: dict[tuple[int, int], dict[str, Any]] = {}
        self._places: dict[tuple[int, int], int] = {}
        if not self.path.parent.is_dir():
            raise ValueError(f"cannot write {out}: there is no folder {self.path.parent}; create it first")
        if Path(out).is_dir():
            raise ValueError(f"cannot write {out}: it is a folder; add a file name")
        if self.path.exists() and not self.path.is_file():
            raise ValueError(f"{self.path} is no file; move it away, or give another --out")
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            self._begin({"format": JOURNAL_FORMAT, "version": JOURNAL_VERSION, **facts}, restart)
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self.records and self.path.exists():
            # no point was finished: an empty journal would only have the next sweep refused
            self.path.unlink()
        os.close(self._file)

    def append(self, wave: int, point: int, record: dict[str, Any], path: str | None) -> None:
        """Keep a finished point; it is on the disk when this returns."""
        record = finite(record)
        entry = {"wave": wave, "point": point, "record": record, "path": path}
        self._places[wave, point] = self._write(entry)
        self.records[wave, point] = record

    def path_at(self, wave: int, point: int) -> str | None:
        """The path of a finished point, read again from the disk."""
        os.lseek(self._file, self._places[wave, point], os.SEEK_SET)
        with os.fdopen(os.dup(self._file), "rb") as stream:
            return json.loads(stream.readline())["path"]

    def remove(self) -> None:
        """Forget it all: the result is written."""
        self.path.unlink()

    def _begin(self, facts: dict[str, Any], restart: bool) -> None:
        if fcntl is not None:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise ValueError(f"another sweep is writing to {self.path}; wait for it to end") from None
        with open(self.path, "rb") as stream:
            end = self._read(stream, None if restart else facts)
        os.ftruncate(self._file, end)
        if not end:
            self._write(facts)
            _settle(self.path.parent)

    def _read(self, stream: Any, facts: dict[str, Any] | None) -> int:
        """Take over the records of an earlier run, unless `facts` is None; where the good lines end."""
        head = stream.readline()
        # what every journal begins with, up to the comma: a head that was cut short is the beginning of it
        start = json.dumps({"format": JOURNAL_FORMAT})[:-1].encode()
        if not head.startswith(start) and not (start.startswith(head) and not head.endswith(b"\n")):
            raise ValueError(f"{self.path} is not the journal of a sweep; move it away, or give another --out")
        if facts is None or not head.endswith(b"\n"):
            return 0
        # `facts` through JSON and back: tuples become lists, as they are in the file
        if changes := differences(self._known(head), json.loads(json.dumps(facts))):
            raise ValueError(f"{self.path} belongs to another sweep: {'; '.join(changes)}; {KEPT}")
        end, damaged = len(head), 0
        for line in stream:
            if not line.endswith(b"\n"):
                break
            if (entry := _entry(line)) is None:
                damaged += 1
            else:
                key = entry["wave"], entry["point"]
                self.records[key], self._places[key] = entry["record"], end
            end += len(line)
        if damaged:
            told = f"{damaged} lines of {self.path} are" if damaged > 1 else f"a line of {self.path} is"
            warnings.warn(f"{told} damaged; what stood there is solved again", stacklevel=2)
        return end

    def _known(self, head: bytes) -> dict[str, Any]:
        """What the first line says of the sweep, or a ValueError."""
        version = (json_object(head) or {}).get("version", JOURNAL_VERSION)
        if version != JOURNAL_VERSION:
            raise ValueError(
                f"{self.path} comes from another dmoc (format {version!r}, this one has {JOURNAL_VERSION}); "
                f"go on with that one; or {KEPT}"
            )
        if (found := unsealed_object(head)) is None:
            raise ValueError(f"{self.path} is damaged: the checksum of its first line does not hold; {KEPT}")
        return found

    def _write(self, entry: dict[str, Any]) -> int:
        """Append one line, and where it begins."""
        place = os.lseek(self._file, 0, os.SEEK_END)
        line = json.dumps(sealed_object(entry), allow_nan=False).encode() + b"\n"
        try:
            while line:
                line = line[os.write(self._file, line) :]
            os.fsync(self._file)
        except OSError as error:
            told = f"cannot write {self.path}: {error.strerror}; make room and give the same command again"
            raise OSError(told) from error
        return place


def journal_of(out: str | os.PathLike) -> Path:
    """Where the journal of a result file stands."""
    return Path(out).with_name(Path(out).name + SUFFIX)


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """What sets two sweeps apart, in words."""
    found = []
    for name in dict.fromkeys([*old, *new]):
        was, now = old.get(name), new.get(name)
        if was == now:
            continue
        if name == "source_hash":
            found.append("the problem file has changed since")
        elif isinstance(was, dict) and isinstance(now, dict):
            found += differences(was, now)
        else:
            found.append(f"{name} was {_value_in_words(was)} and is now {_value_in_words(now)}")
    return found


def _value_in_words(value: Any) -> str:
    if isinstance(value, list) and len(value) > 3:
        return f"{len(value)} values from {value[0]} to {value[-1]}"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return "not given" if value is None else str(value)


def _entry(line: bytes) -> dict[str, Any] | None:
    """The entry of a line, or None if it is damaged or is none."""
    kinds: dict[str, Any] = {"wave": int, "point": int, "record": dict, "path": (str, type(None))}
    entry = unsealed_object(line)
    if entry is None or kinds.keys() != entry.keys():
        return None
    return entry if all(isinstance(entry[name], kind) for name, kind in kinds.items()) else None


def _settle(folder: Path) -> None:
    """Wait until the names of new files in a folder are on the disk, which `fsync` of a file leaves open."""
    place = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(place)
    finally:
        os.close(place)
