"""Points to workers and records to the journal, wave after wave."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from typing import Any

from dmoc.sweeps.journal import Journal
from dmoc.sweeps.plan import Plan
from dmoc.sweeps.pool import Pool
from dmoc.sweeps.retry import DIED, MOST_LOOKS, better, first_retries, further_retries
from dmoc.sweeps.worker import Task, failed_record

SweepProgress = Callable[[int, int, int], Any]


@dataclass
class Sweep:
    """One sweep under way.

    Which points a wave has follows from the records of the waves before it alone, never from the
    order in which points end: so a sweep that was stopped ends with the same numbers.

    Attributes
    ----------
    task : callable
        Makes the task of a worker from the number of a point, the path to start from or None, and whether
        the point was tried before.
    progress : callable or None
        Called with (solves made, solves in all as far as known, points not solved so far).
    best : dict
        The record that counts of each point, and the wave it comes from.
    looks : Counter
        How often each point was tried.
    """

    plan: Plan
    journal: Journal
    pool: Pool
    task: Callable[[int, str | None, bool], Task]
    progress: SweepProgress | None = None
    best: dict[int, tuple[int, dict[str, Any]]] = field(default_factory=dict)
    looks: Counter[int] = field(default_factory=Counter)
    tries: int = 0
    unsolved: int = 0

    def run(self, follow: bool) -> list[dict[str, Any]]:
        """All records, in the order of the points; wave 0 tries every point once, later waves some again."""
        self._wave(0, {point: self.plan.before(point) if follow else None for point in range(self.plan.size)})
        wave, again = 1, first_retries(self.plan, self._records(), follow)
        while again:
            before = {point: self.best[point] for point in again}
            self._wave(wave, again)
            # the record that counts comes from another wave than before: the point became better
            changed = {point: old for point, (at, old) in before.items() if self.best[point][0] != at}
            again = further_retries(self.plan, self._records(), changed, again)
            again = {point: parent for point, parent in again.items() if self.looks[point] < MOST_LOOKS}
            wave += 1
        return self._records()

    def path(self, point: int) -> str | None:
        """The path of a point's answer, None where it is not solved."""
        wave, record = self.best[point]
        return self.journal.path_at(wave, point) if record.get("success") else None

    def _records(self) -> list[dict[str, Any]]:
        return [self.best[point][1] for point in range(self.plan.size)]

    def _wave(self, wave: int, parents: Mapping[int, int | None]) -> None:
        """Try points, each from its parent's answer where that was solved."""
        ready, children = self._sorted_out(wave, parents)
        left = len(ready) + sum(map(len, children.values()))
        running: dict[Future, int] = {}
        # when a worker process dies, all points under way are lost and any of them may be the cause: each is
        # then tried alone, and the one that kills its worker again is the culprit
        suspects: deque[int] = deque()
        while left:
            alone = bool(suspects) and not running
            if alone:
                self._begin(wave, suspects[0], parents, running)
            while ready and not suspects and len(running) < self.pool.width():
                self._begin(wave, ready.popleft(), parents, running)
            self._tell(left)
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                point, outcome = running.pop(future), self._outcome(future)
                if outcome is None and not alone:
                    suspects.append(point)
                    continue
                if alone:
                    suspects.popleft()
                outcome = outcome or (failed_record(DIED, "its worker process ended, twice"), None)
                self.journal.append(wave, point, *outcome)
                self._settle(wave, point)
                ready.extend(children.pop(point, ()))
                left -= 1
        self._tell(left)

    def _tell(self, left: int) -> None:
        if self.progress is not None:
            self.progress(self.tries, self.tries + left, self.unsolved)

    def _sorted_out(self, wave: int, parents: Mapping[int, int | None]) -> tuple[deque, dict[int, list[int]]]:
        """The points that can be begun, and by parent those that wait for its answer.

        Points that the journal has from an earlier run are settled and not tried again.
        """
        ready: deque[int] = deque()
        children: dict[int, list[int]] = {}
        for point, parent in parents.items():
            if (wave, point) in self.journal.records:
                self._settle(wave, point)
            elif parent is None or parent in self.best:
                ready.append(point)
            else:
                children.setdefault(parent, []).append(point)
        return ready, children

    def _begin(
        self, wave: int, point: int, parents: Mapping[int, int | None], running: dict[Future, int]
    ) -> None:
        start, parent = None, parents[point]
        if parent is not None and self.best[parent][1].get("success"):
            start = self.journal.path_at(self.best[parent][0], parent)
        running[self.pool.submit(self.task(point, start, wave > 0))] = point

    def _outcome(self, future: Future) -> tuple[dict[str, Any], str | None] | None:
        """What a worker brought back, or None if it ended before."""
        try:
            return future.result()
        except self.pool.deaths:
            return None
        except CancelledError:
            raise OSError("the scheduler was lost; the journal is kept: run the same sweep again") from None

    def _settle(self, wave: int, point: int) -> None:
        """Let a point's record in the journal count if it is the first of that point, or better."""
        record = self.journal.records[wave, point]
        self.looks[point] += 1
        self.tries += 1
        known = self.best.get(point)
        if known is None or better(record, known[1]):
            was = 0 if known is None else not known[1].get("success")
            self.unsolved += (not record.get("success")) - was
            self.best[point] = wave, record
