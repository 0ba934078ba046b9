"""What checks find: a verdict each, and all those of one solution."""

from __future__ import annotations

from dmoc.basics.records import dataclass


@dataclass(frozen=True)
class Check:
    """One verdict. `value` and `limit` are None where the check does not apply; `note` says why."""

    name: str
    value: float | None
    limit: float | None
    unit: str
    ok: bool
    note: str = ""

    @classmethod
    def of(cls, name: str, value: float, limit: float, unit: str, note: str = "") -> Check:
        """A verdict that holds up to the limit; a value which is not a number never passes."""
        return cls(name, float(value), float(limit), unit, bool(value <= limit), note)


@dataclass(frozen=True)
class Report:
    """The checks of one solution: those of `verify`, then those of the user's own."""

    checks: tuple[Check, ...]
    seconds: float

    def __repr__(self) -> str:
        """Whether they hold; else which do not, with value and limit."""
        broken = [check for check in self.checks if not check.ok]
        if not broken:
            return f"Report: all {len(self.checks)} checks hold"
        told = [f"{one.name} {_number(one.value)} {one.unit}, limit {_number(one.limit)}" for one in broken]
        return f"Report: {len(broken)} of {len(self.checks)} checks fail: {'; '.join(told)}"

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def __getitem__(self, name: str) -> Check:
        return next(check for check in self.checks if check.name == name)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
