"""Functions kept between processes: the same answer, and nothing but what was written is ever read."""

import errno
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import dmoc.basics.memory
from dmoc import solve, verify
from dmoc.basics import cache
from dmoc.basics.memory import forget, remembered, store
from dmoc.motion.dynamics import Dynamics
from dmoc.scene.problem_file import load_problem

NAMES = ["orbit_raise", "leo_raise", "drone_hop", "hovercraft", "formation"]


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Files of one test, and no functions kept from another."""
    store()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    # whoever runs these may be editing the sources
    monkeypatch.setattr(dmoc.basics.memory, "_version", lambda: dmoc.basics.memory.VERSION)
    forget(files=True)
    yield tmp_path / "cache" / "dmoc"
    store()
    forget(files=True)


def files(place):
    return sorted(place.glob("*.functions"))


def next_process():
    store()
    forget(files=True)


def must_not_be_made():
    raise AssertionError("made again")


@pytest.mark.parametrize("name", NAMES)
def test_a_later_process_makes_nothing_anew_and_has_the_same_answer(name, own_folder):
    problem = load_problem(name).make()
    first = solve(problem, order=4, steps=20)
    verify(first)
    next_process()
    before = files(own_folder)
    assert before
    again = solve(problem, order=4, steps=20)
    verify(again)
    assert again.iterations == first.iterations
    np.testing.assert_array_equal(again.position, first.position)
    store()
    assert files(own_folder) == before


def test_a_process_writes_when_it_ends(own_folder):
    code = "from dmoc.motion.dynamics import Dynamics; Dynamics(2).acceleration"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert files(own_folder)
    next_process()
    assert remembered(must_not_be_made, "Dynamics.acceleration", Dynamics(2)).n_in() == 5


@pytest.mark.parametrize("change", ["cut", "empty", "one bit", "longer"])
def test_a_file_that_is_not_as_it_was_written_is_made_anew(change, own_folder):
    assert remembered(lambda: "made", "test") == "made"
    next_process()
    assert remembered(must_not_be_made, "test") == "made"
    forget(files=True)
    (file,) = files(own_folder)
    good = file.read_bytes()
    bit = good[:-3] + bytes([good[-3] ^ 1]) + good[-2:]
    file.write_bytes({"cut": good[:-1], "empty": b"", "one bit": bit, "longer": good + b"."}[change])
    assert remembered(lambda: "made anew", "test") == "made anew"
    store()
    assert file.read_bytes() != good, "the spoiled file must have been replaced"


def test_other_sources_have_other_files(monkeypatch):
    assert remembered(lambda: "made", "test") == "made"
    next_process()
    monkeypatch.setattr(dmoc.basics.memory, "VERSION", "another")
    assert remembered(lambda: "made anew", "test") == "made anew"


def copied(place, code):
    """What a process prints that runs a copy of the package."""
    code = f"import sys; sys.path[:1] = [{str(place)!r}]\n{code}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    return found.stdout


PULL = """
from dmoc import PointGravity
from dmoc.motion.dynamics import Dynamics
{between}
print(Dynamics(1, (PointGravity(1.0),)).point(0, 1, 0, 1)[0])
"""


def test_sources_edited_while_a_process_runs_have_no_files_from_it(tmp_path):
    copy = shutil.copytree(Path(dmoc.__file__).parent, tmp_path / "dmoc") / "effects" / "gravity.py"
    edited = copy.read_text().replace("return self.mu / ", "return 3 * self.mu / ")
    edit = f"from pathlib import Path; Path({str(copy)!r}).write_text({edited!r})"
    assert copied(tmp_path, PULL.format(between=edit)) == "-1\n", "the old sources must have been in memory"
    assert copied(tmp_path, PULL.format(between="")) == "-3\n"


def test_a_package_in_an_archive_works_without_files(tmp_path, own_folder):
    package = Path(dmoc.__file__).parent
    archive = shutil.make_archive(str(tmp_path / "package"), "zip", package.parent, package.name)
    assert copied(archive, PULL.format(between="")) == "-1\n"
    assert not own_folder.exists() or not files(own_folder)


def test_what_cannot_be_read_is_made_anew(own_folder):
    remembered(lambda: "made", "test")
    next_process()
    (file,) = files(own_folder)
    cache.write(file.name, b"cno_such_module\nno_such_class\n.")
    assert remembered(lambda: "made anew", "test") == "made anew"


def test_what_measures_does_without_files():
    assert remembered(lambda: "made", "test") == "made"
    store()
    forget()
    assert remembered(lambda: "made anew", "test") == "made anew"


def test_objects_of_the_user_are_never_written(own_folder):
    remembered(lambda: "made", "test", lambda: None)
    store()
    assert not own_folder.exists() or not files(own_folder)


def test_a_scene_with_a_long_table_has_no_files(own_folder):
    """Each would hold the table: a few scenes with 20,000 rows took 135 MB, and seconds at the end."""
    assert remembered(lambda: "made", "test", tuple(range(1000))) == "made"
    assert remembered(must_not_be_made, "test", tuple(range(1000))) == "made"
    next_process()
    assert not own_folder.exists() or not files(own_folder)
    assert remembered(lambda: "made anew", "test", tuple(range(1000))) == "made anew"


def test_the_folder_is_private(own_folder):
    assert cache.folder() == str(own_folder)
    assert own_folder.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_folder_that_others_may_write_to_is_not_used(own_folder, mode):
    remembered(lambda: "made", "test")
    next_process()
    own_folder.chmod(mode)
    assert cache.folder() is None
    assert remembered(lambda: "made anew", "test") == "made anew"


def test_a_folder_that_is_a_link_is_not_used(own_folder, tmp_path):
    own_folder.parent.mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    own_folder.symlink_to(tmp_path / "elsewhere")
    assert cache.folder() is None


def test_what_a_process_leaves_that_is_killed_is_tidied_away(own_folder, monkeypatch):
    code = "import os, pathlib; pathlib.Path.replace = lambda *_: os._exit(9); from dmoc import cache; "
    ended = subprocess.run([sys.executable, "-c", code + "cache.write('a.functions', b'content')"])
    assert ended.returncode == 9 and list(own_folder.iterdir())
    assert cache.read("a.functions") is None
    monkeypatch.setattr(cache, "MOST_KEPT", 0)
    cache.tidy("*.functions")
    assert not list(own_folder.iterdir())


def test_on_a_full_disk_nothing_is_left(own_folder, monkeypatch):
    def fail(file, content):
        file.touch()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail)
    cache.write("a.functions", b"content")
    assert not list(own_folder.iterdir())


@pytest.mark.parametrize("given", ["cache", ""])
def test_a_path_that_is_not_absolute_does_not_count_and_without_a_home_there_is_no_folder(given, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", given)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    assert cache.folder() is None
    remembered(lambda: "made", "test")
    store()
    assert not Path("cache").exists()


def test_where_the_folder_cannot_be_made_everything_is_made_anew(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert cache.folder() is None
    remembered(lambda: "made", "test")
    next_process()
    assert remembered(lambda: "made anew", "test") == "made anew"


def test_a_disk_that_can_only_be_read_from_is_read(monkeypatch):
    remembered(lambda: "made", "test")
    next_process()

    def refuse(path):
        raise OSError(errno.EROFS, "Read-only file system", path)

    monkeypatch.setattr("os.utime", refuse)
    assert remembered(must_not_be_made, "test") == "made"


def test_the_files_used_last_are_kept(own_folder, monkeypatch):
    monkeypatch.setattr(cache, "MOST_KEPT", 3)
    for i in range(5):
        cache.write(f"{i}.functions", b"content")
        (own_folder / f"{i}.functions").touch()
    cache.read("0.functions")
    cache.tidy("*.functions")
    assert "0.functions" in [file.name for file in files(own_folder)]
    assert len(files(own_folder)) == 3
