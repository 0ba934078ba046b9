"""What is known of a solution beside its numbers: the ladder, the errors, where it comes from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Level:
    """One rung of the ladder from coarse to fine."""

    order: int
    steps: int
    iterations: int
    objective: float
    build_s: float
    solve_s: float
    status: str
    error: float | None = None
    evaluations: int = 0


@dataclass(frozen=True)
class Error:
    """Estimated relative errors of a solution [-].

    `path` and `objective` by Richardson's extrapolation from the mesh with every other step end;
    `goal` measured: how far the independent integrator misses the goal with the same controls.
    """

    path: float
    objective: float
    goal: float

    @property
    def largest(self) -> float:
        return max(self.path, self.objective, self.goal)


@dataclass(frozen=True)
class Provenance:
    """Where a solution comes from: what is to be known of it even where its problem is not at hand.

    Attributes
    ----------
    problem_name : str
    parameters : dict
        What the problem was made with.
    start_time : float
        Time at the start [s].
    objective_unit : str
    control_labels, control_units : tuple of str
        One entry a control.
    options : dict
        Options given to the solver.
    source_hash : str
        Hash of the problem's file, given by who saves it.
    versions : dict
        Of dmoc, casadi, numpy and python when it was saved; empty before.
    created : str
        When it was saved, in UTC; empty before.
    """

    problem_name: str = "problem"
    parameters: dict[str, Any] = field(default_factory=dict)
    start_time: float = 0.0
    objective_unit: str = ""
    control_labels: tuple[str, ...] = ()
    control_units: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    source_hash: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    created: str = ""

    @classmethod
    def of(cls, problem: TransferProblem, options: dict[str, Any] | None = None) -> Provenance:
        """What there is to be known of a problem and of the options of its solver."""
        return cls(
            problem.name,
            problem.parameters,
            problem.start_time,
            problem.objective.unit_with(problem.actuator),
            tuple(problem.actuator.labels(problem.dimension)),
            tuple(problem.actuator.units(problem.dimension)),
            options or {},
        )
