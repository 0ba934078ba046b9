"""An answer that cuts zones between its nodes, or a failure among zones: it is solved anew past them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.guess.past_zones import clear_ways
from dmoc.guess.starting import starting_guess
from dmoc.meshes.choices import coarse_to_fine
from dmoc.meshes.widths import rounding_stages
from dmoc.motion.path import DiscretePath
from dmoc.results.between import Cut
from dmoc.rungs.rung import Rung
from dmoc.solver.ladder import UNEXPLAINED, Ladder
from dmoc.solver.mended import MOST_FINER, cuts_of, noted, shortened

# At most this many ways past the zones are tried, the shortest first: two sides of four zones.
MOST_WAYS = 8
# An answer that cuts a zone leaps it if it costs this part more or less on steps of half the length [-]: what
# only grazes a zone there costs a thousandth more, and a leap ten times as much, as it has half the time.
ANOTHER = 0.05
# Answers whose objectives differ by less than this part are one [-]: on one mesh Ipopt finds an optimum to
# 1e-8.
SAME_OBJECTIVE = 1e-6
# What a user is told of an answer that was mended, or could not be.
LEAPT = "the first answer leapt a zone between two nodes: this one was found on a way past the zones"
FAILED = "the first guess led nowhere: this answer was found on a way past the zones"
LED = "the first guess led nowhere, and then to a dearer answer: this one was found on a way past the zones"


def past_zones(ladder: Ladder, rung: Rung, first: DiscretePath, given: Any, refined: bool) -> Rung:
    """An answer that cuts no zone between its nodes, if there is one past the zones; else the answer as it is.

    A path that leaps a zone between two nodes is an optimum of its mesh alone: finer meshes leap faster and
    dearer. So the problem is solved anew from paths around the zones, on the coarsest mesh. The cheapest of
    these answers that cuts no zone on the mesh of the first guess is taken; where the number of steps is open
    (`refined`), steps that cut one are cut in two first. A failure among zones is treated alike, and so is an
    answer found after one: it stays if none of the others costs less.
    """
    if rung.stopped:
        return rung
    cut, led = rung.solved and bool(cuts_of(ladder, rung)), rung.solved and _was_led(ladder, rung)
    if not (cut or led or (not rung.solved and _zones_may_help(ladder, rung))):
        return rung
    finer, grazed = _grazed(ladder, rung) if refined and cut else (rung, led and not cut)
    if finer.stopped or (grazed and not led):
        return finer
    order, meshes = coarse_to_fine(ladder.problem, first)
    base = starting_guess(ladder.problem, meshes[0], order, first.hold, given)
    answers = [finer]
    for way in clear_ways(ladder.problem, base)[:MOST_WAYS]:
        answers.append(_sharpened(ladder, way))
        if answers[-1].stopped:
            return answers[-1]
    found: list[Rung] = []
    for one in _distinct(answers):
        found.append(_cleared(ladder, one, first, refined))
        if found[-1].stopped:
            return found[-1]
        if found[-1].solved and not cuts_of(ladder, found[-1]):
            if grazed and found[-1].cost >= finer.cost:
                return finer
            return noted(found[-1], (LED if grazed else LEAPT) if rung.solved else FAILED)
    best = min([rung, *found], key=lambda one: _deepest(ladder, one))
    return _blamed(ladder, best, base) if best.solved else best


def _was_led(ladder: Ladder, rung: Rung) -> bool:
    """Whether the answer was found among zones after a failure that nothing explained."""
    failed = any(
        one.answer.status in UNEXPLAINED and not one.level.question for one in ladder.rungs[: rung.number]
    )
    return failed and any(np.isfinite(zone.feature()) for zone in ladder.problem.constraints)


def _blamed(ladder: Ladder, leap: Rung, guess: DiscretePath) -> Rung:
    """A leap as the failure that it is, if zones leave no way and it is known what must give way."""
    from dmoc.diagnosis.search import confirmed_cause

    cause = confirmed_cause(ladder.problem, guess, ladder.tell, ladder.interrupt)
    if not (cause.zones and cause.needs) or ladder.interrupt.seen:
        return leap
    return replace(leap, answer=replace(leap.answer, status="infeasible"), cause=cause)


def _grazed(ladder: Ladder, rung: Rung) -> tuple[Rung, bool]:
    """The answer with the steps that cut a zone in two; whether that makes it clear at about the same cost."""
    for _ in range(MOST_FINER):
        path, before = rung.path, rung.cost
        mesh = shortened(path.mesh, _steps(cuts_of(ladder, rung)))
        finer = ladder.refine_on(path.onto(mesh, path.order, path.hold))
        if not finer.solved:
            return finer if finer.stopped else rung, False
        rung = finer
        if abs(rung.cost - before) > ANOTHER * abs(before):
            return rung, False
        if not cuts_of(ladder, rung):
            return rung, True
    return rung, False


def _distinct(answers: list[Rung]) -> list[Rung]:
    """Those that were solved and differ in what they cost, the cheapest first."""
    solved = sorted((one for one in answers if one.solved), key=lambda one: one.cost)
    last, found = np.inf, []
    for one in solved:
        if not np.isclose(one.cost, last, rtol=SAME_OBJECTIVE, atol=0.0):
            found.append(one)
        last = one.cost
    return found


def _cleared(ladder: Ladder, rung: Rung, first: DiscretePath, refined: bool) -> Rung:
    """An answer on the mesh of the first guess, with the steps that still cut a zone in two if `refined`."""
    if len(rung.nlp.mesh) < len(first.mesh):
        rung = ladder.refine_on(rung.path.onto(first.mesh, first.order, first.hold))
    for _ in range(MOST_FINER if refined else 0):
        if not (left := cuts_of(ladder, rung)):
            break
        mesh = shortened(rung.path.mesh, _steps(left))
        finer = ladder.refine_on(rung.path.onto(mesh, first.order, first.hold))
        if not finer.solved:
            return finer if finer.stopped else rung
        rung = finer
    return rung


def _sharpened(ladder: Ladder, guess: DiscretePath) -> Rung:
    """An answer on the mesh of a guess, with |F| rounded less and less, if at all."""
    for _, width in rounding_stages([guess.mesh], ladder.problem):
        rung = ladder.try_on(guess, width)
        if not rung.solved:
            break
        guess = rung.path
    return rung


def _zones_may_help(ladder: Ladder, rung: Rung) -> bool:
    """Whether a failure may be one of the way past zones, and not of limits that are far too small."""
    if rung.answer.status not in UNEXPLAINED or any("max_" in name for name in ladder.options or ()):
        return False
    cause = rung.cause
    if cause is None or cause.zones or not cause.hopeless:
        return True
    zones = [zone for zone in ladder.problem.constraints if np.isfinite(zone.feature())]
    if not zones:
        return False
    # A gap between zones that is as good as closed is passed between two nodes, at any force. Without zones
    # such a limit is enough.
    rest = [one for one in ladder.problem.constraints if one not in zones]
    alone = replace(ladder.problem, constraints=rest)
    guess = starting_guess(alone, ladder.rungs[0].nlp.mesh, rung.path.order, rung.path.hold)
    return ladder.ask(alone, guess, "whether the zones are to blame").solved


def _deepest(ladder: Ladder, rung: Rung) -> float:
    """The deepest cut over the one that is allowed [-]; infinite for what was not solved."""
    return (
        max((cut.value / cut.allowed for cut in cuts_of(ladder, rung)), default=0.0) if rung.solved else np.inf
    )


def _steps(left: list[Cut]) -> np.ndarray:
    """The steps that cut a zone."""
    return np.concatenate([cut.steps for cut in left])
