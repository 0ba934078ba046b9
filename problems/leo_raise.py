"""Raise a satellite's low orbit by 50 km, least fuel, with oblateness and drag.

A satellite of 500 kg with hydrazine thrusters of 4 N in all, two revolutions around the Earth. It
starts at the ascending node of a circular orbit at 300 km; the goal is any circular orbit at 350 km.
With J2 no orbit stays circular: what is meant is the orbit that it would go on along without.

Optimum at the defaults: 6.6802297 kg (`--structure`, five burns in ten legs); without drag 6.6457 kg,
without J2 6.6396 kg, with neither 6.6211 kg, which is what two impulses need.

D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th edition (2013), table 8-4 (air).
"""

import math

from dmoc import (
    J2,
    CircularOrbit,
    Drag,
    Effect,
    Engine,
    ExponentialAtmosphere,
    Fuel,
    PointGravity,
    State,
    TransferProblem,
)

MU, RADIUS, OBLATENESS, TURN = 3.986004418e14, 6378137.0, 1.08262668e-3, 7.2921159e-5
AIR = ExponentialAtmosphere(2.418e-11, 300e3, 53.628e3, RADIUS, TURN)


def problem(
    height: float = 300e3,
    climb: float = 50e3,
    inclination: float = math.radians(51.6),
    duration: float = 10800.0,
    mass: float = 500.0,
    thrust: float = 4.0,
    specific_impulse: float = 220.0,
    oblate: bool = True,
    air: bool = True,
):
    """The transfer.

    Parameters
    ----------
    height : float [m]
        Height of the orbit at the start.
    climb : float [m]
        How much higher the goal is.
    inclination : float [rad]
        Inclination at the start; it is free at the goal.
    duration : float [s]
        Time of the transfer.
    mass : float [kg]
        Mass at the start.
    thrust : float [N]
        Largest thrust.
    specific_impulse : float [s]
        Specific impulse of the thrusters.
    oblate : bool [-]
        Whether the oblateness of the Earth acts.
    air : bool [-]
        Whether drag acts, on 5 m^2 with a drag coefficient of 2.2.
    """
    radius = RADIUS + height
    along, up = math.cos(inclination), math.sin(inclination)
    speed = math.sqrt(MU / radius)
    effects: list[Effect] = [PointGravity(MU)]
    effects += [J2(MU, RADIUS, OBLATENESS)] if oblate else []
    effects += [Drag(5.0, 2.2, AIR)] if air else []
    return TransferProblem(
        mass=mass,
        start=State((radius, 0, 0), (0, speed * along, speed * up)),
        goal=CircularOrbit(radius + climb, MU),
        duration=duration,
        effects=effects,
        actuator=Engine(thrust, specific_impulse=specific_impulse),
        objective=Fuel(),
    )
