"""Three zones and drag from rest to rest: 32 steps of order 8 leap them between two nodes."""

from dmoc import Effort, FreeForce, KeepOut, LinearDrag, State, TransferProblem


def problem():
    """The best way past them costs 26,401 N^2 s, the leap 1.8 million."""
    return TransferProblem(
        mass=22.181693019032675,
        start=State((0.04906939880950634, -0.9920546904425807), (0.0, 0.0)),
        goal=State((1.9892959963140378, -3.154187323385753), (0.0, 0.0)),
        duration=1.3030460352017736,
        effects=[LinearDrag(12.237132134923595)],
        actuator=FreeForce(),
        objective=Effort(),
        constraints=[
            KeepOut((1.0543229907888831, -1.7600673151825497), 0.575253163611936),
            KeepOut((0.7847707646402418, -1.7431998183435211), 0.43217391167186825),
            KeepOut((1.1134425123078462, -2.873860466452239), 0.5920783889526086),
        ],
    )
