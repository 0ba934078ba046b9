"""Problem files: found by name, read, and made into transfer problems, missions and teams.

A problem file is Python with one function `problem(**parameters)`, all of whose parameters have defaults,
that returns one. Its docstring documents them as `name : type [unit]`.
"""

from __future__ import annotations

import ast
import inspect
import linecache
import sys
import traceback
from collections.abc import Callable, Iterable
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from dmoc.basics.docstrings import documented, first_line
from dmoc.basics.plain import meant, unbroken
from dmoc.basics.records import dataclass

if TYPE_CHECKING:
    from dmoc.scene.problem import TransferProblem

# A problem file defines a function of this name, which makes the problem.
FUNCTION = "problem"
# The module of a problem file is named by this and the file's own name, which tracebacks are searched for.
MODULE = "dmoc_problem_"
# After so many letters a line of a user's file and the message of its error are cut off.
MOST_QUOTED, MOST_TOLD = 160, 400


@dataclass(frozen=True)
class Parameter:
    """A parameter of a problem file, with the unit and the description in the docstring."""

    name: str
    default: Any
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class ProblemFile:
    """A problem file that was read.

    Attributes
    ----------
    name : str
        The file's name without `.py`.
    parameters : tuple of Parameter
        The keyword defaults of its function.
    source : bytes
        The file as it was read.
    """

    name: str
    path: Path
    docstring: str
    parameters: tuple[Parameter, ...]
    source: bytes = field(repr=False)
    function: Callable[..., Any] = field(repr=False, compare=False)

    @cached_property
    def source_hash(self) -> str:
        """SHA-256 of the file."""
        import hashlib

        return hashlib.sha256(self.source).hexdigest()

    def make(self, **values: Any) -> TransferProblem:
        """The transfer problem, with these values in place of the defaults.

        Raises
        ------
        ValueError
            If there is no such parameter, a value has another type than the default, or the file fails.
        """
        from dmoc.scene.problem import TransferProblem

        for name, value in values.items():
            _check_type(name, value, self.parameter(name).default)
        made = _guarded(self.path, lambda: self.function(**values))
        known = isinstance(made, TransferProblem) or hasattr(made, "joints") or hasattr(made, "together")
        if not known or isinstance(made, type):  # a class has the attributes of its objects
            wanted = f"{FUNCTION}() must return a dmoc.TransferProblem, a dmoc.Mission or a dmoc.Team"
            raise ValueError(f"{self.path}: {wanted}; it returned {_short(made)}")
        made = replace(made, name=self.name, parameters={p.name: p.default for p in self.parameters} | values)
        return getattr(made, "alone", None) or made

    def parameter(self, name: str) -> Parameter:
        """The parameter of this name; ValueError if there is none."""
        known = {parameter.name: parameter for parameter in self.parameters}
        if name in known:
            return known[name]
        listing = ", ".join(known) or "none"
        raise ValueError(f"{self.name} has no parameter {name!r}{meant(name, known)}; it has: {listing}")


def folders() -> list[Path]:
    """Where names are looked for: `./problems`, then inside the package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "problems"
    return [Path("problems"), inside if inside.is_dir() else package.parent / "problems"]


def catalogue() -> list[tuple[str, str]]:
    """(name, first line of the docstring) of every problem file, without running any."""
    found: dict[str, str] = {}
    for path in _files():
        if path.stem not in found:
            found[path.stem] = _summary(path)
    return sorted(found.items())


def has_problem(name: str) -> bool:
    """Whether one of the problem folders has a file of this name."""
    return any(path.stem == name for path in _files())


def find(name: str) -> Path:
    """The problem file for a name or a path.

    Raises
    ------
    ValueError
        If there is none.
    """
    if name.endswith(".py") or "/" in name:
        from dmoc.basics.files import as_path

        path = as_path(name)
        if not path.is_file():
            raise ValueError(f"there is no problem file {name}; give a path to a .py file or a name")
        return path
    paths = {path.stem: path for path in reversed(_files())}
    if name in paths:
        return paths[name]
    hint = meant(name, paths) or f"; there are: {', '.join(sorted(paths)) or 'none'}"
    raise ValueError(f"there is no problem {name!r}{hint}; dmoc list shows all, or give a path to a .py file")


def load_problem(name: str) -> ProblemFile:
    """Read and run a problem file, given by name or path.

    Raises
    ------
    ValueError
        If it is not there, fails, or has no function `problem` with defaults for all its parameters.
    """
    path = find(str(name))
    source = _read(path)
    module = _guarded(path, lambda: _run(path, source))
    function = getattr(module, FUNCTION, None)
    if not callable(function):
        raise ValueError(f"{path} has no function {FUNCTION}(); add one that returns a dmoc.TransferProblem")
    entries = documented(inspect.getdoc(function))
    parameters = []
    for name, given in _guarded(path, lambda: inspect.signature(function)).parameters.items():
        if given.default is inspect.Parameter.empty:
            raise ValueError(f"{path}: parameter {name!r} of {FUNCTION}() has no default; give it one")
        unit, description = (entries[name].unit, entries[name].description) if name in entries else ("", "")
        parameters.append(Parameter(name, given.default, unit, description))
    docstring = inspect.getdoc(module) or inspect.getdoc(function) or ""
    return ProblemFile(path.stem, path, docstring, tuple(parameters), source, function)


def parse_settings(settings: Iterable[str], option: str = "--set") -> dict[str, Any]:
    """Values from texts such as `mass=2.5` or `goal=(8, 1, 1)`, parsed as Python literals.

    Raises
    ------
    ValueError
        If a text is not of this form.
    """
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        name = name.strip()
        if not equals or not name.isidentifier():
            raise ValueError(f"{option} {setting!r} is not of the form name=value, as in {option} mass=2.5")
        if name in values:
            raise ValueError(f"{option} gives {name!r} twice; give it once")
        try:
            values[name] = ast.literal_eval(text.strip())
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
            raise ValueError(
                f"{option} {name}: {_short(text)} is not a Python literal; write a number without a unit "
                "(2.5), a tuple ('(8, 1, 1)'), True, None or a quoted text"
            ) from None
    return values


def _files() -> list[Path]:
    """All problem files, in the order in which a name is looked for."""
    return [
        path
        for folder in folders()
        for path in sorted(folder.glob("*.py"))
        if path.stem.isidentifier() and not path.stem.startswith("_") and path.is_file()
    ]


def _summary(path: Path) -> str:
    try:
        tree = ast.parse(_read(path))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        return f"(not valid Python: {_one_line(error)})"
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == FUNCTION]
    if not functions:
        return f"(has no function {FUNCTION})"
    return first_line(ast.get_docstring(tree) or ast.get_docstring(functions[0]))


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}; see who may read it") from None


def _run(path: Path, source: bytes) -> ModuleType:
    # Dataclasses and pickle look a class's module up by name, so it must be known before its code runs.
    module = ModuleType(f"{MODULE}{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    # A traceback must show the lines of the file as it is now, not as it was when it was read before.
    linecache.checkcache(str(path))
    exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    return module


def _guarded(path: Path, call: Callable[[], Any]) -> Any:
    """The result of a user's code; its exceptions become a ValueError of one line, with the user's line."""
    try:
        return call()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # `exit()` in a file is one of these
        number, text = _user_line(path, error)
        where = f"{path}, line {number} ({text})" if text else f"{path}, line {number}"
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        raise ValueError(f"{where}: {kind}{_one_line(error)}") from error


def users_line(error: BaseException) -> str:
    """` (FILE, line N: TEXT)` for an exception from a problem file that it does not name; else empty."""
    begun: BaseException | None = error
    while begun is not None:
        for frame in reversed(traceback.extract_tb(begun.__traceback__)):
            module = sys.modules.get(f"{MODULE}{Path(frame.filename).stem}")
            known = module is not None and module.__file__ == frame.filename
            if known and frame.filename not in str(error):
                return f" ({frame.filename}, line {frame.lineno}: {frame.line})"
        begun = begun.__cause__
    return ""


def _user_line(path: Path, error: BaseException) -> tuple[int, str]:
    """Number and text of the line of the problem file where an exception came from."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return error.lineno or 1, _cut(error.text or "")
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    # The first line of a call over several lines ends with a parenthesis that is closed in a later one.
    return (frames[-1].lineno or 1, _cut(frames[-1].line or "").rstrip("(")) if frames else (1, "")


def _check_type(name: str, value: Any, default: Any) -> None:
    """ValueError unless a value could stand where the default stands; a default of None takes anything."""
    if default is None:
        return
    kinds: tuple[type, ...] = (type(default),)
    if isinstance(default, float):
        kinds = (int, float)
    elif isinstance(default, (tuple, list)):
        kinds = (tuple, list)
    # To Python True is a whole number, but True given for a mass is a mistake.
    wrong_bool = isinstance(value, bool) and not isinstance(default, bool)
    if wrong_bool or not isinstance(value, kinds):
        raise ValueError(
            f"{name} must be of type {type(default).__name__} like its default {_short(default)}; "
            f"got {_short(value)}"
        )


def _short(value: Any) -> str:
    return _cut(repr(value), 60)


def _one_line(error: BaseException) -> str:
    return _cut(getattr(error, "msg", "") or str(error), MOST_TOLD) or type(error).__name__


def _cut(text: str, most: int = MOST_QUOTED) -> str:
    """A text on one line that is not too long."""
    text = unbroken(text)
    return text if len(text) <= most else f"{text[: most - 3]}..."
