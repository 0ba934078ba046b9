"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dmoc.checks import short

# Letters of a name; a temporary file beside it has a few more.
LONGEST = 200


def path_of(path: str | os.PathLike) -> Path:
    """A path, or a ValueError if it is none."""
    if not isinstance(path, (str, os.PathLike)):
        raise ValueError(f"a file is named by a text or a path; got {short(path)}")
    if len(Path(path).name) > LONGEST:
        raise ValueError(f"the name {short(str(path))} is too long for a file")
    return Path(path)


@contextmanager
def whole_file(path: str | os.PathLike) -> Iterator[Path]:
    """A temporary file beside `path`, which takes its name once the block has ended without an error.

    The temporary file keeps the suffix, since writers choose their format by it. After an error it
    is gone and a former file of that name is as it was.

    Raises
    ------
    ValueError
        If the folder does not exist, or the path is itself a folder.
    """
    target = path_of(path)
    if not target.parent.is_dir():
        raise ValueError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
    if target.exists() and not target.is_file():
        raise ValueError(f"cannot write {target}: it is a folder, or no file; add a file name")
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield temporary
        with open(temporary, "rb+") as written:
            # the name must not reach the disk before the contents
            os.fsync(written.fileno())
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
