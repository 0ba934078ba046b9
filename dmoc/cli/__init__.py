"""The command line; what it needs is loaded inside `main`, where Ctrl-C ends it in one line."""

from __future__ import annotations

import signal
import sys

from dmoc.cli.ending import connect, end


def main(arguments: list[str] | None = None) -> None:
    """Run the command line, see `dmoc.cli.app.main`; Ctrl-C ends it while it is still being loaded, too."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, end)
    connect()
    from dmoc.cli.app import main as run

    try:
        signal.signal(signal.SIGINT, before)
        run(arguments)
    except KeyboardInterrupt:
        end()
    sys.exit()
