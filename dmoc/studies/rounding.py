"""What rounding does to a march of many steps, and what steps beyond the limit of stability do."""

from __future__ import annotations

from dataclasses import field

import casadi as ca
import numpy as np

from dmoc.basics.arguments import number
from dmoc.basics.records import dataclass
from dmoc.effects.gravity import PointGravity, Spring
from dmoc.ends.base import State
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.march import simulate
from dmoc.scene.problem import TransferProblem
from dmoc.studies.drift import step_function

# The circular orbit on which rounding is measured takes this many steps a revolution. Its radius, rate and mu
# are 1.
STEPS_A_REVOLUTION = 1000
# Three ways to march equation (16), which differ in rounding alone; `round_off` says what each adds up.
FORMS = ("two-step form", "displacements", "compensated")
# The methods whose one-step matrix is looked at, as `step_function` calls them.
AMPLIFIED = ("order 2", "order 4", "order 6", "order 8", "RK4", "DOP853")
# The one-step matrices are computed at these values of h omega [-], 4e-4 apart up to 8: the narrowest unstable
# interval, the first one of order 8, is 1e-3 wide and must not fall between two of them.
H_OMEGA = np.arange(1, 20_001) * 4e-4
# A method counts as unstable where a step enlarges the oscillation by more than this factor [-]. Where two
# eigenvalues meet on the unit circle, rounding of 1e-16 moves them by its square root or more, 1e-8.
GROWS = 1 + 1e-6
# A history of rounding has at most this many points, evenly spaced on a logarithmic axis.
POINTS = 200


@dataclass(frozen=True)
class RoundOff:
    """One way to march equation (16) along a circular orbit, where all errors are those of rounding.

    Attributes
    ----------
    form : str
    steps : array, shape (count,)
    momentum_error : array, shape (count,)
        Largest relative error of the angular momentum in the first `steps` steps [-].
    miss : float
        Distance from the compensated march at the end, in radii [-].
    """

    form: str
    steps: np.ndarray = field(repr=False)
    momentum_error: np.ndarray = field(repr=False)
    miss: float


@dataclass(frozen=True)
class Amplification:
    """By how much one step of a method enlarges an oscillation at most.

    Attributes
    ----------
    method : str
    reach : array, shape (count,)
        h omega, the step times the rate of the oscillator [-].
    growth : array, shape (count,)
        Spectral radius of the one-step matrix: 1 is stable, less loses energy [-].
    """

    method: str
    reach: np.ndarray = field(repr=False)
    growth: np.ndarray = field(repr=False)

    @property
    def gaps(self) -> list[tuple[float, float, float]]:
        """Intervals in which the method is unstable: from h omega, to h omega, largest growth a step."""
        grows = np.concatenate([[False], self.growth > GROWS, [False]])
        # an interval begins where `grows` turns True and ends where it turns False
        edges = np.flatnonzero(np.diff(grows))
        return [
            (float(self.reach[a]), float(self.reach[b - 1]), float(self.growth[a:b].max()))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]


def round_off(steps: int = 1_000_000) -> list[RoundOff]:
    """March a circular orbit by the three forms of equation (16), 1,000 steps a revolution.

    The two-step form is x_{k+1} = 2 x_k - x_{k-1} + h^2 a_k, as the equation suggests; dmoc adds
    displacements to positions and impulses to momenta, if asked with Kahan's compensated sums.

    Raises
    ------
    ValueError
        If there are fewer than 1,000 steps.
    """
    if number("steps", steps, "-") != int(steps) or steps < STEPS_A_REVOLUTION:
        raise ValueError(f"steps must be a whole number of at least {STEPS_A_REVOLUTION}; got {steps:g}")
    here = State((1, 0), (0, 1))
    duration = 2 * np.pi * steps / STEPS_A_REVOLUTION
    problem = TransferProblem(1.0, here, here, duration, effects=(PointGravity(1.0),))
    plain, exact = (simulate(problem, steps=steps, compensated=flag) for flag in (False, True))
    at = np.unique(np.geomspace(10, steps, POINTS).astype(int))
    paths = {
        FORMS[0]: two_step(steps),
        **{
            form: (found.position, _spin(found.position, found.momentum))
            for form, found in zip(FORMS[1:], (plain, exact), strict=True)
        },
    }
    return [
        RoundOff(
            form,
            at,
            np.maximum.accumulate(np.abs(spin / spin[0] - 1))[at - 1],
            float(np.linalg.norm(places[-1] - exact.position[-1])),
        )
        for form, (places, spin) in paths.items()
    ]


def two_step(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """The two-step form from (1, 0): places, shape (steps+1, 2), and angular momenta of the steps, (steps,)."""
    h, pair = 2 * np.pi / STEPS_A_REVOLUTION, ca.SX.sym("pair", 4)
    before, here = pair[:2], pair[2:]
    pull = -here / (ca.sqrt(ca.dot(here, here)) * ca.dot(here, here))
    step = ca.Function("step", [pair], [ca.vertcat(here, 2 * here - before + h**2 * pull)])
    start = np.array([1.0, 0.0])
    # two-step forms need two places to begin with: a Taylor step, whose error is none of rounding's
    first = np.concatenate([start, start + h * np.array([0.0, 1.0]) - 0.5 * h**2 * start])
    marched = step.mapaccum("march", steps - 1, {"base": 4})(first).full().T
    places = np.vstack([start, first[2:], marched[:, 2:]])
    return places, _spin(places[:-1], np.diff(places, axis=0)) / h


def _spin(place: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Angular momentum of every row."""
    return place[:, 0] * push[:, 1] - place[:, 1] * push[:, 0]


def growth() -> list[Amplification]:
    """Amplification of one step of several methods on x'' = -omega^2 x, for many values of h omega."""
    here = State((1,), (0,))
    problem = TransferProblem(1.0, here, here, 1.0, effects=(Spring(1.0, (0.0,)),))
    dynamics, rows = Dynamics.of(problem), []
    for name in AMPLIFIED:
        # omega is 1, so the step h is h omega; from a unit vector each step gives a column of its matrix
        step = step_function(name, dynamics, problem).map(len(H_OMEGA))
        columns = [
            step(np.tile(begin[:, None], len(H_OMEGA)), np.zeros((1, len(H_OMEGA))), H_OMEGA[None]).full()
            for begin in np.eye(2)
        ]
        rates = np.abs(np.linalg.eigvals(np.stack(columns, axis=1).T))
        rows.append(Amplification(name, H_OMEGA, rates.max(axis=1)))
    return rows
