"""Where the points of a sweep are solved: worker processes here, or the workers of a scheduler.

Both are `concurrent.futures` executors behind one small interface: `submit`, `width` (how many
points to have under way) and `deaths` (what a future raises whose worker ended before its point).
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol

from dmoc.sweeps.worker import Task, solve_point

# Every worker process uses one thread for linear algebra: the sweep has a process a core already, and more
# threads would compete for the same cores.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# A scheduler and its first worker must answer within this time [s]; on a network it takes a fraction of one.
ANSWER_WITHIN_S = 10
# The message where workers die at once. A spawned worker runs the user's script again up to the call of
# `sweep`, which must not start workers of its own.
UNGUARDED = (
    "the worker processes end as soon as they start; in a script, call sweep() below "
    'if __name__ == "__main__":, since every worker reads the script too'
)


class Pool(Protocol):
    """Somewhere to solve points; a context manager, which ends what is under way when it is left early."""

    deaths: tuple[type[BaseException], ...]

    def __enter__(self) -> Pool: ...
    def __exit__(self, *error: Any) -> None: ...
    def submit(self, task: Task) -> Future: ...
    def width(self) -> int: ...


class LocalPool:
    """Worker processes on this machine, each with one thread."""

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, workers: int):
        self.workers = workers

    def __enter__(self) -> LocalPool:
        self._before = {name: os.environ.get(name) for name in ONE_THREAD}
        # libraries read these variables when they are loaded, so they must be set before the processes start
        os.environ.update(ONE_THREAD)
        self._start()
        try:
            with _no_interrupt():
                first = self.executor.submit(os.getpid)
            first.result()
        except BaseException as error:
            self.__exit__(error)
            if isinstance(error, BrokenExecutor):
                raise RuntimeError(UNGUARDED) from None
            raise
        return self

    def __exit__(self, *error: Any) -> None:
        self._stop(at_once=error[0] is not None)
        for name, value in self._before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value

    def submit(self, task: Task) -> Future:
        with _no_interrupt():
            try:
                return self.executor.submit(solve_point, task)
            except BrokenExecutor:
                self._stop(at_once=True)
                self._start()
                return self.executor.submit(solve_point, task)

    def width(self) -> int:
        """One more than there are workers: none has to wait for its next point."""
        return self.workers + 1

    def _start(self) -> None:
        # a forked child would share CasADi's and the caller's threads and locks
        context = multiprocessing.get_context("spawn")
        # a pipe of which this process alone holds the other end: when that end closes, also because this
        # process was killed, every worker that waits at its own end is woken and exits
        self._lifeline, self._held = context.Pipe(duplex=False)
        self.executor = ProcessPoolExecutor(
            self.workers, mp_context=context, initializer=_live_on, initargs=(self._lifeline,)
        )

    def _stop(self, at_once: bool) -> None:
        if at_once:
            self._held.close()
        self.executor.shutdown(wait=True, cancel_futures=True)
        for end in (self._held, self._lifeline):
            end.close()


class SchedulerPool:
    """The workers of a `dask.distributed` scheduler, on any number of machines.

    Parameters
    ----------
    address : str
        Such as tcp://10.0.0.1:8786. Whoever can reach a scheduler can run code on its workers.

    Raises
    ------
    ValueError
        If `distributed` is not installed, or no scheduler or no worker answers there.
    """

    def __init__(self, address: str):
        try:
            from distributed import Client
            from distributed.comm.addressing import parse_address, parse_host_port
            from distributed.scheduler import KilledWorker
        except ImportError:
            raise ValueError("--scheduler needs dask.distributed: pip install distributed") from None
        self.deaths: tuple[type[BaseException], ...] = (KilledWorker,)
        # the library logs failures with a traceback; here each becomes an exception with a message of one line
        self._log = logging.getLogger("distributed.client")
        self._loudness = self._log.level
        self._log.setLevel(logging.CRITICAL)
        try:
            # a client with a malformed address would take 20 s to fail, with a traceback: refuse it before
            parse_host_port(parse_address(address)[1])
            self.client = Client(address, timeout=ANSWER_WITHIN_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ValueError(f"no scheduler answers at {address} ({error})") from None
        try:
            self.client.wait_for_workers(1, timeout=ANSWER_WITHIN_S)
        except TimeoutError:
            self.client.close()
            raise ValueError(f"the scheduler at {address} has no workers; start some: dask worker") from None
        self._remote: dict[Future, Any] = {}

    def __enter__(self) -> SchedulerPool:
        return self

    def __exit__(self, *error: Any) -> None:
        if self.client.status == "running":
            self.client.cancel(list(self._remote.values()))
        self.client.close()
        self._log.setLevel(self._loudness)

    def submit(self, task: Task) -> Future:
        """Do what `Client.get_executor().submit` does, whose future never ends if its worker is lost."""
        found: Future = Future()
        if self.client.status != "running":
            found.set_exception(CancelledError())
            return found
        remote = self._remote[found] = self.client.submit(solve_point, task, pure=False, retries=0)

        def hand_over(remote: Any) -> None:
            try:
                outcome = remote.result()
            except self.deaths as error:
                found.set_exception(error)
            except BaseException as error:
                lost = self.client.status != "running" or "Cancel" in type(error).__name__
                found.set_exception(CancelledError() if lost else error)
            else:
                found.set_result(outcome)
            self._remote.pop(found, None)

        remote.add_done_callback(hand_over)
        return found

    def width(self) -> int:
        """Two a thread, so that a worker has its next point at hand; workers may come and go."""
        try:
            return 2 * max(1, sum(self.client.nthreads().values()))
        except OSError:
            # the scheduler does not answer: the future of the next point will say so
            return 1


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Hold Ctrl-C back; processes started meanwhile inherit that and never see it: their parent ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _live_on(lifeline: Any) -> None:
    """Make this worker process exit as soon as its parent is gone, however the parent ended."""
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Any) -> None:
    try:
        lifeline.poll(None)
    finally:
        os._exit(1)
