"""The ledger panel: energy gained and work done, or momentum gained and the impulses behind it."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.configurations.acting import specific_lagrangian
from dmoc.effects.base import Force
from dmoc.motion.dynamics import Dynamics
from dmoc.motion.lobatto import scheme
from dmoc.motion.mesh import step_nodes
from dmoc.motion.momenta import legendre_momenta
from dmoc.plots.style import AXIS_COLOURS, DARK, PATH, PUSH, readable
from dmoc.results.solution import Solution

# The gain of the body is a broad pale line, so that the thin line of the works or impulses is seen upon it.
GAINED: dict[str, Any] = {"linewidth": 6, "alpha": 0.35}


def draw_ledger(axes: Any, solution: Solution, late: float) -> None:
    """Energy where it is kept, else momentum: the gain of the body, and the works or impulses upon it."""
    (_draw_energy if _keeps_energy(solution) else _draw_momentum)(axes, solution, late)


def _dynamics(solution: Solution) -> Dynamics | None:
    return None if solution.problem is None else Dynamics.of(solution.problem)


def _keeps_energy(solution: Solution) -> bool:
    """Whether the energy per mass changes by work alone; False if the problem is not at hand."""
    dynamics = _dynamics(solution)
    if dynamics is None or dynamics.depends_on_time:
        return False
    t, q, v, m = dynamics.symbols()
    potential = ca.SX(specific_lagrangian(dynamics.effects, dynamics.configuration, t, q, v, m))
    return not (np.ptp(solution.path.mass) > 0 and ca.depends_on(potential, m))


def _draw_energy(axes: Any, solution: Solution, late: float) -> None:
    gained, given = _energy(solution)
    total = sum(given.values())
    shrinks = np.ptp(solution.path.mass) > 0
    size, unit = readable(np.append(gained, total), "J/kg" if shrinks else "J")
    ends = solution.end_times / late
    axes.plot(ends, gained / size, color=PATH, label="energy\ngained", **GAINED)
    styles = ((PUSH, "--"), (AXIS_COLOURS[2], "-."))
    for (name, work), (colour, line) in zip(given.items(), styles, strict=False):
        axes.plot(ends, work / size, color=colour, linestyle=line, label=name)
    if len(given) > 1:
        axes.plot(ends, total / size, color=DARK, linestyle=":", label="sum of work")
    gap = np.abs(gained - total).max() / size
    axes.set_ylabel(f"energy [{unit}]")
    axes.set_title(f"Energy and work{' per mass' if shrinks else ''} (gap {gap:.1g} {unit})")


def _energy(solution: Solution) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Energy gained since the start and the works done on the body, at the step ends.

    In [J], or [J/kg] where mass burns away: then energy itself leaves with it. The works are sums with
    the scheme's own weights, so the gap is of its order.
    """
    dynamics, path = _dynamics(solution), solution.path
    assert dynamics is not None
    rule = scheme(solution.order)
    ends, at = slice(None, None, rule.degree), step_nodes(solution.steps, rule)
    times, mass = solution.time[at], path.mass[at]
    scale = 1.0 if np.ptp(path.mass) > 0 else path.mass[0]
    state = (solution.end_times[None], path.position[ends].T, solution.velocity.T, path.mass[ends][None])
    energy = scale * np.array(dynamics.energy(*state)).ravel()
    works = {"work of\nthe force": scale * _work(solution, _node_forces(solution) / mass[:, :, None])}
    if any(isinstance(effect, Force) for effect in dynamics.effects):
        v, q = _step_velocities(solution), path.position[at]
        rows = (
            times.reshape(1, -1),
            *(a.reshape(-1, solution.dimension).T for a in (q, v)),
            mass.reshape(1, -1),
        )
        push = np.array(dynamics.point(*rows)[2]).T.reshape(v.shape)
        works["work of\nthe effects"] = scale * _work(solution, push)
    return energy - energy[0], works


def _node_forces(solution: Solution) -> np.ndarray:
    """Forces of the actuator at the nodes of every step [N], shape (s+1, steps, axes)."""
    at = step_nodes(solution.steps, scheme(solution.order))
    if solution.path.hold:
        return np.broadcast_to(solution.force, (len(at), *solution.force.shape))
    return solution.force[at]


def _work(solution: Solution, push: np.ndarray) -> np.ndarray:
    """Work per mass since the start at the step ends [J/kg] of accelerations at the nodes of every step."""
    rule = scheme(solution.order)
    power = np.sum(push * _step_velocities(solution), axis=2)
    return np.append(0.0, np.cumsum(np.diff(solution.end_times) * (rule.weights @ power)))


def _step_velocities(solution: Solution) -> np.ndarray:
    """Velocities of every step at its nodes [m/s], shape (s+1, steps, axes)."""
    rule = scheme(solution.order)
    nodes = solution.position[step_nodes(solution.steps, rule)]
    h = np.diff(solution.end_times)[:, None]
    return np.einsum("ij,jkn->ikn", rule.derivative, nodes - nodes[0]) / h


def _draw_momentum(axes: Any, solution: Solution, late: float) -> None:
    """The gain along each axis, the impulse of the force, and that of force and effects if these are known."""
    rule, mass = scheme(solution.order), solution.path.mass
    pushes = _node_forces(solution) / mass[step_nodes(solution.steps, rule)][:, :, None]
    h = np.diff(solution.end_times)[:, None]
    curves = [
        ("gained", solution.momentum[1:] - solution.momentum[0], {**GAINED, "linestyle": "-"}),
        (
            "from the\nforce",
            np.cumsum(h * np.einsum("j,jkn->kn", rule.weights, pushes), axis=0),
            {"linestyle": "--"},
        ),
    ]
    dynamics = _dynamics(solution)
    if dynamics is not None and dynamics.effects:
        impulses = legendre_momenta(dynamics, solution.path, float(solution.time[0])).sum(axis=0)
        curves.append(
            ("from force\nand effects", np.cumsum(impulses, axis=0), {"linestyle": ":", "color": DARK})
        )
    size, unit = readable(np.concatenate([values for _, values, _ in curves]), "m/s")
    ends = solution.end_times / late
    for i, axis in enumerate("xyz"[: solution.dimension]):
        axes.plot([], [], color=AXIS_COLOURS[i], label=axis)
        for name, values, style in curves:
            line = np.append(0.0, values[:, i]) / size
            axes.plot(ends, line, **({"color": AXIS_COLOURS[i]} | style), gid=f"{axis} {name}")
    for name, _, style in curves:
        axes.plot([], [], **({"color": DARK} | style), label=name)
    axes.set_ylabel(f"p / m [{unit}]")
    axes.set_title("Momentum per mass")
