"""What the commands share: where they may write, and what Ctrl-C does."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

SOLVED, BAD_INPUT, NOT_SOLVED, CHECK_FAILED, INTERRUPTED = 0, 2, 3, 4, 130


def writable(path: Path | None, drawn: bool = False) -> None:
    """ValueError unless a file can be written there: said before the work, not after it."""
    if path is None:
        return
    folder = path.parent
    if not folder.is_dir():
        raise ValueError(f"cannot write {path}: there is no folder {folder}; create it first")
    if path.is_dir() or not os.access(folder, os.W_OK):
        raise ValueError(f"cannot write {path}: choose a file in a folder you may write to")
    if drawn:
        from dmoc.plot import SUFFIXES

        if path.suffix.lower() not in SUFFIXES:
            raise ValueError(f"cannot draw into {path}: the file must end in {', '.join(SUFFIXES)}")


@contextmanager
def ends_at_once() -> Iterator[None]:
    """Outside a solve, which stops at Ctrl-C and keeps its iterate, it ends the program.

    CasADi would swallow the exception. Nothing is being written here, so nothing is left behind.
    """

    def end(number: int, frame: Any) -> NoReturn:
        if sys.stderr.isatty():
            sys.stderr.write("\r\x1b[2K\x1b[?25h")
        sys.stderr.write("interrupted\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)

    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
