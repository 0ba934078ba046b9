"""For the pages of the public names: griffe is told that `dmoc.basics.records.dataclass` is a dataclass."""

from __future__ import annotations

from typing import Any

import griffe


class Records(griffe.Extension):
    """Gives the decorator the name that it stands for, by which griffe finds the parameters of a class."""

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        for decorator in cls.decorators:
            called = getattr(decorator.value, "function", None)
            if called is not None and called.canonical_path == "dmoc.basics.records.dataclass":
                called.parent = "dataclasses"
                cls.labels.add("dataclass")
