"""What a flight says of mass and drag, by the discrete equations, a Kalman filter and differences.

Sixty simulated flights a row: a free flyer of 18.9715 kg with linear drag and a marker off its centre of mass,
pushed another way every second for half a minute. Beside `dmoc.identify`:

- an extended Kalman filter of position, velocity, 1/m, drag and offset (filterpy), its equations integrated
  from sample to sample by the exact solution of the linear motion, its process noise that of the forces;
- central second differences of the positions, and forward ones, in a linear regression. They do not know the
  offset of the marker.

./scripts/run python scripts/identification.py [--flights 60] [--write]

It needs the extra `study` (filterpy). With --write the table goes into docs/identification.md.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmoc

PAGE = Path(__file__).parents[1] / "docs" / "identification.md"
MASS, DRAG, OFFSET = 18.9715, 1.2, np.array([0.05, -0.03])
NAMES = ("mass", "linear_drag_1_coefficient", "offset.x", "offset.y")
TRUTH = np.array([MASS, DRAG, *OFFSET])
LASTS = 30.0


class Row(NamedTuple):
    """Time between samples [s], noise of positions [m] and of forces [N]."""

    step: float
    noise: float
    force_noise: float

    @property
    def words(self) -> str:
        errors = [f"{1e3 * self.noise:g} mm"] * bool(self.noise) + [f"{self.force_noise:g} N"] * bool(
            self.force_noise
        )
        return f"{self.step:g} s, {', '.join(errors) or 'none'}"


ROWS = [
    Row(0.1, 0.0, 0.0),
    Row(1.0, 0.0, 0.0),
    Row(0.1, 0.001, 0.0),
    Row(0.1, 0.001, 0.02),
    Row(0.5, 0.001, 0.02),
    Row(0.1, 0.005, 0.05),
]


def flown(row: Row, seed: int) -> dmoc.Flight:
    """One flight; forces change every second, whatever the time between samples."""
    times = np.round(np.arange(0.0, LASTS + row.step / 2, row.step), 6)
    some = np.random.default_rng(1000 + seed).uniform(-0.4, 0.4, (int(LASTS) + 1, 2))
    return dmoc.fly(
        times,
        lambda t: some[int(t + 1e-9)],
        dmoc.State((0, 0), (0, 0)),
        mass=MASS,
        effects=[dmoc.LinearDrag(DRAG)],
        attitudes=0.3 * times,
        offset=OFFSET,
        noise=row.noise,
        force_noise=row.force_noise,
        seed=seed,
    )


def by_equations(flight: dmoc.Flight, row: Row) -> dmoc.Estimate:
    return dmoc.identify(
        flight,
        mass=dmoc.Unknown(10.0),
        effects=[dmoc.LinearDrag(dmoc.Unknown(1.0))],
        offset=dmoc.Unknown((0.0, 0.0)),
        noise=row.noise or 1e-3,
        force_noise=row.force_noise,
    )


def by_filter(flight: dmoc.Flight, row: Row) -> np.ndarray:
    """The last state of an extended Kalman filter of (x, y, vx, vy, 1/m, c, bx, by)."""
    from filterpy.kalman import ExtendedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=8, dim_z=2)
    ekf.x = np.array([*flight.positions[0], 0, 0, 0.1, 1.0, 0, 0])
    ekf.P = np.diag([0.1, 0.1, 0.1, 0.1, 0.1, 1.0, 0.1, 0.1]) ** 2
    ekf.R = np.eye(2) * (row.noise or 1e-3) ** 2
    ekf.Q = np.zeros((8, 8))
    steps = np.diff(flight.times)
    for k, y in enumerate(flight.positions):
        if k:
            force, h = flight.forces[k - 1], steps[k - 1]
            ekf.F = _slopes(ekf.x, force, h)
            ekf.x = _moved(ekf.x, force, h)
            shake = _slopes_by_force(ekf.x, h)
            ekf.P = ekf.F @ ekf.P @ ekf.F.T + row.force_noise**2 * shake @ shake.T + 1e-16 * np.eye(8)
        angle = flight.attitudes[k]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        slope = np.hstack([np.eye(2), np.zeros((2, 4)), turn])
        ekf.update(y, HJacobian=lambda x, H=slope: H, Hx=lambda x, H=slope: H @ x)
    return np.array([1 / ekf.x[4], ekf.x[5], *ekf.x[6:]])


def _moved(x: np.ndarray, force: np.ndarray, h: float) -> np.ndarray:
    """The state a step later: v' = w (f - c v) has an exponential as its solution."""
    lag = x[4] * x[5]
    decay = np.exp(-lag * h)
    speed, last = x[2:4], force / x[5]
    moved = last * h + (speed - last) * (1 - decay) / lag
    return np.concatenate([x[:2] + moved, last + (speed - last) * decay, x[4:]])


def _slopes(x: np.ndarray, force: np.ndarray, h: float) -> np.ndarray:
    """Its slopes, by central differences of a smooth function: right to nine digits."""
    found = np.empty((8, 8))
    for i in range(8):
        step = np.zeros(8)
        step[i] = 1e-6 * max(abs(x[i]), 0.01)
        found[:, i] = (_moved(x + step, force, h) - _moved(x - step, force, h)) / (2 * step[i])
    return found


def _slopes_by_force(x: np.ndarray, h: float) -> np.ndarray:
    found = np.zeros((8, 2))
    found[:2], found[2:4] = np.eye(2) * x[4] * h**2 / 2, np.eye(2) * x[4] * h
    return found


def by_differences(flight: dmoc.Flight, central: bool) -> np.ndarray:
    """Mass and drag by a regression of second differences on forces and first differences."""
    y, f, h = flight.positions, flight.forces, flight.times[1] - flight.times[0]
    if central:
        change, speed = (y[2:] - 2 * y[1:-1] + y[:-2]) / h**2, (y[2:] - y[:-2]) / (2 * h)
        force = 0.5 * (f[:-2] + f[1:-1])
    else:
        velocity = np.diff(y, axis=0) / h
        change, speed, force = np.diff(velocity, axis=0) / h, velocity[:-1], f[:-2]
    inverse, lag = np.linalg.lstsq(
        np.stack([force.ravel(), -speed.ravel()], axis=1), change.ravel(), rcond=None
    )[0]
    return np.array([1 / inverse, lag / inverse])


def rms(found: list[np.ndarray]) -> np.ndarray:
    """Root mean square errors of mass, drag and, where they are found, the offset."""
    values = np.array(found)
    return np.sqrt(np.mean((values - TRUTH[: values.shape[1]]) ** 2, axis=0))


def measured(row: Row, count: int) -> str:
    """A line of the table."""
    flights = [flown(row, seed) for seed in range(count)]
    begun = time.process_time()
    fits = [by_equations(flight, row) for flight in flights]
    each = (time.process_time() - begun) / count
    failed = sum(not fit.success for fit in fits)
    own = rms([np.array([fit.values[name] for name in NAMES]) for fit in fits])
    filtered = [by_filter(flight, row) for flight in flights]
    spans = [
        low <= truth <= high
        for fit in fits
        for truth, (low, high) in zip(TRUTH, fit.interval().values(), strict=True)
    ]
    holds = f"{100 * np.mean(spans):.0f} %" if row.noise else ""
    ekf = rms(filtered)
    differences = [rms([by_differences(flight, central) for flight in flights]) for central in (True, False)]
    offset = 1e3 * np.hypot(*own[2:])
    words = f"**{own[0]:.2g}**, {own[1]:.2g}, {offset:.2g} mm" + (f" ({failed} failed)" if failed else "")
    cells = [row.words, words, _told(ekf), *map(_told, differences), holds, f"{1e3 * each:.0f} ms"]
    return f"| {' | '.join(cells)} |"


def _told(errors: np.ndarray) -> str:
    if not np.isfinite(errors).all() or errors[0] > MASS:
        return "diverges"
    return ", ".join(f"{one:.2g}" for one in errors[:2])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=60)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    heads = [
        "sampling, noise",
        "identify: mass, drag, offset",
        "Kalman filter",
        "central differences",
        "forward",
    ]
    lines = [f"| {' | '.join([*heads, '95 % hold', 'fit'])} |", "|---|---|---|---|---|---|---|"]
    for line in lines:
        print(line)
    for row in ROWS:
        lines.append(measured(row, given.flights))
        print(lines[-1], flush=True)
    if given.write:
        text = PAGE.read_text()
        begin, end = "<!-- identification -->", "<!-- end of identification -->"
        before, after = text.split(begin)[0], text.split(end)[1]
        PAGE.write_text(before + "\n".join([begin, *lines, end]) + after)
        print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
