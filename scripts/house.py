"""The architecture of a package in numbers: sizes, imports, who asks for which part, names, words.

    ./scripts/run python scripts/house.py                    # of dmoc, as it stands beside this script
    ./scripts/run python scripts/house.py FOLDER --names     # of another, with what is behind the counts

Functions are counted without docstrings, folders without `__init__.py`. A part is a class that derives
from one of ROOTS and is not abstract, at home in its own file and in the folders HOMES: everything else
should ask it what it does, not what it is.
"""

import argparse
import ast
import io
import tokenize
from collections import defaultdict
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

ROOTS = {"Constraint", "Actuator", "Objective", "Boundary", "Effect", "Conservative", "Force"}
HOMES = {"scene", "ends", "effects", "parts"}
FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)


class File(NamedTuple):
    path: Path  # below the package
    module: str
    text: str
    tree: ast.Module
    lines: int


def read(root: Path) -> list[File]:
    """All Python files of a package."""
    found = []
    for file in sorted(root.rglob("*.py")):
        path, text = file.relative_to(root), file.read_text(encoding="utf-8")
        module = ".".join([root.name, *path.with_suffix("").parts]).removesuffix(".__init__")
        found.append(File(path, module, text, ast.parse(text), len(text.splitlines())))
    return found


def folders(files: list[File]) -> dict[str, tuple[int, int]]:
    """Lines and files of each folder."""
    held = defaultdict(list)
    for file in files:
        if file.path.name != "__init__.py":
            held[str(file.path.parent)].append(file.lines)
    return {folder: (sum(lines), len(lines)) for folder, lines in held.items()}


def height(node: Any) -> int:
    return node.end_lineno - node.lineno + 1


def docstring(node: Any) -> int:
    """Lines of the docstring that a module, class or function has."""
    has = isinstance(node, (ast.Module, ast.ClassDef, *FUNCTION)) and ast.get_docstring(node) is not None
    return height(node.body[0]) if has else 0


def functions(files: list[File]) -> dict[str, int]:
    """Lines of each function and method."""
    nodes = [(file, node) for file in files for node in ast.walk(file.tree) if isinstance(node, FUNCTION)]
    return {f"{file.path}:{node.lineno} {node.name}": height(node) - docstring(node) for file, node in nodes}


def imports(files: list[File]) -> dict[str, set[str]]:
    """The modules each module imports, at its top or within functions; the package's front is left out."""
    modules, graph = {file.module for file in files if "." in file.module}, {}
    for file in files:
        named = {name if name in modules else name.rpartition(".")[0] for name in imported(file)}
        graph[file.module] = named & modules - {file.module}
    return {module: graph[module] for module in sorted(modules)}


def imported(file: File) -> list[str]:
    """Full names; imports are absolute throughout."""
    nodes = [node for node in ast.walk(file.tree) if isinstance(node, (ast.Import, ast.ImportFrom))]
    above = [f"{node.module}." if isinstance(node, ast.ImportFrom) else "" for node in nodes]
    return [place + alias.name for place, node in zip(above, nodes, strict=True) for alias in node.names]


def circles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """Groups of modules that all reach each other."""
    reach = {module: set(needs) for module, needs in graph.items()}
    for between in graph:
        for needs in reach.values():
            needs |= reach[between] if between in needs else set()
    return {frozenset(other for other in reach[one] if one in reach[other]) for one in graph} - {frozenset()}


def chain(graph: dict[str, set[str]]) -> list[str]:
    """The longest row of modules of which each needs the next; a circle counts with all its modules."""
    circle = {module: group for group in circles(graph) for module in group}

    @cache
    def down(module: str) -> list[str]:
        group = circle.get(module, frozenset([module]))
        below = [down(other) for one in group for other in sorted(graph[one] - group)]
        return [module, *sorted(group - {module}), *max(below, key=len, default=[])]

    return max(map(down, graph), key=len, default=[])


def words(*nodes: Any) -> set[str]:
    """Names and attributes that expressions mention."""
    return {getattr(n, "id", getattr(n, "attr", "")) for node in nodes for n in ast.walk(node)} - {""}


def parts(files: list[File]) -> dict[str, set[Path]]:
    """Where each part is defined."""
    classes = [(f.path, node) for f in files for node in ast.walk(f.tree) if isinstance(node, ast.ClassDef)]
    derived = set(ROOTS)
    for _ in range(9):  # generations
        derived |= {node.name for _, node in classes if words(*node.bases) & derived}
    found = defaultdict(set)
    for path, node in classes:
        if node.name in derived - ROOTS and "ABC" not in words(*node.bases):
            found[node.name].add(path)
    return found


def asked(node: Any) -> set[str]:
    """The classes that isinstance, issubclass or a `case` asks for."""
    test = isinstance(node, ast.Call) and words(node.func) & {"isinstance", "issubclass"}
    return words(*node.args[1:]) if test else words(node.cls) if isinstance(node, ast.MatchClass) else set()


def strangers(files: list[File]) -> list[str]:
    """Places away from home that ask whether something is a certain part."""
    homes, found = parts(files), []
    for file in files:
        away = {name for name, paths in homes.items() if file.path not in paths}
        nodes: list[Any] = [] if file.path.parts[0] in HOMES else [*ast.walk(file.tree)]
        known = sorted((node.lineno, *sorted(asked(node) & away)) for node in nodes if asked(node) & away)
        found += [f"{file.path}:{line} {', '.join(names)}" for line, *names in known]
    return found


def shared(files: list[File]) -> dict[str, list[str]]:
    """Names defined at the top of more than one module, and these modules."""
    found = defaultdict(set)
    for file in files:
        for node in file.tree.body:
            targets = getattr(node, "targets", None) or filter(None, [getattr(node, "target", None)])
            inside = [one for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
            for name in {
                getattr(node, "name", "__"),
                *(one.id for one in inside if isinstance(one.ctx, ast.Store)),
            }:
                found[name].add(file.module)
    return {n: sorted(m) for n, m in sorted(found.items()) if len(m) > 1 and not n.startswith("__")}


def comments(file: File) -> int:
    """Lines with a comment, at their end or as a whole."""
    tokens = tokenize.generate_tokens(io.StringIO(file.text).readline)
    return sum(token.type == tokenize.COMMENT for token in tokens)


def table(files: list[File]) -> dict[str, str]:
    """What is counted, and the count."""
    lines, sizes, lengths = sum(file.lines for file in files), folders(files), functions(files)
    by_lines, by_files = (max(sizes, key=lambda folder: sizes[folder][i]) for i in (0, 1))
    largest, longest = max(files, key=lambda file: file.lines), max(lengths, key=lambda name: lengths[name])
    graph, names, places = imports(files), shared(files), strangers(files)
    row, most = chain(graph), sorted(lengths.values())[int(0.9 * len(lengths))]
    told = sum(docstring(node) for file in files for node in ast.walk(file.tree))
    return {
        "files, lines, folders": f"{len(files)}, {lines:,}, {len(sizes)}",
        "folder of most lines": f"{sizes[by_lines][0]:,} ({by_lines}, {sizes[by_lines][1]} files)",
        "folder of most files": f"{sizes[by_files][1]} ({by_files}, {sizes[by_files][0]:,} lines)",
        "largest file": f"{largest.lines} ({largest.path})",
        "lines of a function": f"median {median(lengths.values()):g}, 90 % up to {most}, "
        f"longest {lengths[longest]} ({longest})",
        "longest chain of imports": f"{len(row)} files ({row[0]} ... {row[-1]})",
        "circles of imports": f"{len(circles(graph))}",
        "isinstance tests on parts": f"{len(places)} away from home, in "
        f"{len({place.partition(':')[0] for place in places})} files",
        "names in several modules": f"{len(names)}, {sum(not n.startswith('_') for n in names)} of them public",
        "comments, docstrings": f"{sum(map(comments, files)) / lines:.1%}, {told / lines:.1%} of lines",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parents[1] / "dmoc")
    parser.add_argument("--names", action="store_true", help="also list what is behind the counts")
    files = read((given := parser.parse_args()).folder.resolve()) or parser.error("no Python files there")
    print(*(f"{what:30}{count}" for what, count in table(files).items()), sep="\n")
    if given.names:
        shown = [f"{name}: {', '.join(modules)}" for name, modules in shared(files).items()]
        print("", *shown, "", *strangers(files), "", " > ".join(chain(imports(files))), sep="\n")


if __name__ == "__main__":
    main()
