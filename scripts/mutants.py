"""Break the mechanics, the checks and the nonlinear programme in one place at a time: does a test fail?

    ./scripts/run python scripts/mutants.py calls FILE              # which test calls what, half an hour
    ./scripts/run python scripts/mutants.py run FILE --count 120    # a sample, up to 90 s each

A mutant swaps an operator or a comparison, changes a number, turns a condition round or leaves out a minus. It
is judged by tests that call the function it is in, those of its own folder first, then the quickest, until a
test fails. The sample is the same for the same seed and the same code. All of it happens in a copy. What
survives is printed at the end: each is either a missing test or another way to write the same.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# What is broken, and the tests that may notice.
FOLDERS = ("motion", "checks", "nlp")
TESTS = (
    *(
        "checks",
        "motion",
        "nlp",
        "verification",
        "results",
        "bodies",
        "solver",
        "links",
        "missions",
        "diagnosis",
    ),
    *(
        "exports",
        "effects",
        "scene",
        "guess",
        "rungs",
        "meshes",
        "parts",
        "sensitivity",
        "teams",
        "structure",
        "identification",
    ),
)
# A mutant is judged by tests that take so many seconds in all, and is dead if they take more than the second.
ENOUGH, TOO_LONG = 40.0, 90.0
SWAPPED: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
PYTEST = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist")
PYTEST = (*PYTEST, "-o", "addopts=--import-mode=importlib", "-m", "not slow", "--tb=no")

_called: set[tuple[str, int]] = set()
_known: dict[object, tuple[str, int] | None] = {}


def _trace(frame, event, arg):
    code = frame.f_code
    if code not in _known:
        file = Path(code.co_filename)
        watched = file.parent.name in FOLDERS and file.parent.parent.name == "dmoc"
        _known[code] = (f"{file.parent.name}/{file.name}", code.co_firstlineno) if watched else None
    if _known[code]:
        _called.add(_known[code])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item, nextitem):
    """As a plugin of pytest: note the functions that a test calls, and its time."""
    _called.clear()
    begun = time.process_time()
    sys.settrace(_trace)
    try:
        return (yield)
    finally:
        sys.settrace(None)
        with open(os.environ["DMOC_CALLS"], "a") as file:
            taken = round(time.process_time() - begun, 3)
            file.write(json.dumps([item.nodeid, taken, sorted(_called)]) + "\n")


def environment(folder: Path, **more: str) -> dict[str, str]:
    paths = os.pathsep.join(map(str, (folder, folder / "scripts")))
    return os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"} | more


def gather(file: Path) -> None:
    """Write which of all tests calls which function."""
    file.unlink(missing_ok=True)
    tests = [f"tests/{name}" for name in TESTS]
    env = environment(ROOT, DMOC_CALLS=str(file.resolve()))
    subprocess.run([*PYTEST, "-p", "mutants", *tests], cwd=ROOT, env=env, check=False)


def sites(tree: ast.AST) -> Iterator[ast.AST]:
    """The places of a module that can be broken; not in annotations and messages."""
    spared: set[int] = set()
    for node in ast.walk(tree):
        parts = [getattr(node, name, None) for name in ("annotation", "returns")]
        parts += [node] if isinstance(node, ast.Raise | ast.JoinedStr) else []
        spared |= {id(inner) for part in parts if part is not None for inner in ast.walk(part)}
    for node in ast.walk(tree):
        if id(node) in spared:
            continue
        if (
            (isinstance(node, ast.BinOp) and type(node.op) in SWAPPED)
            or isinstance(node, ast.BoolOp | ast.If | ast.IfExp)
            or (isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPPED)
            or (isinstance(node, ast.Constant) and type(node.value) in (int, float, bool))
            or (isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not))
        ):
            yield node


def break_at(node: ast.AST) -> None:
    """Break a place: another operator or number, the other case."""
    if isinstance(node, ast.BinOp | ast.BoolOp):
        node.op = SWAPPED[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = SWAPPED[type(node.ops[0])]()
    elif isinstance(node, ast.If | ast.IfExp):
        node.test = ast.UnaryOp(ast.Not(), node.test)
    elif isinstance(node, ast.UnaryOp):
        node.op, node.operand = (
            (ast.UAdd(), node.operand)
            if isinstance(node.op, ast.USub)
            else (ast.Not(), ast.UnaryOp(ast.Not(), node.operand))
        )
    elif isinstance(node, ast.Constant):
        value = node.value
        node.value = (
            not value
            if isinstance(value, bool)
            else value + 1
            if isinstance(value, int)
            else value * 1.5 or 1.0
        )


def judges(calls: list, file: str, tree: ast.AST, line: int) -> list[str]:
    """The tests that call the function of a line: those of its folder first, then the quickest."""
    kinds = ast.FunctionDef | ast.Lambda
    around = [n for n in ast.walk(tree) if isinstance(n, kinds) and n.lineno <= line <= (n.end_lineno or 0)]
    firsts = {min([n.lineno, *(d.lineno for d in getattr(n, "decorator_list", ()))]) for n in around}
    hits = [
        (f"tests/{file.split('/')[0]}/" not in name, taken, name)
        for name, taken, called in calls
        if any(where == file and (not firsts or at in firsts) for where, at in called)
    ]
    chosen, spent = [], 0.0
    for _, taken, name in sorted(hits):
        if spent + taken <= ENOUGH:
            chosen.append(name)
            spent += taken
    return chosen


def run(calls_file: Path, seed: int, count: int, until: str) -> None:
    """Judge a sample, and print the share that dies and what survives."""
    calls = [json.loads(line) for line in calls_file.read_text().splitlines()]
    with tempfile.TemporaryDirectory() as made:
        copy = Path(made) / "dmoc"
        kept = shutil.ignore_patterns(".git", ".venv", "__pycache__", "site")
        shutil.copytree(ROOT, copy, ignore=kept)
        files = [one for name in FOLDERS for one in sorted((copy / "dmoc" / name).glob("[!_]*.py"))]
        places = [(file, i) for file in files for i, _ in enumerate(sites(ast.parse(file.read_text())))]
        chosen = random.Random(seed).sample(places, min(count, len(places)))
        print(f"{len(places)} places, {len(chosen)} chosen", flush=True)
        alive, tried = [], 0
        for file, i in chosen:
            if until and time.strftime("%H:%M") >= until:
                break
            text = file.read_text()
            tree = ast.parse(text)
            node = list(sites(tree))[i]
            line, name = node.lineno, f"{file.parent.name}/{file.name}"  # type: ignore[attr-defined]
            tests = judges(calls, name, tree, line)
            before = ast.unparse(node)
            break_at(node)
            told = f"{name}:{line} {before[:50]!r} -> {ast.unparse(node)[:50]!r}"
            told += f": {text.splitlines()[line - 1].strip()}"
            file.write_text(ast.unparse(ast.fix_missing_locations(tree)))
            verdict = judged(copy, tests)
            file.write_text(text)
            tried += 1
            print(f"{tried:4} {verdict:9} {told}", flush=True)
            if verdict in ("survives", "no test"):
                alive.append(told)
    dead = tried - len(alive)
    print(f"seed {seed}: {dead} of {tried} die, {100 * dead / max(tried, 1):.0f} %; these survive:")
    print("\n".join(alive))


def judged(copy: Path, tests: list[str]) -> str:
    """Whether a test fails in the copy."""
    if not tests:
        return "no test"
    try:
        done = subprocess.run(
            [*PYTEST, "-x", *tests], cwd=copy, env=environment(copy), capture_output=True, timeout=TOO_LONG
        )
    except subprocess.TimeoutExpired:
        return "too long"
    return "dies" if done.returncode else "survives"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("do", choices=("calls", "run"))
    parser.add_argument("file", type=Path, help="what calls what, written by the first command")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=120)
    parser.add_argument("--until", default="", help="HH:MM at which to stop")
    asked = parser.parse_args()
    if asked.do == "calls":
        gather(asked.file)
    else:
        run(asked.file, asked.seed, asked.count, asked.until)
