"""The verb that copies a problem file to start one's own from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the new problem file, without .py.")],
    source: Annotated[
        str, typer.Option("--from", help="The problem to copy: a name (see dmoc list) or a path to a .py file.")
    ] = "free_flyer",
) -> None:
    """Copy a problem file into this folder, to change it there."""
    from dmoc.basics.files import whole_file
    from dmoc.reports import words as report
    from dmoc.scene.problem_file import find

    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise ValueError(
            f"{name!r} is no name for a problem file; give letters, digits and _, such as my_flight"
        )
    target = Path(f"{stem}.py")
    if target.exists():
        raise ValueError(f"{target} is there already; give another name, or remove it first")
    text = find(source).read_bytes()
    with whole_file(target) as temporary:
        Path(temporary).write_bytes(text)
    report.console().print(
        f"wrote {target}, a copy of {source}; change it, and solve it with: dmoc solve {target}"
    )
