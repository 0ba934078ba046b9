"""Two free-flying robots change places head-on while a third one crosses between them, at the least effort.

On a straight line all three would be in the middle at one time. They keep apart all along the way.
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
