"""Every constraint with every actuator solves on a given mesh and to a tolerance, nodal and held, at any order.

What is carried from mesh to mesh must fit each of them: a limit on the speed has rows at the Gauss points of a
step, a burning engine has masses at its inner nodes, and their number depends on the order.
"""

import pytest

from dmoc import (
    ApproachCone,
    BallForce,
    BoxForce,
    Engine,
    FreeForce,
    KeepIn,
    KeepOut,
    SpeedLimit,
    State,
    TransferProblem,
    solve,
    verify,
)

ACTUATORS = {
    "free": FreeForce(),
    "box": BoxForce(3.0),
    "ball": BallForce(3.0),
    "engine": Engine(3.0, exhaust_velocity=5.0),
}
CONSTRAINTS = {
    "speed": SpeedLimit(0.9),
    "two speeds": (SpeedLimit(0.9), SpeedLimit(0.95)),
    "ball": KeepOut((1.0, 0.1), 0.3),
    "room": KeepIn((-1, -0.5), (3, 0.5)),
    "cone": ApproachCone((2.2, 0), (-1, 0), 1.2),
}
# (order, tolerance, hold); the trial of a tolerance is of order 4, and 6 and 8 follow where all is smooth.
WAYS = [(2, None, False), (8, None, False), (None, None, True), (None, 1e-3, False), (None, 1e-3, True)]
# Smooth scenes go on to these orders.
FINE = [(None, 1e-6, False), (6, 1e-6, False), (8, 1e-6, False)]


def scene(actuator, constraint):
    return TransferProblem(
        1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), 4.0, actuator=actuator, constraints=constraint
    )


@pytest.mark.parametrize("order, tol, hold", WAYS)
@pytest.mark.parametrize("constraint", CONSTRAINTS)
@pytest.mark.parametrize("actuator", ACTUATORS)
def test_it_solves(actuator, constraint, order, tol, hold):
    problem = scene(ACTUATORS[actuator], CONSTRAINTS[constraint])
    solution = solve(problem, order, tol=tol, hold=hold, steps=None if tol else 60)
    assert solution.success, solution.message
    report = verify(solution)
    assert all(report[name].ok for name in ("residual", "rollout", "reference", "ledger", "bounds"))


@pytest.mark.parametrize("order, tol, hold", FINE)
@pytest.mark.parametrize("constraint", ["speed", "two speeds", "room"])
def test_it_goes_on_to_higher_orders(constraint, order, tol, hold):
    loose = {"speed": SpeedLimit(100.0), "two speeds": (SpeedLimit(99.0), SpeedLimit(100.0))}
    problem = scene(FreeForce(), loose.get(constraint, CONSTRAINTS[constraint]))
    assert verify(solve(problem, order, tol=tol, hold=hold).raise_for_status()).ok
