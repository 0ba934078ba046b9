"""Facts about a solution besides its path: the ladder, the errors, its provenance."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from dmoc.basics.records import dataclass
from dmoc.scene.clock import dates_of
from dmoc.scene.problem import TransferProblem

# The first-order conditions of an answer may be off by this part of the objective or the force [-].
OPTIMALITY = 1e-5
# Where an accuracy was asked for they may be off by this part of it [-]: least fuel with time to spare has many
# paths that cost the same to less, and the best of them on one mesh is not that on the next.
OF_TOLERANCE = 0.1
# They are never off by more than this [-].
MOST_OFF = 1e-4

# An answer that was held near its guess is an optimum if it is off one by less than this part of that [-].
OFF_OPTIMUM = 0.5


def optimality_limit(tolerance: float | None) -> float:
    """By how much the first-order conditions may be off, of the objective or the force [-]."""
    return max(OPTIMALITY, min(OF_TOLERANCE * (tolerance or 0.0), MOST_OFF))


def off_optimum(tolerance: float | None = None) -> float:
    """By how much an answer to a tolerance, or to none, may be pulled off its optimum [-]."""
    return OFF_OPTIMUM * optimality_limit(tolerance)


@dataclass(frozen=True)
class Level:
    """One rung of the ladder from coarse to fine.

    `question` says what was asked there if it was not the problem itself, such as "least effort in 12 s"; its
    objective is then that of the question.
    """

    order: int
    steps: int
    iterations: int
    objective: float
    build_s: float
    solve_s: float
    status: str
    error: float | None = None
    evaluations: int = 0
    question: str = ""


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
    """Where a solution comes from: the facts that a file of it holds in place of its problem.

    Attributes
    ----------
    problem_name : str
    parameters : dict
        Values of the parameters from which the problem was made.
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
    epoch, frame, center : str
        Date of t = 0 (TDB, ISO text), axes (ECLIPJ2000 or ICRF) and the body at the origin; empty where
        nothing in the scene knows them.
    smoothing : float or None
        Over which part of the largest thrust |F| was rounded [-], which may be less than was asked for; None
        where it is not.
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
    epoch: str = ""
    frame: str = ""
    center: str = ""
    smoothing: float | None = None

    @classmethod
    def of(cls, problem: TransferProblem, options: dict[str, Any] | None = None) -> Provenance:
        """The provenance of a solution of this problem with these options of the solver."""
        return cls(
            problem.name,
            problem.parameters,
            problem.start_time,
            problem.objective.unit_with(problem.actuator),
            tuple(problem.actuator.labels(problem.dimension)),
            tuple(problem.actuator.units(problem.dimension)),
            options or {},
            **dates_of(problem),
            smoothing=problem.actuator.smoothing,
        )
