"""The problem of an answer that was saved: looked up by the name that its file holds.

The name in a file is only ever looked up in the problem folders, or taken for the very file of this name in
the working folder that it was made from: a file must not choose what is run.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dmoc.scene.problem_file import ProblemFile, find, has_problem, load_problem


def attached_as_named(solution: Any) -> Any:
    """A solution that was loaded, with the problem that it names, if its file still has the hash.

    Raises
    ------
    ValueError
        If it names none, or the problem file is another one today: that is not run.
    """
    known = solution.provenance
    source = named(known.problem_name, known.source_hash) if known.source_hash else None
    if source is None:
        solution.require_problem()  # says that there is none, and what to do
    path = find(str(source))
    if _has_hash(path, known.source_hash):
        return attached_from(load_problem(str(source)), solution)
    raise ValueError(
        f"this solution was loaded from a file and does not hold its problem {known.problem_name!r}, and "
        f"{path} is no longer what it was made from; use solution.attach(problem) first"
    )


def attached_from(file: ProblemFile, solution: Any) -> Any:
    """A solution with the problem that a problem file makes of its parameters."""
    made = file.make(**solution.provenance.parameters)
    return solution.attach(getattr(made, "alone", None) or made)


def named(name: str, source_hash: str) -> str | None:
    """What a saved solution names: the file with its hash in the working folder, else one of the folders'."""
    here = Path(f"{name}.py")
    known = bool(source_hash) and here.name == f"{name}.py" and here.is_file()
    if known and _has_hash(here, source_hash):
        return str(here)
    return name if name.isidentifier() and has_problem(name) else None


def _has_hash(path: Path, source_hash: str) -> bool:
    import hashlib

    return hashlib.sha256(path.read_bytes()).hexdigest() == source_hash
