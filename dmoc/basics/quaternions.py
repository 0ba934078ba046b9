"""Unit quaternions, scalar first, that turn body axes into space axes: r_space = R(q) r_body.

Those for CasADi take columns of four entries and stay polynomials in them; those for NumPy take arrays whose
last axis has four entries.

References
----------
J. B. Kuipers, Quaternions and Rotation Sequences (1999), chapter 5 (products), 7 (rotation matrix).
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from dmoc.basics.arguments import entries, number, short

# A body that turns does so in a space of this many axes.
AXES = 3
# An attitude is a unit quaternion of this many entries.
QUATERNION = 4
# Two attitudes nearer to each other than this angle [rad] are joined by a straight line: the sine that slerp
# divides by is then mere rounding.
NEARLY_EQUAL = 1e-7
# A quaternion may be longer or shorter than 1 by this part before it is refused [-]: numbers that were written
# with four digits are made unit quaternions, others are probably no attitudes.
NEARLY_UNIT = 1e-3


def matrix_of(q: Any) -> Any:
    """L(q) with L(q) p = q o p, shape (4, 4), for CasADi."""
    s, x, y, z = ca.vertsplit(q)
    return ca.vertcat(
        ca.horzcat(s, -x, -y, -z),
        ca.horzcat(x, s, -z, y),
        ca.horzcat(y, z, s, -x),
        ca.horzcat(z, -y, x, s),
    )


def columns_of(q: Any) -> Any:
    """L(q) H, the last three columns of L(q), shape (4, 3): 1/2 L(q) H w is dq/dt at the rate w, for CasADi."""
    return matrix_of(q)[:, 1:]


def rotation_of(q: Any) -> Any:
    """R(q) = (s^2 - v.v) I + 2 v v' + 2 s [v]x, shape (3, 3), for CasADi; a rotation where |q| = 1."""
    s, x, y, z = ca.vertsplit(q)
    return ca.vertcat(
        ca.horzcat(s * s + x * x - y * y - z * z, 2 * (x * y - s * z), 2 * (x * z + s * y)),
        ca.horzcat(2 * (x * y + s * z), s * s - x * x + y * y - z * z, 2 * (y * z - s * x)),
        ca.horzcat(2 * (x * z - s * y), 2 * (y * z + s * x), s * s - x * x - y * y + z * z),
    )


def rotated(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """R(q) r for attitudes of shape (..., 4) and vectors of shape (..., 3)."""
    scalar, axis = q[..., :1], q[..., 1:]
    once = np.cross(axis, vectors)
    return vectors + 2 * (scalar * once + np.cross(axis, once))


def times(q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The products q o p: first the turn p, then the turn q, both in space axes."""
    scalar = q[..., :1] * p[..., :1] - np.sum(q[..., 1:] * p[..., 1:], axis=-1, keepdims=True)
    vector = q[..., :1] * p[..., 1:] + p[..., :1] * q[..., 1:] + np.cross(q[..., 1:], p[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def conjugate(q: np.ndarray) -> np.ndarray:
    """The opposite turn."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def normalised(q: np.ndarray) -> np.ndarray:
    """The unit quaternions along q."""
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def angle_between(q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Angle of the turn from one attitude to the other [rad], 0 to pi, whatever their signs."""
    apart = times(conjugate(q), p)
    return 2 * np.arctan2(np.linalg.norm(apart[..., 1:], axis=-1), np.abs(apart[..., 0]))


def slerp(q: np.ndarray, p: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """From q to p, signs and all, by a turn of constant rate; shape (len(fractions), 4)."""
    f = np.asarray(fractions, float)[:, None]
    half = np.arctan2(np.linalg.norm(p - q) / 2, np.linalg.norm(p + q) / 2) * 2
    if half < NEARLY_EQUAL:
        return normalised(q + f * (p - q))
    if np.pi - half < NEARLY_EQUAL:
        # q and -q are one attitude: any axis will do, and a whole turn about z is made.
        p = times(q, np.array([0.0, 0.0, 0.0, 1.0]))
        return np.cos(np.pi * f) * q + np.sin(np.pi * f) * p
    return (np.sin((1 - f) * half) * q + np.sin(f * half) * p) / np.sin(half)


def turned_by(vectors: np.ndarray) -> np.ndarray:
    """The unit quaternions of turns by rotation vectors, axis times angle [rad], of shape (..., 3)."""
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    # sin(angle / 2) / angle, which NumPy's sinc gives without a division by zero.
    return np.concatenate([np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * vectors], axis=-1)


def rotation_vectors(q: np.ndarray) -> np.ndarray:
    """Axis times angle [rad] of the shorter turn of each attitude, shape (..., 3)."""
    q = np.where(q[..., :1] < 0, -q, q)
    size = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(size, q[..., :1])
    return q[..., 1:] * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 2.0)


def in_one_sign(q: np.ndarray) -> np.ndarray:
    """A sequence of attitudes, shape (count, 4), whose neighbours have q_j . q_{j+1} >= 0."""
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def unit_quaternion(value: Any) -> tuple[float, ...]:
    """A user's attitude as a unit quaternion.

    Raises
    ------
    ValueError
        If it is not four numbers of length 1.
    """
    parts = entries(value)
    if parts is None or len(parts) != QUATERNION:
        raise ValueError(
            "an attitude must be a unit quaternion of 4 numbers, scalar first [-], as rotation(axis, degrees) "
            f"gives, or None; got {short(value)}"
        )
    found = np.array([number(f"quaternion[{i}]", part, "-") for i, part in enumerate(parts)])
    length = float(np.linalg.norm(found))
    if abs(length - 1) > NEARLY_UNIT:
        raise ValueError(
            f"an attitude must be a unit quaternion [-]; got {short(value)} of length {length:.6g}"
        )
    return tuple(float(x) for x in found / length)
