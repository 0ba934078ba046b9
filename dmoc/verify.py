"""The checks of a solution: one number, unit and limit each, none of them taken on Ipopt's word."""

from __future__ import annotations

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np

from dmoc.lobatto import scheme
from dmoc.mechanics import Dynamics
from dmoc.mesh import node_weights, step_nodes
from dmoc.objectives import Effort
from dmoc.problem import TransferProblem
from dmoc.simulate import end_momenta, force_of, legendre_momenta, reference, rollout, step_matrices
from dmoc.solution import Solution
from dmoc.solver import stationarity
from dmoc.stability import growth_along

# What each check allows; the reasons stand where they are used.
RESIDUAL = 1e-6
ROLLOUT, ROLLOUT_MOST = 1e-9, 1e-3
REFERENCE = 1e-2
LEDGER, ENERGY = 1e-9, 1e-2
BOUND = 1e-6
OPTIMALITY = 1e-6


@dataclass(frozen=True)
class Check:
    """One verdict. `value` and `limit` are None where the check does not apply; `note` says why."""

    name: str
    value: float | None
    limit: float | None
    unit: str
    ok: bool
    note: str = ""


@dataclass(frozen=True)
class Report:
    """The checks of one solution: residual, rollout, reference, ledger, bounds, optimality, stability."""

    checks: tuple[Check, ...]
    seconds: float

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def __getitem__(self, name: str) -> Check:
        return next(check for check in self.checks if check.name == name)


def verify(solution: Solution, problem: TransferProblem | None = None) -> Report:
    """Check a solution: nothing here uses what the optimiser said of it.

    Parameters
    ----------
    solution : Solution
    problem : TransferProblem, optional
        The problem it answers, if it is not the solution's own.

    Returns
    -------
    Report
        residual : largest defect of the discrete Euler-Lagrange equations and of the boundary
        conditions, as a force [N]; rollout : the same scheme marched forward from the start, against
        the nodes, as a fraction of the path and of the peak speed; reference : the same at the goal
        for an independent integrator (SciPy's DOP853); ledger : change of momentum against impulse
        and of energy against work; bounds : the worst excess, at nodes and between them; optimality :
        for least effort lambda = -m F, else the gradient of the Lagrangian; stability : growth of the
        one-step matrix over that of the exact flow.

    Raises
    ------
    ValueError
        If the solution has no problem and none is given.
    """
    problem = solution.problem if problem is None else problem
    if problem is None:
        raise ValueError("this solution carries no problem; give verify(solution, problem)")
    begun = time.perf_counter()
    case = _Case(solution, problem)
    checks = (
        _residual(case),
        _rollout(case),
        _reference(case),
        _ledger(case),
        _bounds(case),
        _optimality(case),
        _stability(case),
    )
    return Report(checks, time.perf_counter() - begun)


class _Case:
    """A solution with what several checks need of it."""

    def __init__(self, solution: Solution, problem: TransferProblem):
        self.solution, self.problem, self.path = solution, problem, solution.path
        self.dynamics = Dynamics(problem.dimension, problem.effects, problem.actuator)
        self.rule = scheme(self.path.order)
        self.begin = problem.start_time
        self.time = self.begin + self.path.duration * self.path.fractions
        self.ends = self.time[:: self.rule.degree]
        self.position, self.mass = self.path.position, self.path.mass
        self.momentum, self.velocity = end_momenta(self.dynamics, self.path, self.begin)
        self.force = force_of(self.dynamics, self.path.control)
        self.speed = float(np.linalg.norm(self.velocity, axis=1).max())
        extent = float(np.linalg.norm(np.ptp(self.position, axis=0)))
        self.extent = extent or self.speed * self.path.duration or 1.0
        self.speed = self.speed or self.extent / self.path.duration
        self.weights = self.path.duration * node_weights(self.path.mesh, self.rule)
        self.largest = float(np.abs(self.force).max(initial=0.0))
        self.matrices = step_matrices(self.dynamics, self.path, self.begin, self.momentum)

    def node_velocity(self) -> np.ndarray:
        """Velocity at every node: from the momenta at the step ends, of a polynomial with those inside."""
        at = step_nodes(len(self.path.mesh) - 1, self.rule)
        h = self.path.duration * np.diff(self.path.mesh)[:, None]
        ends = np.stack([self.velocity[:-1] * h, self.velocity[1:] * h])
        velocity = np.empty_like(self.position)
        velocity[at] = np.einsum("ij,jkn->ikn", self.rule.hermite_slopes(), [*self.position[at], *ends]) / h
        velocity[:: self.rule.degree] = self.velocity
        return velocity

    def point(self) -> tuple[np.ndarray, np.ndarray]:
        """dl/dq and F/m of the effects at every node, each of shape (nodes, axes) [m/s^2]."""
        velocity = self.node_velocity()
        dldq, _, push = self.dynamics.point(self.time[None], self.position.T, velocity.T, self.mass[None])
        return np.array(dldq).T, np.array(ca.densify(push)).T


def _residual(case: _Case) -> Check:
    """Row k of the discrete Euler-Lagrange equations is a momentum; over the node's weight, a force."""
    path, problem = case.path, case.problem
    momenta = legendre_momenta(case.dynamics, path, case.begin)
    rows = np.zeros_like(case.position)
    np.add.at(rows, step_nodes(len(path.mesh) - 1, case.rule), momenta)
    for place, velocity, sign in ((0, path.start_velocity, 1), (-1, path.goal_velocity, -1)):
        boundary = case.dynamics.point(case.time[place], path.position[place], velocity, case.mass[place])[1]
        rows[place] += sign * np.array(boundary).ravel()
    defect = np.abs(rows * (case.mass / case.weights)[:, None])
    missed, where = _boundary_defect(case)
    worst = np.unravel_index(np.argmax(defect), defect.shape)
    value = float(defect.max())
    if not value >= missed:
        value, name = missed, where
    else:
        name = f"at dynamics[{worst[0]}].{'xyz'[worst[1]]}"
    own = float(np.abs(sum(case.point()) * case.mass[:, None]).max())
    scale = max(problem.actuator.force_limit() or 0.0, case.largest, 1e-3 * own)
    step = case.path.duration * np.diff(path.mesh).min() / case.rule.degree
    # positions are known to a rounding error of their size: no row can be better than that over h^2
    reach = float(np.abs(path.position - path.position.mean(axis=0)).max())
    floor = 10 * np.finfo(float).eps * float(case.mass.max()) * reach / step**2
    limit = RESIDUAL * scale + floor
    return Check("residual", value, limit, "N", bool(value <= limit), name)


def _boundary_defect(case: _Case) -> tuple[float, str]:
    """Largest miss of a fixed boundary entry, as the force that would mend it over the duration [N]."""
    problem, path = case.problem, case.path
    worst, where = 0.0, ""
    mass, duration = float(case.mass.max()), path.duration
    for end, place, velocity in (("start", 0, path.start_velocity), ("goal", -1, path.goal_velocity)):
        wanted = getattr(problem, end).fixed()
        for kind, want, have, scale in (
            ("position", wanted[0], path.position[place], mass / duration**2),
            ("velocity", wanted[1], velocity, mass / duration),
        ):
            miss = float(np.nanmax(np.append(np.abs(have - want), 0.0))) * scale
            if miss > worst:
                worst, where = miss, f"at {end}.{kind}"
    return worst, where


def _rollout(case: _Case) -> Check:
    """March the scheme from the start; what the transfer itself amplifies is not held against the path."""
    path, n = case.path, case.problem.dimension
    start = case.dynamics.point(case.time[0], path.position[0], path.start_velocity, case.mass[0])[1]
    q, p = rollout(case.dynamics, path, case.begin, path.position[0], np.array(start).ravel())
    gap = max(
        np.abs(q - path.position[:: case.rule.degree]).max() / case.extent,
        np.abs(p - case.momentum).max() / case.speed,
    )
    scale = np.repeat([case.extent, case.speed], n)
    growth = _amplification(case.matrices * scale / scale[:, None])
    limit = min(ROLLOUT * max(1.0, growth), ROLLOUT_MOST)
    note = f"the path amplifies errors {growth:.2g} times"
    return Check("rollout", float(gap), limit, "of the path", bool(gap <= limit), note)


def _amplification(matrices: np.ndarray) -> float:
    """Largest growth of a small error between any node and the goal, or from the start to any node."""
    size, steps = matrices.shape[1], len(matrices)
    state, step = ca.MX.sym("state", size, size), ca.MX.sym("step", size, size)
    march = ca.Function("march", [state, step], [step @ state]).mapaccum(steps)
    products = np.array(march(np.eye(size), matrices.transpose(1, 0, 2).reshape(size, -1)))
    since_start = products.reshape(size, steps, size).transpose(1, 0, 2)
    if not np.isfinite(since_start).all():
        return np.inf
    growth = np.linalg.norm(since_start, 2, axis=(1, 2)).max()
    try:
        to_goal = np.linalg.norm(since_start[-1] @ np.linalg.inv(since_start), 2, axis=(1, 2)).max()
    except np.linalg.LinAlgError:
        return float(growth)
    return float(max(growth, to_goal))


def _reference(case: _Case) -> Check:
    q, v = reference(case.dynamics, case.path, case.begin, case.path.start_velocity)
    miss, slip = np.linalg.norm(q - case.position[-1]), np.linalg.norm(v - case.path.goal_velocity)
    value = float(np.nan_to_num(max(miss / case.extent, slip / case.speed), nan=np.inf))
    tolerance = case.solution.details.get("tolerance")
    limit = REFERENCE if tolerance is None else 10 * tolerance
    note = f"misses the goal by {miss:.2g} m and {slip:.2g} m/s"
    return Check("reference", value, limit, "of the path", value <= limit, note)


def _ledger(case: _Case) -> Check:
    """Momentum: the discrete sum is exact. Energy: the work is a quadrature, of the scheme's order."""
    impulse = _impulses(case)
    start, goal = (
        np.array(case.dynamics.point(case.time[i], case.position[i], v, case.mass[i])[1]).ravel()
        for i, v in ((0, case.path.start_velocity), (-1, case.path.goal_velocity))
    )
    scale = np.abs(impulse).sum() + case.speed
    value = float(np.abs(goal - start - impulse.sum(axis=0)).max() / scale)
    energy = _energy_gap(case)
    note = "energy not balanced: the Lagrangian depends on time"
    if energy is not None:
        note = f"energy closes to {energy:.1e} of {ENERGY:g}"
    ok = value <= LEDGER and (energy is None or energy <= ENERGY)
    return Check("ledger", value, LEDGER, "of the impulse", bool(ok), note)


def _impulses(case: _Case) -> np.ndarray:
    """Impulse per mass of every step, h sum_j w_j (dl/dq_j + F_j / m_j), shape (steps, axes) [m/s]."""
    return np.array(legendre_momenta(case.dynamics, case.path, case.begin)).sum(axis=0)


def _energy_gap(case: _Case) -> float | None:
    """Change of energy against work, over the largest of kinetic energy and total work; None if not kept."""
    if case.dynamics.depends_on_time or np.ptp(case.mass) > 0:
        return None
    ends = slice(None, None, case.rule.degree)
    energy = np.array(
        case.dynamics.energy(case.ends[None], case.position[ends].T, case.velocity.T, case.mass[ends][None])
    ).ravel()
    velocity, (_, push) = case.node_velocity(), case.point()
    if case.path.hold:
        moves = np.diff(case.position[ends], axis=0)
        work = np.sum(case.force * moves, axis=1) / case.mass[0]
        passive = np.sum(push * velocity, axis=1) * case.weights
        parts = np.concatenate([work, passive])
    else:
        parts = np.sum((case.force / case.mass[:, None] + push) * velocity, axis=1) * case.weights
    scale = max(0.5 * case.speed**2, np.abs(parts).sum())
    return float(abs(energy[-1] - energy[0] - parts.sum()) / scale)


def _bounds(case: _Case) -> Check:
    """The excess that is largest against what it is allowed."""
    problem, path = case.problem, case.path
    limit = BOUND * (problem.actuator.force_limit() or 1.0)
    found = [("force", float(problem.actuator.excess(path.control).max(initial=0.0)), limit, "N")]
    shortest, longest = problem.duration_bounds
    beyond = max(shortest - path.duration, path.duration - longest, 0.0)
    found.append(("duration", beyond, BOUND * longest, "s"))
    fine, gap = _between_nodes(case)
    for i, constraint in enumerate(problem.constraints):
        name = f"{type(constraint).__name__} {i + 1}"
        if constraint.unit == "m/s":
            change = np.diff(case.velocity, 2, axis=0)
            allowed = BOUND * case.speed + float(np.linalg.norm(change, axis=1).max(initial=0.0)) / 8
            excess = constraint.excess(path.position[:: case.rule.degree], case.velocity)
        else:
            # between two nodes a straight chord of length d cuts d^2 / 8 r deep into a sphere of radius r
            bend = gap**2 / (8 * getattr(constraint, "radius", np.inf))
            allowed = BOUND * case.extent + bend + _sag(case)
            excess = constraint.excess(fine, np.zeros_like(fine))
            at_nodes = float(constraint.excess(path.position, case.node_velocity()).max())
            found.append((f"{name} at nodes", at_nodes, BOUND * case.extent, "m"))
        found.append((name, float(excess.max()), allowed, constraint.unit))
    name, value, allowed, unit = max(found, key=lambda row: row[1] / row[2])
    ok = all(row[1] <= row[2] for row in found)
    note = f"worst: {name}" if value > 0 else "all hold"
    if problem.free_duration and min(path.duration - shortest, longest - path.duration) < 1e-6 * longest:
        bound = "shortest" if path.duration - shortest < longest - path.duration else "longest"
        note += f"; the duration sits on its {bound} limit of {path.duration:g} s"
    return Check("bounds", value, allowed, unit, ok, note)


def _between_nodes(case: _Case, parts: int = 8) -> tuple[np.ndarray, float]:
    """The path sampled inside every step, and the largest distance of two neighbouring nodes [m]."""
    nodes = case.position[step_nodes(len(case.path.mesh) - 1, case.rule)]
    values = case.rule.values_at(np.linspace(0, 1, parts * case.rule.degree, endpoint=False))
    fine = np.einsum("ij,jkn->kin", values, nodes).reshape(-1, case.problem.dimension)
    if case.rule.degree == 1:
        from scipy.interpolate import CubicHermiteSpline

        smooth = CubicHermiteSpline(case.ends, case.position, case.velocity)
        fine = smooth(np.linspace(case.ends[0], case.ends[-1], parts * (len(case.ends) - 1) + 1))
    return fine, float(np.linalg.norm(np.diff(case.position, axis=0), axis=1).max())


def _sag(case: _Case) -> float:
    """How far the path bends away from a chord between nodes, a h^2 / 8 [m]."""
    bends = np.diff(case.position, 2, axis=0)
    return float(np.linalg.norm(bends, axis=1).max(initial=0.0)) / 8


def _optimality(case: _Case) -> Check:
    solution, problem = case.solution, case.problem
    value, note = stationarity(problem, case.path), "gradient of the Lagrangian"
    if isinstance(problem.objective, Effort) and np.ptp(case.mass) == 0 and case.largest > 0:
        costate = solution.costate
        if case.path.hold:
            at = step_nodes(len(case.path.mesh) - 1, case.rule)
            costate = np.einsum("j,jkn->kn", case.rule.weights, costate[at])
        lower, upper = problem.actuator.bounds(problem.dimension)
        near = 1e-3 * case.largest
        free = ((case.path.control > lower + near) & (case.path.control < upper - near)).all(axis=1)
        limit = problem.actuator.force_limit()
        free &= np.linalg.norm(case.force, axis=1) < (np.inf if limit is None else limit - near)
        mismatch = np.abs(costate + case.mass[0] * case.force)[free] / (case.mass[0] * case.largest)
        if mismatch.size:
            value = max(value, float(mismatch.max()))
            note = f"lambda = -m F where no force limit acts ({mismatch.shape[0]} of {len(free)})"
    return Check("optimality", value, OPTIMALITY, "-", value <= OPTIMALITY, note)


def _stability(case: _Case) -> Check:
    """Spectral radius of each one-step matrix over that of the exact flow, both frozen at the step."""
    growth = growth_along(case.dynamics, case.path, case.begin, case.velocity, case.matrices)
    note = f"h omega = {growth.frequency:.2g} at most"
    return Check("stability", growth.value, growth.limit, "growth a step", growth.ok, note)
