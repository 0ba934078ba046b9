"""What all answers have in common: how the solve ended, its effort, and how an answer shows itself."""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

from dmoc.basics.digits import lasting
from dmoc.results.moments import moment_of_legs

if TYPE_CHECKING:
    from dmoc.results.facts import Level, Provenance

# Status of a local optimum that is not as accurate as it was asked to be.
NOT_MET = "tolerance not met"
# Status of a local optimum on a mesh before the last one, when the time was over.
OUT_OF_TIME = "time limit"


class SolveError(RuntimeError):
    """Raised by `Solution.raise_for_status` when the optimisation failed."""


class Outcome:
    """What the solutions of transfers and of missions have in common: how the solve ended, and its effort."""

    problem: Any
    objective: float
    success: bool
    status: str
    message: str
    ladder: tuple[Level, ...]
    provenance: Provenance
    order: Any
    steps: Any
    duration: Any

    def __init_subclass__(cls) -> None:
        # A dataclass would otherwise write one of its own, which prints every array.
        cls.__repr__ = Outcome.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        """One line: what was found, on which mesh, in how many iterations."""
        known, mesh = self.provenance, f"order {self.order}, {self.steps} steps, {self.iterations} iterations"
        head = f"{type(self).__name__} of {known.problem_name!r}"
        if not self.optimal:
            return f"{head}, not solved: {self.status}, {mesh}"
        label = self.problem.objective.label if self.problem is not None else "objective"
        unit = known.objective_unit
        cost = lasting(self.objective, 5) if unit == "s" else f"{self.objective:.5g} {unit}".rstrip()
        parts = [f"{label} {cost}", *([] if label == "time" else [f"duration {lasting(self.duration, 5)}"])]
        return f"{head}: {', '.join([*parts, mesh, *([] if self.success else [self.status])])}"

    @property
    def optimal(self) -> bool:
        """Whether the path is a local optimum, be it as accurate as asked for or not."""
        return self.success or self.status in (NOT_MET, OUT_OF_TIME)

    @property
    def iterations(self) -> int:
        """Iterations of Ipopt on all meshes."""
        return sum(level.iterations for level in self.ladder)

    @property
    def evaluations(self) -> int:
        """Evaluations of functions and derivatives on all meshes."""
        return sum(level.evaluations for level in self.ladder)

    @property
    def build_s(self) -> float:
        """Seconds spent on building NLPs."""
        return sum(level.build_s for level in self.ladder)

    @property
    def solve_s(self) -> float:
        """Seconds spent in Ipopt."""
        return sum(level.solve_s for level in self.ladder)

    def raise_for_status(self) -> Self:
        """Itself if the solve succeeded.

        Raises
        ------
        SolveError
            With what failed and what to try.
        """
        if not self.success:
            raise SolveError(f"{self.status}: {self.message}")
        return self

    def at(self, t: Any) -> Any:
        """State, force and mass at any time [s], as `Solution.at` has them.

        Of a mission they are those of the leg in which the time lies. At a joint they are those behind it, at
        the begin of the next leg: after an impulse or a drop, in that leg's frame. Of a team it is a dictionary
        with the moment of each body by its name.
        """
        if hasattr(self, "members"):
            return {name: one.at(t) for name, one in zip(self.names, self.members, strict=True)}  # type: ignore[attr-defined]
        return moment_of_legs(self, t)

    def table(self) -> Any:
        """A pandas DataFrame with a row a node: time, position, velocity, force, mass, each with its unit.

        Of a mission or a team the first column names the leg or the body. The force is that of the node; with
        hold it is that of the step behind it.
        """
        return shown("table")(self)

    def plot(self, path: str | os.PathLike | None = None, dark: bool = False) -> Any:
        """The figure of `dmoc plot`: a matplotlib Figure or, with a path, that file.

        Parameters
        ----------
        path : path, optional
            Ends in .png, .pdf or .svg; written whole or not at all.
        dark : bool
            On a dark background.

        Raises
        ------
        ValueError
            If the suffix is another one or the folder does not exist.
        """
        return shown("plot")(self, path, dark)

    def animate(self, path: str | os.PathLike, frames: int = 80, dark: bool = False) -> None:
        """Write a moving picture, .gif or .mp4, as `dmoc.animate` does."""
        shown("animate")(self, path, frames, dark)

    def facts(self) -> Any:
        """What users ask of an answer: velocity change, propellant, closest approach, clearance, orbits.

        Returns
        -------
        Facts
            By their names, each with value, unit and words: `facts()["velocity change"].value` [m/s]; printed,
            it is a table. Only what applies is there.

        Raises
        ------
        ValueError
            If it was loaded from a file and its problem is not found.
        """
        return shown("facts")(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: the figure, the closing line, facts, checks and the meshes on the way."""
        return shown("html")(self)


def shown(what: str) -> Any:
    """What shows an answer, by its name in `dmoc.notebook.front`.

    Pictures and reports are made from answers and import them, so that answers must not import these: whoever
    has an answer at hand asks for its picture there, and only then is it looked up. This is the one place.
    """
    return getattr(import_module("dmoc.notebook.front"), what)
