"""Turn a satellite by 120 degrees with four reaction wheels, none of which may store too much."""

from dmoc import Attitude, TransferProblem, Wheels, rotation


def problem(angle=120.0, duration=60.0, torque=0.2, momentum=0.4):
    """A satellite of 100 kg that starts and ends at rest.

    Parameters
    ----------
    angle : float
        Turn about the direction (1, 2, 1) [degrees].
    duration : float
        Time of the turn [s].
    torque : float
        Largest torque of the motor of each wheel [N m].
    momentum : float
        Largest angular momentum that each wheel stores [N m s].
    """
    pyramid = [(1, 0, 0.7), (-1, 0, 0.7), (0, 1, 0.7), (0, -1, 0.7)]
    return TransferProblem(
        mass=100.0,
        inertia=(12.0, 15.0, 20.0),
        start=Attitude((1, 0, 0, 0)),
        goal=Attitude(rotation((1, 2, 1), angle)),
        duration=duration,
        actuator=Wheels(pyramid, torque, momentum),
    )
