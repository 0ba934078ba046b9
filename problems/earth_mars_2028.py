"""Fly from the Earth to Mars by two impulses in the launch window of 2028, at real dates.

From the barycentre of Earth and Moon to Mars, around the Sun alone: the first impulse is the excess speed of
the departure, the second that of the arrival. Date of departure and duration are free; the best of a grid of
Lambert's problems is the start. SI units, J2000 ecliptic, dates in barycentric dynamical time.

Positions are those of the ephemeris DE421 with `pip install 'dmoc[planets]'`. Without it mean elements stand
in, by which the best flight costs 0.04 m/s more and leaves 21 minutes earlier; the scene says so. A third
impulse on the way, which turns the plane, saves 340 m/s: `--impulses auto`.

Optimum at the defaults: 5989.17829 m/s with DE421, leaving at 84.47244 days and 300.69308 days on the way
(Lambert's problem between positions and velocities straight from the ephemeris, by Nelder and Mead's method).
"""

from dmoc import Coast, DeltaV, Impulse, Mission, Moving, PointGravity, planet

DAY = 86400.0
# gravitational parameter of the Sun [m^3/s^2], of DE421
SUN = 1.32712440040945e20


def problem(
    epoch: str = "2028-09-01",
    window: float = 150.0,
    shortest: float = 120.0,
    longest: float = 400.0,
    departure=None,
    flight=None,
    ephemeris=None,
):
    """The transfer.

    Parameters
    ----------
    epoch : str
        Earliest departure, TDB.
    window : float [day]
        Latest departure after it.
    shortest, longest : float [day]
        Shortest and longest flight.
    departure : float or None [day]
        Departure after the epoch; None: the best in the window.
    flight : float or None [day]
        Duration of the flight; None: the best between shortest and longest.
    ephemeris : str or None
        A file .bsp; "mean elements" for those; None: DE421 if it is installed.
    """
    last = (window if departure is None else departure) + (longest if flight is None else flight)
    earth, mars = (
        planet(name, epoch, duration=last * DAY, ephemeris=ephemeris)
        for name in ("earth-moon barycenter", "mars")
    )
    return Mission(
        mass=1000.0,
        start=Moving(earth),
        goal=Moving(mars),
        effects=[PointGravity(SUN)],
        legs=[
            Impulse(),
            Coast((shortest * DAY, longest * DAY) if flight is None else flight * DAY),
            Impulse(),
        ],
        objective=DeltaV(),
        start_time=(0.0, window * DAY) if departure is None else departure * DAY,
    )
