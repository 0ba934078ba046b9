"""Report: one number, unit and limit for each check of a solution."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One verdict. `value` and `limit` are None where the check does not apply; `note` says why or what else."""

    name: str
    value: float | None
    limit: float | None
    unit: str
    ok: bool
    note: str = ""


@dataclass(frozen=True)
class Report:
    """The checks of one solution: residual, rollout, reference, ledger, bounds, optimality, stability."""

    checks: tuple[Check, ...]
    seconds: float

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def __getitem__(self, name: str) -> Check:
        return next(check for check in self.checks if check.name == name)
