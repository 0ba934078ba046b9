"""An answer that hardly pays for the rounding of |F| at zero, as of a transfer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dmoc.chains.path import cold
from dmoc.motion.dynamics import Dynamics
from dmoc.results.estimate import rounded_share
from dmoc.results.facts import sharper
from dmoc.solver.mended import MOST_SHARPER, PAID

if TYPE_CHECKING:
    from dmoc.missions.attempt import Attempt

# |F| is rounded over this part of the width before, or where that leads nowhere over the next one [-].
SHARES = (0.1, 0.3)
# An attempt with |F| rounded less ends after this many iterations: those that get there take 20 to 100.
MOST_TRYING = 200


def onto_magnitude(climb: Any, attempt: Attempt) -> Attempt:
    """An answer with |F| rounded less where that costs much; the mission of the climb is then the sharper one.

    The width is a part of the largest thrust, so that one far above what a mission takes is paid for on the
    whole way.
    """
    for _ in range(MOST_SHARPER):
        if not attempt.solved or _paid(climb.mission, attempt) <= PAID:
            break
        asked, held = climb.mission, climb.held
        for share in SHARES:
            climb.mission = sharper(asked, share)
            tried = climb.attempt(attempt.path, most=MOST_TRYING, carried=True)
            if not (tried.solved or tried.answer.status == "stopped"):
                tried = climb.attempt(cold(attempt.path), most=MOST_TRYING, carried=True)
            if tried.solved or tried.answer.status == "stopped":
                break
        if not tried.solved:
            climb.mission, climb.held = asked, held
            return tried if tried.answer.status == "stopped" else attempt
        attempt = tried
    return attempt


def _paid(mission: Any, attempt: Attempt) -> float:
    """The part of the impulse that is paid and not flown, of the leg where that is most [-]."""
    legs = zip(mission.stretches, attempt.path.legs, strict=True)
    return max(rounded_share(Dynamics.of(problem), leg) for problem, leg in legs)
