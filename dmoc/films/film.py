"""A moving picture of a solution: bodies, links, body axes and what pushes, as time goes by."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from dmoc.basics.arguments import of_kind, short
from dmoc.basics.files import as_path, whole_file
from dmoc.films.frames import Scene, scene_of
from dmoc.plots.mission import scenery
from dmoc.plots.path import frame as framed
from dmoc.plots.path import scale_of
from dmoc.plots.sheet import darkened
from dmoc.plots.style import AXIS_COLOURS, DARK, PALE, PUSH, SETTINGS, readable
from dmoc.plots.surroundings import draw_scene
from dmoc.results.solution import Solution
from dmoc.surroundings.view import view_of

if TYPE_CHECKING:
    from dmoc.missions.solution import MissionSolution
    from dmoc.teams.solution import TeamSolution

# A film can be written in these formats, which the end of the file's name decides.
SUFFIXES = (".gif", ".mp4")
# A film has at most so many frames, and so many a second: writing takes seconds, and a file a few megabytes.
MOST_FRAMES, RATE = 200, 20
# A film is so large [inches], of so many dots an inch.
SIZE, DOTS = (7.2, 5.6), 90
# About so many letters of a legend, with the lines before them, have room beside each other.
ROW = 72
# Times so near to each other are the same, as a part of the film [-].
NEAR = 1e-9


def animate(
    solution: Solution | MissionSolution | TeamSolution,
    path: str | os.PathLike,
    frames: int = 80,
    dark: bool = False,
) -> None:
    """Write a moving picture of a solution, whole or not at all.

    Of a mission each leg has its colour; joints are marked, and the arrow of an impulse stays from its time on.
    Of a team each body has its colour and its name.

    Parameters
    ----------
    solution : Solution, MissionSolution or TeamSolution
    path : path
        Ends in .gif or, where ffmpeg is on the computer, in .mp4.
    frames : int
        Number of frames at even times, 2 to 200; 20 of them are shown a second.
    dark : bool
        On a dark background.

    Raises
    ------
    ValueError
        If the suffix is another one, the folder does not exist, ffmpeg is missing or the path is not finite.
    """
    parts: Any = getattr(solution, "parts", None)
    if parts is None:
        of_kind("solution", solution, Solution)
    several = parts != (solution,)
    check_target(path)
    if type(frames) is not int or not 2 <= frames <= MOST_FRAMES:
        raise ValueError(f"frames must be a whole number from 2 to {MOST_FRAMES}; got {short(frames)}")
    if not all(np.isfinite(part.path.position).all() for part in parts):
        raise ValueError("the path is not finite, so there is nothing to show")
    import matplotlib
    from matplotlib import animation
    from matplotlib.figure import Figure

    scene = scene_of(solution, frames)
    with matplotlib.rc_context(SETTINGS), whole_file(path) as temporary:
        page = Figure(figsize=SIZE)
        film = _Film(page, scenery(solution) if several else solution, scene)  # type: ignore[arg-type]
        darkened(page, dark)
        if as_path(path).suffix.lower() == ".gif":
            _write_gif(film, page, temporary, frames)
            return
        writer: Any = animation.FFMpegWriter(fps=RATE)
        with writer.saving(page, str(temporary), DOTS):
            for frame in range(frames):
                film.show(frame)
                writer.grab_frame()


def _write_gif(film: _Film, page: Any, target: Any, frames: int) -> None:
    """Draw what stands still once, and only what moves for each frame."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    page.set_dpi(DOTS)
    canvas = FigureCanvasAgg(page)
    for artist in film.moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(page.bbox)
    images = []
    for frame in range(frames):
        canvas.restore_region(still)
        film.show(frame)
        for artist in film.moving:
            film.axes.draw_artist(artist)
        images.append(Image.fromarray(np.array(canvas.buffer_rgba())).convert("RGB"))
    # One palette for all frames: that of the last, where all there is has come into view.
    palette = images[-1].quantize(255)
    images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    images[0].save(target, save_all=True, append_images=images[1:], duration=1000 // RATE, loop=0)


def check_target(path: str | os.PathLike) -> None:
    """ValueError unless a film can be written into such a file."""
    suffix = as_path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"cannot write a film into {path}: the file must end in {' or '.join(SUFFIXES)}")
    if suffix == ".mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise ValueError(f"cannot write {path}: ffmpeg is not on this computer; install it, or use .gif")


class _Film:
    """A panel of which some lines move from frame to frame."""

    def __init__(self, page: Any, solution: Solution, scene: Scene):
        self.scene, space = scene, scene.axes == 3
        self.late, self.late_unit = readable(scene.times, "s")
        self.axes = page.add_subplot(projection="3d" if space else None)
        unit = self._surround(solution, space)
        for i, name in enumerate("xyz"[: scene.axes]):
            label = f"{name} [{unit}]" if solution.dimension > i else ("" if solution.dimension else name)
            getattr(self.axes, f"set_{name}label")(label)
        if solution.dimension == 1:
            self.axes.set_yticks([])
        self.ahead = [self._line(trail.points, color=PALE, linewidth=1.2) for trail in scene.trails]
        self.behind = [
            self._line(trail.points[:1], color=trail.colour, linewidth=2.0) for trail in scene.trails
        ]
        if len(scene.joints):
            self._line(scene.joints, color=DARK, marker="D", markersize=6, fillstyle="none", linestyle="none")
        self.kicks = [self._line(arrow[:1], color=DARK, linewidth=2.2) for _, arrow in scene.kicks]
        self.links = [self._line(line[0], color=DARK, linewidth=2.2) for line in scene.links]
        self.triads = [
            self._line(arm[0], color=AXIS_COLOURS[i % 3], linewidth=2.0) for i, arm in enumerate(scene.triads)
        ]
        self.pushes = [self._line(push[0], color=PUSH, linewidth=2.6) for push in scene.pushes]
        dot: dict[str, Any] = {"marker": "o", "markersize": 8, "linestyle": "none"}
        self.bodies = [
            self._line(path[:1], color=scene.colour(i), **dot) for i, path in enumerate(scene.places)
        ]
        named = list(zip(self.bodies, scene.names, strict=True))
        named += {
            trail.name: (line, trail.name) for line, trail in zip(self.behind, scene.trails, strict=True)
        }.values()
        if self.pushes:
            named.append((self.pushes[0], scene.push_words))
        if self.kicks:
            named.append((self.kicks[0], "impulse"))
        named = [one for one in named if one[1]]
        rows = 1 + sum(len(name) + 6 for _, name in named) // ROW
        if named:
            columns = -(-len(named) // rows)
            page.legend(*zip(*named, strict=True), loc="lower center", ncol=columns)
        if space:
            self.axes.set_position((0.0, 0.05 * rows, 1.0, 0.93 - 0.05 * rows))
        else:
            page.subplots_adjust(bottom=0.12 + 0.05 * rows)
        self.title = self.axes.set_title("", loc="left")
        lines = self.behind, self.kicks, self.links, self.triads, self.pushes, self.bodies
        # All that is not the same in every frame, from what is behind to what is before it.
        self.moving = [*(line for group in lines for line in group), self.title]

    def _surround(self, solution: Solution, space: bool) -> str:
        """Zones and attractors, and a view that holds all that moves; the name of the unit of its axes."""
        from matplotlib.ticker import MaxNLocator

        low, high = self.scene.everything.min(axis=0), self.scene.everything.max(axis=0)
        margin = 0.06 * float((high - low).max() or 1.0)
        low, high = low - margin, high + margin
        if solution.dimension == self.scene.axes:
            scenery = view_of(solution, self.scene.everything)
            low, high = np.minimum(low, scenery[0]), np.maximum(high, scenery[1])
        if space:
            middle, side = 0.5 * (low + high), np.maximum(high - low, 0.2 * (high - low).max())
            low, high = middle - side / 2, middle + side / 2
            self.axes.computed_zorder = False
        else:
            self.axes.set_aspect("equal")
        self.size, unit = scale_of(self.scene.everything, low, high)
        view = low / self.size, high / self.size
        if solution.dimension == self.scene.axes:
            draw_scene(self.axes, solution, view, self.size)
        if space:
            framed(self.axes, view, unit)
            return unit
        span = view[1] - view[0]
        for i, name in enumerate("xyz"[: self.scene.axes]):
            self.axes.set(**{f"{name}lim": (view[0][i], view[1][i])})
            axis = getattr(self.axes, f"{name}axis")
            # A short side has room for few numbers, and plain ones are drawn five times as fast.
            axis.set_major_locator(MaxNLocator(2 + round(4 * span[i] / span.max())))
            axis.set_major_formatter("{x:g}")
        return unit

    def _line(self, points: np.ndarray, **look: Any) -> Any:
        return self.axes.plot(*points.T / self.size, zorder=5, **look)[0]

    def _move(self, line: Any, points: np.ndarray) -> None:
        (line.set_data_3d if self.scene.axes == 3 else line.set_data)(*points.T / self.size)

    def show(self, frame: int) -> None:
        """Move all lines to a frame."""
        scene = self.scene
        for path, dot in zip(scene.places, self.bodies, strict=True):
            self._move(dot, path[frame : frame + 1])
        now = scene.times[frame]
        for line, trail in zip(self.behind, scene.trails, strict=True):
            gone = trail.points[trail.times <= now]
            here = scene.places[trail.body][frame : frame + 1 if len(gone) < len(trail.points) else frame]
            self._move(line, np.concatenate([gone, here]) if len(gone) else gone)
        for line, (late, arrow) in zip(self.kicks, scene.kicks, strict=True):
            self._move(line, arrow[: len(arrow) if late <= now + NEAR * np.ptp(scene.times) else 0])
        moving = ((self.links, scene.links), (self.triads, scene.triads), (self.pushes, scene.pushes))
        for lines, points in moving:
            for line, known in zip(lines, points, strict=True):
                self._move(line, known[min(frame, len(known) - 1)])
        self.title.set_text(f"t = {scene.times[frame] / self.late:.2f} {self.late_unit}")
