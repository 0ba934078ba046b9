"""Events that change the velocity without a push, or the frame in which it is counted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from dmoc.basics.arguments import checked, number, short
from dmoc.basics.records import dataclass
from dmoc.effects.user_functions import as_column, tried
from dmoc.ends.base import Boundary
from dmoc.ends.moving import Moving
from dmoc.legs.events import Event, Instant, Passed
from dmoc.parts.rows import Row

# The remedies that are told where a user's function of a place, or of time and place, cannot be used.
OF_PLACE = "it must take a position q [m] as a CasADi expression and give a number that is 0 on the surface"
OF_TIME = "it must take a CasADi time [s] and give 2 or 3 numbers [m]: write it with casadi's functions"
OF_TIME_AND_PLACE = "it must take (t, q) as CasADi expressions and give a position [m]"


@dataclass(frozen=True)
class Frame(Event):
    """From here on positions count in another frame: an inertial one, one that turns, another origin.

    Parameters
    ----------
    position : callable
        (t [s], q [m]) -> the position in the new frame [m], of CasADi expressions. Velocities follow by its
        derivatives.
    name : str
        The name of the new frame, for people.
    """

    position: Callable
    name: str = "another frame"
    changes_frame: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not callable(self.position):
            raise ValueError(f"Frame: position must be a function (t, q); got {short(self.position)}")

    def check_dimension(self, dimension: int) -> None:
        given = [ca.SX.sym("t"), ca.SX.sym("q", dimension)]
        count = tried("Frame: position", self.position, given, OF_TIME_AND_PLACE)
        if count != dimension:
            raise ValueError(f"Frame: position must give {dimension} values; it gives {count}")

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        t, q, v = ca.SX.sym("t"), ca.SX.sym("q", here.q.numel()), ca.SX.sym("v", here.v.numel())
        moved = ca.SX(as_column(self.position(t, q)))
        change = ca.Function("frame", [t, q, v], [moved, ca.jtimes(moved, q, v) + ca.jacobian(moved, t)])
        place, velocity = change(here.t, here.q, here.v)
        return Passed(here._replace(q=place, v=velocity), [])

    def words(self) -> str:
        return f"from here on in {self.name}"


@dataclass(frozen=True)
class Bounce(Event):
    """An impact on a surface: the velocity along it stays, that across it turns round.

    Parameters
    ----------
    surface : callable
        q [m] -> a CasADi expression that is 0 on the surface.
    restitution : float
        The share of the velocity across that is left [-]: 1 keeps the energy.
    """

    surface: Callable
    restitution: float = 1.0
    turns_velocity: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not callable(self.surface):
            raise ValueError(f"Bounce: surface must be a function of q; got {short(self.surface)}")
        share = number("Bounce: restitution", self.restitution, "-", nonnegative=True)
        if share > 1:
            raise ValueError(f"Bounce: restitution must be 0 to 1 [-]; got {share:g}")
        checked(self, restitution=share)

    def check_dimension(self, dimension: int) -> None:
        count = tried("Bounce: surface", self.surface, [ca.SX.sym("q", dimension)], OF_PLACE)
        if count != 1:
            raise ValueError(f"Bounce: surface must give 1 value; it gives {count}")

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        q = ca.SX.sym("q", here.q.numel())
        gap = ca.SX(as_column(self.surface(q)))
        slope = ca.Function("slope", [q], [gap, ca.gradient(gap, q)])
        value, normal = slope(here.q)
        across = ca.dot(here.v, normal) / ca.dot(normal, normal)
        velocity = here.v - (1 + self.restitution) * across * normal
        return Passed(here._replace(v=velocity), [Row("surface", value, 0.0, 0.0)])

    @property
    def keeps_energy(self) -> bool:  # type: ignore[override]
        return self.restitution == 1

    def words(self) -> str:
        return f"an impact of restitution {self.restitution:g}"


@dataclass(frozen=True)
class Flyby(Event):
    """A planet is passed so fast that its attraction turns the velocity at one instant, and costs nothing.

    At the place of the planet the velocity relative to it keeps its size v and turns by no more than 2 asin(1 /
    (1 + r v^2 / mu)), the angle of the hyperbola that comes as near as r.

    Parameters
    ----------
    position : callable
        Function of the time [s], a CasADi symbol, that gives the planet's position [m].
    radius : float
        Least distance from its centre [m].
    mu : float
        Its gravitational parameter [m^3/s^2].

    References
    ----------
    R. H. Battin, An Introduction to the Mathematics and Methods of Astrodynamics (1999), chapter 9.
    """

    position: Callable
    radius: float
    mu: float
    turns_velocity: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not callable(self.position):
            raise ValueError(f"Flyby: position must be a function of the time [s]; got {short(self.position)}")
        checked(
            self,
            radius=number("Flyby: radius", self.radius, "m", positive=True),
            mu=number("Flyby: mu", self.mu, "m^3/s^2", positive=True),
        )

    def unknowns(self, axes: int) -> tuple[tuple[str, str], ...]:
        return tuple((axis, "m/s") for axis in "xyz"[:axes])

    def first_guess(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        return after

    def check_dimension(self, dimension: int) -> None:
        count = tried("Flyby: position", self.position, [ca.SX.sym("t")], OF_TIME)
        if count != dimension:
            raise ValueError(f"Flyby: position must give {dimension} values; it gives {count}")

    @property
    def condition(self) -> Boundary:
        return Moving(self.position, None)

    def passed(self, here: Instant, own: Any, speeds: np.ndarray, tiny: float) -> Passed:
        t = ca.SX.sym("t")
        place = ca.SX(as_column(self.position(t)))
        planet = ca.Function("planet", [t], [place, ca.densify(ca.jacobian(place, t))])
        where, speed = planet(here.t)
        come, gone = here.v - speed, own - speed
        square = ca.dot(come, come)
        sharpest = 1 - 2 / (1 + self.radius * square / self.mu) ** 2
        rows = [Row(f"position.{'xyz'[i]}", here.q[i] - where[i], 0.0, 0.0, "m") for i in range(where.numel())]
        rows.append(Row("size", ca.dot(gone, gone) / square, 1.0, 1.0))
        rows.append(Row("turn", ca.dot(come, gone) / square - sharpest, 0.0, np.inf))
        return Passed(here._replace(v=own), rows)

    def words(self) -> str:
        return f"a planet of mu {self.mu:g} m^3/s^2 is passed, {self.radius:g} m from its centre at least"
