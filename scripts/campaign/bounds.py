"""What an optimum costs at least, proven by duality where motion is linear: NumPy and SciPy alone.

Between fixed ends in a fixed time, with a force F(t) in a convex set and no mass burnt, least effort and least
fuel are convex problems. For every costate l,

    cost >= l . d - integral of max over F of (p(t) . F - price(F)),    p(t) = B' exp(A (T - t))' l

where d is by how far the body misses the goal without a force. The best l makes both sides equal (Luenberger
1969, section 8.6), so that the largest right-hand side is the optimum itself: no answer may cost less, and a
good one costs hardly more. Least time in free space or uniform gravity is bounded along every axis, in closed
form.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize

import dmoc
from campaign.making import Scene
from campaign.physics import Push, World

# Places in time for the integral [-]. At a switch Simpson's rule errs by the slope of p times the square of the
# spacing: 1e-6 of the cost.
PLACES = 2001
# An answer may cost this many times what is proven to be the optimum [-], when no tolerance was asked for: the
# meshes by default err by less, and a local optimum by far more.
SHARP = 1.05

Ends = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def sharpened(scene: Scene) -> Scene:
    """The same scene, with what can be proven of its optimum in the judge's hands."""
    truth = scene.truth
    if scene.blames or not truth.world.linear or truth.push.exhaust:
        return scene
    ends, fixed = _ends(scene.problem), truth.durations[0] == truth.durations[1]
    if ends is None:
        return scene
    if truth.cost == "time" and truth.world.steady is not None:
        least, sharp = quickest(truth.push, truth.mass, truth.world.steady, ends)
        sharp = sharp and least > truth.durations[0]
        least = max(least, truth.durations[0])
    elif truth.cost in ("effort", "fuel") and fixed:
        least, sharp = dual(truth.world, truth.push, truth.mass, ends, truth.durations[0], truth.cost)
    else:
        return scene
    # Zones and speed limits make it dearer: then the bound still holds, but is not the optimum.
    known = {"known": least, "dear": SHARP} if sharp and not scene.problem.constraints else {}
    return replace(scene, truth=replace(truth, least=least, **known))


def _ends(problem: dmoc.TransferProblem) -> Ends | None:
    """Place and velocity at the start and the goal, NaN where the goal is free; None if they are not fixed."""
    parts = (problem.start, problem.goal)
    if not all(type(part) is dmoc.State for part in parts):
        return None
    found = [np.array(x, float) for part in parts for x in (part.position, part.velocity)]
    return None if np.isnan(found[:2]).any() else tuple(found)


def dual(world: World, push: Push, mass: float, ends: Ends, duration: float, cost: str) -> tuple[float, bool]:
    """The proven bound of an effort or a fuel in a linear world, and whether it is the optimum itself."""
    q0, v0, q1, v1 = ends
    kept = ~np.isnan(np.concatenate([q1, v1]))
    length = float(np.linalg.norm(np.nan_to_num(q1 - q0)))
    length += duration * max(np.linalg.norm(v0), np.linalg.norm(np.nan_to_num(v1))) or 1.0
    moved, missed = _motion(world, mass, ends, duration, length)
    # Forces in units of the limit or, without one, of what moves the body by the length in the time.
    unit = push.limit if np.isfinite(push.limit) else mass * length / duration**2
    moved, missed = moved[:, kept] * unit * duration**2 / (mass * length), missed[kept]
    weights = _simpson()
    # Costates are taken in a basis in which the least effort without a limit costs half the square of the miss.
    root = np.linalg.cholesky(np.einsum("k,kin,kjn->ij", weights, moved, moved))
    rows, miss = np.linalg.solve(root, moved), np.linalg.solve(root, missed)

    def negative(costate: np.ndarray) -> tuple[float, np.ndarray]:
        value, force = _conjugate(push, cost, np.einsum("i,kin->kn", costate, rows))
        return weights @ value - costate @ miss, np.einsum("k,kin,kn->i", weights, rows, force) - miss

    peak = np.linalg.norm(np.einsum("i,kin->kn", miss, rows), axis=1).max()
    begin = miss if cost == "effort" else miss / (peak or 1.0)
    best = minimize(negative, begin, jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 500})
    size = unit**2 * duration if cost == "effort" else unit * duration
    return -float(best.fun) * size, not (push.kind == "box" and cost == "fuel")


def _motion(
    world: World, mass: float, ends: Ends, duration: float, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """What a force at each time moves the end by, shape (PLACES, 2n, n), and the miss without one, (2n,).

    Lengths in units of `length` from the start on, so that far from the origin nothing is lost to rounding;
    times in units of the duration, forces of mass length / duration^2.
    """
    q0, v0, q1, v1 = ends
    n, zero = len(q0), np.zeros(len(q0))
    here = world.acceleration(0.0, q0, zero, mass)
    # An affine function is known from its values at one place and a unit away along each axis.
    by_place = [world.acceleration(0.0, q0 + x, zero, mass) - here for x in length * np.eye(n)]
    by_speed = [world.acceleration(0.0, q0, x, mass) - here for x in length / duration * np.eye(n)]
    matrix = np.zeros((2 * n + 1, 2 * n + 1))
    matrix[:n, n : 2 * n] = np.eye(n)
    matrix[n : 2 * n] = np.column_stack([*by_place, *by_speed, here]) * duration**2 / length
    step = expm(matrix / (PLACES - 1))
    onward = [np.eye(2 * n + 1)]
    for _ in range(PLACES - 1):
        onward.append(onward[-1] @ step)
    moves = np.array(onward[::-1])
    free = moves[0] @ np.concatenate([zero, v0 * duration / length, [1.0]])
    wanted = np.concatenate([(q1 - q0) / length, v1 * duration / length])
    return moves[:, : 2 * n, n : 2 * n], wanted - free[: 2 * n]


def _simpson() -> np.ndarray:
    weights = np.full(PLACES, 2.0)
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    return weights / weights.sum()


def _conjugate(push: Push, cost: str, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The largest p . F - price(F), shape (count,), and the F [limit] that has it, shape of p.

    For the fuel of a box, a ball that holds the box is taken: then the bound holds but is not sharp.
    """
    axes = push.kind == "nozzles" or (push.kind == "box" and cost == "effort")
    size = np.abs(p) if axes else np.linalg.norm(p, axis=1, keepdims=True)
    most = (
        np.inf if push.kind == "free" else np.sqrt(push.dimension) if push.kind == "box" and not axes else 1.0
    )
    force = np.minimum(size, most) if cost == "effort" else most * (size > 1)
    price = 0.5 * force**2 if cost == "effort" else force
    value = (size * force - price).sum(axis=1)
    return value, np.divide(p, size, out=np.zeros_like(p), where=size > 0) * force


def quickest(push: Push, mass: float, steady: np.ndarray, ends: Ends) -> tuple[float, bool]:
    """A bound of the time in which a goal can be reached, and whether it is the optimum itself.

    Along every axis, and along the way, the body is a double integrator.
    """
    q0, v0, q1, v1 = ends
    if np.isnan([*q1, *v1]).any():
        return 0.0, False
    along = [*np.eye(len(q0)), (q1 - q0) / (np.linalg.norm(q1 - q0) or 1.0)]
    times = []
    for d in along:
        corner = np.abs(d).sum() if push.kind in ("box", "nozzles") else np.linalg.norm(d)
        most, pull = push.limit / mass * corner, float(steady @ d)
        times.append(_bang_bang(most + pull, most - pull, float((q1 - q0) @ d), float(v0 @ d), float(v1 @ d)))
    return max(times), len(q0) == 1


def _bang_bang(up: float, down: float, way: float, v0: float, v1: float) -> float:
    """Least time of a double integrator with accelerations from -down to up, by one switch at a speed w."""
    if min(up, down) <= 0:
        return 0.0
    found = []
    for a, b, sign in ((up, down, 1.0), (down, up, -1.0)):
        # Seen along the first acceleration: faster to w by a, slower to the end by b.
        s, begin, end = sign * way, sign * v0, sign * v1
        square = (s + begin**2 / (2 * a) + end**2 / (2 * b)) / (1 / (2 * a) + 1 / (2 * b))
        for w in (np.sqrt(max(square, 0.0)), -np.sqrt(max(square, 0.0))):
            if square >= 0 and w >= max(begin, end) - 1e-12 * abs(w):
                found.append((w - begin) / a + (w - end) / b)
    return min(found, default=0.0)
