"""Thrusters that are fixed to a body that turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import Vector, checked, entries, flag, number, short, times_each, vector
from dmoc.basics.quaternions import AXES
from dmoc.basics.records import dataclass
from dmoc.basics.unknown import open_fields
from dmoc.bodies.torques import OnBody
from dmoc.parts.actuator import Actuator, limit_told
from dmoc.parts.engines import Burner
from dmoc.parts.outline import Jet


@dataclass(frozen=True)
class Thrusters(OnBody, Burner):
    """Thrusters fixed to the body, each with a thrust between 0 and its largest.

    The force in body axes is sum_i u_i d_i, the torque about the centre of mass sum_i u_i r_i x d_i. Where they
    burn propellant, the centre of mass stays where it is.

    Parameters
    ----------
    positions : sequence of sequences
        Where each thruster sits, from the centre of mass in body axes [m], one row a thruster.
    directions : sequence of sequences
        Direction of the force that each makes, in body axes [-]; made unit vectors.
    max_thrust : float or sequence of float, optional
        Largest thrust [N], one number or one a thruster; without a limit only if they push both ways.
    both_ways : bool
        Whether each can push against its direction, too.
    specific_impulse, exhaust_velocity, dry_mass
        As for `Engine`.
    inertia_law : "scaled" or "constant"
        While they burn, the inertia shrinks in proportion to the mass, as where propellant is spread like the
        rest of the body, or stays what it is, as where the tank is at the centre of mass. Either way Euler's
        equation is J dw/dt + w x J w = tau: what leaves the body takes its own angular momentum along. Angular
        momenta per unit mass, as `spin` is, are per start mass where the inertia stays.
    """

    positions: Sequence[Vector] | np.ndarray
    directions: Sequence[Vector] | np.ndarray
    max_thrust: float | Vector | None = None
    both_ways: bool = False
    specific_impulse: float | None = None
    exhaust_velocity: float | None = None
    dry_mass: float = 0.0
    inertia_law: str = "scaled"
    limit_label = "limit of\na thruster"

    def __post_init__(self) -> None:
        places, ways = _rows("positions", self.positions, "m"), _rows("directions", self.directions, "-")
        if len(places) != len(ways):
            raise ValueError(
                f"Thrusters: there are {len(places)} positions but {len(ways)} directions; give one each"
            )
        lengths = [float(np.linalg.norm(way)) for way in ways]
        if min(lengths) == 0:
            raise ValueError(f"Thrusters: directions must not be zero; got {short(self.directions)}")
        units = tuple(tuple(x / length for x in way) for way, length in zip(ways, lengths, strict=True))
        checked(self, positions=places, directions=units, both_ways=flag("both_ways", self.both_ways))
        self._check_thrust(len(units))
        self._check_exhaust(self.specific_impulse)
        if self.inertia_law not in ("scaled", "constant"):
            given = short(self.inertia_law)
            raise ValueError(f"Thrusters: inertia_law must be 'scaled' or 'constant'; got {given}")
        if self.burns and self.both_ways:
            raise ValueError("Thrusters: those that burn push one way; state each way as a thruster of its own")

    def _check_thrust(self, count: int) -> None:
        if self.max_thrust is None:
            if not self.both_ways:
                raise ValueError("Thrusters: give max_thrust [N]; only thrusters that push both ways need none")
            return
        given = entries(self.max_thrust)
        thrusts = (self.max_thrust,) * count if given is None else given
        if len(thrusts) != count:
            raise ValueError(
                f"Thrusters: max_thrust has {len(thrusts)} entries but there are {count} thrusters; "
                f"give one number [N] or {count}"
            )
        most = tuple(number(f"max_thrust[{i}]", x, "N", positive=True) for i, x in enumerate(thrusts))
        checked(self, max_thrust=most)

    @property
    def adjustable(self) -> tuple[str, ...]:  # type: ignore[override]
        return (*(("exhaust_velocity",) if self.burns else ()), *open_fields(self))

    @property
    def structure(self) -> tuple:
        return type(self), self.burns, self.positions, self.directions

    def jets(self) -> list[Jet]:
        pairs = zip(self.positions, self.directions, strict=True)
        return [Jet(tuple(place), tuple(way), i) for i, (place, way) in enumerate(pairs)]

    def size(self, dimension: int) -> int:
        return len(self.directions)

    def labels(self, dimension: int) -> tuple[str, ...]:
        return tuple(f"thruster_{i + 1}" for i in range(len(self.directions)))

    def force(self, u: Any) -> Any:
        return _ways(self.directions) @ u

    def wrench(self, rotation: Any, u: Any) -> tuple[Any, Any]:
        places, ways = _columns(self.positions), _ways(self.directions)
        return rotation @ self.force(u), ca.cross(places, ways) @ u

    def throttle(self, u: Any) -> Any:
        return ca.sum1(u)

    def metered(self, dimension: int) -> Actuator:
        if self.both_ways:
            raise ValueError(
                "least fuel with Thrusters that push both ways has no smooth cost; state each way as a "
                "thruster of its own, both_ways=False"
            )
        return self

    def bounds(self, dimension: int) -> tuple[np.ndarray, np.ndarray]:
        limit = np.full(len(self.directions), np.inf) if self.max_thrust is None else np.array(self.max_thrust)
        return (-limit if self.both_ways else np.zeros(len(limit))), limit

    def force_limit(self) -> float | None:
        return None if self.max_thrust is None else float(np.max(self.max_thrust))

    def _arms(self) -> np.ndarray:
        """The torque of each thruster for a thrust of 1 N [m], shape (count, 3)."""
        return np.cross(np.array(self.positions), np.array(self.directions))

    @property
    def turns_every_way(self) -> bool:
        return bool(np.linalg.matrix_rank(self._arms()) == AXES)

    def turning_limit(self) -> float | None:
        if self.max_thrust is None:
            return None
        arms = self._arms() * np.array(self.max_thrust)[:, None]
        # Of the thrusters that turn the body one way about an axis, all fire: the weakest axis counts.
        ways = [np.maximum(sign * arms, 0).sum(axis=0) for sign in (1, -1)]
        weakest = float(np.min(np.maximum(*ways) if self.both_ways else np.minimum(*ways)))
        return weakest or float(np.linalg.norm(arms, axis=1).max()) or None

    def times(self, factor: float) -> Thrusters:
        return (
            self if self.max_thrust is None else replace(self, max_thrust=times_each(self.max_thrust, factor))
        )

    def needs(self, eased: Actuator) -> str:
        given = self.max_thrust or 0.0
        factor = (eased.force_limit() or 0.0) / (self.force_limit() or 1.0)
        return limit_told(self.limit_words, given, factor, "N")

    def words(self) -> str:
        most = "without a limit" if self.max_thrust is None else f"of at most {self.force_limit():g} N"
        ways = " both ways" if self.both_ways else ""
        law = {"scaled": "the inertia shrinks with the mass", "constant": "the inertia stays"}[self.inertia_law]
        burning = self._burning_words() + (f", {law}" if self.burns else "")
        return f"{len(self.directions)} thrusters fixed to the body, {most}{ways}{burning}"


def _columns(rows: Any) -> Any:
    """Rows of three numbers as the columns of a matrix; of unknown ones the symbols, row after row."""
    return ca.reshape(rows, AXES, -1) if isinstance(rows, ca.SX) else ca.DM(np.array(rows).T)


def _ways(rows: Any) -> Any:
    """Directions as columns, unit vectors also where they are unknown."""
    found = _columns(rows)
    return found / ca.repmat(ca.sqrt(ca.sum1(found**2)), AXES, 1) if isinstance(rows, ca.SX) else found


def _rows(name: str, value: Any, unit: str) -> tuple[tuple[float, ...], ...]:
    rows = tuple(vector(f"{name}[{i}]", row, unit) for i, row in enumerate(entries(value) or ()))
    if not rows or any(len(row) != AXES for row in rows):
        raise ValueError(f"Thrusters: {name} must be rows of three numbers [{unit}]; got {short(value)}")
    return rows
