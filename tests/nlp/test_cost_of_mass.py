"""The largest final mass is the least propellant: the same optimum, in about as many iterations."""

from dataclasses import replace

import pytest

from dmoc import (
    Drop,
    Effort,
    Engine,
    FinalMass,
    Fuel,
    Leg,
    Mission,
    Nozzles,
    State,
    TransferProblem,
    solve,
    verify,
)

CROSS = ((1, 0), (-1, 0), (0, 1), (0, -1))
ENGINES = {
    "engine": Engine(3.0, exhaust_velocity=5.0),
    "nozzles": Nozzles(CROSS, 3.0, exhaust_velocity=5.0),
}


def hop(actuator, objective):
    return TransferProblem(
        1.0, State((0, 0), (0, 0)), State((2, 0), (0, 0)), 4.0, actuator=actuator, objective=objective
    )


@pytest.mark.parametrize(("order", "steps"), [(2, 100), (8, 30)])
@pytest.mark.parametrize("engine", ENGINES)
def test_the_largest_final_mass_is_the_least_propellant(engine, order, steps):
    problem = hop(ENGINES[engine], Fuel())
    fuel = solve(problem, order, steps=steps).raise_for_status()
    mass = solve(replace(problem, objective=FinalMass()), order, steps=steps).raise_for_status()
    assert mass.objective == pytest.approx(1.0 - fuel.objective, rel=1e-6)
    assert mass.objective == pytest.approx(mass.final_mass, rel=1e-9)
    assert mass.iterations <= 2 * fuel.iterations
    assert verify(mass)["optimality"].ok


def test_a_final_mass_beside_another_cost_is_paid_alike():
    """Effort - 0.5 final mass differs from effort + 0.5 propellant by half the mass at the start."""
    both = [
        solve(hop(ENGINES["engine"], cost), steps=60).raise_for_status().objective
        for cost in (Effort() - 0.5 * FinalMass(), Effort() + 0.5 * Fuel())
    ]
    assert both[0] == pytest.approx(both[1] - 0.5, rel=1e-6)


def test_over_a_drop_between_legs_too():
    ends = State((0, 0), (0, 0)), State((2, 0), (0, 0))
    legs = (Leg(2.0), Drop(0.2), Leg(2.0))
    fuel, mass = (
        solve(Mission(1.0, *ends, legs, actuator=ENGINES["engine"], objective=cost)).raise_for_status()
        for cost in (Fuel(), FinalMass())
    )
    assert mass.objective == pytest.approx(0.8 - fuel.objective, rel=1e-6)
