"""Functions as machine code: the same answer, and nothing that others could have written is ever loaded."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from dmoc import solve
from dmoc.basics.compiled import compiled
from dmoc.basics.memory import forget
from dmoc.nlp.stencils import stencils_of
from dmoc.scene.problem_file import load_problem

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
BROKEN = "#!/bin/sh\nexit 1\n"


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Libraries of one test, and no functions kept from another."""
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


@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_folder_that_others_may_write_to_is_not_used(own_folder, mode):
    own_folder.mkdir(parents=True)
    own_folder.chmod(mode)
    assert not any(is_machine_code(compiled(functions())).values())
    assert not libraries(own_folder)


def test_without_a_compiler_functions_stay_as_they_are(own_folder, without_compiler):
    problem = replace(load_problem("drone_hop").make(), duration=3.0)
    assert solve(problem, order=4, steps=20, compiled=True).success
    assert not any(own_folder.iterdir())
