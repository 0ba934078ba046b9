"""Swing up two rods by a motor in the joint between them alone, at the least effort."""

from dmoc import JointTorque, Member, Rod, State, System, TransferProblem, UniformGravity


def problem(duration=8.0, limit=None):
    """Masses of 1 kg at the ends of rods of 1 m; gravity is 1 m/s^2.

    There are many swings: from the default guess the effort is 7.1991 N^2 m^2 s, and `--starts 4` finds one of
    1.79547.

    Parameters
    ----------
    duration : float
        Time of the swing [s].
    limit : float, optional
        Largest torque of the motor [N m]; none if not given.
    """
    upper = Rod((0, 0), 1.0, on="joint")
    lower = Rod("joint", 1.0, on="tip")
    return TransferProblem(
        System([Member("joint", 1.0), Member("tip", 1.0)], [upper, lower]),
        start={"joint": State((0, -1), (0, 0)), "tip": State((0, -2), (0, 0))},
        goal={"joint": State((0, 1), (0, 0)), "tip": State((0, 2), (0, 0))},
        duration=duration,
        effects=[UniformGravity((0, -1))],
        actuator=JointTorque(lower, limit, against=upper),
    )
