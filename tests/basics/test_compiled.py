"""Functions as machine code: the same answer, and nothing that others could have written is ever loaded."""

import os
import shutil
import stat
from dataclasses import replace

import numpy as np
import pytest

from dmoc import solve
from dmoc.assembly import compiled as module
from dmoc.assembly.compiled import compiled, folder
from dmoc.basics.memory import forget
from dmoc.nlp.stencils import stencils_of
from dmoc.scene.problem_file import load_problem

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
BROKEN = "#!/bin/sh\nexit 1\n"


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Libraries of one test, and no functions remembered from another."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    forget()
    yield tmp_path / "cache" / "dmoc"
    forget()


def functions():
    """Those of a step around the Earth, with air."""
    problem = load_problem("leo_raise").make()
    return stencils_of(problem, 4, False).stencils[1].kernel.functions


def is_machine_code(found):
    return {name: function.class_name() == "External" for name, function in found.items()}


def libraries(place):
    return sorted(place.glob("*.so"))


@pytest.fixture
def without_compiler(tmp_path, monkeypatch):
    """A computer on which every compiler fails."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("cc", "gcc", "clang"):
        (programs / name).write_text(BROKEN)
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(programs))


@needs_compiler
def test_long_functions_are_machine_code_and_give_the_same_numbers():
    plain = functions()
    found = compiled(plain)
    assert is_machine_code(found) == {name: f.n_instructions() >= 100 for name, f in plain.items()}
    random = np.random.default_rng(1)
    arguments = [random.uniform(0.5, 1.5, plain["hessian"].size_in(i)) for i in range(5)]
    ours, theirs = (np.array(each["hessian"](*arguments)) for each in (found, plain))
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12 * np.abs(theirs).max())


@needs_compiler
def test_a_solve_with_machine_code_has_the_same_answer(own_folder):
    problem = load_problem("drone_hop").make()
    plain, found = (solve(problem, order=4, steps=40, compiled=on).raise_for_status() for on in (False, True))
    assert libraries(own_folder)
    assert found.objective == pytest.approx(plain.objective, rel=1e-9)
    assert found.iterations == plain.iterations


@needs_compiler
def test_a_library_does_not_grow_with_the_mesh(own_folder):
    problem = load_problem("drone_hop").make()
    for steps in (10, 40, 80):
        solve(problem, order=4, steps=steps, compiled=True)
    # one for nodes and one for steps
    assert len(libraries(own_folder)) <= 2


@needs_compiler
def test_a_library_is_kept_for_the_next_time(own_folder, monkeypatch, tmp_path):
    compiled(functions())
    (library,) = libraries(own_folder)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert is_machine_code(compiled(functions()))["hessian"]
    assert libraries(own_folder) == [library]


@needs_compiler
@pytest.mark.parametrize("content", [b"", b"\x7fELF", None], ids=["empty", "foreign", "one byte changed"])
def test_a_library_that_is_not_as_it_was_compiled_is_not_loaded(own_folder, content, request):
    compiled(functions())
    (library,) = libraries(own_folder)
    good = library.read_bytes()
    spoiled = bytes([good[0], good[1] ^ 1]) + good[2:] if content is None else content
    library.unlink()
    library.write_bytes(spoiled)
    assert is_machine_code(compiled(functions()))["hessian"]
    assert library.read_bytes() == good, "it must have been compiled anew"
    library.unlink()
    library.write_bytes(spoiled)
    request.getfixturevalue("without_compiler")
    assert not any(is_machine_code(compiled(functions())).values())


@needs_compiler
def test_a_library_without_its_record_is_not_loaded(own_folder, request):
    compiled(functions())
    (library,) = libraries(own_folder)
    library.with_suffix(".sha256").unlink()
    request.getfixturevalue("without_compiler")
    assert not any(is_machine_code(compiled(functions())).values())


def others_may_write(file, monkeypatch):
    file.chmod(0o602)


def its_group_may_write(file, monkeypatch):
    file.chmod(0o620)


def it_is_another_user_s(file, monkeypatch):
    owned_by(file, os.geteuid() + 1, monkeypatch)


def it_is_a_link(file, monkeypatch):
    file.symlink_to(file.rename(file.parent.parent / "elsewhere.so"))


def owned_by(place, user, monkeypatch):
    """Give a file to a user, or let it look so where only root may do that."""
    if os.geteuid() == 0:
        os.chown(place, user, -1)
        return
    look = os.lstat

    def lstat(path, **given):
        found = look(path, **given)
        return os.stat_result([*found[:4], user, *found[5:]]) if str(path) == str(place) else found

    monkeypatch.setattr(os, "lstat", lstat)


SPOILED = [others_may_write, its_group_may_write, it_is_another_user_s, it_is_a_link]


@needs_compiler
@pytest.mark.parametrize("spoil", SPOILED)
def test_a_library_that_others_could_have_written_is_not_loaded(own_folder, spoil, monkeypatch, request):
    """Its content is what was compiled: nothing else speaks against it."""
    compiled(functions())
    (library,) = libraries(own_folder)
    spoil(library, monkeypatch)
    request.getfixturevalue("without_compiler")
    assert not any(is_machine_code(compiled(functions())).values())


@needs_compiler
@pytest.mark.parametrize("spoil", SPOILED)
def test_a_library_that_others_could_have_written_is_compiled_anew(own_folder, spoil, monkeypatch):
    compiled(functions())
    (library,) = libraries(own_folder)
    spoil(library, monkeypatch)
    before = os.stat(library, follow_symlinks=False)
    assert is_machine_code(compiled(functions()))["hessian"]
    found = os.stat(library, follow_symlinks=False)
    assert found.st_ino != before.st_ino and found.st_uid == os.geteuid() and stat.S_ISREG(found.st_mode)
    assert not found.st_mode & 0o022


@needs_compiler
def test_a_library_of_root_is_loaded(own_folder, monkeypatch, request):
    compiled(functions())
    (library,) = libraries(own_folder)
    owned_by(library, 0, monkeypatch)
    request.getfixturevalue("without_compiler")
    if os.geteuid() == 0:
        monkeypatch.setattr(os, "geteuid", lambda: 1)
    assert is_machine_code(compiled(functions()))["hessian"]


@needs_compiler
def test_a_library_is_kept_where_files_are_made_for_a_group_to_write(own_folder, request):
    before = os.umask(0o002)
    try:
        compiled(functions())
    finally:
        os.umask(before)
    request.getfixturevalue("without_compiler")
    assert is_machine_code(compiled(functions()))["hessian"]


@needs_compiler
def test_the_newest_libraries_are_kept(own_folder, monkeypatch):
    monkeypatch.setattr(module, "MOST_KEPT", 2)
    own_folder.mkdir(parents=True, mode=0o700)
    for age, name in enumerate(("new", "old", "older")):
        for file in (own_folder / f"{name}.so", own_folder / f"{name}.sha256"):
            file.touch()
            os.utime(file, (1e9 - age, 1e9 - age))
    compiled(functions())
    assert {file.stem for file in libraries(own_folder)} > {"new"}
    assert len(libraries(own_folder)) == len(list(own_folder.glob("*.sha256"))) == 2


# --- the folder -------------------------------------------------------------------------------------------


def test_the_folder_is_private(own_folder):
    assert folder() == str(own_folder)
    assert own_folder.stat().st_mode & 0o077 == 0


@needs_compiler
@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_folder_that_others_may_write_to_is_not_used(own_folder, mode):
    compiled(functions())
    (library,) = libraries(own_folder)
    own_folder.chmod(mode)
    assert folder() is None
    assert not any(is_machine_code(compiled(functions())).values())
    library.unlink()
    assert not any(is_machine_code(compiled(functions())).values())
    assert not libraries(own_folder)


def test_a_folder_of_another_user_is_not_used(own_folder, monkeypatch):
    own_folder.mkdir(parents=True, mode=0o700)
    owned_by(own_folder, os.geteuid() + 1, monkeypatch)
    assert folder() is None


def test_a_folder_that_is_a_link_is_not_used(own_folder, tmp_path):
    own_folder.parent.mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    own_folder.symlink_to(tmp_path / "elsewhere")
    assert folder() is None


@pytest.mark.parametrize("given", ["cache", ""])
def test_a_path_that_is_not_absolute_does_not_count_and_without_a_home_there_is_no_folder(
    given, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", given)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    assert folder() is None
    assert not any(is_machine_code(compiled(functions())).values())
    assert not list(tmp_path.iterdir())


def test_where_the_folder_cannot_be_made_functions_stay_as_they_are(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert folder() is None
    assert not any(is_machine_code(compiled(functions())).values())


def test_without_a_compiler_functions_stay_as_they_are(own_folder, without_compiler):
    problem = replace(load_problem("drone_hop").make(), duration=3.0)
    assert solve(problem, order=4, steps=20, compiled=True).success
    assert not any(own_folder.iterdir())
