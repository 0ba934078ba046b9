"""What is the same in every frame: controls that act alike in all, and the pull of a point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from dmoc.configurations.acting import point_function, state_symbols
from dmoc.configurations.base import Configuration
from dmoc.effects.base import Effect

# Two results are the same up to this part of their size [-]: rounding leaves some 1e-15.
SAME = 1e-9
# Turned by this angle [rad] over and over a vector comes as near as one likes to every direction of the plane.
ANGLE = 1.0
# Functions that agree at a place for each of these agree: those of a scene are smooth. Multiples of a number
# that is no fraction fall anywhere between whole ones; to draw numbers at random takes 17 ms to import.
SPREAD = np.sqrt([2.0, 3.0, 5.0])


def are_alike(acts: Callable[[Any], Any], tells: Callable[[Any], Any], controls: int, axes: int) -> bool:
    """Whether a control whose first `axes` entries are turned acts turned, and all that is told of it stays.

    Parameters
    ----------
    acts : callable
        The force of a control, a column for a column of symbols.
    tells : callable
        A column of what else depends on it: what it burns and costs.
    controls, axes : int
        Entries of a control, and how many of them are a vector.
    """
    u = ca.SX.sym("u", controls)
    plain, turned = [], []
    for first in range(axes - 1):
        turn = _turn(axes, first)
        other = ca.vertcat(turn @ u[:axes], u[axes:])
        plain += [turn @ acts(u), tells(u)]
        turned += [acts(other), tells(other)]
    return _agree(ca.vertcat(*plain), ca.vertcat(*turned))


def lone_pull(effects: Sequence[Effect], configuration: Configuration) -> tuple[Effect, float] | None:
    """The effect that is nothing but the pull of a point mass, and its mu: a user's attractor may be more."""
    t, q, v, m = state_symbols(configuration.size)
    for one in effects:
        if (source := one.attractor()) is not None:
            offset = q - ca.vertcat(*source.place(configuration.size).tolist())
            pull = -source.mu * offset / ca.norm_2(offset) ** 3
            acts = ca.vertcat(*point_function((one,), configuration, kinetic=False)(t, q, v, m))
            if _agree(acts, ca.vertcat(pull, ca.SX.zeros(2 * configuration.size))):
                return one, source.mu
    return None


def _agree(one: ca.SX, other: ca.SX) -> bool:
    """Whether two columns are the same whatever the numbers."""
    symbols = ca.vertcat(*ca.symvar(ca.veccat(one, other)))
    function = ca.Function("both", [symbols], [ca.densify(one - other), ca.densify(one)])
    places = 0.5 + np.outer(np.arange(1, symbols.numel() + 1), SPREAD) % 1.0
    gaps, sizes = (np.array(result) for result in function(places))
    return bool(np.abs(gaps).max() <= SAME * np.abs(sizes).max())


def _turn(axes: int, first: int) -> ca.DM:
    """The turn of two axes that follow each other."""
    turn = np.eye(axes)
    cos, sin = np.cos(ANGLE), np.sin(ANGLE)
    turn[first : first + 2, first : first + 2] = [[cos, -sin], [sin, cos]]
    return ca.DM(turn)
