"""Land softly on the Moon along a vertical, least fuel.

The lander falls freely and then brakes at full thrust u down to the ground: one switch (Pontryagin),
at the speed w = sqrt((v^2 + 2 g h) (1 - g/u)). The mass is taken as constant and is 1, so that fuel
is the integral of the thrust, w u / (u - g): 8.246211251 N s at the defaults, where the switch is at
1.4154037504 and the landing at 4.1641408342. Canonical units; gravity is 1.5.

J. S. Meditch, On the problem of optimal thrust programming for a lunar soft landing (1964).
"""

from dmoc import Fuel, Nozzles, State, TransferProblem, UniformGravity


def problem(height: float = 10.0, speed: float = 2.0, gravity: float = 1.5, thrust: float = 3.0):
    """The landing.

    Parameters
    ----------
    height : float [m]
        Height at the start.
    speed : float [m/s]
        Speed at the start, downwards.
    gravity : float [m/s^2]
        Gravity of the Moon.
    thrust : float [N]
        Largest thrust, upwards.
    """
    return TransferProblem(
        mass=1.0,
        start=State([height], [-speed]),
        goal=State([0], [0]),
        duration=(0.5, 20.0),
        effects=[UniformGravity([-gravity])],
        actuator=Nozzles([(1,)], thrust),
        objective=Fuel(),
    )
