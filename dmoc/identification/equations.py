"""The least-squares problem of a flight: discrete equations as rows, and what was measured as residuals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from dmoc.basics.quaternions import QUATERNION, matrix_of, rotation_of
from dmoc.configurations.coordinates import PLACE
from dmoc.identification.pieces import Piece, made, summed, values
from dmoc.identification.setting import Setting
from dmoc.motion.momenta import legendre_function


@dataclass
class Equations:
    """Rows that hold and residuals that are to be small, of all unknowns in SI units.

    Attributes
    ----------
    rows, residuals : list of Piece
    labels : list of (str, array)
        Of each kind of residual its name and where it stands, shape (entries, count).
    free : bool array
        The unknowns that are not known.
    """

    setting: Setting
    rows: list[Piece] = field(default_factory=list)
    residuals: list[Piece] = field(default_factory=list)
    labels: list[tuple[str, np.ndarray]] = field(default_factory=list)
    row_count: int = 0
    row_scales: np.ndarray = field(default_factory=lambda: np.empty(0))
    row_nodes: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(places.size for _, places in self.labels)

    def add_rows(self, part: tuple, columns: np.ndarray, numbers: np.ndarray, nodes: np.ndarray, scale: float) -> None:
        """Rows of their own; `nodes` is where on the path each evaluation stands."""
        results = part[0][0].size1_out(0)
        targets = self.row_count + np.arange(results * columns.shape[1]).reshape(-1, results).T
        self.rows.append(Piece(*part, columns, targets, numbers))
        self.row_count += targets.size
        self.row_scales = np.append(self.row_scales, np.full(targets.size, scale))
        self.row_nodes = np.append(self.row_nodes, np.repeat(nodes, results))

    def add_residuals(self, name: str, part: tuple, columns: np.ndarray, numbers: np.ndarray) -> None:
        """Residuals over their standard deviations."""
        results = part[0][0].size1_out(0)
        targets = self.count + np.arange(results * columns.shape[1]).reshape(-1, results).T
        self.residuals.append(Piece(*part, columns, targets, numbers))
        self.labels.append((name, targets))

    def rows_at(self, x: np.ndarray) -> tuple[np.ndarray, sparse.csr_matrix]:
        return summed(self.rows, x, self.row_count)

    def values_at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and residuals alone."""
        return values(self.rows, x, self.row_count), values(self.residuals, x, self.count)

    def residuals_at(self, x: np.ndarray) -> tuple[np.ndarray, sparse.csr_matrix]:
        return summed(self.residuals, x, self.count)

    def with_numbers(self, columns: np.ndarray) -> np.ndarray:
        """Places of unknowns, with those of all numbers below."""
        numbers = np.broadcast_to(self.setting.numbers[:, None], (len(self.setting.wanted), columns.shape[1]))
        return np.vstack([columns, numbers])


def add_motion(equations: Equations) -> None:
    """The discrete Euler-Lagrange equations, whose parameters are the numbers of the scene."""
    setting = equations.setting
    low, high = setting.row_bounds
    held = low == high
    place = np.cumsum(held) - 1
    for block in setting.blocks:
        known, used = block.kernel.used
        inside = block.first + np.array(used, int)
        rows = np.flatnonzero(held[block.targets].all(axis=1))
        if not len(rows):
            continue
        at_mass = np.flatnonzero(inside == setting.mass_at)
        slopes = setting.slopes[inside]

        def write(block: Any = block, rows: Any = rows, at_mass: Any = at_mass, slopes: Any = slopes) -> tuple:
            z, p = ca.SX.sym("z", len(block.columns)), ca.SX.sym("p", len(slopes))
            d, theta = ca.SX.sym("d", len(block.kernel.used[0])), numbers_of(setting)
            values = block.kernel.functions["rows"](z, d, scene_numbers(setting, p, at_mass, slopes, theta))
            return [z, theta], [d, p], values[rows.tolist()]

        key = "motion", block.kernel, len(setting.wanted), _kinds(setting), slopes.tobytes(), rows.tobytes()
        base = setting.parameters[inside] - slopes @ [one.begin for one in setting.wanted]
        numbers = np.vstack([block.values[known], np.tile(base[:, None], block.count)])
        columns = equations.with_numbers(block.columns)
        equations.rows.append(Piece(*made(key, block.count, write), columns, place[block.targets[rows]], numbers))
    equations.row_count = int(held.sum())
    equations.row_scales = setting.row_scales[held]
    equations.row_nodes = layout_nodes(setting, setting.rows)[held]


def _kinds(setting: Setting) -> tuple:
    return tuple(one.kind for one in setting.wanted)


def numbers_of(setting: Setting) -> ca.SX:
    """Symbols of the numbers."""
    return ca.SX.sym("theta", len(setting.wanted))


def scene_numbers(setting: Setting, base: Any, at_mass: Any, slopes: np.ndarray, theta: ca.SX) -> Any:
    """Parameters of the scene with the numbers in them, from those where the numbers are 0."""
    p = ca.SX(base + ca.sparsify(ca.DM(slopes)) @ theta)
    for j, one in enumerate(setting.wanted):
        if one.inverse:
            for place in at_mass:
                p[int(place)] = 1 / theta[j]
    return p


def layout_nodes(setting: Setting, layout: Any) -> np.ndarray:
    """The node at which each unknown or row of the path stands."""
    last = setting.steps * setting.degree
    found = np.zeros(layout.size)
    for group in layout.groups:
        many = np.arange(group.count) * (setting.degree if group.kind in ("control", "step") else 1.0)
        ends = last if group.name.startswith("goal") else 0.0
        found[group.indices] = ends if group.kind == "end" else many
    return found


def add_positions(equations: Equations, sigma: float, offset: Sequence[Any], delay: Any) -> None:
    """The positions of the marker: that of the body, plus the offset turned with it, a delay ago."""
    setting = equations.setting
    flight, (place, attitude) = setting.flight, _parts(setting)
    turning = known_rotations(flight) if not len(attitude) else None
    there = np.flatnonzero(np.isfinite(flight.positions).any(axis=1))
    if isinstance(delay, float) and delay == 0.0:
        steps, fractions = None, np.zeros(len(there))
        nodes = [there * setting.degree]
    else:
        steps = np.clip(np.searchsorted(flight.times, flight.times[there] - delay, side="right") - 1, 0, setting.steps - 1)
        nodes = [steps * setting.degree + j for j in range(setting.degree + 1)]
        fractions = np.diff(flight.times)[steps]
    axes, moved = flight.axes, any(offset) or any(one.kind in ("offset", "center") for one in setting.wanted)
    rotated = bool(moved and (turning is not None or len(attitude)))

    def write() -> tuple:
        theta = numbers_of(setting)
        q = [ca.SX.sym(f"q{j}", len(place) + len(attitude) * rotated) for j in range(len(nodes))]
        y, weight, late, length = ca.SX.sym("y", axes), ca.SX.sym("w", axes), ca.SX.sym("late"), ca.SX.sym("length")
        R = ca.SX.sym("R", axes, axes)
        at = q[0]
        if steps is not None:
            passed = (late - _of_kind(setting, theta, "delay", 0, delay)) / length
            at = sum((w * one for w, one in zip(_lagrange(setting.rule.points, passed), q, strict=True)), ca.SX(0))
        seen = at[:axes]
        if moved:
            body = ca.vertcat(
                *[
                    _of_kind(setting, theta, "offset", i, offset[i]) - _of_kind(setting, theta, "center", i, 0.0)
                    for i in range(axes)
                ]
            )
            turned = rotation_of(at[axes:]) if len(attitude) else R if rotated else ca.DM.eye(axes)
            seen = seen + turned @ body
        return [*q, theta], [y, weight, late, length, ca.vec(R)], weight * (seen - y)

    key = "positions", _kinds(setting), axes, len(nodes), rotated, moved, tuple(map(float, offset)), float(delay), len(attitude)
    y = flight.positions[there] - setting.units.origin[: axes]
    known = np.isfinite(y)
    which = np.concatenate([place, attitude]) if rotated and len(attitude) else place
    columns = equations.with_numbers(np.vstack([which[:, node] for node in nodes]))
    matrices = np.zeros((axes * axes, len(there)))
    if rotated and turning is not None:
        matrices = turning[there].transpose(2, 1, 0).reshape(axes * axes, -1)
    begin = flight.times[there] - flight.times[0 if steps is None else steps]
    numbers = np.vstack([np.nan_to_num(y).T, (known / sigma).T, begin[None], np.maximum(fractions, 0)[None], matrices])
    equations.add_residuals("position", made(key, columns.shape[1], write), columns, numbers)


def _lagrange(points: np.ndarray, at: Any) -> list[Any]:
    """The Lagrange polynomials through the nodes of a step at a fraction of it."""
    found = []
    for j, own in enumerate(points):
        value: Any = 1
        for other in np.delete(points, j):
            value = value * (at - float(other)) / float(own - other)
        found.append(value)
    return found


def _of_kind(setting: Setting, theta: ca.SX, kind: str, index: int, known: Any) -> Any:
    """A number that is asked for, or what it is known to be."""
    for j, one in enumerate(setting.wanted):
        if one.kind == kind and one.index == index:
            return theta[j]
    return float(known)


def _parts(setting: Setting) -> tuple[np.ndarray, np.ndarray]:
    """Places of the coordinates of position and of attitude among the unknowns, shape (entries, nodes)."""
    indices, at = setting.columns["position"].indices, 0
    found = {True: np.empty((0, indices.shape[1]), int), False: np.empty((0, indices.shape[1]), int)}
    for block in setting.path.coordinates.blocks:
        found[block.kind == PLACE] = indices[at : at + block.size]
        at += block.size
    return found[True], found[False]


def known_rotations(flight: Any) -> np.ndarray | None:
    """The rotation from body to space at every sample, shape (samples, axes, axes); None if it is not known."""
    given = flight.attitudes
    if given is None:
        return None
    if given.ndim == 1:
        cos, sin = np.cos(given), np.sin(given)
        return np.moveaxis(np.array([[cos, -sin], [sin, cos]]), 2, 0)
    q = ca.SX.sym("q", QUATERNION)
    turn = ca.Function("turn", [q], [ca.densify(ca.vec(rotation_of(q)))])
    return turn(given.T).full().T.reshape(-1, 3, 3).transpose(0, 2, 1)


def add_attitudes(equations: Equations, sigma: float) -> None:
    """The attitudes of a body that turns, as the turn between what is measured and what is so [rad]."""
    setting, (_, attitude) = equations.setting, _parts(equations.setting)
    there = np.flatnonzero(np.isfinite(setting.flight.attitudes).all(axis=1))

    def write() -> tuple:
        q, seen = ca.SX.sym("q", QUATERNION), ca.SX.sym("seen", QUATERNION)
        turn = 2 * (matrix_of(seen).T @ q)[1:]
        return [q], [seen, sigma_ := ca.SX.sym("sigma")], turn / sigma_

    columns = attitude[:, there * setting.degree]
    numbers = np.vstack([setting.flight.attitudes[there].T, np.full(len(there), sigma)])
    equations.add_residuals("attitude", made(("attitudes",), len(there), write), columns, numbers)


def add_speeds(equations: Equations, sigmas: dict[str, float]) -> None:
    """Velocities and rates: those of the momenta that leave the begin of each step."""
    setting, flight = equations.setting, equations.setting.flight
    columns, degree, n = setting.columns, setting.degree, setting.problem.size
    seen = [(name, getattr(flight, name)) for name in ("velocities", "rates") if name in sigmas]
    measured = np.hstack([rows for _, rows in seen])
    sigma = np.concatenate([np.full(rows.shape[1], sigmas[name]) for name, rows in seen])
    freedom = setting.writer.dynamics.freedom
    first = {"velocities": 0, "rates": freedom - 3}
    which = np.concatenate([first[name] + np.arange(rows.shape[1]) for name, rows in seen])
    there = np.flatnonzero(np.isfinite(measured[:-1]).any(axis=1))

    def write() -> tuple:
        writer, theta = setting.writer, numbers_of(setting)
        dynamics, p = writer.dynamics, writer.parameters
        nodes, u = ca.SX.sym("q", n * (degree + 1)), ca.SX.sym("u", dynamics.controls)
        begin, length, y, weight = ca.SX.sym("begin"), ca.SX.sym("length"), ca.SX.sym("y", len(sigma)), ca.SX.sym("w", len(sigma))
        t, h = writer.start_time + begin * writer.duration, length * writer.duration
        masses = ca.repmat(writer.mass, degree + 1)
        momenta = legendre_function(dynamics, setting.order, True)(nodes, masses, u, t, h, writer.origin)
        place = nodes[:n] + writer.origin
        leaving = -dynamics.configuration.along(place, momenta[0])
        speed = dynamics.velocity(t, place, leaving, writer.mass)[which.tolist()]
        base = ca.SX.sym("p", p.numel())
        numbers = scene_numbers(setting, base, [setting.mass_at], setting.slopes, theta)
        result = ca.substitute(weight * (speed - y), p, numbers)
        return [nodes, u, theta], [begin, length, y, weight, base], result

    key = "speeds", setting.writer, tuple(which), degree
    base = setting.parameters - setting.slopes @ [one.begin for one in setting.wanted]
    place, force, mesh = columns["position"].indices, columns["force"].indices, setting.path.mesh
    at = [place[:, there * degree + j] for j in range(degree + 1)]
    weights = np.isfinite(measured) / sigma
    numbers = np.vstack(
        [
            mesh[there][None],
            np.diff(mesh)[there][None],
            np.nan_to_num(measured[there]).T,
            weights[there].T,
            np.tile(base[:, None], len(there)),
        ]
    )
    equations.add_residuals("speed", made(key, len(there), write), equations.with_numbers(np.vstack([*at, force[:, there]])), numbers)


def add_forces(equations: Equations, sigma: np.ndarray, strength: Sequence[Any], turn: Sequence[Any]) -> bool:
    """Forces near what was commanded, or just that; whether they are unknown at all."""
    setting = equations.setting
    group, commanded = setting.columns["force"], setting.path.control
    asked = [one for one in setting.wanted if one.kind in ("strength", "turn")]
    altered = asked or any(value != 1.0 for value in strength) or any(turn)
    if not sigma.any() and not altered or not commanded.shape[1]:
        return False
    count, noisy = commanded.shape[1], bool(sigma.any())

    def write() -> tuple:
        theta, u, given = numbers_of(setting), ca.SX.sym("u", count), ca.SX.sym("given", count)
        weight = ca.SX.sym("weight", count)
        factors = ca.vertcat(*[_of_kind(setting, theta, "strength", i, strength[i]) for i in range(count)])
        whole = [j for j, one in enumerate(setting.wanted) if one.name == "strength"]
        factors = ca.repmat(theta[whole[0]], count) if whole else factors
        angles = [_of_kind(setting, theta, "turn", i, value) for i, value in enumerate(turn)]
        return [u, theta], [given, weight], weight * (u - turned(angles, factors * given, setting.flight.axes))

    kinds = tuple((one.kind, one.index, one.name) for one in setting.wanted)
    key = "forces", kinds, count, setting.flight.axes, tuple(map(float, strength)), tuple(map(float, turn))
    columns = equations.with_numbers(group.indices)
    scale = np.ones(count) if not noisy else 1 / sigma
    numbers = np.vstack([commanded.T, np.tile(scale[:, None], len(commanded))])
    if noisy:
        equations.add_residuals("force", made(key, columns.shape[1], write), columns, numbers)
    else:
        nodes = setting.degree * np.arange(setting.steps)
        equations.add_rows(made(key, columns.shape[1], write), columns, numbers, nodes, 1 / setting.units.force)
    return True


def turned(angles: Sequence[Any], force: Any, axes: int) -> Any:
    """A force turned by an angle in the plane, or by a small rotation vector in space (Cayley)."""
    if not len(angles) or all(isinstance(one, float) and one == 0.0 for one in angles):
        return force
    if axes == 2:
        cos, sin = ca.cos(angles[0]), ca.sin(angles[0])
        return ca.vertcat(cos * force[0] - sin * force[1], sin * force[0] + cos * force[1])
    vector = ca.vertcat(*angles)
    cross = ca.skew(ca.SX(vector))
    rotation = ca.SX.eye(3) + (cross + cross @ cross / 2) / (1 + ca.dot(vector, vector) / 4)
    return ca.vertcat(rotation @ force[:3], *([rotation @ force[3:]] if force.numel() == 6 else []))


def add_beliefs(equations: Equations) -> None:
    """What the numbers are thought to be."""
    setting = equations.setting
    for j, one in enumerate(setting.wanted):
        if one.sigma is None:
            continue

        def write(inverse: bool = one.inverse) -> tuple:
            x, value, sigma = (ca.SX.sym(name) for name in ("x", "value", "sigma"))
            return [x], [value, sigma], ((1 / x if inverse else x) - value) / sigma

        numbers = np.array([[one.value], [one.sigma]])
        equations.add_residuals(f"belief {one.name}", made(("belief", one.inverse), 1, write), setting.numbers[j : j + 1, None], numbers)


def residual_parts(equations: Equations, r: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Residuals over their standard deviations by kind, one row an evaluation."""
    for name, places in equations.labels:
        yield name, r[places].T
