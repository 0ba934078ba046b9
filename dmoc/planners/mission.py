"""The program of a mission with named unknowns in SI units, for functions that leave the package."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.records import dataclass
from dmoc.chains.path import MissionPath
from dmoc.chains.program import MissionProgram
from dmoc.missions.guess import first_path
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import uniform_mesh
from dmoc.nlp.layout import LEG_MASS, LEG_START, Group
from dmoc.parts.rows import snake
from dmoc.planners.functions import Scene, rows_of
from dmoc.planners.numbers import Numbers, numbers_of_mission
from dmoc.planners.planner import multiplier_names
from dmoc.planners.terms import TERMS, Term
from dmoc.scene.mission import Mission
from dmoc.scene.problem import TransferProblem

# What a leg may not be called in functions: these words stand at the beginning of other arguments.
TAKEN = ("start", "goal", "joint", "mission", "guess", "multipliers", "mass", "duration", "actuator", "largest")


class Part(NamedTuple):
    """Multipliers of a group: names and sizes, and the SI value of a scaled one of 1, one column an index."""

    sizes: dict[str, int]
    unit: np.ndarray


class Stage(NamedTuple):
    """What the unknowns of a leg are called: arguments and shapes by name, unit and meaning by the argument."""

    arguments: dict[str, str]
    shapes: dict[str, tuple[int, int]]
    terms: dict[str, Term]


@dataclass(frozen=True)
class MissionPlanner:
    """The program of a mission, and what its functions need to speak SI units."""

    program: MissionProgram
    path: MissionPath
    scenes: tuple[Scene, ...]
    names: tuple[str, ...]
    # What it is and what its parts are, for people.
    kind: ClassVar[str] = "mission"
    stretch: ClassVar[str] = "leg"
    stretches: ClassVar[str] = "legs"
    # Where its rows are.
    parts: ClassVar[str] = "legs and joints"

    @classmethod
    def of(
        cls, mission: Mission, order: int | None, steps: int | None, hold: bool, guess: Any = None
    ) -> MissionPlanner:
        """The planner of a mission on the meshes of its guess, or on those it is solved on at first."""
        count = len(getattr(getattr(guess, "path", guess), "legs", mission.plan))
        if count != len(mission.plan):
            raise ValueError(
                f"mission {mission.name!r} has {len(mission.plan)} and its guess {count} legs; export the "
                "mission that the guess solves, which is solution.problem where legs were made by a solve"
            )
        path = first_path(mission, order, steps, hold, guess)
        program = MissionProgram.of(mission, mission.stretches, path)
        return cls(program, path, scenes_of(mission.stretches, path), identifiers(mission.leg_names))

    @property
    def mission(self) -> Mission:
        return self.program.mission

    @cached_property
    def numbers(self) -> Numbers:
        return Numbers(self.mission, numbers_of_mission(self.mission, self.names), self._taken)

    def _taken(self, twin: Mission) -> list[np.ndarray]:
        """Bounds and parameters of a mission that differs in numbers, unchecked."""
        legs = [
            replace(placed, program=replace(placed.program, problem=stretch_with(twin, i)))
            for i, placed in enumerate(self.program.legs)
        ]
        program = replace(self.program, mission=twin, legs=tuple(legs))
        return [*program.bounds(), program.parameters()]

    @cached_property
    def legs(self) -> list[Stage]:
        """What the unknowns of each leg are called."""
        found = []
        for name, words, scene in zip(self.names, self.mission.leg_names, self.scenes, strict=True):
            plan = [*scene.names("places"), *scene.names("speed", "start_"), *scene.names("speed", "goal_")]
            plan += ["forces"] * bool(scene.controls) + ["reactions"] * scene.held
            plan += self._unknowns(scene)
            called = {one: f"{name}_{self._called(one)}" for one in plan}
            terms = {called[one]: scene.terms.get(one) or TERMS[one] for one in plan}
            terms = {one: Term(term.unit, f"{words}: {term.words}") for one, term in terms.items()}
            found.append(Stage(called, {one: scene.shape(one) for one in plan}, terms))
        return found

    def _unknowns(self, scene: Scene) -> list[str]:
        """What a leg has beside places, velocities and forces."""
        return ["masses" if scene.burns else "mass", "start_time", *["duration"] * scene.problem.free_duration]

    def _called(self, unknown: str) -> str:
        """What an unknown of a leg is called behind the name of that."""
        return unknown

    @cached_property
    def joints(self) -> dict[str, tuple[int, Term]]:
        """Unknowns of joints in the order of the program: how many, unit and meaning of each."""
        found = {}
        for joint in self.mission.joints:
            for group in self.program.own[joint.name][0].groups:
                axes = ", ".join(group.labels)
                if not group.name.startswith("event"):
                    found[f"velocity_before_{identifier(joint.name)}"] = (
                        len(group.labels),
                        Term("m/s", f"velocity before what happens at the {joint.name}: {axes}"),
                    )
                    continue
                i = int(group.name.split()[1])
                event = joint.events[i]
                unit = event.unknowns(len(group.labels))[0][1]
                name = f"{identifier(joint.name)}_{snake(type(event).__name__)}_{i + 1}"
                words = "velocity change" if event.pushes else "velocity behind it"
                found[name] = len(group.labels), Term(unit, f"{words} of {event.words()}, {joint.name}: {axes}")
        return found

    @property
    def terms(self) -> dict[str, Term]:
        """Unit and meaning of all unknowns."""
        legs = {name: term for leg in self.legs for name, term in leg.terms.items()}
        return legs | {name: term for name, (_, term) in self.joints.items()}

    def symbols(self) -> dict[str, ca.MX]:
        """Symbols for all unknowns [SI]."""
        shapes = {leg.arguments[name]: shape for leg in self.legs for name, shape in leg.shapes.items()}
        shapes |= {name: (size, 1) for name, (size, _) in self.joints.items()}
        return {name: ca.MX.sym(name, *shape) for name, shape in shapes.items()}

    def pack(self, plan: Mapping[str, Any]) -> ca.MX:
        """Scaled unknowns."""
        parts = []
        for leg, scene, placed in zip(self.legs, self.scenes, self.program.legs, strict=True):
            mine = {name: plan[argument] for name, argument in leg.arguments.items()}
            values = {
                "position": scene.joined(mine, "places") - ca.DM(placed.program.units.origin),
                "force": mine.get("forces", ca.MX(0, 1)),
                "mass": mine.get("masses"),
                LEG_MASS: mine.get("mass"),
                LEG_START: mine.get("start_time"),
                "reaction": mine.get("reactions"),
                "start.velocity": scene.joined(mine, "speed", "start_"),
                "goal.velocity": scene.joined(mine, "speed", "goal_"),
                "duration": mine.get("duration"),
            }
            parts.append(placed.program.scaled(values, ca.vec, lambda one: ca.vertcat(*one)))
        own = np.concatenate([np.zeros(0), *[layout.scales() for layout, _ in self.program.own.values()]])
        return ca.vertcat(*parts, ca.vertcat(*[plan[name] for name in self.joints]) / ca.DM(own))

    def unpack(self, x: ca.MX) -> dict[str, ca.MX]:
        """The unknowns in SI units, by name."""
        values, found = x * ca.DM(self.program.column_scales()), dict[str, ca.MX]()
        for leg, scene, placed in zip(self.legs, self.scenes, self.program.legs, strict=True):
            program = placed.program
            get = {group.name: _matrix(values, group, placed.columns) for group in program.columns.groups}
            mine = scene.parted(get["position"] + ca.DM(program.units.origin), "places")
            for end in ("start", "goal"):
                mine |= scene.parted(get[f"{end}.velocity"], "speed", f"{end}_")
            mine |= {"forces": get["force"], "start_time": get.get(LEG_START)}
            mine |= {"masses": get.get("mass"), "mass": get.get(LEG_MASS)}
            mine |= {"reactions": get.get("reaction"), "duration": get.get("duration")}
            found |= {argument: mine[name] for name, argument in leg.arguments.items()}
        first = self.program.legs[-1].columns + self.program.legs[-1].program.columns.size
        return found | rows_of(values[first:], {name: size for name, (size, _) in self.joints.items()})

    @cached_property
    def multipliers(self) -> tuple[list[Part], list[Part]]:
        """The multipliers of unknowns, without those of joints, and of rows, group by group."""
        sides: dict[str, list[Part]] = {"column": [], "row": []}
        for name, scene, placed in zip(self.names, self.scenes, self.program.legs, strict=True):
            known = [density for density in placed.program.densities if density[2].size]
            for key, _, unit in known:
                parts = multiplier_names(scene, key, [key for key, _, _ in known], unit.shape[1])
                sides[key.side].append(
                    Part(
                        {
                            f"multipliers_{name}{part.removeprefix('multipliers')}": n
                            for part, n in parts.items()
                        },
                        unit.T,
                    )
                )
        for group in self.program.rows.groups:
            name = f"multipliers_{identifier(group.name)}"
            sides["row"].append(Part({name: len(group.labels)}, group.scales.T * self.program.cost))
        return sides["column"], sides["row"]


def identifiers(names: Sequence[str], kind: str = "leg") -> tuple[str, ...]:
    """Names of legs as names of arguments; where one cannot be one, or is there twice, leg_1 and so on."""
    made = [identifier(name) for name in names]
    return tuple(
        name
        if name[:1].isalpha() and made.count(name) == 1 and name.split("_")[0] not in TAKEN
        else f"{kind}_{i + 1}"
        for i, name in enumerate(made)
    )


def identifier(name: str) -> str:
    """A name in small letters, digits and single underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def uneven(mesh: np.ndarray) -> tuple[float, ...]:
    """The mesh, unless its steps are equal."""
    return () if np.allclose(mesh, uniform_mesh(len(mesh) - 1), rtol=0, atol=1e-14) else tuple(map(float, mesh))


def _matrix(values: ca.MX, group: Group, first: int) -> ca.MX:
    """A group of unknowns of a leg, one column an index."""
    return ca.reshape(values[first + group.start : first + group.stop], len(group.labels), group.count)


def scenes_of(problems: Sequence[TransferProblem], path: Any) -> tuple[Scene, ...]:
    """What each leg of a path is, on its mesh."""
    return tuple(
        Scene(problem, scheme(leg.order), len(leg.mesh) - 1, leg.hold, uneven(leg.mesh))
        for problem, leg in zip(problems, path.legs, strict=True)
    )


def stretch_with(twin: Mission, index: int) -> TransferProblem:
    """A leg of a mission that differs in numbers, unchecked."""
    leg, stretch = twin.plan[index], copy.copy(twin.stretches[index])
    values = {
        "mass": twin.mass,
        "start_time": twin.start_bounds[0],
        "duration": twin.duration_of(leg),
        "actuator": twin.actuator if leg.actuator is None else leg.actuator,
        "constraints": twin.constraints if leg.constraints is None else leg.constraints,
        "effects": twin.effects if leg.effects is None else leg.effects,
    }
    for field, value in values.items():
        object.__setattr__(stretch, field, value)
    return stretch
