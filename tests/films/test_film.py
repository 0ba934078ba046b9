"""Moving pictures, read back: frames, size, and that what moves is where it should be."""

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from matplotlib import animation
from matplotlib.colors import to_rgb
from PIL import Image

from dmoc import (
    JointState,
    JointTorque,
    Member,
    On,
    Pose,
    Revolute,
    System,
    Thrusters,
    TransferProblem,
    animate,
    load,
    solve,
)
from dmoc.basics.quaternions import rotated
from dmoc.films.frames import scene_of
from dmoc.plots.style import CHANNEL_COLOURS
from dmoc.scene.problem_file import load_problem

NAMES = ("cart_pole", "bang_bang", "reorientation", "twelve_thrusters")


def seen(image, colour):
    """The mean place of the pixels of a colour [pixels], from the left and from above."""
    pixels = np.asarray(image.convert("RGB"), float)
    near = np.abs(pixels - 255 * np.array(to_rgb(colour))).max(axis=2) < 40
    return np.argwhere(near)[:, ::-1].mean(axis=0)


@pytest.fixture(scope="module", params=NAMES)
def filmed(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("films") / f"{request.param}.gif"
    solution = solve(load_problem(request.param).make())
    animate(solution, path, frames=6)
    return solution, Image.open(path)


def test_a_film_has_its_frames_and_something_moves_in_each(filmed):
    _, film = filmed
    assert film.n_frames == 6 and film.size == (648, 504) and film.info["duration"] == 50
    frames = []
    for frame in range(6):
        film.seek(frame)
        frames.append(np.asarray(film.convert("RGB"), int))
    for one, other in pairwise(frames):
        assert (np.abs(one - other).max(axis=2) > 100).sum() > 20
    assert len(np.unique(frames[0])) > 10


def test_the_first_body_goes_from_left_to_right():
    """The cart of the pole ends a metre to the right of where it starts, at the same height."""
    solution = solve(load_problem("cart_pole").make())
    scene = scene_of(solution, 11)
    assert scene.names == ["cart", "bob"] and scene.times[-1] == pytest.approx(2.0)
    np.testing.assert_allclose(scene.places[0][[0, -1]], [[0, 0], [1, 0]], atol=1e-9)
    rod = scene.links[1]
    assert rod.shape == (11, 2, 2)
    # Between nodes a polynomial of the coordinates is off the rod by a little.
    np.testing.assert_allclose(np.linalg.norm(rod[:, 1] - rod[:, 0], axis=1), 0.5, rtol=1e-3)
    force = scene.pushes[0][:, 1] - scene.pushes[0][:, 0]
    assert len(scene.pushes) == 1 and np.abs(force[:, 1]).max() < 1e-12
    at = np.searchsorted(solution.time, scene.times[5])
    assert np.sign(force[5, 0]) == np.sign(solution.path.control[at, 0])


def test_the_marker_of_a_body_is_where_the_body_is(tmp_path):
    solution = solve(load_problem("cart_pole").make())
    animate(solution, tmp_path / "pole.gif", frames=3)
    film = Image.open(tmp_path / "pole.gif")
    places = []
    for frame in (0, 1):
        film.seek(frame)
        places.append(seen(film.crop((0, 0, 648, 440)), CHANNEL_COLOURS[1]))
    # The bob starts below its cart at the left; in the middle of the way its trail reaches to the right.
    assert places[1][0] > places[0][0] + 100


def test_a_film_of_a_mission_shows_legs_joints_and_impulses_at_their_times(tmp_path):
    solution = solve(load_problem("bielliptic").make())
    scene = scene_of(solution, 41)
    assert [trail.name for trail in scene.trails] == ["out", "back"]
    assert len(scene.joints) == 1 and scene.joints[0] == pytest.approx(solution.legs[1].position[0])
    # The body is where the path is at that time, in either leg.
    for place, now in zip(scene.places[0], scene.times, strict=True):
        trail = next(trail for trail in reversed(scene.trails) if trail.times[0] <= now)
        assert place == pytest.approx([np.interp(now, trail.times, column) for column in trail.points.T])
    assert [late for late, _ in scene.kicks] == pytest.approx([kick.time for kick in solution.impulses])
    for (_, arrow), kick in zip(scene.kicks, solution.impulses, strict=True):
        way = (arrow[1] - arrow[0]) / np.linalg.norm(arrow[1] - arrow[0])
        assert arrow[0] == pytest.approx(kick.position) and way == pytest.approx(kick.change / kick.size)
    path = tmp_path / "flight.gif"
    animate(solution, path, frames=3)
    film, dark = Image.open(path), []
    for frame in range(3):
        film.seek(frame)
        image = np.asarray(film.convert("RGB").crop((90, 60, 620, 400)), int)
        dark.append(int((image.max(axis=2) < 60).sum()))
    # Each impulse leaves its arrow: one at the start, then two, and the last one at the goal.
    assert dark[0] + 40 < dark[1] and dark[1] + 40 < dark[2]


def test_forces_of_a_mission_that_loses_mass_are_shown_per_mass():
    solution = solve(load_problem("delta_iii").make())
    scene = scene_of(solution, 30)
    assert scene.push_words == "force per mass" and len(scene.pushes) == 1
    lengths = np.linalg.norm(scene.pushes[0][:, 1] - scene.pushes[0][:, 0], axis=1)
    # The last stage pushes with a fortieth of the force of the first, but not of its force per mass.
    assert lengths[-1] > 0.2 * lengths.max()


@pytest.mark.slow
def test_thrusters_of_a_body_of_a_system_fire_against_their_force():
    places, ways = [(0.3, 0.2, 0), (-0.3, -0.2, 0)], [(0, 0, 1), (0, 0, 1)]
    joint = Revolute((0, 0, 1), anchor=(0.5, 0, 0), at=(-0.5, 0, 0), on="arm", to="hull")
    bodies = [Member("hull", 2.0, (0.1, 0.2, 0.2)), Member("arm", 1.0, (0.01, 0.1, 0.1))]
    problem = TransferProblem(
        System(bodies, [joint]),
        {"hull": Pose((0, 0, 0)), joint: JointState(0.0)},
        {"hull": Pose((0, 0, 0.2), attitude=None, rate=None), joint: JointState(0.5)},
        4.0,
        actuator=[JointTorque(joint), On("hull", Thrusters(places, ways, max_thrust=2.0, both_ways=True))],
    )
    solution = solve(problem, order=4, steps=20)
    assert solution.success
    scene = scene_of(solution, 5)
    assert scene.push_words == "thrusters" and len(scene.pushes) == 2
    hull = solution.path.position[0]
    attitude = hull[solution.path.coordinates.quaternion_of("hull")][None]
    nozzle, way = (rotated(attitude, np.array([x[0]], float))[0] for x in (places, ways))
    plume = scene.pushes[0][0]
    np.testing.assert_allclose(plume[0], nozzle, atol=1e-9)
    thrust = solution.path.control[0, 1]
    assert (plume[1] - plume[0]) @ way * thrust < 0


def test_a_loaded_solution_without_its_problem_moves_too(filmed, tmp_path):
    solution, _ = filmed
    solution.save(tmp_path / "flight.nc")
    animate(load(tmp_path / "flight.nc"), tmp_path / "flight.gif", frames=2)
    assert Image.open(tmp_path / "flight.gif").n_frames == 2


def test_what_cannot_be_filmed_is_told(tmp_path, monkeypatch):
    solution = solve(load_problem("point_to_point").make())
    bad = {"flight.png": "must end in .gif or .mp4", "no/flight.gif": "does not exist"}
    for name, words in bad.items():
        with pytest.raises(ValueError, match=words):
            animate(solution, tmp_path / name)
    for frames in (1, 201, 2.5, "many"):
        with pytest.raises(ValueError, match="from 2 to 200"):
            animate(solution, tmp_path / "flight.gif", frames)
    monkeypatch.setattr(animation.FFMpegWriter, "isAvailable", classmethod(lambda _: False))
    with pytest.raises(ValueError, match="ffmpeg is not on this computer; install it"):
        animate(solution, tmp_path / "flight.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_command_line_writes_one_and_says_so(tmp_path):
    path = tmp_path / "flight.gif"
    command = [sys.executable, "-m", "dmoc.cli", "solve", "point_to_point", "--animate"]
    done = subprocess.run([*command, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "flight.gif" in "".join(done.stdout.split())
    assert Image.open(path).n_frames == 80
    refused = subprocess.run([*command, "flight.avi"], capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and ".gif or .mp4" in refused.stderr and "Traceback" not in refused.stderr
