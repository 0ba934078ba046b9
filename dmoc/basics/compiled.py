"""Functions as machine code, made by the computer's C compiler and kept for the next time.

They are those of one node or one step: neither their source nor the time to compile it grows with the
mesh. A library is named by its source and kept in the user's own folder (`cache`); it is loaded only if
its content is what was compiled. Without a compiler, or with anything else amiss, functions stay as they
are: CasADi interprets them, with the same result to rounding.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import casadi as ca

from dmoc.basics.cache import folder

COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-O1", "-fPIC", "-shared")
# Functions of fewer instructions gain nothing; the oldest libraries beyond this number are removed.
WORTHWHILE, MOST_KEPT = 100, 200
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
    """Whether a library is there as it was compiled."""
    try:
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
            record.write_text(hashlib.sha256(made.read_bytes()).hexdigest())
            made.replace(library)
            record.replace(_record(library))
            for old in sorted(library.parent.glob("*.so"), key=lambda file: -file.stat().st_mtime)[MOST_KEPT:]:
                old.unlink(missing_ok=True)
                _record(old).unlink(missing_ok=True)
    except (OSError, subprocess.SubprocessError):
        return False
    return True
