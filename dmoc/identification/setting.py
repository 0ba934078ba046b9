"""A flight and a scene on one mesh: the unknowns of the least-squares problem, and a path to begin with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from dmoc.assembly.blocks import Block
from dmoc.basics.quaternions import normalised, times
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import ATTITUDE, PLACE
from dmoc.configurations.of_problem import configuration_of
from dmoc.flights.flight import Flight
from dmoc.flights.flown import with_throttle
from dmoc.identification.wanted import Wanted
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import Scheme, scheme
from dmoc.motion.march import node_masses
from dmoc.motion.mesh import node_fractions
from dmoc.motion.path import DiscretePath
from dmoc.nlp.layout import Layout
from dmoc.nlp.stencils import Writer
from dmoc.nlp.transcription import unassembled
from dmoc.nlp.units import Units, units_of
from dmoc.scene.problem import TransferProblem


@dataclass(frozen=True)
class Setting:
    """The unknowns of a path on the samples of a flight, scaled as in a solve, and behind them the numbers.

    Attributes
    ----------
    blocks : tuple of Block
        The discrete equations, whose parameters are the scene's numbers.
    row_bounds : tuple of arrays
    wanted : tuple of Wanted
    inverted : tuple of (int, int)
        The numbers of which the unknown is the inverse, and which parameter of the scene each is.
    """

    flight: Flight
    problem: TransferProblem
    order: int
    path: DiscretePath
    units: Units
    columns: Layout
    rows: Layout
    row_bounds: tuple[np.ndarray, np.ndarray]
    blocks: tuple[Block, ...]
    wanted: tuple[Wanted, ...]
    parameters: np.ndarray
    slopes: np.ndarray
    inverted: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, flight: Flight, problem: TransferProblem, order: int, wanted: Sequence[Wanted]) -> Setting:
        path = first_path(flight, problem, order)
        units = units_of(problem, path)
        nlp, blocks = unassembled(problem, path, units)
        base = nlp.parameters(problem)
        slopes, inverted = np.zeros((len(base), len(wanted))), []
        for j, one in enumerate(wanted):
            if one.inverse:
                # The mass comes behind the origin and the time at the start.
                other = base if one.changed is None else nlp.parameters(one.changed(problem, 2 * one.value))
                at = problem.size + 1 if one.changed is None else int(np.flatnonzero(other != base)[0])
                inverted.append((j, at))
                continue
            if one.changed is not None:
                # The parameters are affine in a number; a power of two as its change loses no digit.
                step = 2.0 ** np.ceil(np.log2(one.scale))
                slopes[:, j] = (nlp.parameters(one.changed(problem, one.value + step)) - base) / step
        sizes = nlp.columns, nlp.rows, nlp.row_bounds
        return cls(
            flight,
            problem,
            order,
            path,
            units,
            *sizes,
            tuple(blocks),
            tuple(wanted),
            base,
            slopes,
            tuple(inverted),
        )

    @property
    def rule(self) -> Scheme:
        return scheme(self.order)

    @property
    def steps(self) -> int:
        return len(self.path.mesh) - 1

    @property
    def degree(self) -> int:
        return self.rule.degree

    @property
    def size(self) -> int:
        """Number of unknowns of the path."""
        return self.columns.size

    @cached_property
    def scales(self) -> np.ndarray:
        """SI value of a scaled unknown of 1; the numbers behind those of the path."""
        return np.concatenate([self.columns.scales(), [one.scale for one in self.wanted]])

    @cached_property
    def row_scales(self) -> np.ndarray:
        return self.rows.scales()

    @cached_property
    def held(self) -> np.ndarray:
        """The rows that are equations of motion; those of an actuator hold of commands by themselves."""
        low, high = self.row_bounds
        found = low == high
        for group in self.rows.groups:
            if group.owner is not None and group.owner.field == "actuator":
                found[group.start : group.stop] = False
        return found

    @property
    def numbers(self) -> np.ndarray:
        """Where the numbers stand among the unknowns."""
        return self.size + np.arange(len(self.wanted))

    @cached_property
    def writer(self) -> Writer:
        """The scene with symbols for its numbers."""
        return Writer(self.problem, self.rule, True, False, False)

    def begin(self) -> np.ndarray:
        """All unknowns to begin with, in SI units."""
        path = self.path
        values = {
            "position": path.position - self.units.origin,
            "force": path.control,
            "mass": path.mass,
            "start.velocity": path.start_velocity,
            "goal.velocity": path.goal_velocity,
        }
        parts = [
            np.ravel(values[group.name]) if group.name in values else np.zeros(group.stop - group.start)
            for group in self.columns.groups
        ]
        return np.concatenate([*parts, [one.begin for one in self.wanted]])


def first_path(flight: Flight, problem: TransferProblem, order: int) -> DiscretePath:
    """A smooth path through the samples, on steps from sample to sample, under the commanded forces."""
    configuration = configuration_of(problem)
    made, mesh = configuration.coordinates, (flight.times - flight.times[0]) / flight.duration
    nodes = flight.times[0] + flight.duration * node_fractions(mesh, scheme(order))
    position, speeds = [], []
    for block in made.blocks:
        given = flight.positions if block.kind == PLACE else flight.attitudes
        places, slopes = _smooth(flight.times, given, nodes)
        if block.kind == ATTITUDE:
            places = normalised(places)
            conjugates = places * np.array([1.0, -1.0, -1.0, -1.0])
            slopes = np.array([2 * times(conjugates[i], slopes[i])[1:] for i in (0, -1)])
        position.append(places)
        speeds.append(slopes[[0, -1]])
    place, ends = np.hstack(position), np.hstack(speeds)
    count = problem.controls
    forces = np.zeros((len(mesh) - 1, count)) if flight.forces is None else flight.forces[:-1]
    forces = with_throttle(forces, problem)
    mass = np.full(len(place), float(problem.mass))
    several = made if len(made.blocks) > 1 or configuration.surplus else None
    path = DiscretePath(
        mesh, order, True, flight.duration, place, forces, mass, ends[0], ends[1], made_of=several
    )
    masses = node_masses(Dynamics.of(problem), path, float(problem.mass))
    if (least := float(masses.min())) <= 0:
        raise ValueError(
            f"a mass of {problem.mass:g} kg burns away: the commands burn {problem.mass - least:.3g} kg at an "
            f"exhaust velocity of {problem.actuator.exhaust_velocity:g} m/s; begin with more of either"
        )
    return replace(path, mass=masses)


def _smooth(times: np.ndarray, given: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes at other times of a curve through the samples that are there."""
    there = np.isfinite(given).all(axis=1)
    curve = CubicSpline(times[there], given[there])
    # Beyond the first and the last sample there is nothing to hold a cubic.
    inside = np.clip(nodes, times[there][0], times[there][-1])
    slopes = curve(inside, 1)
    return curve(inside) + slopes * (nodes - inside)[:, None], slopes
