"""Climb in two stages to the height and speed of an orbit over a flat Earth, with the most mass left.

Gravity is the same everywhere and there is no air. The first stage burns as long as its propellant lasts, then
its shell is dropped, and the second stage burns until the goal is reached. Both engines always burn fully; only
their direction is sought. Its tangent is linear in time over both stages.

Optimum at the defaults: 20162.4824 kg (shooting with that law).

A. E. Bryson, Y.-C. Ho, Applied Optimal Control (1975), sections 2.4 and 2.7.
"""

from dmoc import Drop, Engine, FinalMass, Leg, Mission, State, UniformGravity


def problem(mass: float = 300e3, shell: float = 18e3, height: float = 200e3, speed: float = 7.8e3):
    """The ascent.

    Parameters
    ----------
    mass : float [kg]
        Mass at lift-off.
    shell : float [kg]
        What is dropped between the stages.
    height : float [m]
        Height of the goal.
    speed : float [m/s]
        Horizontal speed of the goal.
    """
    first = Engine(4.2e6, exhaust_velocity=3000.0, min_thrust=4.2e6)
    second = Engine(7.5e5, exhaust_velocity=4400.0, min_thrust=7.5e5)
    return Mission(
        mass=mass,
        start=State((0, 0), (0, 0)),
        goal=State((None, height), (speed, 0)),
        legs=[
            Leg(150.0, actuator=first, name="first stage"),
            Drop(shell),
            Leg((100.0, 400.0), actuator=second, name="second stage"),
        ],
        effects=[UniformGravity((0, -9.81))],
        objective=FinalMass(),
    )
