"""Constants of effects as numbers of a problem: their worth, changed without a rebuild, predicted."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

from dmoc import (
    Drag,
    Leg,
    LinearDrag,
    Mission,
    PointGravity,
    State,
    TransferProblem,
    UniformAtmosphere,
    UniformGravity,
    Unknown,
    Via,
    predict,
    solve,
    transcribe,
    worth,
)
from dmoc.effects.base import Conservative
from dmoc.nlp.stencils import stencils_of


def scene(drag=1.0, fall=-0.1, density=1.2):
    effects = [LinearDrag(drag), UniformGravity((0.0, fall)), Drag(0.5, 1.0, UniformAtmosphere(density))]
    return TransferProblem(10.0, State((0, 0), (0, 0)), State((3, 1), (0, 0)), 10.0, effects=effects)


NAMES = {
    "drag": "linear_drag_1_coefficient",
    "fall": "uniform_gravity_2_acceleration.y",
    "density": "drag_3_atmosphere_density",
}


@pytest.mark.parametrize("name, value", [("drag", 1.0), ("fall", -0.1), ("density", 1.2)])
def test_the_worth_of_a_constant_is_that_of_solving_again(name, value):
    """Also of one in a part of an effect, and of one entry of a vector."""

    def cost(changed):
        return solve(scene(**{name: changed}), order=4, steps=12, options={"ipopt.tol": 1e-11}).objective

    found = worth(solve(scene(), order=4, steps=12))[NAMES[name]]
    step = 1e-4 * abs(value)
    assert found.value == pytest.approx((cost(value + step) - cost(value - step)) / (2 * step), rel=1e-6)
    assert found.number == value and found.unit.startswith("N^2 s/")


def test_the_worth_of_a_constant_of_a_mission():
    def mission(mu):
        legs = [Leg(1.5), Via((0.0, 1.3)), Leg(1.5)]
        return Mission(
            1.0, State((1, 0), (0, 1)), State((-1.3, 0), (0, -0.8)), legs, effects=[PointGravity(mu)]
        )

    found = worth(solve(mission(1.0), order=4, steps=8))["point_gravity_1_mu"]
    up, down = (
        solve(mission(mu), order=4, steps=8, options={"ipopt.tol": 1e-11}).objective for mu in (1.0001, 0.9999)
    )
    assert found.value == pytest.approx((up - down) / 2e-4, rel=1e-5)


def test_a_constant_that_is_unknown_changes_without_a_rebuild():
    nlp = transcribe(scene(drag=Unknown(1.0)), 12, 4)
    again = nlp.solve(scene(drag=Unknown(1.7)))
    wanted = solve(scene(drag=1.7), order=4, steps=12)
    assert again.objective == pytest.approx(wanted.objective, rel=1e-8)
    assert again.velocity == pytest.approx(wanted.velocity, abs=1e-6)
    with pytest.raises(ValueError, match="built for another effects"):
        nlp.solve(scene(drag=1.7))
    with pytest.raises(ValueError, match="built for another effects"):
        nlp.solve(scene(drag=Unknown(1.7), fall=-0.2))


def test_a_prediction_with_another_constant():
    answer = solve(scene(), order=4, steps=12)
    path = predict(answer, linear_drag_1_coefficient=1.01)
    wanted, before = solve(scene(drag=1.01), order=4, steps=12).path, answer.path
    assert np.abs(path.control - wanted.control).max() < 0.02 * np.abs(before.control - wanted.control).max()


def test_plain_scenes_have_no_further_parameters():
    """What is not unknown is a constant of the formulas, as before: kernels know nothing of it."""
    plain, known = stencils_of(scene(), 4, False), stencils_of(scene(drag=Unknown(1.0)), 4, False)
    assert known.parameter_count == plain.parameter_count + 1
    assert scene().adjustable_parts[4:] == ()


@dataclass(frozen=True)
class Stubborn(Conservative):
    """Gravity that looks at its number before it computes.

    Parameters
    ----------
    pull : float
        [m/s^2]
    bend : float
        [1/m]
    """

    pull: float
    bend: float = 0.1

    def lagrangian(self, t, q, v, m):
        if self.pull > 5:
            raise RuntimeError
        return -float(self.pull) * q[1] * (1 + self.bend * q[1])


def test_a_number_that_formulas_do_not_take_as_a_symbol_stays_one():
    problem = replace(scene(), effects=[Stubborn(0.1)])
    found = worth(solve(problem, order=4, steps=8))
    assert "stubborn_1_pull" not in found and np.isfinite(found["stubborn_1_bend"].value)


def test_unknown_is_a_number():
    one = Unknown(2.5, sigma=0.5)
    assert one == 2.5 and type(2 * one) is float and one.sigma == 0.5
    assert Unknown((1, 2), sigma=(0.1, 0.2))[1].sigma == 0.2 and Unknown([1, 2])[0].sigma is None
    assert repr(one) == "Unknown(2.5, sigma=0.5)" and eval(repr(one)).sigma == 0.5
    assert LinearDrag(one).coefficient is one and "coefficient 2.5 N s/m" in LinearDrag(one).words()
    for value in (None, "a", float("nan"), True):
        with pytest.raises(ValueError, match="Unknown: value"):
            Unknown(value)
    with pytest.raises(ValueError, match="sigma must be greater than 0"):
        Unknown(1.0, sigma=0.0)
    with pytest.raises(ValueError, match="must not be negative"):
        LinearDrag(Unknown(-1.0))
    assert float(ca.DM(one)) == 2.5


def test_unknown_travels_between_processes():
    import copy
    import pickle

    one = scene(drag=Unknown(1.0, sigma=0.3))
    for twin in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one)):
        assert twin.effects[0].coefficient.sigma == 0.3 and twin == one
