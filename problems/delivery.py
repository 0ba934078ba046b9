"""Let a robot set down its load at a place on its way while another one crosses, kept apart, least effort.

The courier touches the distance to the other one at 16.549 s and is at the place at 20.112 s, and the effort is
1.56103672760 N^2 s: so say cubic splines through both, the cheapest of them in the time of the place and the
dearest in that of the touch, and order 8 with steps cut where they touch. On the other side it costs 1.70.
"""

from dmoc import Apart, Drop, Leg, Mission, State, Team, TransferProblem, Via


def problem(distance: float = 1.0, duration: float = 30.0, load: float = 9.6, place: float = 1.0):
    """The two robots, in the plane.

    Parameters
    ----------
    distance : float [m]
        The least distance of their centres.
    duration : float [s]
        Time for all of it.
    load : float [kg]
        Mass that the courier leaves behind; without it, it has 9.6 kg as the other one has.
    place : float [m]
        How far behind the middle the load is set down.
    """
    courier = Mission(
        mass=9.6 + load,
        start=State((-2, 0), (0, 0)),
        goal=State((2, 0), (0, 0)),
        legs=[Leg(name="loaded"), Via((place, 0.5)), Drop(load), Leg(name="empty")],
        duration=duration,
        name="courier",
    )
    crosser = TransferProblem(9.6, State((0.3, -2), (0, 0)), State((0, 2), (0, 0)), duration, name="crosser")
    return Team([courier, crosser], [Apart(distance)])
