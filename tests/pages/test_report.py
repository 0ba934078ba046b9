"""A report: what it holds, and what a person sees and does in a browser."""

import importlib.util
import json
import re
import shutil

import numpy as np
import pytest

from dmoc import (
    Attitude,
    BallForce,
    BoxForce,
    Drag,
    ExponentialAtmosphere,
    KeepOut,
    Leg,
    Mission,
    PointGravity,
    State,
    Team,
    Torque,
    TransferProblem,
    Via,
    load,
    report,
    rotation,
    solve,
)
from dmoc.cli.app import main
from dmoc.pages import bundle, panels
from dmoc.pages.report import page
from dmoc.pages.traces import rounded

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
# WebGL in software, since no graphics card is to be expected.
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("plotly") is None, reason="plotly is not installed: pip install plotly"
)


def at(*place):
    return State(place, (0.0,) * len(place))


FLIGHT = TransferProblem(
    10.0,
    at(0, 0, 0),
    at(8, 1, 1),
    40.0,
    actuator=BoxForce(0.6),
    constraints=[KeepOut((4, 0.5, 0.2), 1.0)],
    name="through_a_hatch",
)
ONE, TWO = (TransferProblem(1.0, at(x, 0), at(-x, 1), 10.0, actuator=BallForce(1.0)) for x in (1.0, -1.5))
KINDS = {
    "space": FLIGHT,
    "line": TransferProblem(1.0, at(0), at(1), 2.0, actuator=BoxForce(2.0)),
    "attitude": TransferProblem(
        1.0,
        Attitude((1, 0, 0, 0), (0, 0, 0)),
        Attitude(rotation((0, 0, 1), 1.0), (0, 0, 0)),
        5.0,
        actuator=Torque(1.0),
        inertia=(1.0, 2.0, 3.0),
    ),
    "mission": Mission(1.0, at(0, 0), at(2, 0), [Leg(5.0, actuator=BallForce(1.0)), Via((1, 1)), Leg(5.0)]),
    "team": Team([ONE, TWO]),
}


@pytest.fixture(scope="module")
def solved():
    return {name: solve(problem, steps=16) for name, problem in KINDS.items()}


def data_of(text):
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_holds_the_values_of_its_answer(solved, kind):
    solution = solved[kind]
    text = page(solution)
    shown = data_of(text)
    assert shown["times"][-1] == pytest.approx(solution.time[-1])
    assert 1e6 < len(text) < 3e6
    # The bundle is packed, so that no address in it could be one that the page asks for.
    assert not re.search(r'(src|href)="?(http|//)', text)
    if kind == "line":
        curve = shown["line"]["curves"][0]
        assert curve["y"] == pytest.approx(solution.position[:, 0], abs=1e-5)
    elif kind != "attitude":
        flown = np.array(shown["stage"]["moving"][-1]["frames"])[:, 0]
        last = solution.members[-1] if kind == "team" else solution
        assert flown[0] == pytest.approx(last.position[0], abs=1e-5)
        assert flown[-1] == pytest.approx(last.position[-1], abs=1e-5)


def test_panels_of_a_page_are_force_and_limit_speed_and_clearance(solved):
    shown = {panel["title"].split(" (")[0]: panel for panel in data_of(page(solved["space"]))["panels"]}
    assert {"Force of the actuator", "Speed", "Clearance from the zones"} <= shown.keys()
    assert {level["y"] for level in shown["Force of the actuator"]["fixed"]} == {0.6, -0.6}
    nearest = min(shown["Clearance from the zones"]["curves"][0]["y"])
    assert nearest == pytest.approx(solved["space"].facts()["clearance"].value, abs=1e-3)


def test_altitude_is_that_above_the_ground_of_the_air():
    air = ExponentialAtmosphere(1.0, 0.0, 1.0, radius=10.0)
    effects = [PointGravity(1000.0), Drag(1e-9, 1.0, air)]
    flight = TransferProblem(1.0, State((12, 0), (0, 9)), State((0, 13), (-9, 0)), 2.0, effects=effects)
    panel = next(one for one in data_of(page(solve(flight, steps=20)))["panels"] if one["title"] == "Altitude")
    assert (panel["curves"][0]["y"][0], panel["curves"][0]["y"][-1]) == pytest.approx((2.0, 3.0), abs=1e-5)


def test_numbers_of_a_page_are_short_and_none_is_lost():
    assert rounded([[1 / 3, 0.0], [-1e-300, 123456789.0]]) == [[0.333333, 0.0], [-1e-300, 123457000.0]]
    assert rounded([np.nan, np.inf, 5e-324]) == [None, None, 0.0]


def test_formulas_of_the_pictures_are_html():
    assert panels.plain("$F_x$ [$10^{5}$ km]\nof $\\omega_z$") == (
        "F<sub>x</sub> [10<sup>5</sup> km] of \u03c9<sub>z</sub>"
    )


def test_without_plotly_one_line_says_what_to_install(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(bundle, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="2"):
        main(["solve", "point_to_point", "--plot", str(tmp_path / "p.html")])
    told = capsys.readouterr().err
    assert "pip install plotly" in told and told.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_page_of_a_saved_flight_with_its_study(tmp_path, capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        return ended.value.code

    flight, study = str(tmp_path / "p.nc"), str(tmp_path / "s.csv")
    assert run("solve", "point_to_point", "--out", flight, "--plot", str(tmp_path / "p.html"), "--quiet") == 0
    assert (
        run("study", "point_to_point", "--orders", "2", "--steps", "4,8", "--repeats", "1", "--csv", study) == 0
    )
    assert run("report", flight, "--study", study, "--out", str(tmp_path / "q.html"), "--dark") == 0
    text = (tmp_path / "q.html").read_text()
    assert "What accuracy costs" in text and 'data-theme="dark"' in text
    assert "Checks of the answer" in (tmp_path / "p.html").read_text()
    for wrong, said in (
        (("report", flight, "--out", str(tmp_path / "p.png")), "must end in .html"),
        (("report", flight, "--study", flight), "is no table of a study"),
    ):
        assert run(*wrong) == 2
        assert said in capsys.readouterr().err


def test_a_page_of_a_file_without_its_problem_says_so(solved, tmp_path):
    solved["space"].save(tmp_path / "s.nc")
    report(load(tmp_path / "s.nc"), tmp_path / "s.html")
    assert "problem is not at hand" in (tmp_path / "s.html").read_text()


@pytest.fixture(scope="module")
def browser():
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if BROWSER is None:
        pytest.skip("there is no Chromium on this computer; Debian: apt-get install chromium")
    with driver.sync_playwright() as started:
        # A container has no sandbox of its own; the page is ours.
        shown = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox", *SOFTWARE])
        yield shown
        shown.close()


@pytest.fixture
def view(browser):
    """An empty page of a browser without a network, and the errors of scripts on it."""
    shown = browser.new_context(
        viewport={"width": 900, "height": 700}, color_scheme="dark", offline=True
    ).new_page()
    shown.set_default_timeout(120_000)
    errors = []
    shown.on("pageerror", lambda error: errors.append(str(error)))
    yield shown
    shown.context.close()
    assert errors == []


def _open(view, solution, path):
    report(solution, path)
    view.goto(path.as_uri())
    view.wait_for_selector("html[data-ready=yes]")


def test_in_a_browser_the_path_turns_the_body_flies_and_values_are_told(view, solved, tmp_path):
    _open(view, solved["space"], tmp_path / "space.html")
    _turns(view)
    _tells(view, solved["space"])
    view.click("#play")
    view.wait_for_function("Number(document.getElementById('slider').value) > 160")


@pytest.mark.parametrize(
    "kind", ["mission", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("line", "attitude", "team"))]
)
def test_pages_of_all_kinds_open_in_a_browser(view, solved, tmp_path, kind):
    _open(view, solved[kind], tmp_path / "page.html")
    before = view.locator(".legend b").all_inner_texts()
    view.locator("#slider").press("PageUp")
    assert view.locator(".legend b").all_inner_texts() != before


def _turns(view):
    """A drag turns the path."""
    eye = "JSON.stringify(document.getElementById('stage').layout.scene.camera.eye)"
    before, box = view.evaluate(eye), view.locator("#stage").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    view.mouse.move(x, y)
    view.mouse.down()
    view.mouse.move(x + 80, y + 30, steps=4)
    view.mouse.up()
    view.wait_for_function(f"{eye} !== {json.dumps(before)}")


def _tells(view, solution):
    """The slider moves the body, and the numbers are those of the answer at that time."""
    script = "slider.value = 150; slider.dispatchEvent(new Event('input'))"
    view.evaluate(script)
    clock, _, unit = view.locator("#clock").inner_text().partition(" ")
    now = solution.at(float(clock))
    assert unit == "s" and float(clock) == pytest.approx(150 / 240 * 40)

    def number(words):
        return float(words.replace("\u2212", "-"))

    lane = view.locator(".panel", has_text="Speed").first
    assert number(lane.locator(".legend b").first.inner_text()) == pytest.approx(
        np.linalg.norm(now.velocity), rel=2e-3
    )
    lane = view.locator(".panel", has_text="Force of the actuator").first
    told = [number(words) for words in lane.locator(".legend b").all_inner_texts()]
    assert told == pytest.approx([*now.force, np.linalg.norm(now.force)], abs=2e-4)
    place = re.findall(r"[\u2212\d.e]+", view.locator("#place").inner_text().split("(")[1])
    assert [number(words) for words in place] == pytest.approx(now.position, abs=2e-2)
    body = view.evaluate("[stage.place.data.at(-1).x[0], stage.place.data.at(-1).y[0]]")
    assert body == pytest.approx(now.position[:2], abs=2e-2)
