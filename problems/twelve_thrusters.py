"""Move and turn a body by twelve thrusters that are fixed to it, with the least impulse.

Each thruster pushes one way, between 0 and its largest thrust; pairs of them turn the body. The position is in
space axes, the thrust in body axes. The least impulse is 5.750 N s at the defaults, by another discretisation
of the state as well; with Effort() in its place the least effort is 1.51254 N^2 s.
"""

from dmoc import Fuel, Pose, Thrusters, TransferProblem, rotation

PLACES = [(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0), (0, 1, 1), (0, 1, -1)]
PLACES += [(0, -1, 1), (0, -1, -1), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1)]
WAYS = [(-1, 0, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0), (0, -1, 0), (0, -1, 0)]
WAYS += [(0, 1, 0), (0, 1, 0), (0, 0, -1), (0, 0, -1), (0, 0, 1), (0, 0, 1)]


def problem(goal: tuple = (2.0, 1.0, -1.0), degrees: float = 85.94366926962348, thrust: float = 1.0):
    """The transfer.

    Parameters
    ----------
    goal : tuple [m]
        Where the body comes to rest.
    degrees : float [degrees]
        Angle of its turn about (0.2, 0.5, -0.8).
    thrust : float [N]
        Largest thrust of each thruster.
    """
    return TransferProblem(
        mass=3.0,
        inertia=(1.0, 2.0, 2.8),
        start=Pose((0, 0, 0)),
        goal=Pose(goal, attitude=rotation((0.2, 0.5, -0.8), degrees)),
        duration=6.0,
        actuator=Thrusters([[0.5 * x for x in place] for place in PLACES], WAYS, thrust),
        objective=Fuel(),
    )
