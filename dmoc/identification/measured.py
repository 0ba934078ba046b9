"""What was measured and commanded, and what numbers are thought to be, as residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.quaternions import QUATERNION, matrix_of, rotation_of
from dmoc.basics.unknown import is_unknown
from dmoc.configurations.coordinates import PLACE
from dmoc.flights.flown import known_rotations, turned
from dmoc.identification.equations import Equations, kinds_of, made, numbers_of, scene_numbers
from dmoc.identification.setting import Setting
from dmoc.motion.momenta import legendre_function


def delayed(flight: Any, delay: float, asked: bool) -> tuple[np.ndarray, np.ndarray]:
    """Samples with a position whose motion the flight has, and the steps in which they were taken."""
    latest = max(delay, float(np.diff(flight.times)[0]) if asked else 0.0)
    there = np.isfinite(flight.positions).any(axis=1) & (flight.times >= flight.times[0] + latest)
    found = np.flatnonzero(there)
    steps = np.searchsorted(flight.times, flight.times[found] - delay, side="right") - 1
    return found, np.clip(steps, 0, len(flight.times) - 2)


def add_positions(equations: Equations, sigma: float, offset: Sequence[Any], delay: Any, now: float) -> None:
    """The positions of the marker: that of the body, plus the offset turned with it, a delay ago.

    Each is on the polynomial of the step in which it was taken if the delay is what it is thought to be `now`.
    """
    setting = equations.setting
    flight, (place, attitude) = setting.flight, _parts(setting)
    turning = known_rotations(flight) if not len(attitude) else None
    there, steps = delayed(flight, now, is_unknown(delay))
    late = is_unknown(delay) or delay != 0.0
    nodes = (
        [steps * setting.degree + j for j in range(setting.degree + 1)] if late else [there * setting.degree]
    )
    axes, moved = flight.axes, any(offset) or any(one.kind in ("offset", "center") for one in setting.wanted)
    rotated = bool(moved and (turning is not None or len(attitude)))

    def write() -> tuple:
        theta = numbers_of(setting)
        q = [ca.SX.sym(f"q{j}", len(place) + len(attitude) * rotated) for j in range(len(nodes))]
        y, weight, begun, length = (
            ca.SX.sym(name, axes if name in "yw" else 1) for name in ("y", "w", "begun", "length")
        )
        R = ca.SX.sym("R", axes, axes)
        at = q[0]
        if late:
            passed = (begun - _of_kind(setting, theta, "delay", 0, delay)) / length
            at = sum(
                (w * one for w, one in zip(_lagrange(setting.rule.points, passed), q, strict=True)), ca.SX(0)
            )
        seen = at[:axes]
        if moved:
            body = ca.vertcat(
                *[
                    _of_kind(setting, theta, "offset", i, offset[i])
                    - _of_kind(setting, theta, "center", i, 0.0)
                    for i in range(axes)
                ]
            )
            turned = rotation_of(at[axes:]) if len(attitude) else R if rotated else ca.DM.eye(axes)
            seen = seen + turned @ body
        return [*q, theta], [y, weight, begun, length, ca.vec(R)], weight * (seen - y)

    key = (
        "positions",
        kinds_of(setting),
        axes,
        len(nodes),
        rotated,
        moved,
        tuple(map(float, offset)),
        float(delay),
        len(attitude),
    )
    y = flight.positions[there] - setting.units.origin[:axes]
    known = np.isfinite(y)
    which = np.concatenate([place, attitude]) if rotated and len(attitude) else place
    columns = equations.with_numbers(np.vstack([which[:, node] for node in nodes]))
    matrices = np.zeros((axes * axes, len(there)))
    if rotated and turning is not None:
        matrices = turning[there].transpose(2, 1, 0).reshape(axes * axes, -1)
    begun, lengths = flight.times[there] - flight.times[steps], np.diff(flight.times)[steps]
    numbers = np.vstack([np.nan_to_num(y).T, (known / sigma).T, begun[None], lengths[None], matrices])
    part = made(key, columns.shape[1], write)
    equations.add_residuals("position", part, columns, numbers, int((~known).sum()))


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
        dynamics, p = replace(writer.dynamics, actuator=writer.actuator), writer.parameters
        nodes, u = ca.SX.sym("q", n * (degree + 1)), ca.SX.sym("u", dynamics.controls)
        begin, length, y, weight = (
            ca.SX.sym("begin"),
            ca.SX.sym("length"),
            ca.SX.sym("y", len(sigma)),
            ca.SX.sym("w", len(sigma)),
        )
        t, h = writer.start_time + begin * writer.duration, length * writer.duration
        burns = setting.problem.actuator.burns
        masses = ca.SX.sym("m", degree + 1) if burns else ca.repmat(writer.mass, degree + 1)
        momenta = legendre_function(dynamics, setting.order, True)(nodes, masses, u, t, h, writer.origin)
        place = nodes[:n] + writer.origin
        leaving = -dynamics.configuration.along(place, momenta[0])
        speed = dynamics.velocity(t, place, leaving, masses[0])[which.tolist()]
        base = ca.SX.sym("p", p.numel())
        numbers = scene_numbers(base, setting.inverted, setting.slopes, theta)
        result = ca.substitute(weight * (speed - y), p, numbers)
        return [nodes, u, *([masses] if burns else []), theta], [begin, length, y, weight, base], result

    key = "speeds", setting.writer, tuple(which), degree
    base = setting.parameters - setting.slopes @ [one.begin for one in setting.wanted]
    place, force, mesh = columns["position"].indices, columns["force"].indices, setting.path.mesh
    every = [there * degree + j for j in range(degree + 1)]
    at = [place[:, nodes] for nodes in every]
    burning = [columns["mass"].indices[:, nodes] for nodes in every] if "mass" in columns else []
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
    equations.add_residuals(
        "speed",
        made(key, len(there), write),
        equations.with_numbers(np.vstack([*at, force[:, there], *burning])),
        numbers,
        int((~np.isfinite(measured[there])).sum()),
    )


def add_forces(equations: Equations, sigma: np.ndarray, strength: Sequence[Any], turn: Sequence[Any]) -> bool:
    """Forces near what was commanded, or just that; whether they are unknown at all."""
    setting = equations.setting
    group, commanded = setting.columns["force"], setting.path.control
    asked = [one for one in setting.wanted if one.kind in ("strength", "turn")]
    altered = asked or any(value != 1.0 for value in strength) or any(turn)
    if (not sigma.any() and not altered) or not commanded.shape[1]:
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


def add_mass(equations: Equations, fixed: np.ndarray) -> None:
    """The mass at the start, where propellant burns: known, or the number that is asked for."""
    setting = equations.setting
    if "mass" not in setting.columns:
        return
    first = setting.columns["mass"].indices[:, :1]
    asked = [j for j, one in enumerate(setting.wanted) if one.kind == "mass"]
    if not asked:
        fixed[first.ravel()] = True
        return

    def write() -> tuple:
        m, x = ca.SX.sym("m"), ca.SX.sym("x")
        return [m, x], [], m - 1 / x

    columns = np.vstack([first, setting.numbers[asked][:, None]])
    part = made(("mass",), 1, write)
    equations.add_rows(part, columns, np.empty((0, 1)), np.zeros(1), 1 / setting.units.mass)


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
        equations.add_residuals(
            f"belief {one.name}",
            made(("belief", one.inverse), 1, write),
            setting.numbers[j : j + 1, None],
            numbers,
        )
