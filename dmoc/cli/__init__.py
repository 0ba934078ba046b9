"""The command line; what it needs is loaded inside `main`, where Ctrl-C ends it in one line."""

from __future__ import annotations

import gc
import signal
import sys

from dmoc.cli.ending import connect, end

# Python looks for unreachable rings of objects after so many new ones; a small solve makes half of them, all to
# stay. After every 700, as Python has it, takes 4 % of its processor time.
NEW_OBJECTS = 100_000


def main(arguments: list[str] | None = None) -> None:
    """Run the command line, see `dmoc.cli.app.main`; Ctrl-C ends it while it is still being loaded, too."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, end)
    connect()
    gc.set_threshold(NEW_OBJECTS)
    from dmoc.cli.app import main as run

    try:
        signal.signal(signal.SIGINT, before)
        run(arguments)
    except KeyboardInterrupt:
        end()
    finally:
        # At its end Python would look through all that is left, several times: a tenth of a small solve.
        gc.freeze()
    sys.exit()
