"""Reach out with an arm of two rods, motors in shoulder and elbow, at their least effort."""

import numpy as np

from dmoc import JointTorque, Member, Rod, State, System, TransferProblem, UniformGravity


def problem(upper=1.2, lower=2.0, duration=4.0):
    """Masses of 1 kg at the ends of rods of 1 m that hang at rest; gravity is 1 m/s^2.

    Parameters
    ----------
    upper, lower : float
        Angles of the rods with the vertical at the goal [rad].
    duration : float
        Time of the reach [s].
    """
    arm = Rod((0, 0), 1.0, on="elbow")
    forearm = Rod("elbow", 1.0, on="hand")

    def posed(first, second):
        elbow = np.array([np.sin(first), -np.cos(first)])
        hand = elbow + np.array([np.sin(second), -np.cos(second)])
        return {"elbow": State(elbow, (0, 0)), "hand": State(hand, (0, 0))}

    return TransferProblem(
        System([Member("elbow", 1.0), Member("hand", 1.0)], [arm, forearm]),
        start=posed(0.0, 0.0),
        goal=posed(upper, lower),
        duration=duration,
        effects=[UniformGravity((0, -1))],
        actuator=[JointTorque(arm), JointTorque(forearm, against=arm)],
    )
