"""Carry as much as possible to a geostationary transfer orbit with a Delta III, in four legs.

Six boosters and the first stage burn, then three boosters and the first stage, the first stage alone, and the
second stage as long as it takes. Empty parts are left behind between the legs. The Earth attracts as a point,
and its air turns with it.

Optimum: 7529.712 kg (Betts, Practical Methods for Optimal Control and Estimation Using Nonlinear Programming,
2010, who has the data from Benson, 2004); 7529.712296 by indirect shooting.
"""

from math import cos, pi, radians, sin

from dmoc import Drag, Drop, Engine, ExponentialAtmosphere, FinalMass, Leg, Mission, Orbit, PointGravity, State

MU, RADIUS, RATE = 3.986012e14, 6378145.0, 7.29211585e-5  # m^3/s^2, m, rad/s
# Thrust [N] and propellant a second [kg/s].
BOOSTER = (628500.0, 17010.0 / 75.2)
FIRST = (1083100.0, 95550.0 / 261.0)
SECOND = (110094.0, 16820.0 / 700.0)


def engine(*parts):
    thrust, flow = map(sum, zip(*parts, strict=True))
    return Engine(thrust, exhaust_velocity=thrust / flow, min_thrust=thrust)


def problem(latitude: float = 28.5, apogee: float = 24361140.0 * 1.7308):
    """The ascent.

    Parameters
    ----------
    latitude : float [deg]
        Of the launch pad, and the inclination of the orbit.
    apogee : float [m]
        Largest distance of the orbit from the Earth's centre.
    """
    north = radians(latitude)
    pad = RADIUS * cos(north), 0.0, RADIUS * sin(north)
    air = ExponentialAtmosphere(1.225, 0.0, 7200.0, RADIUS, rate=RATE)
    node, perigee = radians(269.8), radians(130.5)
    return Mission(
        mass=301454.0,
        start=State(pad, (0.0, RATE * pad[0], 0.0)),
        goal=Orbit(MU, a=apogee / 1.7308, e=0.7308, i=north, raan=node, argp=perigee),
        effects=[PointGravity(MU), Drag(4 * pi, 0.5, air)],
        legs=[
            Leg(75.2, actuator=engine(*[BOOSTER] * 6, FIRST), name="six boosters"),
            Drop(13680.0),
            Leg(75.2, actuator=engine(*[BOOSTER] * 3, FIRST), name="three boosters"),
            Drop(6840.0),
            Leg(110.6, actuator=engine(FIRST), name="first stage"),
            Drop(8830.0),
            Leg((300.0, 700.0), actuator=engine(SECOND), name="second stage"),
        ],
        objective=FinalMass(),
    )
