"""A cost that looks at the velocity, of forces that are held."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from dmoc import Effort, Objective, State, TransferProblem, solve


@dataclass(frozen=True)
class Haste(Objective):
    """The integral of the square of the speed."""

    def running(self, t, q, v, u, m):
        return ca.dot(v, v)

    def words(self):
        return "least square of the speed"


def test_it_counts_the_velocities_at_both_ends_of_each_step():
    """At order 2 that is the trapezoidal rule on the velocities that the solution reports."""
    problem = TransferProblem(
        2.0, State((0.0,), (1.5,)), State((1.0,), (-0.5,)), 2.0, objective=Effort() + 0.3 * Haste()
    )
    found = solve(problem, steps=12, hold=True).raise_for_status()
    h = np.diff(found.time)
    speed = found.velocity[:, 0] ** 2
    wanted = np.sum(h * (speed[1:] + speed[:-1]) / 2)
    effort = np.sum(h * found.force[:, 0] ** 2) / 2
    assert found.objective == pytest.approx(effort + 0.3 * wanted, rel=1e-9)


@dataclass(frozen=True)
class Wear(Objective):
    """The integral of height times speed squared."""

    def running(self, t, q, v, u, m):
        return q[0] * ca.dot(v, v)

    def words(self):
        return "least wear"


@pytest.mark.parametrize("height", [10.0, 1000.0])
def test_it_counts_the_place_from_the_problems_own_origin(height):
    ends = State((height,), (1.5,)), State((height + 1.0,), (-0.5,))
    problem = TransferProblem(2.0, *ends, 2.0, objective=Effort() + (1 / height) * Wear())
    found = solve(problem, steps=12, hold=True).raise_for_status()
    h = np.diff(found.time)
    rate = found.position[:, 0] * found.velocity[:, 0] ** 2 / height
    effort = np.sum(h * found.force[:, 0] ** 2) / 2
    assert found.objective == pytest.approx(effort + np.sum(h * (rate[1:] + rate[:-1]) / 2), rel=1e-9)
