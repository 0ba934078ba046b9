"""From an eccentric orbit to another in 2.4 revolutions with a limit of the force: 100 steps miss the goal."""

from dmoc import BallForce, Effort, PointGravity, State, TransferProblem


def problem():
    """It costs 1.15999e-5 N^2 s, and four times less on a mesh that does not follow the pericentre."""
    return TransferProblem(
        mass=0.22834999882671475,
        start=State(
            (0.691335821265284, 1.3807838252867428, 2.0870172487851892),
            (0.3087427172535415, -0.01713496439371025, 0.6239047643974206),
        ),
        goal=State(
            (0.8807634632091298, 1.2344953021073812, 1.2592766372558812),
            (0.3703177092243228, -0.05356060104580499, 0.6602854922211224),
        ),
        duration=64.9388831780397,
        effects=[PointGravity(1.0)],
        actuator=BallForce(0.07034820327771464),
        objective=Effort(),
    )
