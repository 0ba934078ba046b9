"""What a flight says of the numbers: values, intervals, correlations, and how well the equations fit it."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2, norm, t

from dmoc.basics.arguments import number
from dmoc.basics.files import as_path, whole_file
from dmoc.basics.plain import finite
from dmoc.identification.equations import residual_parts
from dmoc.identification.fit import Fit
from dmoc.identification.remarks import PART, on_fit, on_sight
from dmoc.identification.wanted import Wanted
from dmoc.results.outcome import shown

# Intervals hold a number with this probability [-].
SURE = 0.95
# Residuals are compared with so many drawn ones, by correlations over so many samples.
DRAWS, LAGS = 200, 10


@dataclass(frozen=True, repr=False)
class Estimate:
    """Numbers of a body as a flight tells them.

    Attributes
    ----------
    flight : Flight
    problem : TransferProblem
        The scene with the estimated numbers in it, from the begin of the flight to its end.
    wanted : tuple of Wanted
        The numbers that were asked for.
    noise : float
        Standard deviation of the positions [m]: as it was given, or as it was found.
    found_noise : bool
        Whether it was found.
    position, velocity : arrays, shape (samples, axes)
        Of the centre of mass along the estimated path [m], [m/s].
    force : array, shape (samples-1, controls)
        The forces that flew, as far as they can be told [N].
    mass : array, shape (samples,)
        Of the body; it falls where propellant burns [kg].
    success : bool
    message : str
        What went wrong, and what to try.
    seconds : float
        Time of the fit.
    """

    flight: Any
    problem: Any
    wanted: tuple[Wanted, ...]
    fit: Fit
    noise: float
    found_noise: bool
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    mass: np.ndarray
    sigmas_given: dict[str, float]
    success: bool
    message: str
    seconds: float

    @property
    def order(self) -> int:
        """Of the equations between the samples."""
        return self.fit.system.equations.setting.order

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(one.name for one in self.wanted)

    @cached_property
    def values(self) -> dict[str, float]:
        """The numbers by their names [SI]."""
        return {one.name: float(value) for one, value in zip(self.wanted, self._values, strict=True)}

    @property
    def _unknowns(self) -> np.ndarray:
        return self.fit.x[len(self.fit.x) - len(self.wanted) :]

    @property
    def _values(self) -> np.ndarray:
        return np.array(
            [1 / x if one.inverse else x for one, x in zip(self.wanted, self._unknowns, strict=True)]
        )

    @cached_property
    def _spread(self) -> np.ndarray:
        """Covariance of the unknowns of the fit; infinite where the flight does not see them."""
        scale = np.array([one.scale for one in self.wanted])
        hidden = self._hidden
        kept = np.flatnonzero(~hidden)
        found = np.full((len(scale), len(scale)), np.nan)
        if len(kept):
            factor = self.chi_squared / self.fit.degrees if self.found_noise and self.fit.degrees > 0 else 1.0
            inverse = factor * self.fit.covariance()
            found[np.ix_(kept, kept)] = (inverse * np.outer(scale, scale))[np.ix_(kept, kept)]
        found[hidden, hidden] = np.inf
        return found

    @cached_property
    def _hidden(self) -> np.ndarray:
        """Which numbers take part in a direction that the flight does not see."""
        return (
            (np.abs(self.fit.unseen) > PART).any(axis=1)
            if self.fit.unseen.size
            else np.zeros(len(self.wanted), bool)
        )

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the numbers in the order of `names` [SI]; infinite or NaN where the flight does not see them."""
        slopes = np.array(
            [-(v**2) if one.inverse else 1.0 for one, v in zip(self.wanted, self._values, strict=True)]
        )
        return self._spread * np.outer(slopes, slopes)

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviations by name."""
        return dict(zip(self.names, map(float, np.sqrt(np.diag(self.covariance))), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Correlations of the numbers in the order of `names`, shape (numbers, numbers)."""
        deviation = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            found = self.covariance / np.outer(deviation, deviation)
        np.fill_diagonal(found, 1.0)
        return found

    def interval(self, sure: float = SURE) -> dict[str, tuple[float, float]]:
        """Intervals that hold each number with a probability.

        Where noise was found from the flight itself, of Student's distribution. That of a mass is the interval
        of 1/m, in which the equations are linear.
        """
        level = 0.5 * (1 + number("sure", sure, "-", positive=True))
        if level >= 1:
            raise ValueError(f"an interval holds a number with a probability below 1; got {sure:g}")
        wide = float(t.ppf(level, max(self.fit.degrees, 1)) if self.found_noise else norm.ppf(level))
        found = {}
        for one, x, deviation in zip(self.wanted, self._unknowns, np.sqrt(np.diag(self._spread)), strict=True):
            low, high = x - wide * deviation, x + wide * deviation
            if one.inverse:
                low, high = 1 / high if np.isfinite(high) else 0.0, 1 / low if low > 0 else np.inf
            found[one.name] = (float(low), float(high))
        return found

    @cached_property
    def residuals(self) -> dict[str, np.ndarray]:
        """What is left of every kind of measurement, over its standard deviation, one row a sample."""
        return dict(residual_parts(self.fit.system.equations, self.fit.residuals))

    @property
    def chi_squared(self) -> float:
        """Sum of the squares of all residuals over their standard deviations."""
        return float(self.fit.residuals @ self.fit.residuals)

    @property
    def fitting(self) -> float:
        """Probability that errors of the stated size leave as much as is left, or more [-]."""
        return float(chi2.sf(self.chi_squared, max(self.fit.degrees, 1)))

    @cached_property
    def whiteness(self) -> float:
        """Probability that residuals of positions of a right model are as alike from sample to sample [-].

        Their correlations over up to ten samples, squared and added up (Ljung and Box 1978), against those of
        residuals that the same equations leave of independent errors, since a fit makes its residuals alike.
        """
        if not self.residuals:
            return 1.0
        system, kind = self.fit.system, next(iter(self.residuals))
        random = np.random.default_rng(0)
        drawn = random.standard_normal((len(self.fit.residuals), DRAWS))
        left = system.left_of(drawn)
        places = dict(system.equations.labels)[kind]
        alike = [_alike(left[places, i].T) for i in range(DRAWS)]
        mine = _alike(self.residuals[kind])
        return float((1 + np.sum(np.array(alike) >= mine)) / (1 + DRAWS))

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What a person should know before relying on the numbers, a sentence each."""
        return tuple([*on_sight(self), *on_fit(self)])

    def plot(self, path: str | os.PathLike | None = None, dark: bool = False) -> Any:
        """The figure: path and residuals, intervals, correlations; with a path, that file, dark if asked."""
        return shown("estimate")(self, path, dark)

    def save(self, path: str | os.PathLike) -> Path:
        """Write values, intervals and the fit as JSON, whole or not at all."""
        target = as_path(path)
        with whole_file(target) as work:
            Path(work).write_text(json.dumps(finite(self.as_object()), indent=2, allow_nan=False) + "\n")
        return target

    def as_object(self) -> dict[str, Any]:
        """For JSON."""
        spans, sigma = self.interval(), self.sigma
        return {
            "flight": self.flight.name,
            "samples": len(self.flight.times),
            "dropped": self.flight.dropped,
            "success": self.success,
            "message": self.message,
            "numbers": {
                one.name: {
                    "value": self.values[one.name],
                    "sigma": sigma[one.name],
                    "interval": list(spans[one.name]),
                    "unit": one.unit,
                    "believed": one.value,
                }
                for one in self.wanted
            },
            "correlation": self.correlation.tolist(),
            "noise": self.noise,
            "noise_found": self.found_noise,
            "chi_squared": self.chi_squared,
            "degrees_of_freedom": self.fit.degrees,
            "fitting": None if self.found_noise else self.fitting,
            "whiteness": self.whiteness,
            "remarks": list(self.remarks),
            "iterations": self.fit.steps,
            "seconds": self.seconds,
        }

    def lines(self) -> list[tuple[str, str, str, str]]:
        """Name, value, 95 % interval and unit of every number, as a table shows them."""
        found, spans = [], self.interval()
        for one in self.wanted:
            low, high = spans[one.name]
            seen = np.isfinite(self.sigma[one.name])
            value = told(self.values[one.name], (low, high)) if seen else "?"
            span = span_told(low, high) if seen else "not observable"
            found.append((one.name, value, span, one.unit or "-"))
        return found

    def __repr__(self) -> str:
        if not self.success:
            return f"Estimate of {self.flight.name!r}: failed, {self.message}"
        each = ", ".join(f"{name} {value} {unit} (95 %: {span})" for name, value, span, unit in self.lines())
        return f"Estimate of {self.flight.name!r}: {each}"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>" for line in self.lines()
        )
        head = "".join(f"<th>{name}</th>" for name in ("number", "value", "95 % interval", "unit"))
        said = "".join(
            f"<p>{escape(line)}</p>" for line in (*([] if self.success else [self.message]), *self.remarks)
        )
        return f"<table><tr>{head}</tr>{rows}</table>{said}"


def told(value: float, span: Sequence[float]) -> str:
    """A value with as many digits as its interval lets it have."""
    wide = span[1] - span[0]
    if not np.isfinite(wide) or wide <= 0:
        return f"{value:.4g}"
    size = max(abs(value), wide)
    return f"{value:.{min(max(2, int(np.ceil(np.log10(size / wide))) + 2), 12)}g}"


def span_told(low: float, high: float) -> str:
    if not np.isfinite(high - low):
        return f"from {low:.4g} on"
    wide = max(high - low, 1e-300)
    digits = min(max(3, int(np.ceil(np.log10(max(abs(low), abs(high), wide) / wide))) + 2), 12)
    return f"{low:.{digits}g} to {high:.{digits}g}"


def _alike(rows: np.ndarray) -> float:
    """Squared correlations of residuals over up to `LAGS` samples, added up over lags and axes."""
    total = 0.0
    for column in rows.T:
        square = float(column @ column) or 1.0
        for lag in range(1, min(LAGS, len(column) - 1) + 1):
            total += (float(column[:-lag] @ column[lag:]) / square) ** 2
    return total
