"""An answer that hardly pays for the rounding of |F| at zero, of a mission or of a team."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dmoc.chains.path import cold
from dmoc.motion.dynamics import Dynamics
from dmoc.results.estimate import rounded_share
from dmoc.scene.rounding import sharper
from dmoc.solver.mended import narrowed

if TYPE_CHECKING:
    from dmoc.missions.attempt import Attempt

# An attempt with |F| rounded less ends after this many iterations: those that get there take 20 to 100.
MOST_TRYING = 200


def onto_magnitude(climb: Any, attempt: Attempt) -> Attempt:
    """An answer with |F| rounded less where that costs much; what the climb is of is then sharper, too."""

    def again(attempt: Attempt, share: float) -> Attempt:
        asked, held = climb.mission, climb.held
        climb.mission = sharper(asked, share)
        tried = climb.attempt(attempt.path, most=MOST_TRYING, carried=True)
        if not (tried.solved or tried.answer.status == "stopped"):
            tried = climb.attempt(cold(attempt.path), most=MOST_TRYING, carried=True)
        if not tried.solved:
            climb.mission, climb.held = asked, held
        return tried

    return narrowed(attempt, lambda attempt: _paid(climb.mission, attempt), again)


def _paid(mission: Any, attempt: Attempt) -> float:
    """The part of the impulse that is paid and not flown, of the leg where that is most [-]."""
    legs = zip(mission.stretches, attempt.path.legs, strict=True)
    return max(rounded_share(Dynamics.of(problem), leg) for problem, leg in legs)
