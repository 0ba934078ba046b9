"""Spiral up to the geostationary orbit in twenty revolutions, with a change of plane, least effort.

A satellite of one ton leaves a circular orbit of half the radius at a node of its plane, inclined as
Cape Canaveral's latitude makes it, and arrives in the Earth's equator after a whole number of
revolutions; its thrust is not limited. The program guesses the spiral, and takes as many steps as the
revolutions need: 20 each, of order 6.

As the revolutions become many, the orbit stays a circle and its speed V and inclination i change slowly:
dV/dt is minus the thrust along the path over m, and di/dt its amplitude a across, when it swings as
a cos(L) with the angle from the node, over 2 m V. The mean of its square is a^2 / 2, so that

    effort = m^2/2 integral of (dV/dt)^2 + 2 V^2 (di/dt)^2 dt  ->  m^2 D^2 / (2 T),
    D^2 = V1^2 + V2^2 - 2 V1 V2 cos(sqrt(2) (i1 - i2)),

a straight line in the polar coordinates V and sqrt(2) i, passed evenly. The duration T is the one in
which that makes the revolutions wanted, 2 pi n = integral of V^3/mu dt. (At constant thrust, with a
sign that switches twice a revolution, pi/2 stands for sqrt(2): T. N. Edelbaum, Propulsion requirements
for controllable satellites, ARS Journal 31 (1961).)

Optimum at the defaults: 3728452.0 N^2 s, 0.99978 of that limit (400 steps of order 8); 0.9962 of it for
five revolutions, 0.9991 for ten, 0.99995 for forty; in the plane 1.0065 for five and 1.0004 for twenty.
At order 2 the same takes 13,000 steps: phase errors add up.
"""

import math

from dmoc import PointGravity, State, TransferProblem

MU, SLOT = 3.986004418e14, 42164170.0


def limit(revolutions: float, radius: float, inclination: float) -> tuple[float, float]:
    """Duration [s] and D [m/s] as the revolutions become many."""
    fast, slow, angle = math.sqrt(MU / radius), math.sqrt(MU / SLOT), math.sqrt(2) * inclination
    x, y = (slow * math.cos(angle) - fast) / 1000, slow * math.sin(angle) / 1000
    mean = sum(math.hypot(fast + x * (k + 0.5), y * (k + 0.5)) ** 3 for k in range(1000)) / 1000
    return 2 * math.pi * revolutions * MU / mean, 1000 * math.hypot(x, y)


def problem(
    revolutions: float = 20.0,
    radius: float = 21082085.0,
    inclination: float = math.radians(28.5),
    mass: float = 1000.0,
):
    """The transfer.

    Parameters
    ----------
    revolutions : float [-]
        How often it goes around the Earth.
    radius : float [m]
        Radius of the orbit at the start.
    inclination : float [rad]
        Inclination at the start; 0: in the plane.
    mass : float [kg]
        Mass of the satellite.
    """
    fast, slow, end = math.sqrt(MU / radius), math.sqrt(MU / SLOT), 2 * math.pi * revolutions
    return TransferProblem(
        mass=mass,
        start=State((radius, 0, 0), (0, fast * math.cos(inclination), fast * math.sin(inclination))),
        goal=State(
            (SLOT * math.cos(end), SLOT * math.sin(end), 0), (-slow * math.sin(end), slow * math.cos(end), 0)
        ),
        duration=limit(revolutions, radius, inclination)[0],
        effects=[PointGravity(MU)],
    )
