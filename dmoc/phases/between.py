"""The rows between the bodies of a team of missions: in every phase, at the end, and of their common clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.chains.within import Placed
from dmoc.nlp.layout import LEG_START, Layout
from dmoc.parts.rows import Row
from dmoc.phases.path import suffix
from dmoc.phases.timetable import Timetable
from dmoc.teams.between import BetweenBodies

# Rows of durations of several phases together, and rows by which all bodies begin at one time.
SPANS, STARTS = "durations of phases", "common start"


class BetweenMissions(BetweenBodies):
    """The rows between missions while they are written down, phase by phase; see `write`.

    `kicks` are the unknowns of the velocity changes at the goal of each body, which come before they meet.
    """

    def __init__(
        self,
        plan: Timetable,
        legs: Sequence[Placed],
        first_row: int,
        fixed: np.ndarray,
        kicks: Sequence[np.ndarray],
    ):
        self.team: Any = plan
        self.plan, self.first_row, self._fixed, self.kicks = plan, first_row, fixed, kicks
        self.grid = [legs[i : i + plan.count] for i in range(0, len(legs), plan.count)]
        self.rows, self.blocks, self._low, self._high, self._kernels = Layout(), [], [], [], {}

    def write(self) -> None:
        """All rows and their blocks."""
        plan, axes = self.plan, self.plan.dimension
        places, origin = ca.SX.sym("q", 2 * axes), ca.SX.sym("o", axes)
        apart = places[axes:] - places[:axes] + origin
        for phase in range(plan.count):
            self.legs = [mine[phase] for mine in self.grid]
            for name, (part, a, b) in zip(plan.pair_names(), plan.pairs(), strict=True):
                if rows := part.rows(apart):
                    made = self._kernel((part, "node"), places, origin, rows)
                    at = np.vstack([self._places(a), self._places(b)])
                    # Where phases meet the bodies are in one place, whose row is that of the phase before.
                    late = 1 if phase else 0
                    self._add(
                        name + suffix(phase), "node", rows, at, made, self._origin(b) - self._origin(a), late
                    )
        self._meet(apart, places, origin)
        self._clock()

    def _meet(self, apart: Any, places: ca.SX, origin: ca.SX) -> None:
        """What holds at the end; velocities are those behind what happens there."""
        axes = self.plan.dimension
        for name, (part, a, b) in zip(self.plan.pair_names(), self.plan.pairs(), strict=True):
            kicks = [self.kicks[a].reshape(-1, axes), self.kicks[b].reshape(-1, axes)]
            speeds = ca.SX.sym("v", 2 * axes)
            more = [ca.SX.sym("k", axes, len(kick)) for kick in kicks]
            first, second = (ca.sum2(part) if part.numel() else ca.SX.zeros(axes) for part in more)
            drift = speeds[axes:] - speeds[:axes] + second - first
            if not (rows := part.goal_rows(apart, drift)):
                continue
            unknowns = ca.vertcat(places, speeds, *[ca.vec(part) for part in more])
            made = self._kernel((part, "end", *map(len, kicks)), unknowns, origin, rows)
            ends = [self._places(a)[:, -1], self._places(b)[:, -1], self._speeds(a), self._speeds(b)]
            at = np.concatenate([*ends, *[kick.ravel() for kick in kicks]])
            self._add(name, "end", rows, at[:, None], made, self._origin(b) - self._origin(a))

    def _clock(self) -> None:
        """All bodies begin at one time, their phases last equally long, and as long as legs are to last."""
        plan, first = self.plan, self.grid[0]
        if plan.start_bounds[0] < plan.start_bounds[1]:
            self._alike(STARTS, lambda mine: mine[0].at(LEG_START, 0))
        free = [phase for phase in range(plan.count) if "duration" in first[phase].program.columns]
        for phase in free:
            self._alike(f"common duration{suffix(phase)}", lambda mine, at=phase: mine[at].at("duration", 0))
        if not (spans := plan.rows):
            return
        lasts = ca.SX.sym("T", len(free))
        total = [
            ca.sum1(lasts[[i for i, at in enumerate(free) if span.first <= at <= span.last]]) for span in spans
        ]
        rows = []
        for span, sum_of in zip(spans, total, strict=True):
            given = float(np.nansum(plan.known[span.first : span.last + 1]))
            rows.append(
                Row(
                    f"phases {span.first + 1} to {span.last + 1}",
                    sum_of,
                    span.shortest - given,
                    span.longest - given,
                    "s",
                )
            )
        at = np.concatenate([first[phase].at("duration", 0) for phase in free])
        self._add(SPANS, "end", rows, at[:, None], self._kernel(SPANS, lasts, ca.SX(0, 1), rows), np.empty(0))

    def _alike(self, name: str, unknown: Callable) -> None:
        """Rows by which an unknown of every other body is that of the first one."""
        values = ca.SX.sym("T", len(self.grid))
        rows = [
            Row(other, values[i + 1] - values[0], 0.0, 0.0, "s") for i, other in enumerate(self.plan.names[1:])
        ]
        at = np.concatenate([unknown(mine) for mine in self.grid])
        self._add(name, "end", rows, at[:, None], self._kernel("alike", values, ca.SX(0, 1), rows), np.empty(0))
