"""How the program ends at Ctrl-C and goes without an output; it loads nothing, since it comes first."""

from __future__ import annotations

import os
import sys

# Exit code after Ctrl-C: 128 and the number of the signal, as shells have it.
INTERRUPTED = 130


def end(*received: object) -> None:
    """End the program in one line, whatever it is doing: nothing is being written."""
    line = "\r\x1b[2K\x1b[?25hinterrupted\n" if os.isatty(2) else "interrupted\n"
    os.write(2, line.encode())
    os._exit(INTERRUPTED)


def connect() -> None:
    """Lead a stream that a shell closed, as `>&-` does, to nowhere.

    Python has None in its place, and the next file to be opened would get what libraries print.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, open(number, mode))  # noqa: SIM115
