"""What watches a run of Ipopt: Ctrl-C and the clock, and what is told of every iteration."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import casadi as ca
import numpy as np

# When the solve began whose time limits count together [s of the monotonic clock].
_begun: ContextVar[float | None] = ContextVar("begun", default=None)


@contextmanager
def one_clock() -> Iterator[None]:
    """Within it, as in one solve by several ways, all time limits count from its begin."""
    token = _begun.set(_begun.get() or time.monotonic())
    try:
        yield
    finally:
        _begun.reset(token)


class Interrupt:
    """Ctrl-C as a flag while a solve runs: CasADi would swallow the exception, and the iterate be lost.

    It is set as well once so many `seconds` are over.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self.seconds, self._begun = seconds, _begun.get() or time.monotonic()
        self._pressed = False
        self._previous: Any = None

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return self.seconds is not None and time.monotonic() - self._begun > self.seconds

    @property
    def seen(self) -> bool:
        """Whether the run is to end."""
        return self._pressed or self.late

    def __enter__(self) -> Interrupt:
        # Python lets no other thread handle signals.
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._see)
        return self

    def __exit__(self, *error: Any) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _see(self, *received: Any) -> None:
        self._pressed = True


class Watch:
    """Follows the iterations of one run: tells of each, and stops it when `interrupt` has seen a Ctrl-C.

    It stops as well when `tell` says so, (iteration, objective, x, g) -> whether to stop, scaled. CasADi would
    print an exception of `tell` and go on: the watch stops the run and keeps the exception as `error`, to be
    raised afterwards.
    """

    def __init__(self, tell: Callable[..., bool] | None, interrupt: Interrupt):
        self.tell, self.interrupt, self.iteration = tell, interrupt, 0
        self.error: BaseException | None = None
        # CasADi holds no reference to its callback: this one lives as long as the run.
        self.follower: Follower | None = None

    def stops(self, at: dict[str, Any]) -> bool:
        """Whether to stop, after it has told of an iterate, whose memory is CasADi's."""
        stop = self.interrupt.seen
        if self.tell is not None:
            f, x, g = (np.frombuffer(at[name]).copy() for name in ("f", "x", "g"))
            stop |= self.tell(self.iteration, float(f[0]), x, g)
        self.iteration += 1
        return stop


class Follower(ca.Callback):
    """What CasADi calls every iteration; it asks the `watch` of the run.

    Parameters
    ----------
    columns, rows, parameters : int
        Sizes of the NLP.
    """

    def __init__(self, columns: int, rows: int, parameters: int, watch: Watch):
        ca.Callback.__init__(self)
        self.sizes = {"f": 1, "x": columns, "lam_x": columns, "g": rows, "lam_g": rows}
        self.parameters, self.watch, self.telling = parameters, watch, False
        self.construct("follower", {})

    @classmethod
    def of(cls, parts: Any, watch: Watch) -> Follower:
        """The one of a run of this NLP."""
        follower = cls(parts.x.numel(), parts.g.numel(), parts.p.numel(), watch)
        watch.follower = follower
        return follower

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.sizes.get(ca.nlpsol_out(i), self.parameters))

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, given: Sequence, results: Sequence) -> int:
        self.telling = True
        try:
            stop = self.watch.stops(dict(zip(ca.nlpsol_out(), given, strict=True)))
        except BaseException as error:
            self.watch.error, stop = error, True
        finally:
            self.telling = False
        np.frombuffer(results[0])[:] = stop
        return 0
