"""One run of Ipopt on one sparse NLP, and the meaning of its status."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from dmoc.basics.arguments import short
from dmoc.basics.numerics import in_plain_memory
from dmoc.basics.records import dataclass


class Status(NamedTuple):
    """Return codes of Ipopt that mean the same to a user, and the advice that follows one of them."""

    codes: tuple[str, ...]
    advice: str = ""


# Every status of a solve by name, with Ipopt's return codes that lead to it and the advice for a user.
STATUSES = {
    "solved": Status(("Solve_Succeeded", "Solved_To_Acceptable_Level")),
    "infeasible": Status(
        ("Infeasible_Problem_Detected",),
        "no path near the guess meets every row; relax the duration, the force limit or a zone, "
        "or try another guess (this is a local verdict)",
    ),
    "iteration limit": Status(
        ("Maximum_Iterations_Exceeded", "Maximum_CpuTime_Exceeded", "Maximum_WallTime_Exceeded"),
        "another number of steps helps most often, then another order, hold=True or a better "
        "guess, and last options={'ipopt.max_iter': ...}",
    ),
    "invalid number": Status(
        ("Invalid_Number_Detected",),
        "the guess or an iterate met an undefined value (a distance of 0, say): change the guess",
    ),
    "restoration failed": Status(
        ("Restoration_Failed",),
        "another number of steps or another order helps most often; if not, look for "
        "contradictory or repeated conditions, then try another guess",
    ),
    "diverging": Status(
        ("Diverging_Iterates",), "the objective has no lower bound here; limit the force or the duration"
    ),
    "stopped": Status(("User_Requested_Stop",), "interrupted; the best iterate is kept"),
    "time limit": Status((), "give more time, fewer steps or a looser tolerance; the answer is kept as it is"),
    "tolerance not met": Status(
        (), "give steps to begin with, another order, or a looser tolerance; the answer is kept as it is"
    ),
    "failed": Status((), "try another number of steps, another order, hold=True, or another guess"),
}
# The name of the status that each of Ipopt's return codes leads to.
_STATUS_OF = {code: name for name, status in STATUSES.items() for code in status.codes}

# Ipopt's return code where its steps have become as small as the rounding of the unknowns, and by how much the
# gradient and the barrier may then be off at an optimum [-]: a tenth of the tightest tolerance.
STALLED, SETTLED = "Search_Direction_Becomes_Too_Small", 1e-12

# Every run has these settings: derivatives are given, so CasADi makes none, and the NLP is scaled already.
ALWAYS: dict[str, Any] = {
    "no_nlp_grad": True,
    "calc_lam_p": False,
    "print_time": False,
    "error_on_fail": False,
    # Ipopt cuts a step to where the functions are finite: nobody need be told.
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.linear_solver": "mumps",
    "ipopt.nlp_scaling_method": "none",
}

# So many solvers are held for one NLP, if it has at most this many unknowns.
MOST_SOLVERS, MOST_UNKNOWNS = 4, 20_000


@dataclass(frozen=True)
class Answer:
    """The answer of one run of Ipopt on one mesh, scaled."""

    x: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray
    g: np.ndarray
    objective: float
    status: str
    iterations: int
    evaluations: int
    seconds: float


def status_of(code: str) -> str:
    """The status that one of Ipopt's return codes stands for."""
    return _STATUS_OF.get(code, "failed")


def make_solver(
    parts: Any,
    settings: dict[str, Any],
    options: dict[str, Any] | None = None,
    watch: Watch | None = None,
) -> ca.Function:
    """The CasADi `nlpsol` Function of an NLP, with its exact derivatives.

    `parts` is an `Assembly` of `dmoc.nlp`. The solver is held with a small NLP, and serves again for the same
    settings. With the user's option "jit" CasADi
    compiles f and g; the derivatives are compiled likewise.

    Raises
    ------
    ValueError
        If CasADi or Ipopt refuses one of the user's options.
    """
    if options or parts.x.numel() > MOST_UNKNOWNS:
        return _made(parts, settings, options, Follower.of(parts, watch) if watch else None)
    # Two threads may solve at a time, each with an eye of its own on the iterations.
    key = (*settings.items(), watch is None, threading.get_ident())
    solver, follower = parts.solvers.pop(key, (None, None))
    if solver is None or (follower is not None and follower.telling):
        follower = Follower.of(parts, watch) if watch else None
        solver = _made(parts, settings, None, follower)
    if follower is not None and watch is not None:
        follower.watch = watch
    parts.solvers[key] = solver, follower
    while len(parts.solvers) > MOST_SOLVERS:
        parts.solvers.pop(next(iter(parts.solvers)))
    return solver


def _made(
    parts: Any, settings: dict[str, Any], options: dict[str, Any] | None, follower: Follower | None
) -> ca.Function:
    derivatives = {"jac_g": parts.jacobian, "hess_lag": parts.hessian, "grad_f": parts.gradient}
    callback: dict[str, Any] = {} if follower is None else {"iteration_callback": follower}
    program = {"x": parts.x, "p": parts.p, "f": parts.f, "g": parts.g}
    given = options or {}
    try:
        if given.get("jit"):
            how = {name: value for name, value in given.items() if name.startswith("jit") or name == "compiler"}
            derivatives = {name: function.wrap_as_needed(how) for name, function in derivatives.items()}
        every = ALWAYS | derivatives | settings | callback | given
        return ca.nlpsol("solver", "ipopt", program, every)
    except RuntimeError as error:
        if not options:
            raise
        raise ValueError(
            f"CasADi or Ipopt refuses one of the options {short(options)}: its name or its value; "
            "names are such as 'ipopt.max_iter'"
        ) from error


def run(solver: ca.Function, rounding: float = 0.0, **given: np.ndarray) -> Answer:
    """One solve; `given` are the inputs of `nlpsol`: x0, p, bounds and multipliers, scaled.

    `rounding` is by how much rows may be off by rounding alone [-].
    """
    begun = time.perf_counter()
    result, stats = in_plain_memory(solver, given)
    seconds = time.perf_counter() - begun
    x, lam_x, lam_g, g = (result[key] for key in ("x", "lam_x", "lam_g", "g"))
    calls = sum(count for name, count in stats.items() if name.startswith("n_call_nlp"))
    status = status_of(stats["return_status"])
    if stats["return_status"] == STALLED and _is_settled(stats["iterations"], rounding):
        status = "solved"
    return Answer(x, lam_x, lam_g, g, float(result["f"][0]), status, int(stats["iter_count"]), calls, seconds)


def _is_settled(iterations: dict[str, list[float]], rounding: float) -> bool:
    """Whether rows hold up to their rounding, and the optimality conditions up to that of numbers near 1."""
    row, slope, barrier = (iterations[name][-1] for name in ("inf_pr", "inf_du", "mu"))
    return bool(row <= rounding and max(slope, barrier) <= SETTLED)


# When the solve began whose time limits count together [s of the monotonic clock].
_begun: ContextVar[float | None] = ContextVar("begun", default=None)


@contextmanager
def one_clock() -> Iterator[None]:
    """Within it, as in one solve by several ways, all time limits count from its begin."""
    token = _begun.set(_begun.get() or time.monotonic())
    try:
        yield
    finally:
        _begun.reset(token)


class Interrupt:
    """Ctrl-C as a flag while a solve runs: CasADi would swallow the exception, and the iterate be lost.

    It is set as well once so many `seconds` are over.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self.seconds, self._begun = seconds, _begun.get() or time.monotonic()
        self._pressed = False
        self._previous: Any = None

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return self.seconds is not None and time.monotonic() - self._begun > self.seconds

    @property
    def seen(self) -> bool:
        """Whether the run is to end."""
        return self._pressed or self.late

    def __enter__(self) -> Interrupt:
        # Python lets no other thread handle signals.
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._see)
        return self

    def __exit__(self, *error: Any) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _see(self, *received: Any) -> None:
        self._pressed = True


class Watch:
    """Follows the iterations of one run: tells of each, and stops it when `interrupt` has seen a Ctrl-C.

    It stops as well when `tell` says so, (iteration, objective, x, g) -> whether to stop, scaled. CasADi would
    print an exception of `tell` and go on: the watch stops the run and keeps the exception as `error`, to be
    raised afterwards.
    """

    def __init__(self, tell: Callable[..., bool] | None, interrupt: Interrupt):
        self.tell, self.interrupt, self.iteration = tell, interrupt, 0
        self.error: BaseException | None = None
        # CasADi holds no reference to its callback: this one lives as long as the run.
        self.follower: Follower | None = None

    def stops(self, at: dict[str, ca.DM]) -> bool:
        """Whether to stop, after it has told of an iterate."""
        stop = self.interrupt.seen
        if self.tell is not None:
            stop |= self.tell(self.iteration, float(at["f"]), np.array(at["x"]), np.array(at["g"]))
        self.iteration += 1
        return stop


class Follower(ca.Callback):
    """What CasADi calls every iteration; it asks the `watch` of the run.

    Parameters
    ----------
    columns, rows, parameters : int
        Sizes of the NLP.
    """

    def __init__(self, columns: int, rows: int, parameters: int, watch: Watch):
        ca.Callback.__init__(self)
        self.sizes = {"f": 1, "x": columns, "lam_x": columns, "g": rows, "lam_g": rows}
        self.parameters, self.watch, self.telling = parameters, watch, False
        self.construct("follower", {})

    @classmethod
    def of(cls, parts: Any, watch: Watch) -> Follower:
        """The one of a run of this NLP."""
        follower = cls(parts.x.numel(), parts.g.numel(), parts.p.numel(), watch)
        watch.follower = follower
        return follower

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return ca.nlpsol_out(i)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.sizes.get(ca.nlpsol_out(i), self.parameters))

    def eval(self, arguments: list) -> list:
        self.telling = True
        try:
            return [int(self.watch.stops(dict(zip(ca.nlpsol_out(), arguments, strict=True))))]
        except BaseException as error:
            self.watch.error = error
            return [1]
        finally:
            self.telling = False
