"""Every command that draws takes --dark, and what it draws is dark then."""

from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image

from dmoc import BoxForce, State, TransferProblem, solve
from dmoc.charts.study import save_page, study_figure
from dmoc.cli.app import app, main
from dmoc.plots.sheet import darkened
from dmoc.studies.accuracy import Trial

COMMANDS = typer.main.get_command(app).commands


def run(*arguments):
    with pytest.raises(SystemExit) as stopped:
        main([*map(str, arguments)])
    return stopped.value.code


def darkness(path):
    """The mean brightness of the edge of a picture, 0 to 1."""
    image = np.asarray(Image.open(path).convert("L"), float) / 255
    return np.concatenate([image[0], image[-1]]).mean()


def test_every_command_that_draws_takes_it():
    drawing = {"plot", "animate", "report"}
    for name, command in COMMANDS.items():
        if any(option.name == "plot" for option in command.params):
            drawing.add(name)
    assert {"solve", "simulate", "study", "stability", "disperse", "identify"} < drawing
    assert [name for name in drawing if not any(one.name == "dark" for one in COMMANDS[name].params)] == []


def test_pictures_of_flights_are_dark(tmp_path):
    flight, drawn = tmp_path / "flight.nc", tmp_path / "drawn.png"
    assert run("solve", "orbit_raise", "--order", "4", "--steps", "20", "-q", "--out", flight) in (0, 4)
    simulate = "simulate", "orbit_raise", "--steps", "20", "--plot", drawn
    assert run(*simulate) == 0 and darkness(drawn) > 0.9
    for command in (
        simulate,
        ("disperse", flight, "--start", "0.01,0.01", "--samples", "10", "--plot", drawn),
        ("plot", flight, "--out", drawn),
        ("identify", "free_flyer", "--noise", "0.001", "--plot", drawn),
    ):
        assert run(*command, "--dark") == 0 and darkness(drawn) < 0.2
    film = tmp_path / "film.gif"
    assert run("animate", flight, "--out", film, "--frames", "2", "--dark") == 0 and darkness(film) < 0.2


def test_charts_and_figures_are_dark(tmp_path):
    row = Trial.__dataclass_fields__
    known = {
        "method": "order 2",
        "status": "solved",
        "build_s": 0.1,
        "solve_s": 0.1,
        "error": 1e-3,
        "path_error": 1e-3,
    }
    trial = Trial(**{name: known.get(name) for name in row})
    save_page(study_figure([trial]), tmp_path / "study.png", dark=True)
    assert darkness(tmp_path / "study.png") < 0.2
    problem = TransferProblem(
        1.0, State((0,), (0,)), State((1,), (0,)), 2.0, actuator=BoxForce(2.0), name="cart"
    )
    solution = solve(problem, steps=10)
    page = Path(tmp_path / "cart.png")
    solution.plot(page, dark=True)
    assert darkness(page) < 0.2
    assert solution.plot(dark=True).get_facecolor()[0] < 0.2 < solution.plot().get_facecolor()[0]


def test_surfaces_in_space_keep_the_colour_of_every_face():
    """They tell their colours in the order of depth, in which they must not be set again."""
    from matplotlib.figure import Figure

    page = Figure()
    axes = page.add_subplot(projection="3d")
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    colours = np.ones((4, 4, 4)) * np.linspace(0.3, 0.9, 4)[:, None, None]
    surface = axes.plot_surface(x, y, x * y, facecolors=colours, shade=False)
    page.draw_without_rendering()
    before = surface._facecolor3d.copy()
    darkened(page)
    assert np.array_equal(surface._facecolor3d, before)
