"""Iterations and evaluations do not creep up: on every problem against recorded numbers, and warm against cold.

Times depend on the computer; these counts do not. To record anew, after a change that is worth it:

    ./scripts/run python tests/test_iteration_counts.py
"""

from functools import lru_cache

import pytest

from dmoc import solve
from dmoc.climb import Climb
from dmoc.guess import starting_guess
from dmoc.library import catalogue, load_problem
from dmoc.mesh import uniform_mesh

# Each problem at its defaults, (order, steps): iterations and evaluations on all meshes.
RECORD = {
    "bang_bang": {(2, 400): (17, 114), (8, 32): (13, 84)},
    "drone_hop": {(2, 400): (43, 430), (8, 32): (29, 340)},
    "earth_mars": {(2, 400): (70, 444), (8, 32): (87, 566)},
    "formation": {(2, 400): (48, 304), (8, 32): (28, 174)},
    "free_flyer": {(2, 400): (97, 660), (8, 32): (64, 394)},
    "goddard": {(2, 400): (73, 450), (8, 32): (73, 448)},
    "halo_transfer": {(2, 400): (176, 1112), (8, 32): (148, 940)},
    "hovercraft": {(2, 400): (89, 606), (8, 32): (95, 612)},
    "leo_raise": {(2, 400): (121, 782), (8, 32): (109, 688)},
    "lunar_landing": {(2, 400): (22, 150), (8, 32): (88, 574)},
    "orbit_raise": {(2, 400): (5, 36), (8, 32): (6, 42)},
    "point_to_point": {(2, 400): (1, 12), (8, 32): (1, 12)},
    "rendezvous": {(2, 400): (1, 12), (8, 32): (1, 12)},
    "two_body_fuel": {(2, 400): (152, 984), (8, 32): (111, 718)},
}
MESHES = ((2, 400), (8, 32))
GROWTH = 1.2
# Not counted, and why.
LEFT_OUT = {
    "dionysus": "five revolutions: neither mesh is fine enough",
    "geo_raise": "twenty revolutions: neither mesh is fine enough",
}
# Where a warm start may take more iterations on the last mesh than a cold one, and why.
SLOWER_WARM = {
    ("leo_raise", 2, 400): "least fuel: 46 iterations warm; cold 35 to 140, or none in 1,000, by rounding. "
    "Throttles interpolated across a switch break the dynamics, and the first ten steps are cut short by "
    "limits 1e-8 away; a push of 1e-4 off the limits takes fewer here, but 5,424 instead of 4,874 over 32 "
    "variants of least fuel",
}
CASES = [(name, *at) for name, counts in RECORD.items() for at in counts]


@lru_cache
def warm(name, order, steps):
    return solve(load_problem(name).make(), order=order, steps=steps).raise_for_status()


def counted(solution):
    return solution.iterations, solution.evaluations


def record():
    """The table above, as it would be now."""
    for name in [name for name, _ in catalogue() if name not in LEFT_OUT]:
        counts = {at: counted(warm(name, *at)) for at in MESHES}
        print(f'    "{name}": {counts},')


@pytest.mark.parametrize("name", [name for name, _ in catalogue()])
def test_every_problem_file_is_recorded(name):
    assert name in RECORD or name in LEFT_OUT, (
        "run this file as a script and add the line it prints for the new problem"
    )


@pytest.mark.parametrize("name, order, steps", CASES)
def test_counts_have_not_grown(name, order, steps):
    recorded, found = RECORD[name][order, steps], warm(name, order, steps)
    levels = [(level.steps, level.iterations, level.evaluations) for level in found.ladder]
    # one iteration more or less, with its evaluations, is not a trend
    for before, now, few in zip(recorded, counted(found), (1, 6), strict=True):
        assert now <= max(GROWTH * before, before + few), f"recorded {recorded}, now {levels}"


@pytest.mark.parametrize(
    "name, order, steps",
    [
        pytest.param(*case, marks=pytest.mark.xfail(strict=False, reason=SLOWER_WARM[case]))
        if case in SLOWER_WARM
        else case
        for case in CASES
    ],
)
def test_the_last_mesh_takes_no_more_iterations_warm_than_cold(name, order, steps):
    problem = load_problem(name).make()
    cold = Climb(problem)
    solved = cold.solve_on(starting_guess(problem, uniform_mesh(steps), order, False))
    last = warm(name, order, steps).ladder[-1]
    assert not solved or last.iterations <= cold.levels[-1].iterations


if __name__ == "__main__":
    record()
