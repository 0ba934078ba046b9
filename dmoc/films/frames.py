"""What a film of a solution shows at the time of each frame."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import normalised, rotated
from dmoc.basics.records import dataclass
from dmoc.configurations.coordinates import Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.links.along import states_of
from dmoc.plots.lanes import looks_of
from dmoc.plots.mission import MUCH_LOST, NOTHING, SHORTEST
from dmoc.plots.style import CHANNEL_COLOURS, flown_control, within_steps
from dmoc.plots.team import styles
from dmoc.results.solution import Solution

# The axes of a body are this long, as a part of what is to be seen [-]; at the goal that is seen beside them.
TRIAD = 0.1
# The largest push is drawn as long as this part of it [-].
PUSH_LENGTH = 0.15


class _Scale(NamedTuple):
    """The extent of a path [m], the largest force [N] if known, and whether it is one per mass [m/s^2]."""

    extent: float
    largest: float = 0.0
    light: bool = False


class Trail(NamedTuple):
    """A path close enough to draw: which of the places moves on it, times [s], points [m], colour and name."""

    body: int
    times: np.ndarray
    points: np.ndarray
    colour: str
    name: str = ""


@dataclass(frozen=True)
class Scene:
    """Lines at the times of the frames [s], all in metres, shape (frames, points, axes) each.

    `places` are the paths of the bodies by their `names`, shape (frames, axes); `links`, `triads` and `pushes`
    move; a link that stands still has one frame. `push_words` say what pushes are.

    `trails` are the paths behind the bodies, those of a mission leg by leg. Of a mission `joints` are places
    where legs meet, shape (count, axes), and `kicks` arrows of impulses with their times.
    """

    times: np.ndarray
    axes: int
    names: list[str]
    places: list[np.ndarray]
    links: list[np.ndarray]
    triads: list[np.ndarray]
    pushes: list[np.ndarray]
    push_words: str
    trails: list[Trail]
    joints: np.ndarray
    kicks: list[tuple[float, np.ndarray]]

    def colour(self, body: int) -> str:
        """The colour of a body that moves on one trail; where it changes from leg to leg, that of any body."""
        own = {trail.colour for trail in self.trails if trail.body == body}
        return own.pop() if len(own) == 1 else CHANNEL_COLOURS[body % len(CHANNEL_COLOURS)]

    @property
    def everything(self) -> np.ndarray:
        """All points that are shown at some time, shape (count, axes)."""
        moving = [*self.links, *self.triads, *self.pushes, *(arrow for _, arrow in self.kicks)]
        lines = [*(line.reshape(-1, self.axes) for line in moving), *(trail.points for trail in self.trails)]
        return np.concatenate([*self.places, *lines])


def scene_of(solution: Any, frames: int) -> Scene:
    """The lines of a film of so many frames at even times, of a Solution, MissionSolution or TeamSolution."""
    times = np.linspace(solution.time[0], solution.time[-1], frames)
    if hasattr(solution, "members"):
        return _team(solution, times)
    return _mission(solution, times) if hasattr(solution, "legs") else _scene(solution, times)


def _team(solution: Any, times: np.ndarray) -> Scene:
    """The lines of all bodies, each with its name and in its colour."""
    extent = float(np.ptp(solution.position, axis=0).max()) or 1.0
    largest = max(float(np.linalg.norm(one.force, axis=1).max(initial=0.0)) for one in solution.parts)
    scale = _Scale(extent, largest)
    parts = [
        _mission(one, times, scale) if hasattr(one, "legs") else _scene(one, times, scale)
        for one in solution.members
    ]
    trails = [
        Trail(i, known.times, known.points, style["color"])
        for i, (part, style) in enumerate(zip(parts, styles(solution.names), strict=True))
        for known in part.trails
    ]
    return Scene(
        times,
        parts[0].axes,
        list(solution.names),
        [place for part in parts for place in part.places],
        [link for part in parts for link in part.links],
        [arm for part in parts for arm in part.triads],
        [push for part in parts for push in part.pushes],
        next((part.push_words for part in parts if part.pushes), ""),
        trails,
        np.concatenate([part.joints for part in parts]),
        [kick for part in parts for kick in part.kicks],
    )


def _mission(solution: Any, times: np.ndarray, scale: _Scale | None = None) -> Scene:
    """The lines of all legs, one after the other, with joints and impulses."""
    begins = [leg.provenance.start_time for leg in solution.legs]
    which = np.searchsorted(begins[1:], times, side="right")
    extent = float(np.ptp(solution.position, axis=0).max()) or 1.0
    masses = solution.path.mass
    light = masses.min() < MUCH_LOST * masses.max()
    pushed = []
    for leg in solution.legs:
        held = np.interp(np.linspace(0, 1, len(leg.force)), leg.path.fractions, leg.path.mass)
        pushed.append(np.linalg.norm(leg.force, axis=1) / (held if light else 1.0))
    seen = [i for i in range(len(begins)) if (which == i).any()]
    scale = scale or _Scale(extent, max(float(size.max(initial=0.0)) for size in pushed), light)
    parts = [_scene(solution.legs[i], times[which == i], scale) for i in seen]
    axes, count = parts[0].axes, max(len(part.pushes) for part in parts)

    def joined(lines: list[list[np.ndarray]]) -> list[np.ndarray]:
        return [np.concatenate(line) for line in zip(*lines, strict=True)]

    pushes = []
    for part in parts:
        nothing = np.stack([part.places[0]] * 2, axis=1)
        pushes.append([*part.pushes, *[nothing] * (count - len(part.pushes))])
    trails = []
    for leg, look in zip(solution.legs, looks_of(solution.legs), strict=True):
        late, points = within_steps(leg, leg.position)
        points = np.pad(points, ((0, 0), (0, axes - points.shape[1])))
        trails.append(Trail(0, late, points, look.style["color"], look.label))
    return Scene(
        times,
        axes,
        parts[0].names,
        joined([part.places for part in parts]),
        [],
        joined([part.triads for part in parts]),
        joined(pushes),
        next((part.push_words for part in parts if part.pushes), ""),
        trails,
        np.array([trail.points[0] for trail in trails[1:]]).reshape(-1, axes),
        _kicks(solution, axes, extent),
    )


def _kicks(solution: Any, axes: int, extent: float) -> list[tuple[float, np.ndarray]]:
    """Arrows of the impulses that are some, each with its time."""
    longest = max((kick.size for kick in solution.impulses), default=0.0)
    found = []
    for kick in solution.impulses:
        if kick.size > NOTHING * longest:
            place, way = (np.pad(x, (0, axes - len(x))) for x in (kick.position, kick.change / kick.size))
            length = PUSH_LENGTH * extent * max(kick.size / longest, SHORTEST)
            found.append((kick.time, _arrow(place, length * way)))
    return found


def _arrow(tail: np.ndarray, arrow: np.ndarray) -> np.ndarray:
    """The line of an arrow with its head, shape (5, axes)."""
    across = np.zeros_like(arrow)
    across[:2] = (-arrow[1], arrow[0]) if arrow[:2].any() else (np.linalg.norm(arrow), 0.0)
    tip = tail + arrow
    return np.array(
        [tail, tip, *(part for side in (1, -1) for part in (tip - 0.3 * arrow + 0.18 * side * across, tip))]
    )


def _scene(solution: Solution, times: np.ndarray, scale: _Scale | None = None) -> Scene:
    """The lines at some times; of a leg of a mission with the scale of all."""
    frames = len(times)
    made, (known, fine) = solution.path.coordinates, within_steps(solution, solution.path.position)
    q = np.stack([np.interp(times, known, column) for column in fine.T], axis=1)
    for at in made.quaternions:
        q[:, at] = normalised(q[:, at])
    names = list(dict.fromkeys(block.body for block in made.blocks))
    axes = 3 if made.turns else max(2, made.axes)
    places = {name: _place_of(made, q, name, axes) for name in names}
    links = _links(solution, made, q)
    shown = np.concatenate([*places.values(), *(x.reshape(-1, axes) for x in links)])
    scale = scale or _Scale(float(np.ptp(shown, axis=0).max()) or 1.0)
    triads = []
    for name in [block.body for block in made.blocks if block.kind == "attitude"]:
        attitude = q[:, made.quaternion_of(name)]
        for axis in np.eye(3):
            arm = (
                TRIAD
                * scale.extent
                * (1 if made.axes else 10)
                * rotated(attitude, np.broadcast_to(axis, (frames, 3)))
            )
            triads.append(np.stack([places[name], places[name] + arm], axis=1))
    pushes, words = _pushes(solution, q, times, places, scale)
    trails = [
        Trail(i, known, _place_of(made, fine, name, axes), CHANNEL_COLOURS[i % len(CHANNEL_COLOURS)])
        for i, name in enumerate(names)
    ]
    drawn = names, list(places.values()), links, triads, pushes, words
    return Scene(times, axes, *drawn, trails, np.empty((0, axes)), [])


def _place_of(made: Coordinates, q: np.ndarray, name: str, axes: int) -> np.ndarray:
    """Where a body is, with as many axes as are shown; of an attitude alone the origin."""
    place = q[:, made.of_body(name)[0] & made.places]
    return np.pad(place, ((0, 0), (0, axes - place.shape[1])))


def _links(solution: Solution, made: Coordinates, q: np.ndarray) -> list[np.ndarray]:
    links = solution.problem.links if solution.problem else ()
    at = states_of(made, q) if links else {}
    return [line for link in links for line in link.lines(at)]


def _pushes(
    solution: Solution,
    q: np.ndarray,
    times: np.ndarray,
    places: dict[str, np.ndarray],
    scale: _Scale,
) -> tuple[list[np.ndarray], str]:
    """Lines of the plumes of thrusters or, where there are none, of the force on each body; and their words."""
    problem, length = solution.problem, PUSH_LENGTH * scale.extent
    if problem is None or not problem.controls:
        return [], ""
    known, control = flown_control(solution)
    u = np.stack([np.interp(times, known, column) for column in control.T], axis=1)
    made, found = solution.path.coordinates, []
    jets = problem.actuator.jets()
    most = float(np.abs(control).max(initial=0.0)) or 1.0
    for jet in jets:
        attitude = q[:, made.quaternion_of(jet.body)]
        nozzle, way = (rotated(attitude, np.broadcast_to(x, (len(q), 3))) for x in (jet.place, jet.direction))
        start = places[jet.body] + nozzle
        # A plume leaves against the force that it makes.
        found.append(np.stack([start, start - length * u[:, jet.control, None] / most * way], axis=1))
    if jets:
        return found, "thrusters"
    body = configuration_of(problem)
    at, by = ca.SX.sym("q", body.size), ca.SX.sym("u", problem.controls)
    acts = ca.densify(ca.SX(problem.actuator.acts(body, at, by)))
    forces = np.array(ca.Function("acts", [at, by], [acts]).map(len(q))(q.T, u.T)).T
    on_bodies = {name: _place_of(made, forces, name, place.shape[1]) for name, place in places.items()}
    if scale.light:
        mass = np.interp(times, solution.time, solution.path.mass)[:, None]
        on_bodies = {name: force / mass for name, force in on_bodies.items()}
    largest = scale.largest or max(float(np.linalg.norm(force, axis=1).max()) for force in on_bodies.values())
    for name, force in on_bodies.items():
        if np.abs(force).max() > 1e-9 * largest and largest:
            found.append(np.stack([places[name], places[name] + length / largest * force], axis=1))
    return found, "force per mass" if scale.light else "force"
