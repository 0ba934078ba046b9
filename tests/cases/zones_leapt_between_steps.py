"""Three zones that overlap stand in the way: the optimum of 20 steps leaps them between two nodes."""

from dmoc import Effort, FreeForce, KeepOut, State, TransferProblem


def problem():
    """The best way past them costs 31,435 N^2 s, the leap on 20 steps a million and more on finer ones."""
    return TransferProblem(
        mass=9.032934181330864,
        start=State((-0.41779123290903497, 0.5340506054961818), (0.0, 0.0)),
        goal=State((-0.2486214399692568, 2.445560339415441), (-0.49814691466844324, -0.27338856908719644)),
        duration=0.5237001990741825,
        actuator=FreeForce(),
        objective=Effort(),
        constraints=[
            KeepOut((-0.5558243309493964, 1.0734348977249089), 0.27066716392242385),
            KeepOut((-0.26312800018804666, 1.8505727474716123), 0.5134522194967192),
            KeepOut((-0.20681849141279474, 1.3623567267254975), 0.33669369546064676),
        ],
    )
