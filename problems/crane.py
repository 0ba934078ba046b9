"""Carry a load on a rope by a trolley, so that it hangs at rest at the end, in the least time."""

from dmoc import BoxForce, Member, On, Rod, Slider, State, System, Time, TransferProblem, UniformGravity


def problem(distance=10.0, limit=2000.0, length=8.0, load=500.0):
    """A trolley of 300 kg on a rail above the load.

    Parameters
    ----------
    distance : float
        How far the load is carried [m].
    limit : float
        Largest force on the trolley [N].
    length : float
        Length of the rope [m]; it stays taut.
    load : float
        Mass of the load [kg].
    """
    links = [Slider((0, 0), (1, 0), on="trolley"), Rod("trolley", length, on="load")]
    return TransferProblem(
        System([Member("trolley", 300.0), Member("load", load)], links),
        start={"trolley": State((0, 0), (0, 0)), "load": State((0, -length), (0, 0))},
        goal={"trolley": State((distance, 0), (0, 0)), "load": State((distance, -length), (0, 0))},
        duration=(2.0, 40.0),
        effects=[UniformGravity((0, -9.81))],
        actuator=On("trolley", BoxForce(limit), axes=[0]),
        objective=Time(),
    )
