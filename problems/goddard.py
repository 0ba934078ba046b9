"""Send a sounding rocket as high as its propellant takes it.

One dimension, along the radius. Full thrust, then a singular arc on which thrust balances drag
against gravity, then a coast to the top. Canonical units: the radius of the Earth, its gravity at
the ground and the mass at the start are 1. Drag is 310 v^2 exp(-500 (h - 1)).

Optimum at the defaults: a height of 1.012836918 after 0.198856, full thrust until 0.0235, the
singular arc until 0.0727 (collocation in three phases; published: 1.01283). The thrust is smooth on
the singular arc with forces at the nodes; held forces reach the same height but jump from step to
step there, since drag sees only the mean velocity of a step.

E. D. Dolan, J. J. More, T. S. Munson, Benchmarking optimization software with COPS 3.0 (2004).
"""

from dataclasses import dataclass

import casadi as ca

from dmoc import FinalHeight, Force, Nozzles, PointGravity, State, TransferProblem


@dataclass(frozen=True)
class ThinningAir(Force):
    """Drag in air that thins out with the height."""

    coefficient: float
    decay: float

    def force(self, t, q, v, m):
        return -self.coefficient * ca.exp(-self.decay * (q - 1)) * ca.fabs(v) * v


def problem(
    thrust: float = 3.5,
    exhaust_velocity: float = 0.5,
    dry_mass: float = 0.6,
    drag: float = 310.0,
    decay: float = 500.0,
):
    """The ascent.

    Parameters
    ----------
    thrust : float [N]
        Largest thrust, upwards; the weight at the start is 1.
    exhaust_velocity : float [m/s]
        Exhaust velocity of the engine.
    dry_mass : float [kg]
        Mass without propellant.
    drag : float [kg/m]
        Drag at the ground over the square of the speed.
    decay : float [1/m]
        How fast the air thins out: the inverse of its scale height.
    """
    return TransferProblem(
        mass=1.0,
        start=State([1], [0]),
        goal=State([None], [None]),
        duration=(0.05, 1.0),
        effects=[PointGravity(mu=1.0), ThinningAir(drag, decay)],
        actuator=Nozzles([(1,)], thrust, exhaust_velocity=exhaust_velocity, dry_mass=dry_mass),
        objective=FinalHeight(),
    )
