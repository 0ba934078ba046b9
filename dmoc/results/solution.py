"""Solution: the answer of a solve in SI units, with its meshes and times; saved to and loaded from netCDF."""

from __future__ import annotations

import os
from dataclasses import field, replace
from typing import Any

import numpy as np

from dmoc.basics.arguments import of_kind
from dmoc.basics.records import dataclass
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import force_of
from dmoc.motion.momenta import end_momenta
from dmoc.motion.path import COSTATE, DiscretePath
from dmoc.results.facts import Error, Level, Provenance
from dmoc.results.moments import Moment, moment, named_body
from dmoc.results.outcome import NOT_MET as NOT_MET
from dmoc.results.outcome import OUT_OF_TIME as OUT_OF_TIME
from dmoc.results.outcome import Outcome as Outcome
from dmoc.results.outcome import SolveError as SolveError
from dmoc.scene.problem import TransferProblem
from dmoc.scene.rounding import sharp_as


@dataclass(frozen=True)
class Solution(Outcome):
    """The answer to a transfer problem on the last mesh, whether it succeeded or not.

    Attributes
    ----------
    problem : TransferProblem or None
        None after `load`: a file holds numbers, not the problem; see `attach`.
    path : DiscretePath
        Positions [m], controls, masses [kg], boundary velocities [m/s] and multipliers on the mesh.
    time : array, shape (nodes,)
        Times of the nodes [s].
    force : array, shape (nodes, axes), or (steps, axes) with hold
        Force of the actuator [N].
    velocity, momentum : arrays, shape (steps+1, axes)
        At the step ends, from the discrete Legendre transforms [m/s]; momentum is per unit mass.
    costate : array, shape (nodes, axes)
        Multipliers of the discrete Euler-Lagrange equations [unit of the objective per m/s].
    rate, spin, torque : arrays, shape (steps+1 or nodes, 3), or None
        Of a rigid body, in body axes: angular rate [rad/s] and angular momentum per unit mass [m^2/s] at the
        step ends, and torque of the actuator about the centre of mass [N m] where `force` is given. The
        angular momentum counts that of reaction wheels; what they do is no torque from outside.
    wheel_momentum, wheel_torque : arrays, shape (steps+1 or nodes, wheels), or None
        Angular momenta of reaction wheels about their axes [N m s], and the torques of their motors on them
        [N m].
    attitude : array, shape (nodes, 4), or None
        Of a rigid body: unit quaternion from body to space, scalar first.
    success : bool
        Whether what was asked for was found: a local optimum, to the tolerance if one was given.
    status, message : str
        The outcome of the solve, and what to try if it failed.
    ladder : tuple of Level
        The meshes on the way, coarse to fine.
    worst : tuple of (str, float, str)
        The worst violated rows and bounds of a failed solve, worst first: name, size and unit.
    warnings : tuple of str
        What a user should know of an answer that is right: a duration that ends on its limit, say.
    tolerance, error, reason
        The accuracy that was asked for, the estimated errors, and the reason for this mesh; empty without a
        tolerance.
    provenance : Provenance
    """

    problem: TransferProblem | None
    path: DiscretePath
    velocity: np.ndarray
    momentum: np.ndarray
    force: np.ndarray
    objective: float
    success: bool
    status: str
    message: str
    ladder: tuple[Level, ...]
    worst: tuple[tuple[str, float, str], ...] = ()
    warnings: tuple[str, ...] = ()
    tolerance: float | None = None
    error: Error | None = None
    reason: str = ""
    rate: np.ndarray | None = None
    spin: np.ndarray | None = None
    torque: np.ndarray | None = None
    wheel_momentum: np.ndarray | None = None
    wheel_torque: np.ndarray | None = None
    provenance: Provenance = field(kw_only=True)

    @property
    def order(self) -> int:
        return self.path.order

    @property
    def hold(self) -> bool:
        return self.path.hold

    @property
    def steps(self) -> int:
        return len(self.path.mesh) - 1

    @property
    def dimension(self) -> int:
        """Number of axes, 1 to 3; 0 for an attitude alone."""
        return self.path.coordinates.axes

    def of(self, body: str) -> tuple[np.ndarray, np.ndarray]:
        """Positions at the nodes [m] and velocities at the step ends [m/s] of one body of a system.

        Raises
        ------
        ValueError
            If no body has this name.
        """
        made = self.path.coordinates
        places, speeds = named_body(made, body)
        return self.path.position[:, places & made.places], self.velocity[:, speeds[made.speeds]]

    def at(self, t: Any) -> Moment:
        """State, force and mass at any time, as what is flown between the nodes has them.

        Inside a step positions and velocities are those of the polynomial of degree order/2 + 2 that has the
        positions of its nodes and the velocities at both of its ends, at order 2 a cubic: as exact as the nodes
        are. The force is the control that is flown, which jumps to the value behind a switch; without the
        problem, after `load`, it is the polynomial through the nodes, whatever limits there are.

        Parameters
        ----------
        t : float or array
            Times [s] between the start and the goal.

        Returns
        -------
        Moment
            Its arrays begin with the shape of t.

        Raises
        ------
        ValueError
            If a time lies before the start or behind the goal.
        """
        return moment(self, t)

    @property
    def reaction(self) -> np.ndarray | None:
        """Forces of links at the nodes [N for each m of g], one column an equation; None without links.

        What a link exerts is minus the slope of its g times this: a rod pulls where it is positive.
        """
        path = self.path
        if path.reaction is None or not (held := path.reaction.shape[1] - len(path.attitudes)):
            return None
        return path.reaction[:, -held:] * path.mass[:, None]

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.path.duration

    @property
    def time(self) -> np.ndarray:
        return self.provenance.start_time + self.duration * self.path.fractions

    @property
    def end_times(self) -> np.ndarray:
        """Times of the step ends [s], shape (steps+1,)."""
        return self.provenance.start_time + self.duration * self.path.mesh

    @property
    def position(self) -> np.ndarray:
        """Positions of the nodes [m], shape (nodes, axes)."""
        return self.path.place

    @property
    def attitude(self) -> np.ndarray | None:
        return np.hstack(self.path.attitudes) if self.path.attitudes else None

    @property
    def parts(self) -> tuple[Any, ...]:
        """Itself: what has legs or bodies has several of them."""
        return (self,)

    @property
    def final_mass(self) -> float:
        """Mass at the goal [kg]."""
        return float(self.path.mass[-1])

    @property
    def costate(self) -> np.ndarray:
        return self.path.multipliers[COSTATE]

    def require_problem(self) -> TransferProblem:
        """The problem.

        Raises
        ------
        ValueError
            If the solution was loaded from a file and no problem has been attached since.
        """
        if self.problem is None:
            name = self.provenance.problem_name
            raise ValueError(
                f"this solution was loaded from a file and does not hold its problem {name!r}; "
                "use solution.attach(problem) first"
            )
        return self.problem

    def attach(self, problem: TransferProblem) -> Solution:
        """A copy that holds its problem again, after `load`.

        Raises
        ------
        ValueError
            If the problem has another dimension, number of controls or start time than the solution.
        """
        of_kind("problem", problem, TransferProblem)
        axes = problem.dimension if problem.start.has_position else 0
        facts = (
            ("dimension", self.dimension, axes, ""),
            ("number of attitudes", len(self.path.attitudes), len(problem.inertias), ""),
            ("number of controls", self.path.control.shape[1], problem.controls, ""),
            ("start time", self.provenance.start_time, problem.start_time, " s"),
        )
        for name, here, there, unit in facts:
            if here != there:
                raise ValueError(
                    f"problem {problem.name!r} does not fit this solution of {self.provenance.problem_name!r}: "
                    f"its {name} is {there:g}{unit}, the solution's {here:g}{unit}; "
                    "attach the problem that was solved"
                )
        return replace(self, problem=sharp_as(problem, self.provenance.smoothing))

    def save(self, path: str | os.PathLike, **provenance: Any) -> None:
        """Write the solution to a netCDF-4 file, whole or not at all.

        Parameters
        ----------
        path : path
            Where to; an existing file is replaced.
        provenance
            Facts that only the caller knows, by the names of `Provenance` (`source_hash`, `parameters`,
            `problem_name`, ...).

        Raises
        ------
        ValueError
            If the folder does not exist.
        """
        from dmoc.results.table import write

        write(replace(self, provenance=replace(self.provenance, **provenance)), path)


def reported(path: DiscretePath, velocity: np.ndarray, momentum: np.ndarray, force: np.ndarray) -> dict:
    """The fields of a solution for independent velocities, momenta and what the actuator does, one row each."""
    made, places = path.coordinates, {"velocity": velocity, "momentum": momentum, "force": force}
    found = {name: values[:, made.speeds] for name, values in places.items()}
    if made.turns:
        turns = {"rate": velocity, "spin": momentum, "torque": force}
        found |= {name: values[:, made.rates] for name, values in turns.items()}
    if made.spins.any():
        found |= {"wheel_momentum": velocity[:, made.spins], "wheel_torque": force[:, made.spins]}
    return found


def part_solution(
    problem: TransferProblem, path: DiscretePath, objective: float, status: str, level: Level, words: str
) -> Solution:
    """A part of an answer, as the answer of a transfer; `words` say of what."""
    dynamics = Dynamics.of(problem)
    momentum, velocity = end_momenta(dynamics, path, problem.start_time)
    return Solution(
        problem=problem,
        path=path,
        **reported(path, velocity, momentum, force_of(dynamics, path)),
        objective=objective,
        success=status == "solved",
        status=status,
        message=words,
        ladder=(level,),
        provenance=Provenance.of(problem),
    )


def load(path: str | os.PathLike) -> Solution:
    """The solution in a file that `Solution.save` wrote. Nothing in the file is ever run.

    The problem is not in the file: `load(path).attach(problem)` gives it back. A loaded solution is
    as good a guess as the original: `solve(problem, guess=load(path))`.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged, foreign or from a newer dmoc.
    """
    from dmoc.results.table import read

    return read(path, Solution)
