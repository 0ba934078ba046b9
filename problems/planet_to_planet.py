"""Fly from one planet to another by two impulses, at the best time within years, in the best duration.

The planets are like the Earth and Mars, in one plane: semi-major axes 1 and 1.524, eccentricities 0.0167 and
0.0934; units in which the Sun's attraction is 1, so that a year lasts 2 pi. A grid of Lambert's problems over
departure and duration gives the start, the optimisation the rest. With both given, a sweep over them is the map
by which launch windows are found.
"""

from dmoc import Coast, DeltaV, Impulse, Mission, Moving, PointGravity, kepler_motion


def problem(earliest: float = 0.0, latest: float = 14.0, longest: float = 8.0, departure=None, flight=None):
    """The transfer.

    Parameters
    ----------
    earliest : float [s]
        Earliest departure.
    latest : float [s]
        Latest departure.
    longest : float [s]
        Longest duration of the flight.
    departure : float or None [s]
        Departure; None: the best between earliest and latest.
    flight : float or None [s]
        Duration of the flight; None: the best up to the longest.
    """
    home = kepler_motion(1.0, 1.0, 0.0167, 0.0, 0.0, 1.8, 0.0)
    there = kepler_motion(1.0, 1.524, 0.0934, 0.0, 0.0, 5.0, 2.0)
    return Mission(
        mass=1.0,
        start=Moving(lambda t: home(t)[:2]),
        goal=Moving(lambda t: there(t)[:2]),
        effects=[PointGravity(1.0)],
        legs=[Impulse(), Coast((0.5, longest) if flight is None else flight), Impulse()],
        objective=DeltaV(),
        start_time=(earliest, latest) if departure is None else departure,
    )
