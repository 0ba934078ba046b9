"""What a transfer takes where a limit is taken away: how large a force, how much propellant."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.diagnosis.cause import HOPELESS, Cause
from dmoc.diagnosis.elastic import MOST_ITERATIONS
from dmoc.diagnosis.giving import LOOSER, Remedy
from dmoc.diagnosis.relaxable import Relaxable
from dmoc.motion.path import DiscretePath
from dmoc.nlp.transcription import transcribe_onto
from dmoc.nlp.units import units_of
from dmoc.parts.objectives import Fuel
from dmoc.scene.problem import TransferProblem

# A limit is far off if the guess takes more than this many times as much on average [-]: in units of such a
# limit the slacks are so large that no solver finds them.
FAR_OFF = 10.0
# Least fuel is looked for with |F| rounded at zero over this part of the largest thrust [-]: from a guess Ipopt
# wanders with less, and with the far wider rounding of a first mesh an engine that coasts burns too much.
ROUNDED = 1e-2


def unlimited(transfer: Relaxable) -> Cause | None:
    """The largest force of least effort without a limit: more than the least needed, but sooner found."""
    given = transfer.given.actuator
    free = given.unlimited()
    if free is None:
        return None
    problem = replace(transfer.problem, actuator=free, constraints=transfer.given.constraints)
    path = _answer(transfer, problem, "least effort without a limit")
    if path is None:
        return None
    factor = given.share(path.control)
    if factor <= 1:
        return Cause(path=path)
    enough = (given.times(factor * (1 + looser)) for looser in LOOSER)
    needs = tuple(
        Remedy(f"no more than {given.needs(limit)}", replace(transfer.given, actuator=limit))
        for limit in enough
    )
    # Least effort may take a little more than the least that is needed, so only a large factor is an excess.
    return Cause(needs=(needs,), excess=factor if factor > FAR_OFF else np.inf)


def too_little_propellant(transfer: Relaxable) -> Cause | None:
    """The dry mass that leaves propellant for the way that takes least; None where that is not what is lacking.

    The limits of force and speed stay as they are, and the engine may burn all that there is.
    """
    limit = transfer.propellant()
    if limit is None:
        return None
    given: Any = transfer.given.actuator
    rounding = {} if given.smoothing is None else {"smoothing": ROUNDED}
    problem = replace(transfer.problem, actuator=replace(given, dry_mass=0.0, **rounding), objective=Fuel())
    path = _answer(transfer, problem, "least fuel, and as much of it as there is")
    if path is None:
        return None
    load = problem.mass - given.dry_mass
    slack = (problem.mass - float(path.mass[-1])) / load - 1
    if slack <= HOPELESS:
        return None
    return Cause(needs=(transfer.remedies([limit], slack),), excess=slack, shown=True)


def _answer(transfer: Relaxable, problem: TransferProblem, question: str) -> DiscretePath | None:
    """The answer to a changed problem on the mesh of the guess; None if it leaps a zone, or none is found."""
    nlp = transcribe_onto(problem, transfer.guess, units_of(problem, transfer.guess))
    watch = nlp.watch(problem, None, transfer.interrupt)
    solver = nlp.solver(watch=watch, limits={"ipopt.max_iter": MOST_ITERATIONS})
    answer = nlp.run(solver, problem, transfer.guess)
    transfer.tell(replace(nlp.level(answer, 0.0), question=question))
    path = replace(nlp.path(problem, answer), multipliers={})
    return None if answer.status != "solved" or transfer.leaps(path) else path
