"""Make the measured flights that come with dmoc, in problems/flights: simulated, with the errors of sensors.

./scripts/run python scripts/flights.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import dmoc

FOLDER = Path(__file__).parents[1] / "problems" / "flights"
# Positions are written to a hundredth of a millimetre, forces and angles to as many digits.
DIGITS = 5


def free_flyer() -> tuple[dmoc.Flight, str]:
    """A free flyer on a table, pushed another way every second, its marker off its centre of mass."""
    times = np.round(np.arange(0.0, 30.05, 0.1), 3)
    random = np.random.default_rng(7)
    forces = np.repeat(np.round(random.uniform(-0.4, 0.4, (31, 2)), 2), 10, axis=0)[: len(times)]
    flight = dmoc.fly(
        times,
        forces,
        dmoc.State((0, 0), (0.02, 0)),
        mass=18.9715,
        effects=[dmoc.LinearDrag(1.2)],
        attitudes=0.3 * times,
        offset=(0.05, -0.03),
        noise=0.001,
        dropped=0.05,
        seed=1,
    )
    words = (
        "A free flyer on a table of air, simulated: mass 18.9715 kg, linear drag 1.2 N s/m, a marker at\n"
        "(0.05, -0.03) m in its axes, seen to 1 mm ten times a second; 5 % of the samples are lost."
    )
    return flight, words


def satellite() -> tuple[dmoc.Flight, str]:
    """A cube that turns and moves, pushed and twisted another way every two seconds."""
    times = np.round(np.arange(0.0, 30.1, 0.25), 3)
    random = np.random.default_rng(3)
    each = random.uniform(-1, 1, (16, 6)) * np.array([0.4, 0.4, 0.4, 0.04, 0.04, 0.04])
    controls = np.repeat(np.round(each, 3), 8, axis=0)[: len(times)]
    flight = dmoc.fly(
        times,
        controls,
        dmoc.Pose((0, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0.02, -0.01, 0)),
        mass=9.58,
        actuator=dmoc.Wrench(frame="space"),
        inertia=(0.153, 0.143, 0.162),
        noise=0.002,
        attitude_noise=0.002,
        seed=2,
    )
    words = (
        "A cube that turns, simulated: mass 9.58 kg, inertia (0.153, 0.143, 0.162) kg m^2; position seen\n"
        "to 2 mm, attitude to 2 mrad; u1..u3 are forces in space axes [N], u4..u6 torques in body axes [N m]."
    )
    return flight, words


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for make in (free_flyer, satellite):
        flight, words = make()
        rounded = dmoc.Flight(
            flight.times,
            np.round(flight.positions, DIGITS),
            flight.forces,
            attitudes=np.round(flight.attitudes, DIGITS),
        )
        path = rounded.save(FOLDER / f"{make.__name__}.csv")
        told = "".join(f"# {line}\n" for line in words.splitlines())
        path.write_text(told + path.read_text())
        print(f"wrote {path}")


if __name__ == "__main__":
    main()
