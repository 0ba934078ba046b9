"""Orbital elements: conditions on a state that are regular at e = 0 and i = 0, and the nearest state."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

from dmoc.parts.rows import Row

# The orbital elements by the names that the fields of `Orbit` have: semi-major axis [m], eccentricity [-], then
# inclination, ascending node, argument of the periapsis and true anomaly [rad].
ELEMENTS = ("a", "e", "i", "raan", "argp", "nu")


def element_rows(orbit: Any, q: Any, v: Any, planar: bool) -> list[Row]:
    """Independent conditions that a state has the elements of `orbit` that are not None.

    With k the direction of the angular momentum h, the eccentricity vector is e_r = h^2/(mu r) - 1
    along the position and e_s = -(q . v) h/(mu r) along k x q.

    Parameters
    ----------
    orbit
        Has `mu` and the ELEMENTS, numbers or symbols; those that are exactly 0 or pi are numbers.
    q, v : columns of 3
        Position [m] and velocity [m/s] from the attractor.
    planar : bool
        Whether there are only two axes, and the third entries are zero.
    """
    mu, r, h = orbit.mu, ca.sqrt(ca.dot(q, q)), ca.cross(q, v)
    spin = ca.sqrt(ca.dot(h, h))
    normal = h / spin
    rows = []
    if orbit.a is not None:
        rows.append(Row("energy", orbit.a * (2 / r - ca.dot(v, v) / mu), 1.0, 1.0))
    if planar:
        rows += [] if orbit.i is None else [Row("sense", normal[2] * math.cos(orbit.i), 0.0, np.inf)]
    else:
        rows += _plane_rows(orbit.i, orbit.raan, normal)
    node = _node(orbit, normal, planar)
    x, y = ca.dot(q, node) / r, ca.dot(q, ca.cross(normal, node)) / r
    e_r, e_s = spin**2 / (mu * r) - 1, -ca.dot(q, v) * spin / (mu * r)
    if orbit.nu is not None:
        return rows + _anomaly_rows(orbit, e_r, e_s, x, y)
    if orbit.argp is not None:
        return rows + _periapsis_rows(orbit, e_r * x - e_s * y, e_r * y + e_s * x)
    if _is(orbit.e, 0.0):
        # The gradient of |e|^2 vanishes where e = 0, so both components of the eccentricity vector must be 0.
        # The second one has sqrt(mu r), the angular momentum of a circle, in place of h.
        return [*rows, Row("e_along", e_r, 0.0, 0.0), Row("e_across", ca.dot(q, v) / ca.sqrt(mu * r), 0.0, 0.0)]
    return rows if orbit.e is None else [*rows, Row("e", (e_r**2 + e_s**2) / orbit.e - orbit.e, 0.0, 0.0)]


def _plane_rows(i: Any, raan: Any, normal: Any) -> list[Row]:
    """Rows for the inclination and the ascending node, whichever of the two are given."""
    if raan is None and i is not None and not _flat(i):
        return [Row("i", normal[2] - ca.cos(i), 0.0, 0.0)]
    if i is None and raan is None:
        return []
    angle = 0.0 if raan is None else raan
    first = ca.vertcat(ca.cos(angle), ca.sin(angle), 0)
    level = ca.vertcat(ca.sin(angle), -ca.cos(angle), 0)
    rows = [Row("node", ca.dot(first, normal), 0.0, 0.0)]
    if i is None:
        return [*rows, Row("sense", ca.dot(level, normal), 0.0, np.inf)]
    # The gradient of cos i vanishes at i = 0. Instead the normal must have no component along two directions
    # in the wanted plane: `first`, towards the node, and `second`, a quarter turn from it.
    wanted = ca.sin(i) * level + ca.vertcat(0, 0, ca.cos(i))
    second = ca.cross(wanted, first)
    tilt, sense = ca.dot(second, normal), ca.dot(wanted, normal)
    return [*rows, Row("i", tilt, 0.0, 0.0), Row("sense", sense, 0.0, np.inf)]


def _node(orbit: Any, normal: Any, planar: bool) -> Any:
    """Direction of the ascending node, from which argp counts."""
    # A flat orbit has no node: argp then counts from the x axis.
    if planar or _flat(orbit.i):
        return ca.DM([1.0, 0.0, 0.0])
    if orbit.raan is not None:
        return ca.vertcat(ca.cos(orbit.raan), ca.sin(orbit.raan), 0)
    return ca.vertcat(-normal[1], normal[0], 0) / ca.sqrt(normal[0] ** 2 + normal[1] ** 2)


def _anomaly_rows(orbit: Any, e_r: Any, e_s: Any, x: Any, y: Any) -> list[Row]:
    """Rows where the true anomaly is given; (x, y) is the direction of the position, counted from the node."""
    e, argp, nu = orbit.e, orbit.argp, orbit.nu
    rows = [] if argp is None else _directed("latitude", x, y, argp + nu)
    if e is None:
        return rows + _directed("nu", e_r, -e_s, nu)
    along, across = e_r - e * ca.cos(nu), e_s + e * ca.sin(nu)
    return [*rows, Row("e_along", along, 0.0, 0.0), Row("e_across", across, 0.0, 0.0)]


def _periapsis_rows(orbit: Any, e_x: Any, e_y: Any) -> list[Row]:
    """Rows where argp is given but no true anomaly; (e_x, e_y) is the eccentricity vector from the node."""
    e, argp = orbit.e, orbit.argp
    if e is None:
        return _directed("argp", e_x, e_y, argp)
    return [Row("e_x", e_x - e * ca.cos(argp), 0.0, 0.0), Row("e_y", e_y - e * ca.sin(argp), 0.0, 0.0)]


def _directed(name: str, x: Any, y: Any, angle: Any) -> list[Row]:
    """Rows for a vector (x, y) that points along `angle`: it lies on that line, on the right half."""
    cos, sin = ca.cos(angle), ca.sin(angle)
    return [Row(name, y * cos - x * sin, 0.0, 0.0), Row(f"{name}_sense", x * cos + y * sin, 0.0, np.inf)]


def _is(value: Any, number: float) -> bool:
    """Whether a value is exactly this number; a symbol never is."""
    return isinstance(value, float) and value == number


def _flat(i: Any) -> bool:
    return _is(i, 0.0) or _is(i, math.pi)


def nearest_state(
    wanted: dict[str, float], mu: float, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A state with the elements `wanted`; energy, direction and distance stay near those of q, v.

    `q` and `v` have three entries, from the attractor.
    """
    distance, h = float(np.linalg.norm(q)), np.cross(q, v)
    node, side = _nearest_plane(wanted, h)
    pull = float(np.linalg.norm(np.cross(v, h) / mu - q / distance))
    e, a = _nearest_shape(wanted, 2 / distance - v @ v / mu, pull)
    parameter = distance * (1 + e) if a is None else a * (1 - e**2)
    # The conic r = p / (1 + e cos nu) gives cos nu at this distance; where it does not reach so far, at an
    # apsis.
    reach = np.clip((parameter / distance - 1) / (e or 1.0), -1.0, 1.0)
    nu = math.copysign(math.acos(reach), q @ v) if e > 0 else 0.0
    latitude = math.atan2(q @ side, q @ node)
    argp = wanted.get("argp", latitude - wanted.get("nu", nu))
    nu = wanted.get("nu", latitude - argp)
    if 1 + e * math.cos(nu) < 0.05:
        # At this anomaly r = p / (1 + e cos nu) is over 20 p or infinite: the periapsis is taken instead.
        nu, argp = 0.0, wanted.get("argp", latitude)
    x, y = math.cos(argp + nu), math.sin(argp + nu)
    velocity = (x + e * math.cos(argp)) * side - (y + e * math.sin(argp)) * node
    position = parameter / (1 + e * math.cos(nu)) * (x * node + y * side)
    return position, math.sqrt(mu / parameter) * velocity


def _nearest_shape(wanted: dict[str, float], curve: float, e: float) -> tuple[float, float | None]:
    """Eccentricity [-] and semi-major axis [m] near a state that has 1/a = `curve` [1/m] and eccentricity `e`.

    The axis is None where it is not wanted and the state is on no ellipse. A free eccentricity fits the
    energy that is wanted, stays away from 1, the parabola, and is at least 0.1 where an angle from the
    periapsis is wanted: a circle has no periapsis.
    """
    a = wanted.get("a")
    least = 0.1 if {"argp", "nu"} & set(wanted) else 0.0
    if "e" in wanted:
        e = wanted["e"]
    elif a is None:
        e = max(e, least)
    else:
        e = float(np.clip(e, least, 0.7)) if a > 0 else max(e, 1.5)
    if a is None and e < 1 and curve > 0:
        a = 1 / curve
    return e, a


def _nearest_plane(wanted: dict[str, float], h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors in the wanted plane near that of `h`: towards the node, and a quarter turn further on."""
    normal = _unit(h, [0.0, 0.0, 1.0])
    near = plane_elements(normal) | wanted
    i, raan = near["i"], 0.0 if _flat(near["i"]) else near.get("raan", 0.0)
    node = np.array([math.cos(raan), math.sin(raan), 0.0])
    level = np.array([math.sin(raan), -math.cos(raan), 0.0])
    return node, np.cross(math.sin(i) * level + math.cos(i) * np.array([0.0, 0.0, 1.0]), node)


def plane_elements(normal: np.ndarray) -> dict[str, float]:
    """Inclination and node of the plane with this unit normal."""
    level = math.hypot(normal[0], normal[1])
    i = math.atan2(level, normal[2])
    return {"i": i} if _flat(i) else {"i": i, "raan": math.atan2(normal[0], -normal[1])}


def _unit(x: np.ndarray, otherwise: Any) -> np.ndarray:
    length = np.linalg.norm(x)
    return x / length if length > 0 else np.array(otherwise)
