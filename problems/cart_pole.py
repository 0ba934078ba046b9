"""Swing up a pole by the force on its cart alone, and stop a metre further on, at the least effort."""

from dmoc import BoxForce, Member, On, Rod, Slider, State, System, TransferProblem, UniformGravity


def problem(distance=1.0, duration=2.0, limit=20.0, length=0.5):
    """The cart-pole of M. Kelly, SIAM Review 59 (2017), section 6: a cart of 1 kg, a bob of 0.3 kg.

    Parameters
    ----------
    distance : float
        How far the cart goes [m].
    duration : float
        Time of the swing [s].
    limit : float
        Largest force on the cart [N].
    length : float
        Length of the pole [m].
    """
    links = [Slider((0, 0), (1, 0), on="cart"), Rod("cart", length, on="bob")]
    return TransferProblem(
        System([Member("cart", 1.0), Member("bob", 0.3)], links),
        start={"cart": State((0, 0), (0, 0)), "bob": State((0, -length), (0, 0))},
        goal={"cart": State((distance, 0), (0, 0)), "bob": State((distance, length), (0, 0))},
        duration=duration,
        effects=[UniformGravity((0, -9.81))],
        actuator=On("cart", BoxForce(limit), axes=[0]),
    )
