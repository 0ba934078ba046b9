"""Functions as machine code, made by the computer's C compiler and kept for the next time.

They are those of one node or one step: neither their source nor the time to compile it grows with the
mesh. A library is named by its source and kept in a folder of the user's own, `dmoc` in $XDG_CACHE_HOME or
~/.cache, which may be removed at any time. It is loaded only if nobody else may write to it or to the
folder, and its content is what was compiled. Without a compiler, or with anything else amiss, functions
stay as they are: CasADi interprets them, with the same result to rounding.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import casadi as ca

# The first of these C compilers that the computer has is used.
COMPILERS = ("cc", "gcc", "clang")
# The compiler gets these flags; with other flags a library gets another name.
FLAGS = ("-O1", "-fPIC", "-shared")
# A function is compiled if it has at least this many instructions: shorter ones gain nothing.
WORTHWHILE = 100
# The folder keeps this many libraries; the oldest ones beyond are removed.
MOST_KEPT = 200
# The compiler is given up after this time [s]; functions then stay as they are.
PATIENCE_S = 120


def compiled(functions: dict[str, ca.Function]) -> dict[str, ca.Function]:
    """The same functions, the long ones as machine code where that can be had."""
    long = {name: function for name, function in functions.items() if function.n_instructions() >= WORTHWHILE}
    library = _library(list(long.values())) if long else None
    if library is None:
        return functions
    try:
        return functions | {name: ca.external(f.name(), str(library)) for name, f in long.items()}
    except RuntimeError:
        return functions


def compiler() -> str | None:
    """Path of the C compiler."""
    return next(filter(None, map(shutil.which, COMPILERS)), None)


def folder() -> str | None:
    """The user's folder for libraries; None where it cannot be made or others may write to it."""
    # By the specification of XDG_CACHE_HOME a path that is not absolute does not count.
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
    return place if stat.S_ISDIR(found.st_mode) and _is_private(found) else None


def _is_private(found: os.stat_result) -> bool:
    """Whether a file or folder is this user's or root's, and nobody else may write to it."""
    own = hasattr(os, "geteuid") and found.st_uid in (os.geteuid(), 0)
    return own and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _library(functions: list[ca.Function]) -> Path | None:
    """The library of some functions, compiled if there is none that is intact."""
    place = folder()
    if place is None:
        return None
    generator = ca.CodeGenerator("kernel.c")
    for function in functions:
        generator.add(function)
    source = generator.dump()
    made_of = "\n".join([source, *FLAGS, platform.machine(), sys.platform])
    library = Path(place) / f"{hashlib.sha256(made_of.encode()).hexdigest()}.so"
    return library if _intact(library) or _compile(source, library) else None


def _record(library: Path) -> Path:
    return library.with_suffix(".sha256")


def _intact(library: Path) -> bool:
    """Whether a library is there as it was compiled, in a file of its own that nobody else may write to."""
    try:
        found = os.lstat(library)  # of a link itself, wherever it leads
        if not (stat.S_ISREG(found.st_mode) and _is_private(found)):
            return False
        return hashlib.sha256(library.read_bytes()).hexdigest() == _record(library).read_text()
    except (OSError, UnicodeDecodeError):
        return False


def _compile(source: str, library: Path) -> bool:
    """Compile into a scratch folder, then put library and record at their places; False if it fails."""
    program = compiler()
    if program is None:
        return False
    try:
        with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
            code, made, record = (Path(scratch) / name for name in ("kernel.c", "kernel.so", "record"))
            code.write_text(source)
            command = [program, *FLAGS, str(code), "-lm", "-o", str(made)]
            subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE_S)
            # A umask may let the group write, and such a library would not be loaded.
            made.chmod(0o600)
            record.write_text(hashlib.sha256(made.read_bytes()).hexdigest())
            made.replace(library)
            record.replace(_record(library))
        _tidy(library.parent)
    except (OSError, subprocess.SubprocessError):
        return False
    return True


def _tidy(place: Path) -> None:
    """Remove the oldest libraries beyond a number."""
    for old in sorted(place.glob("*.so"), key=lambda file: -file.stat().st_mtime)[MOST_KEPT:]:
        old.unlink(missing_ok=True)
        _record(old).unlink(missing_ok=True)


def usable_cores() -> int:
    """How many cores this process may use, where the system says so, else how many there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
