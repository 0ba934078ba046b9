"""What a person should know before relying on estimated numbers, in sentences."""

from __future__ import annotations

from typing import Any

import numpy as np

# Two numbers are hardly told apart from this correlation on [-].
ALIKE = 0.98
# A number is hardly seen whose standard deviation is so large a part of itself, or of what was believed [-].
HARDLY, BELIEVED = 1.0, 0.9
# A number takes part in a direction that is not seen by this much of it [-].
PART = 0.1
# What is less likely than this is told [-].
UNLIKELY = 0.01
# Residuals whose squares are below this part of what noise would leave are no noise [-].
TINY = 1e-2


def on_sight(found: Any) -> list[str]:
    """Numbers that the flight does not see, or hardly."""
    said, sigma = [], found.sigma
    for way in found.fit.unseen.T:
        names = [name for name, part in zip(found.names, way, strict=True) if abs(part) > PART]
        if len(names) == 1:
            said.append(f"{names[0]} is not observable: this flight would be the same with any value of it.")
        else:
            said.append(
                f"{' and '.join(names)} are not observable: this flight tells a combination of them alone. "
                "State one of them, or fly so that they act differently."
            )
    for one, value in zip(found.wanted, found._values, strict=True):
        if not np.isfinite(sigma[one.name]):
            continue
        if one.sigma is not None and sigma[one.name] > BELIEVED * one.sigma:
            said.append(
                f"{one.name} is hardly observable: the flight adds next to nothing to what was believed."
            )
        elif one.kind in ("mass", "exhaust", "scene", "strength") and sigma[one.name] > HARDLY * abs(value):
            said.append(f"{one.name} is hardly observable: its standard deviation is larger than itfound.")
    alike = found.correlation
    for i, first in enumerate(found.names):
        for j in range(i):
            if abs(alike[i, j]) > ALIKE:
                said.append(
                    f"{found.names[j]} and {first} are hardly told apart: correlation {alike[i, j]:.4f}."
                )
    return said


def on_fit(found: Any) -> list[str]:
    said = []
    if not found.found_noise and found.fitting < UNLIKELY:
        factor = np.sqrt(found.chi_squared / max(found.fit.degrees, 1))
        said.append(
            f"Residuals are {factor:.3g} times as large as the stated noise: intervals are too narrow. "
            "Something acts that the scene does not have, or the noise is larger."
        )
    if found.fit.degrees > 0 and found.chi_squared < TINY * found.fit.degrees:
        said.append("Residuals are far smaller than the stated noise: intervals are too wide.")
    elif found.whiteness < UNLIKELY:
        said.append(
            "Residuals are alike from sample to sample: something acts that the scene does not have, such "
            "as an effect, a delay or errors of the forces."
        )
    return said
