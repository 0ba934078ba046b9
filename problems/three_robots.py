"""Let two robots change places while a third one crosses between them, all kept apart, least effort.

On straight lines all three would be in the middle at one time. At the best path the third one touches the
distance to each of the others once, at 13.885 s and 16.115 s, and the effort is 1.80540487595 N^2 s: so say
cubic splines through those two places, the best of them at the worst times, and order 8 with steps cut where
they touch. The same on the other side of the middle costs as much; other ways round cost 2.10 and 2.84.
"""

from dmoc import Apart, State, Team, TransferProblem


def problem(distance: float = 1.0, duration: float = 30.0, width: float = 4.0, third_mass: float = 14.0):
    """The three robots, in the plane.

    Parameters
    ----------
    distance : float [m]
        The least distance of their centres.
    duration : float [s]
        Time for all of it.
    width : float [m]
        How far each one goes.
    third_mass : float [kg]
        Mass of the robot that crosses; the others have 9.6 kg.
    """
    half = 0.5 * width

    def robot(name, mass, start, goal):
        ends = State(start, (0, 0)), State(goal, (0, 0))
        return TransferProblem(mass, *ends, duration, name=name)

    robots = [
        robot("east", 9.6, (-half, 0), (half, 0)),
        robot("west", 9.6, (half, 0), (-half, 0)),
        robot("north", third_mass, (0, -half), (0, half)),
    ]
    return Team(robots, [Apart(distance)])
