"""Find the halo orbit around the near libration point of the Moon that closes.

The circular restricted three-body problem in its turning frame, as in `halo_transfer`. The orbit begins in the
plane of symmetry at a height that is given; its place there, its velocity and its period are found. The
guess is an ellipse of the right size.
"""

import numpy as np

from dmoc import Coast, Mission, Periodic, State, three_body


def problem(height: float = 0.05, mass_ratio: float = 0.01215058560962404):
    """The orbit.

    Parameters
    ----------
    height : float [m]
        Distance from the plane of both bodies at the start.
    mass_ratio : float [-]
        Mass of the Moon over that of both.
    """

    def ellipse(time):
        angle = 2 * np.pi * time / 2.75
        return (
            0.836 - 0.012 * np.cos(angle),
            0.055 * np.sin(angle),
            height * np.cos(angle),
        )

    return Mission(
        mass=1.0,
        start=State((None, 0.0, height), None),
        goal=Periodic(),
        effects=three_body(mass_ratio),
        legs=[Coast((2.2, 3.2), order=8, steps=20)],
        guess=ellipse,
    )
