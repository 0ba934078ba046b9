"""Why a mission or a team is not met: limits that give way, one by one or together, or its rows.

They are those of legs and impulses, or of bodies and between them. The program of a mission or a team comes
from above; what is asked of it here is what `Relaxation` asks of an NLP.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.digits import up
from dmoc.diagnosis.cause import MOST_NAMED, NAMED_SHARE
from dmoc.diagnosis.elastic import MET, Relaxation, Relaxed
from dmoc.diagnosis.giving import ROOM, Limits
from dmoc.ipopt.run import Answer
from dmoc.ipopt.watch import Interrupt
from dmoc.results.facts import Level

# At most this many limits are relaxed each alone: each takes about as long as a solve.
MOST_ALONE = 8


class Yielding(NamedTuple):
    """A limit that may give way, on the whole mission: rows with signs, unknowns with shares, and its words."""

    told: Callable[[float], str]
    rows: np.ndarray
    signs: np.ndarray
    columns: np.ndarray
    below: np.ndarray
    above: np.ndarray


class Elastic:
    """The program of a mission as `Relaxation` sees an NLP."""

    def __init__(self, program: Any, tell: Callable[[Level], None], interrupt: Interrupt):
        self.program, self.tell, self.interrupt = program, tell, interrupt
        self.assembly = program.assembly()
        columns, rows, _ = program.sizes
        self.columns, self.rows = SimpleNamespace(size=columns), SimpleNamespace(size=rows)

    def bounds(self, mission: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Scaled bounds of unknowns and rows."""
        return self.program.bounds()

    def pack(self, path: Any) -> np.ndarray:
        """Scaled unknowns of a path."""
        return self.program.pack(path)

    def parameters(self, mission: Any) -> np.ndarray:
        """The parameters [SI]."""
        return self.program.parameters()

    def unpack(self, x: np.ndarray, mission: Any) -> Any:
        """The path of scaled unknowns, without multipliers."""
        none = np.zeros(self.rows.size)
        path = self.program.path(Answer(x, np.zeros(len(x)), none, none, 0.0, "", 0, 0, 0.0))
        legs = tuple(replace(leg, multipliers={}) for leg in path.legs)
        return replace(path, legs=legs, forces={})

    def level(self, answer: Answer, build_s: float) -> Level:
        """One run as a level of the ladder."""
        order, steps = self.program.numerics
        told = answer.iterations, answer.objective, build_s, answer.seconds, answer.status
        return Level(order, steps, *told, evaluations=answer.evaluations)

    def relaxed(self, *limits: Yielding) -> Relaxation:
        """The elastic program in which these limits give way by one slack."""
        rows = np.zeros((self.rows.size, 1))
        for limit in limits:
            rows[limit.rows, 0] = limit.signs
        columns, below, above = (
            np.concatenate([getattr(limit, name) for limit in limits]) for name in ("columns", "below", "above")
        )
        nlp: Any = self
        return Relaxation(nlp, rows, columns, below, above, 0.0, self.tell, self.interrupt)


class _Leg(Limits):
    """The limits of one leg, in the places of its own program."""

    def __init__(self, placed: Any, path: Any, bounds: tuple):
        self.nlp, self.guess = placed.program, path
        self.problem = self.given = placed.program.problem
        columns = slice(placed.columns, placed.columns + placed.program.columns.size)
        rows = slice(placed.rows, placed.rows + placed.program.rows.size)
        self.bounds = bounds[0][columns], bounds[1][columns], bounds[2][rows], bounds[3][rows]


def mission_cause(
    program: Any, paths: Sequence, tell: Callable[[Level], None], interrupt: Interrupt
) -> tuple[Any, str]:
    """A path that meets every row, if there is one after all, else None; and in words what is in the way.

    It is looked for from the first of some paths, and from the next ones where that leads nowhere. `tell` takes
    the `Level` of every run; once `interrupt` has seen something, nothing is found any more.
    """
    elastic = Elastic(program, tell, interrupt)
    mission = program.mission
    limits = _of_legs(program, paths[0])
    limits += _of_impulses(program) if hasattr(mission, "joints") else []
    limits += _of_pairs(program) if hasattr(mission, "pairs") else []
    if limits:
        relaxed = elastic.relaxed(*limits)
        for path in paths:
            joint: Relaxed = relaxed(program.mission, path)
            if joint.feasible:
                break
        if joint.feasible and joint.slack[0] <= MET:
            return joint.path, ""
        if joint.feasible:
            needs = []
            for limit in limits[:MOST_ALONE]:
                alone = joint if len(limits) == 1 else elastic.relaxed(limit)(program.mission, joint.path)
                if alone.feasible and (words := limit.told(_roomy(alone.slack[0]))):
                    needs.append(words + ("" if alone.exact else ", which is more than enough"))
            if not needs:
                needs = [" and ".join(filter(None, (limit.told(_roomy(joint.slack[0])) for limit in limits)))]
            return None, f"a path near the guess needs {', or '.join(needs)}"
    near, words = _rows(elastic, paths[0])
    return (near, words) if near is not None or not words else (None, _zones(elastic, paths) or words)


def _zones(elastic: Elastic, paths: Sequence) -> str:
    """The zones of legs that would be enough if they gave way, each alone; empty if none is."""
    program, needs = elastic.program, []
    for limit in _of_legs(program, paths[0], zones=True)[:MOST_ALONE]:
        alone = elastic.relaxed(limit)(program.mission, paths[0])
        if alone.feasible and alone.slack[0] > MET and (words := limit.told(alone.slack[0])):
            needs.append(words)
    return f"a path near the guess needs {', or '.join(needs)}" if needs else ""


def _roomy(slack: float) -> float:
    return (1 + float(slack)) * (1 + ROOM) - 1


def _of_legs(program: Any, path: Any, zones: bool = False) -> list[Yielding]:
    """What gives way in each leg: what more time eases, or its zones."""
    found, bounds = [], program.bounds()
    for name, placed, leg in zip(program.mission.leg_names, program.legs, path.legs, strict=True):
        mine = _Leg(placed, leg, bounds)
        each = [mine.zone(entry, leg) for entry in mine.zones()] if zones else mine.limits()
        for limit in filter(None, each):
            words = _in_leg(limit.told, name)
            rows, columns = placed.rows + limit.rows, placed.columns + limit.columns
            found.append(Yielding(words, rows, limit.signs, columns, limit.below, limit.above))
    return found


def _in_leg(told: Callable[[float], str], name: str) -> Callable[[float], str]:
    def words(slack: float) -> str:
        return f"{said} in {name}" if (said := told(slack)) else ""

    return words


def _of_impulses(program: Any) -> list[Yielding]:
    """The limits of impulses, whose rows are squares of their shares."""
    found, none = [], np.zeros(0)
    for joint in program.mission.joints:
        for i, event in enumerate(joint.events):
            label = f"impulse_{i + 1}.limit"
            if joint.name in program.rows and label in program.rows[joint.name].labels:
                group = program.rows[joint.name]
                place = program.first_row + group.start + group.labels.index(label)
                words = _of_impulse(float(event.limit), joint.name)
                found.append(Yielding(words, np.array([place]), np.array([-1.0]), np.zeros(0, int), none, none))
    return found


def _of_impulse(limit: float, name: str) -> Callable[[float], str]:
    def words(slack: float) -> str:
        return f"an impulse of {up(limit * np.sqrt(1 + slack))} m/s at the {name} (you gave {limit:g} m/s)"

    return words


def _of_pairs(program: Any) -> list[Yielding]:
    """What two bodies of a team keep all along, whose rows are at the nodes that they share."""
    found, none = [], np.zeros(0)
    for name, (part, a, b) in zip(program.mission.pair_names(), program.mission.pairs(), strict=True):
        if part.distance_kept:
            # A team of missions has a group of rows for each phase.
            groups = [
                one for one in program.rows.groups if one.name == name or one.name.startswith(f"{name} in ")
            ]
            places = program.first_row + np.concatenate([np.arange(one.start, one.stop) for one in groups])
            both = f"between {program.mission.names[a]} and {program.mission.names[b]}"
            words = _of_pair(part, both)
            found.append(Yielding(words, places, np.ones(len(places)), np.zeros(0, int), none, none))
    return found


def _of_pair(part: Any, both: str) -> Callable[[float], str]:
    def words(slack: float) -> str:
        return f"{said} {both}" if (said := part.needs(slack)) else ""

    return words


def _rows(elastic: Elastic, path: Any) -> tuple[Any, str]:
    """Every row made elastic: the rows that cannot be met together."""
    size = elastic.rows.size
    every = ca.DM.eye(size)
    slacks = ca.horzcat(every, -every)
    nlp: Any = elastic
    relaxed = Relaxation(nlp, slacks, tell=elastic.tell, interrupt=elastic.interrupt)
    found = relaxed(elastic.program.mission, path)
    if not found.feasible:
        return None, ""
    miss = np.abs(found.slack[:size] - found.slack[size:])
    if miss.max() <= MET:
        return found.path, ""
    worst = [int(i) for i in np.argsort(-miss)[:MOST_NAMED] if miss[i] > NAMED_SHARE * miss.max()]
    told = dict.fromkeys(_missed(elastic.program, place, float(miss[place])) for place in worst)
    return None, f"{_unsteered(elastic.program)}not all that is asked can hold together: {'; '.join(told)}"


def _unsteered(program: Any) -> str:
    """The legs without controls, in words."""
    names = zip(program.mission.leg_names, program.legs, strict=True)
    coasts = [name for name, leg in names if not leg.program.problem.controls]
    return f"{' and '.join(coasts)} cannot be steered, and " if coasts else ""


def _missed(program: Any, place: int, miss: float) -> str:
    """A row that is missed, in words, and by how much [SI]."""
    for name, placed in zip(program.mission.leg_names, program.legs, strict=True):
        at = place - placed.rows
        if 0 <= at < placed.program.rows.size:
            return f"in {name} {_missed_in_leg(placed, at, miss)}"
    at = place - program.first_row
    group = program.rows.group_at(at)
    component = (at - group.start) % len(group.labels)
    size, unit = miss / float(group.scales[0, component]), group.units[component]
    label = group.labels[component].removeprefix(f"{group.name}.").replace("_", " ").replace(".", " ")
    where = {"start": "at the start", "goal": "at the goal", "mission": "of the mission"}
    return f"the {label} {where.get(group.name, f'at {group.name}')} is missed by {size:.3g} {unit}".rstrip()


def _missed_in_leg(placed: Any, at: int, miss: float) -> str:
    layout, problem = placed.program.rows, placed.program.problem
    group = layout.group_at(at)
    if group.owner is not None and group.owner.field == "constraints":
        return f"the body cannot be one that {group.owner.of(problem).words()}"
    if group.name == "dynamics":
        return "the motion that follows from the forces does not lead where it must"
    return f"{layout.name_of(at)} does not hold"
