"""What a notebook shows of an answer, the picture that it gives, and the problem that a file names."""

import base64
import gc
import io
import re

import matplotlib.figure
import matplotlib.image
import pytest

import dmoc
from dmoc import BoxForce, KeepOut, State, TransferProblem, load, solve, verify
from dmoc.notebook import page
from dmoc.scene.problem_file import load_problem

HOP = """\
from dmoc import State, TransferProblem
{extra}

def problem(distance=1.0):
    return TransferProblem(1.0, State((0, 0), (0, 0)), State((distance, 0), (0, 0)), 2.0)
"""


def flight(**parts):
    given = {"constraints": [KeepOut((0.5, 0.1), 0.2)], "name": "a <hop>"}
    return TransferProblem(1.0, State((0, 0), (0, 0)), State((1, 0), (0, 0)), 2.0, **(given | parts))


@pytest.fixture(scope="module")
def found():
    return solve(flight(), steps=30)


@pytest.fixture
def saved(tmp_path, monkeypatch):
    """A solution in a file, of a problem file in the working folder, one parameter not the default."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hop.py").write_text(HOP.format(extra=""))
    file = load_problem("hop.py")
    solution = solve(file.make(distance=3.0), steps=20)
    solution.save("hop.nc", source_hash=file.source_hash)
    return tmp_path / "hop.nc"


def picture(html):
    data = base64.b64decode(re.search(r'src="data:image/png;base64,([^"]+)"', html)[1])
    assert len(data) < 300_000
    return matplotlib.image.imread(io.BytesIO(data))


def test_a_notebook_shows_figure_closing_line_facts_checks_and_meshes(found):
    html = found._repr_html_()
    assert 800 < picture(html).shape[1] < 1200
    for words in (
        "Solved, a local optimum: effort ",
        "Every check holds.",
        "least clearance",
        "reference",
        "holds",
    ):
        assert words in html
    assert f"<td>{found.ladder[-1].steps}</td>" in html and "<details><summary>Checks of the answer" in html
    assert "a &lt;hop&gt;" in html and "<hop>" not in html and "script" not in html


def test_a_table_has_the_force_of_the_step_behind_a_node():
    """Where forces are held; the last node has that of the step before it."""
    solution = solve(flight(constraints=[]), steps=6, hold=True)
    held = solution.table()["force x [N]"].tolist()
    assert held == [*solution.force[:, 0], solution.force[-1, 0]] and held[-1] != held[-3]


def test_a_table_has_what_wheels_store():
    solution = solve(load_problem("satellite_slew").make(), order=2, steps=6)
    stored = solution.table()[[f"wheel momentum {i} [N m s]" for i in range(1, 5)]]
    assert stored.to_numpy() == pytest.approx(solution.wheel_momentum, abs=1e-12)


def test_an_answer_is_checked_once(found, monkeypatch):
    counted = []
    monkeypatch.setattr(page, "verify", lambda solution: counted.append(solution) or verify(solution))
    solution = solve(flight(), steps=12)
    assert solution._repr_html_() == solution._repr_html_()
    assert counted == [solution]
    key = id(solution)
    assert key in page._reports
    counted.clear()
    del solution
    gc.collect()
    assert key not in page._reports


def test_a_failed_solve_says_what_to_try():
    html = solve(flight(actuator=BoxForce(0.1), constraints=[]), steps=8)._repr_html_()
    assert "Not solved: " in html and "What to try: " in html and "Solved, a" not in html


def test_a_check_that_fails_is_not_folded_away(found):
    broken = type(found)(**(vars(found) | {"velocity": found.velocity + 1.0}))
    assert "<details open><summary>Checks of the answer" in broken._repr_html_()


def test_plot_gives_the_figure_or_writes_it(found, tmp_path):
    page = found.plot()
    assert isinstance(page, matplotlib.figure.Figure) and len(page.axes) == 4
    assert found.plot(tmp_path / "hop.svg") is None and "<svg" in (tmp_path / "hop.svg").read_text()
    with pytest.raises(ValueError, match=r"must end in \.png"):
        found.plot(tmp_path / "hop.jpg")


def test_animate_writes_a_film(found, tmp_path):
    found.animate(tmp_path / "hop.gif", frames=2)
    assert (tmp_path / "hop.gif").read_bytes()[:6] == b"GIF89a"


def test_a_file_finds_the_problem_that_it_names(saved):
    loaded = load(saved)
    assert loaded.problem is None and verify(loaded).ok
    assert loaded.facts()["velocity change"].value == pytest.approx(4.5, rel=1e-2)
    assert "Every check holds." in loaded._repr_html_()


def test_a_problem_file_that_was_changed_is_not_run(saved):
    (saved.parent / "hop.py").write_text(HOP.format(extra="raise SystemExit('it was run')"))
    (saved.parent / "problems").mkdir()
    (saved.parent / "problems" / "hop.py").write_text(HOP.format(extra="raise SystemExit('it was run')"))
    for ask in (verify, lambda loaded: loaded.facts()):
        with pytest.raises(
            ValueError, match=r"hop\.py is no longer what it was made from; use solution\.attach"
        ):
            ask(load(saved))
    html = load(saved)._repr_html_()
    assert picture(html).size and "<p>Solution of &#x27;hop&#x27;: objective" in html and "check" not in html


def test_what_names_no_file_says_so(found, tmp_path):
    found.save(tmp_path / "hop.nc")
    with pytest.raises(ValueError, match=r"does not hold its problem 'a <hop>'; use solution\.attach"):
        verify(load(tmp_path / "hop.nc"))
    assert verify(load(tmp_path / "hop.nc"), found.problem).ok


def test_missions_and_teams_are_shown_too():
    for name, words in (("hohmann", "in 2 impulses"), ("three_robots", "velocity change")):
        html = solve(load_problem(name).make())._repr_html_()
        assert words in html and picture(html).size


def test_saved_in_a_folder_of_problems_it_is_found_by_its_name(tmp_path):
    file = load_problem("hohmann")
    solve(file.make()).save(tmp_path / "h.nc", source_hash=file.source_hash)
    assert verify(dmoc.load(tmp_path / "h.nc")).ok
