"""A folder of the user's own for what can be made again: functions written down, and machine code.

It is `dmoc` in $XDG_CACHE_HOME or ~/.cache, and may be removed at any time. It is used only if nobody
else may write to it; a file counts only if its content is what was written. Where there is no such
folder everything works as well, and is made anew each time.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from pathlib import Path

# The files used last are kept.
MOST_KEPT = 500


def folder() -> str | None:
    """The user's folder; None where it cannot be made or others may write to it."""
    # by its specification a path that is not absolute does not count
    given = os.environ.get("XDG_CACHE_HOME", "")
    place = os.path.join(given if os.path.isabs(given) else os.path.expanduser("~/.cache"), "dmoc")
    try:
        if not os.path.isabs(place):  # a user without a home
            return None
        if not os.path.lexists(place):
            os.makedirs(place, mode=0o700, exist_ok=True)
        found = os.lstat(place)
    except OSError:
        return None
    own = hasattr(os, "geteuid") and found.st_uid == os.geteuid() and stat.S_ISDIR(found.st_mode)
    return place if own and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else None


def read(name: str) -> bytes | None:
    """What was written under a name; None if nothing was, or not all of it is there."""
    place = folder()
    if place is None:
        return None
    try:
        with open(os.path.join(place, name), "rb") as file:
            digest, content = file.read(32), file.read()
    except OSError:
        return None
    with suppress(OSError):  # a disk that can only be read from
        os.utime(file.name)
    return content if digest == hashlib.sha256(content).digest() else None


def write(name: str, content: bytes) -> None:
    """Write under a name, whole or not at all; nothing happens where that is not possible."""
    place = folder()
    if place is None:
        return
    # the same ending: what a process leaves that is killed here is tidied away
    scratch = Path(place) / f"{os.getpid()}-{name}"
    try:
        scratch.write_bytes(hashlib.sha256(content).digest() + content)
        scratch.replace(Path(place) / name)
    except OSError:
        with suppress(OSError):
            scratch.unlink()


def tidy(pattern: str) -> None:
    """Remove the files of a pattern that were not used for longest, beyond a number."""
    place = folder()
    if place is None:
        return
    try:
        files = sorted(Path(place).glob(pattern), key=lambda file: -file.stat().st_mtime)
        for old in files[MOST_KEPT:]:
            old.unlink(missing_ok=True)
    except OSError:
        pass
