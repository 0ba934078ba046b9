"""Reach with the arm of a free-flyer whose base is free: its total angular momentum stays zero."""

from dmoc import JointState, JointTorque, Member, Pose, Revolute, System, TransferProblem


def problem(shoulder_angle=1.0, elbow_angle=-1.4, duration=10.0, limit=0.2):
    """A free-flyer of 10 kg and its arm of two links, from folded to reaching, by motors in the joints alone.

    The effort is 1.10957918e-4 N^2 m^2 s at order 8 with 64 steps, 1.10957914e-4 by default. Where the forearm
    comes by the other side, as `--starts 4` finds, it is 6.1329e-5.

    Parameters
    ----------
    shoulder_angle, elbow_angle : float
        Angles of the joints at the goal [rad].
    duration : float
        Time of the reach [s].
    limit : float
        Largest torque of each motor [N m].
    """
    upper = Revolute((0, 0, 1), anchor=(0.15, 0, 0), at=(-0.2, 0, 0), on="upper", to="base")
    fore = Revolute((0, 1, 0), anchor=(0.2, 0, 0), at=(-0.2, 0, 0), on="fore", to="upper")
    bodies = [
        Member("base", 10.0, inertia=(0.15, 0.16, 0.17)),
        Member("upper", 1.0, inertia=(0.002, 0.014, 0.014)),
        Member("fore", 0.8, inertia=(0.002, 0.011, 0.011)),
    ]
    return TransferProblem(
        System(bodies, links=[upper, fore]),
        start={"base": Pose((0, 0, 0)), upper: JointState(0.0), fore: JointState(2.4)},
        goal={upper: JointState(shoulder_angle), fore: JointState(elbow_angle)},
        duration=duration,
        actuator=[JointTorque(upper, limit), JointTorque(fore, limit)],
    )
