"""The points of a sweep: a grid or a sample of a problem's parameters, and which points are neighbours."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from dmoc.basics.records import dataclass
from dmoc.scene.problem_file import Parameter, ProblemFile

# A sweep has at most this many points: with solves of 0.1 s they take a day of one core, and a typing error in
# a count is told before the work begins.
MOST_POINTS = 1_000_000
# With `follow`, a point starts from the answer of the one before it along the last axis, except every 8th,
# which starts from the problem's own guess: a wrong branch of local optima then spoils 8 points at most, and
# several runs of 8 points can be solved at the same time.
RUN = 8
# How a sample can be spread over its ranges.
SAMPLINGS = ("sobol", "latin")


@dataclass(frozen=True)
class Plan:
    """Every point of a sweep, numbered as in a C-ordered array.

    Attributes
    ----------
    parameters : tuple of Parameter
        Those that are swept.
    values : tuple of arrays
        One array a parameter: its values on the grid, or at every point of the sample.
    sampled : bool
    """

    parameters: tuple[Parameter, ...]
    values: tuple[np.ndarray, ...]
    sampled: bool

    @property
    def names(self) -> list[str]:
        return [parameter.name for parameter in self.parameters]

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the dimensions; a sample has one."""
        return (len(self.values[0]),) if self.sampled else tuple(len(values) for values in self.values)

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    def at(self, point: int) -> dict[str, Any]:
        """The values of the swept parameters at a point, as plain Python."""
        places = [point] * len(self.values) if self.sampled else map(int, np.unravel_index(point, self.shape))
        return {
            name: values[place].item() if isinstance(values[place], np.generic) else values[place]
            for name, values, place in zip(self.names, self.values, places, strict=True)
        }

    def neighbours(self, point: int) -> list[list[int]]:
        """The points next to a point: along each dimension of numbers, or the nearest in the sample."""
        if self.sampled:
            far = np.sum((self._cube - self._cube[point]) ** 2, axis=1)
            nearest = np.argsort(far, kind="stable")
            return [[int(other) for other in nearest if other != point][: 2 * len(self.values)]]
        # points are numbered as in a C-ordered array: a step along a dimension adds its stride to the number
        stride, found = self.size, []
        for length, values in zip(self.shape, self.values, strict=True):
            stride //= length
            place = point // stride % length
            if ordered(values):
                found.append([point + step * stride for step in (-1, 1) if 0 <= place + step < length])
        return found

    @cached_property
    def _cube(self) -> np.ndarray:
        """A sample as points of the unit cube."""
        spreads = [(values - values.min()) / (float(np.ptp(values)) or 1.0) for values in self.values]
        return np.stack(spreads, axis=1)

    def before(self, point: int) -> int | None:
        """The point that a point starts from with `follow`; None where a run begins."""
        return point - 1 if ordered(self.values[-1]) and point % self.shape[-1] % RUN else None

    def joined(self, point: int) -> list[int]:
        """The neighbour along the last dimension that belongs to another run."""
        if self.sampled or not ordered(self.values[-1]):
            return []
        return [other for other in self.neighbours(point)[-1] if max(other, point) % self.shape[-1] % RUN == 0]

    def listing(self) -> dict[str, list]:
        """The values by name, as JSON holds them."""
        return {name: values.tolist() for name, values in zip(self.names, self.values, strict=True)}


def make_plan(
    file: ProblemFile, vary: Mapping[str, Any], sample: int | None, method: str, seed: int, settings: Iterable
) -> Plan:
    """The points to solve.

    Raises
    ------
    ValueError
        If a name, a range or a value has no meaning for the problem.
    """
    if not vary:
        raise ValueError("nothing is varied; name a parameter, for example --vary duration=8:20:25")
    known = {parameter.name: parameter for parameter in file.parameters}
    for name in [*vary, *settings]:
        file.parameter(name)
    if both := set(vary) & set(settings):
        raise ValueError(f"{sorted(both)[0]} is both varied and set; do one of them")
    parameters = tuple(known[name] for name in vary)
    if sample is not None:
        return Plan(parameters, _sample(parameters, list(vary.values()), sample, method, seed), True)
    plan = Plan(parameters, tuple(_grid(p, vary[p.name]) for p in parameters), False)
    if plan.size > MOST_POINTS:
        raise ValueError(f"the grid has {plan.size} points; at most {MOST_POINTS} can be swept")
    return plan


def ordered(values: np.ndarray) -> bool:
    """Whether values are numbers, so that next to each other means something."""
    return values.dtype.kind in "if"


def parse_vary(texts: Iterable[str]) -> dict[str, str]:
    """Names and what they run over, from texts such as `duration=8:20:25`."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, values = (part.strip() for part in text.partition("="))
        if not (equals and values and name.isidentifier()):
            raise ValueError(
                f"--vary {text!r} is not of the form name=start:stop:count or name=value,value,..., "
                "for example --vary duration=8:20:25"
            )
        if name in found:
            raise ValueError(f"--vary gives {name!r} twice; give it once")
        found[name] = values
    return found


def _grid(parameter: Parameter, given: Any) -> np.ndarray:
    """The values of one axis: a text start:stop:count, start:stop:logcount or value,..., or any sequence."""
    name = parameter.name
    if not isinstance(given, str):
        values = list(given) if isinstance(given, Iterable) else [given]
    elif ":" in given and given.strip()[0] not in "'\"":
        numbers, log = _without_log(given)
        form = "start:stop:count, for example 8:20:25, or start:stop:logcount, for example 1:100:log7"
        start, stop, count = _numbers_of(name, numbers, 3, form, given)
        if count != int(count) or not 1 <= count <= MOST_POINTS:
            raise ValueError(f"{name}: the count in {given!r} must be a whole number of at least 1")
        if log:
            _check_positive(name, start, stop)
        values = (np.geomspace if log else np.linspace)(start, stop, int(count)).tolist()
    else:
        try:
            values = list(ast.literal_eval(f"({given},)"))
        except (ValueError, SyntaxError, MemoryError, RecursionError):
            raise ValueError(
                f"{name}: {given!r} is neither start:stop:count nor values with commas between"
            ) from None
    return _checked(parameter, values)


def _checked(parameter: Parameter, values: list) -> np.ndarray:
    """The values with the type of the parameter's default; numbers in order."""
    name, default = parameter.name, parameter.default
    values = [value.item() if isinstance(value, np.generic) else value for value in values]
    if not values:
        raise ValueError(f"{name} has no values to run over")
    texts = isinstance(default, str)
    if not (texts or default is None or isinstance(default, (int, float))):
        raise ValueError(f"{name} is a {type(default).__name__}; only numbers and texts can be varied")
    for value in values:
        good = isinstance(value, str) if texts else isinstance(value, (int, float)) and math.isfinite(value)
        if not good or isinstance(value, bool) != isinstance(default, bool):
            kind = "text" if texts else "bool" if isinstance(default, bool) else "finite number"
            raise ValueError(f"{name} must run over {kind}s, as its default {default!r} is; got {value!r}")
    if len(set(values)) < len(values):
        raise ValueError(f"{name} has the same value more than once; give each once")
    if texts:
        return np.array(values, object)
    whole = isinstance(default, int)
    if whole and any(value != int(value) for value in values):
        raise ValueError(f"{name} takes whole numbers, as its default {default!r} is; got {values!r:.60}")
    descending = values == sorted(values, reverse=True)
    in_order = values if descending else sorted(values)
    return np.array(in_order, bool if isinstance(default, bool) else int if whole else float)


def _sample(parameters: tuple, given: list, count: int, method: str, seed: int) -> tuple[np.ndarray, ...]:
    """Points spread over the ranges: one array a parameter, with its value at every point."""
    from scipy.stats import qmc

    if method not in SAMPLINGS:
        raise ValueError(f"the method must be {' or '.join(SAMPLINGS)}; got {method!r}")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_POINTS:
        raise ValueError(f"a sample must have 1 to {MOST_POINTS} points; got {count!r}")
    for parameter in parameters:
        if not (parameter.default is None or type(parameter.default) is float):
            raise ValueError(f"{parameter.name} takes no real numbers and cannot be sampled; use a grid")
    ranges = [_range(parameter.name, entry) for parameter, entry in zip(parameters, given, strict=True)]
    if method == "latin":
        unit = qmc.LatinHypercube(len(ranges), seed=seed).random(count)
    else:
        # Sobol points come in powers of two; the first `count` of the next larger one are spread as evenly
        unit = qmc.Sobol(len(ranges), seed=seed).random_base2((count - 1).bit_length())[:count]
    spread = [
        low * (high / low) ** u if log else low + u * (high - low)
        for u, (low, high, log) in zip(unit.T, ranges, strict=True)
    ]
    return tuple(np.ascontiguousarray(values) for values in spread)


def _without_log(text: str) -> tuple[str, bool]:
    """The numbers of a range whose last part begins with log, and whether it does."""
    before, colon, last = text.rpartition(":")
    if not last.strip().startswith("log"):
        return text, False
    count = last.strip().removeprefix("log")
    return f"{before}{colon}{count}" if count else before, True


def _check_positive(name: str, start: float, stop: float) -> None:
    if min(start, stop) <= 0:
        raise ValueError(f"{name}: a range with log must be of numbers above 0; got {start:g} to {stop:g}")


def _range(name: str, given: Any) -> tuple[float, float, bool]:
    log = False
    if isinstance(given, str):
        numbers, log = _without_log(given)
        form = "start:stop in a sample, for example 8:20 or 1:100:log"
        given = _numbers_of(name, numbers, 2, form, given)
    try:
        low, high = (float(value) for value in given)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: a sample needs a range (start, stop); got {given!r:.60}") from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ValueError(f"{name}: a range must go up between finite numbers; got {low:g} to {high:g}")
    if log:
        _check_positive(name, low, high)
    return low, high, log


def _numbers_of(name: str, text: str, count: int, form: str, given: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name}: {given!r} is not of the form {form}")
    return numbers
