"""What a film of a solution shows at the time of each frame."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import normalised, rotated
from dmoc.configurations.coordinates import Coordinates
from dmoc.configurations.of_problem import configuration_of
from dmoc.links.along import states_of
from dmoc.plots.style import flown_control, within_steps
from dmoc.results.solution import Solution

# The axes of a body are this long, as a part of what is to be seen [-]; at the goal that is seen beside them.
TRIAD = 0.1
# The largest push is drawn as long as this part of it [-].
PUSH_LENGTH = 0.15


@dataclass(frozen=True)
class Scene:
    """Lines at the times of the frames [s], all in metres, shape (frames, points, axes) each.

    `places` are the paths of the bodies by their `names`, shape (frames, axes); `links`, `triads` and `pushes`
    move; a link that stands still has one frame. `push_words` say what pushes are.
    """

    times: np.ndarray
    axes: int
    names: list[str]
    places: list[np.ndarray]
    links: list[np.ndarray]
    triads: list[np.ndarray]
    pushes: list[np.ndarray]
    push_words: str

    @property
    def everything(self) -> np.ndarray:
        """All points that are shown at some time, shape (count, axes)."""
        moving = [*self.links, *self.triads, *self.pushes]
        return np.concatenate([*self.places, *(line.reshape(-1, self.axes) for line in moving)])


def scene_of(solution: Solution, frames: int) -> Scene:
    """The lines of a film of so many frames at even times."""
    made, (known, fine) = solution.path.coordinates, within_steps(solution, solution.path.position)
    times = np.linspace(known[0], known[-1], frames)
    q = np.stack([np.interp(times, known, column) for column in fine.T], axis=1)
    for at in made.quaternions:
        q[:, at] = normalised(q[:, at])
    names = list(dict.fromkeys(block.body for block in made.blocks))
    axes = 3 if made.turns else max(2, made.axes)
    places = {name: _place_of(made, q, name, axes) for name in names}
    links = _links(solution, made, q)
    extent = float(
        np.ptp(np.concatenate([*places.values(), *(x.reshape(-1, axes) for x in links)]), axis=0).max()
    )
    extent = extent or 1.0
    triads = []
    for name in [block.body for block in made.blocks if block.kind == "attitude"]:
        attitude = q[:, made.quaternion_of(name)]
        for axis in np.eye(3):
            arm = (
                TRIAD
                * extent
                * (1 if made.axes else 10)
                * rotated(attitude, np.broadcast_to(axis, (frames, 3)))
            )
            triads.append(np.stack([places[name], places[name] + arm], axis=1))
    pushes, words = _pushes(solution, q, times, places, PUSH_LENGTH * extent)
    return Scene(times, axes, names, list(places.values()), links, triads, pushes, words)


def _place_of(made: Coordinates, q: np.ndarray, name: str, axes: int) -> np.ndarray:
    """Where a body is, with as many axes as are shown; of an attitude alone the origin."""
    place = q[:, made.of_body(name)[0] & made.places]
    return np.pad(place, ((0, 0), (0, axes - place.shape[1])))


def _links(solution: Solution, made: Coordinates, q: np.ndarray) -> list[np.ndarray]:
    links = solution.problem.links if solution.problem else ()
    at = states_of(made, q) if links else {}
    return [line for link in links for line in link.lines(at)]


def _pushes(
    solution: Solution, q: np.ndarray, times: np.ndarray, places: dict[str, np.ndarray], length: float
) -> tuple[list[np.ndarray], str]:
    """Lines of the plumes of thrusters or, where there are none, of the force on each body; and their words."""
    problem = solution.problem
    if problem is None:
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
    largest = max(float(np.linalg.norm(force, axis=1).max()) for force in on_bodies.values())
    for name, force in on_bodies.items():
        if np.abs(force).max() > 1e-9 * largest and largest:
            found.append(np.stack([places[name], places[name] + length / largest * force], axis=1))
    return found, "force"
