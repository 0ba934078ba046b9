"""Raise the first link of a hanging chain by one motor, so that the others hang at rest at the end."""

import math

from dmoc import JointState, JointTorque, Member, Rod, System, TransferProblem, UniformGravity


def problem(links=3, degrees=60.0, duration=4.0, length=0.5, limit=10.0):
    """A chain of points on rods, from straight down to its first rod raised; only that rod is driven.

    The least effort found is 7.4856614 N^2 m^2 s, at order 8 with 100 steps and, to five digits, by default.

    Parameters
    ----------
    links : int
        Number of rods, each with 1 kg at its end.
    degrees : float
        How far the first rod is raised from straight down.
    duration : float
        Time of the move [s].
    length : float
        Length of each rod [m].
    limit : float
        Largest torque of the motor [N m].
    """
    names = [f"link{i + 1}" for i in range(links)]
    rods = [Rod((0, 0) if i == 0 else names[i - 1], length, on=name) for i, name in enumerate(names)]
    down = JointState(-math.pi / 2)
    return TransferProblem(
        System([Member(name, 1.0) for name in names], rods),
        start=dict.fromkeys(rods, down),
        goal=dict.fromkeys(rods, down) | {rods[0]: JointState(math.radians(degrees - 90))},
        duration=duration,
        effects=[UniformGravity((0, -9.81))],
        actuator=JointTorque(rods[0], limit),
    )
