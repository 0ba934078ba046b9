"""From an eccentric orbit to another in 1.8 revolutions: 50 steps of order 6 miss the goal."""

from dmoc import Effort, FreeForce, PointGravity, State, TransferProblem


def problem():
    """The best known optimum is 0.016439377 N^2 s, another one 0.04395; on the mesh that misses, 0.0244."""
    return TransferProblem(
        mass=175.9382902213579,
        start=State(
            (0.19316126523639227, 0.5675352437924454, -0.19044755923247567),
            (-0.06746696999599958, -0.013159523674003018, -0.04893819195432762),
        ),
        goal=State(
            (0.5134081919233747, 0.6370647568233992, -0.3109099325869127),
            (-0.053390870212963355, 0.016678131479970496, -0.023111078174885814),
        ),
        duration=614.1469569026357,
        effects=[PointGravity(0.002421560436828885)],
        actuator=FreeForce(),
        objective=Effort(),
    )
