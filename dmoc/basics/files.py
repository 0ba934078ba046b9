"""Files that are written whole or not at all, and that know when they were changed."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dmoc.basics.arguments import short

# A file name has at most this many letters: most systems allow 255, and the temporary file has a few more.
LONGEST = 200
# A sealed file ends with these bytes, then the checksum of all before them.
SEAL = b"\ndmoc sha256 "
# The remedy that is told where a file is damaged.
AGAIN = "copy it or write it again"
# A sealed JSON object holds the checksum of its other entries under this name.
CHECKSUM = "sha256"


def as_path(path: str | os.PathLike) -> Path:
    """A path, or a ValueError if it is none or its name is too long."""
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
    OSError
        If the disk is full, say.
    """
    target = as_path(path)
    if not target.parent.is_dir():
        raise ValueError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
    if target.exists() and not target.is_file():
        raise ValueError(f"cannot write {target}: it is a folder, or no file; add a file name")
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield temporary
        with open(temporary, "rb+") as written:
            # After a power cut there must be no file of that name without its contents.
            os.fsync(written.fileno())
        os.replace(temporary, target)
    except OSError as error:
        raise OSError(f"cannot write {target}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def sealed(content: bytes) -> bytes:
    """A file's content with a checksum at its end.

    An HDF5 file says in its header where it ends, so other programs that read it ignore the checksum.
    """
    return content + _seal_of(content)


def is_sealed(path: Path) -> bool:
    """Whether a file has a checksum that holds; ask before a library that trusts its files opens it.

    Raises
    ------
    ValueError
        If the checksum does not hold.
    """
    whole = path.read_bytes()
    length = len(_seal_of(b""))
    found, wanted = whole[-length:], _seal_of(whole[:-length])
    # A file that never had a checksum may be read. A file whose seal is damaged must not pass for such a one:
    # if most bytes at the place of the seal are right, the file had a checksum.
    if found != wanted and sum(a == b for a, b in zip(found, SEAL, strict=False)) > len(SEAL) / 2:
        raise ValueError(f"{path} is damaged: its checksum does not hold; {AGAIN}")
    return found == wanted


def sealed_object(entries: dict[str, Any]) -> dict[str, Any]:
    """The entries, which JSON can hold, and the checksum of them all."""
    return entries | {CHECKSUM: _sum_of(entries)}


def unsealed_object(text: str | bytes) -> dict[str, Any] | None:
    """The entries in the JSON of a sealed object, without the checksum; None if that does not hold."""
    entries = json_object(text)
    if entries is None:
        return None
    known = entries.pop(CHECKSUM, None)
    try:
        return entries if known == _sum_of(entries) else None
    except UnicodeEncodeError:  # half of a letter of two parts, which nothing here has written
        return None


def json_object(text: str | bytes) -> dict[str, Any] | None:
    """The object in a JSON text; None if there is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):  # brackets in brackets in brackets
        return None
    return found if isinstance(found, dict) else None


def _sum_of(entries: dict[str, Any]) -> str:
    """A checksum that does not depend on how JSON is laid out: what is read back has the same."""
    plain = json.loads(json.dumps(entries))
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def _seal_of(content: bytes) -> bytes:
    return SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"
