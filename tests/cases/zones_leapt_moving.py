"""Three zones, two of them nearly one, between ends that move: 20 steps leap them between two nodes."""

from dmoc import Effort, FreeForce, KeepOut, State, TransferProblem


def problem():
    """The best way past them costs 35.874 N^2 s, the leap on 20 steps 1,110."""
    return TransferProblem(
        mass=2.1338280273263996,
        start=State((-0.3042747475092449, -0.5561534321233947), (0.729134864846574, -0.05856396579896766)),
        goal=State((2.0244475949205807, 0.8916041295966703), (0.3658235454461933, -0.5274392417377274)),
        duration=1.7347353126176914,
        actuator=FreeForce(),
        objective=Effort(),
        constraints=[
            KeepOut((0.6290003385139673, -0.1424136790213955), 0.28634089972647486),
            KeepOut((0.6262739823170922, -0.10330413169048042), 0.22660652239313894),
            KeepOut((0.8570758358138066, 0.2152522015105902), 0.24478806613083692),
        ],
    )
