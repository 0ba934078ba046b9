"""One stencil while it is being written down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from dmoc.assembly.kernel import kernel
from dmoc.guess.chart import drafted, pulled
from dmoc.nlp.layout import LEG_MASS, LEG_START, Limit, Owner, Stencil
from dmoc.parts.rows import Row

# A stencil takes all entries of a group, one for each evaluation.
ALL = slice(None)


class Draft:
    """The unknowns, numbers and rows of one stencil while it is being written down.

    `writer` knows the dynamics, the problem, the parameters, and whether unknowns are curved.
    """

    def __init__(self, writer: Any):
        self.writer, self.cost = writer, ca.SX(0)
        self._symbols: list[ca.SX] = []
        self._unknowns: list[tuple[str, slice]] = []
        self._data: list[ca.SX] = []
        self._numbers: list[tuple[str, slice]] = []
        self._rows: list[ca.SX] = []
        self._targets: list[tuple[str, slice]] = []
        self._limits: list[Limit] = []
        self._between: tuple[ca.SX, ca.SX] | None = None

    def _once(self, group: str) -> ca.SX:
        """The symbol of a single unknown, however often it is asked for."""
        known = dict(zip((name for name, _ in self._unknowns), self._symbols, strict=True))
        return known[group] if group in known else self.take(group, 1)

    def take(self, group: str, size: int, at: slice = ALL) -> ca.SX:
        """Symbols for some of the unknowns of a group."""
        self._symbols.append(ca.SX.sym(group, size))
        self._unknowns.append((group, at))
        return self._symbols[-1]

    def place(self, at: slice = ALL) -> tuple[Any, Any]:
        """The position of a node from the origin, and the frame that forces and rows of motion have there."""
        n = self.writer.dynamics.positions
        unknowns = self.take("position", n, at)
        if not self.writer.curved:
            return unknowns, ca.DM.eye(n)
        return drafted(lambda name: self.number(name, at), unknowns)

    def pulled(self, mu: Any) -> ca.SX:
        """The pull of the attractor at the node of a curved place, in the frame there."""
        return pulled(self.number, self._symbols[0], mu)

    def control(self, frame: Any, at: slice = ALL) -> ca.SX:
        """The controls of a node, whose force is in the frame there; kept in it if it acts alike in all."""
        u, n = self.take("force", self.writer.dynamics.controls, at), self.writer.dynamics.positions
        return ca.vertcat(frame @ u[:n], u[n:]) if self.writer.curved and not self.writer.alike else u

    def velocity(self, end: str, frame: Any) -> ca.SX:
        """The velocity at one end, which is in the frame there."""
        v = self.take(f"{end}.velocity", self.writer.dynamics.freedom)
        return frame @ v if self.writer.curved else v

    def number(self, name: str, at: slice = ALL) -> ca.SX:
        """A symbol for a number that the mesh, or the chart, gives to each evaluation."""
        if (name, at) not in self._numbers:
            self._data.append(ca.SX.sym(name))
            self._numbers.append((name, at))
        return self._data[self._numbers.index((name, at))]

    def mass(self, at: slice) -> ca.SX:
        """The mass at nodes: unknowns if it burns away, one of a leg of a mission, else a parameter."""
        if self.writer.problem.actuator.burns:
            return self.take("mass", 1, at)
        return self._once(LEG_MASS) if self.writer.joined else self.writer.mass

    def clock(self) -> ca.SX:
        """The time at the start: an unknown in a leg of a mission, else a parameter."""
        return self._once(LEG_START) if self.writer.joined else self.writer.start_time

    def duration(self) -> ca.SX:
        """The duration: an unknown if it is free, a parameter if not."""
        return self._once("duration") if self.writer.problem.free_duration else self.writer.duration

    def between(self, known: list) -> list:
        """Symbols that stand for some columns in the rows: see `kernel`."""
        symbols = [ca.SX.sym(f"between_{i}", column.numel()) for i, column in enumerate(known)]
        self._between = ca.vertcat(*symbols), ca.vertcat(*known)
        return symbols

    def add(self, group: str, rows: ca.SX, at: slice = ALL) -> None:
        """Add to rows of a group that others also add to."""
        self._rows.append(rows)
        self._targets.append((group, at))

    def limit(self, name: str, kind: str, rows: Sequence[Row], owner: Owner | None = None) -> None:
        """Rows of this stencil alone."""
        if rows:
            # The expressions are in the kernel; the layout needs only names, bounds and units.
            bare = tuple(row._replace(expression=None) for row in rows)
            self._limits.append(Limit(name, kind, bare, owner))
            self.add(name, ca.vertcat(*[row.expression for row in rows]))

    def unknowns(self, group: str) -> list[tuple[ca.SX, slice]]:
        """The symbols of a group so far, and which of its entries they are."""
        return [
            (symbol, at)
            for symbol, (name, at) in zip(self._symbols, self._unknowns, strict=True)
            if name == group
        ]

    def rows_of(self, group: str) -> list[tuple[ca.SX, slice]]:
        """What has been added to the rows of a group, and to which of them."""
        return [(rows, at) for rows, (name, at) in zip(self._rows, self._targets, strict=True) if name == group]

    def stencil(self, every: str) -> Stencil:
        if self.writer.lesson is not None:
            self.writer.lesson.extend(self, every)
        given = ca.vertcat(*self._symbols), ca.vertcat(*self._data), self.writer.parameters
        made = kernel(every, *given, ca.vertcat(*self._rows), ca.SX(self.cost), self._between)
        places = tuple(self._unknowns), tuple(self._numbers), tuple(self._targets)
        return Stencil(made, every, *places, tuple(self._limits))
