"""Spin up two satellites on a tether by small thrusters, from rest to a given rate, at the least effort."""

import numpy as np

from dmoc import FreeForce, Member, On, Rod, State, System, TransferProblem


def problem(rate=0.1, duration=60.0, length=20.0):
    """Two bodies of 50 kg and 100 kg in free space that end a quarter of a turn further on.

    Parameters
    ----------
    rate : float
        Angular rate at the end [rad/s].
    duration : float
        Time of the spin-up [s].
    length : float
        Length of the tether [m]; it stays taut.
    """
    near, far = -length / 3, 2 * length / 3

    def at(angle, turning):
        out, along = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        arms = {"heavy": near, "light": far}
        return {name: State(arm * out, turning * arm * along) for name, arm in arms.items()}

    return TransferProblem(
        System([Member("heavy", 100.0), Member("light", 50.0)], [Rod("heavy", length, on="light")]),
        start=at(0.0, 0.0),
        goal=at(np.pi / 2, rate),
        duration=duration,
        actuator=[On("heavy", FreeForce()), On("light", FreeForce())],
    )
