"""What the tests of sweeps share: a problem file, a pool without processes, made-up records."""

import textwrap
from concurrent.futures import Future

import numpy as np

from dmoc.scene.problem_file import Parameter
from dmoc.sweeps.plan import Plan
from dmoc.sweeps.worker import solve_point

PUSH = '''
    """A push on a line, which notes who makes it and of what."""
    import os
    import time
    from pathlib import Path

    from dmoc import BoxForce, State, TransferProblem


    def problem(duration=4.0, mass=1.0, limit=9.0, deadly=-1.0, nap=0.0):
        """The push.

        Parameters
        ----------
        duration : float [s]
            Time of the push.
        mass : float [kg]
            Mass of the cart.
        limit : float [N]
            Largest force.
        """
        with open(Path(__file__).with_name("made.txt"), "a") as made:
            made.write(f"{os.getpid()} {mass!r} {os.environ.get('OMP_NUM_THREADS')}\\n")
        time.sleep(nap)
        if mass == deadly:
            os._exit(9)
        return TransferProblem(mass, State([0], [0]), State([1], [0]), duration, actuator=BoxForce(limit))
'''
SOLVED = {
    "success": True,
    "status": "solved",
    "checks_hold": True,
    "objective_name": "effort",
    "objective_sense": 1,
}
FAILED = {"status": "infeasible", "message": ""}


def write_push(folder):
    """The problem file in a folder."""
    path = folder / "push.py"
    path.write_text(textwrap.dedent(PUSH))
    return path


def found(value):
    return SOLVED | {"objective": float(value)}


class Here:
    """A pool that solves in this process, at once, with `solve_point` or what stands in for it."""

    deaths = (ChildProcessError,)

    def __init__(self, function=solve_point):
        self.function, self.tasks = function, []

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def width(self):
        return 3

    def submit(self, task):
        self.tasks.append(task)
        future = Future()
        try:
            future.set_result(self.function(task))
        except Exception as error:
            future.set_exception(error)
        return future


def same(one, other):
    """Whether two results are equal to the last bit, but for what a clock says."""
    drop = ["build_s", "solve_s", "verify_s"]
    one, other = (data.drop_vars(drop).drop_attrs(deep=False) for data in (one, other))
    return one.identical(other)


def plan_of(*lengths, sampled=False):
    parameters = tuple(Parameter(f"p{i}", 1.0) for i in range(len(lengths)))
    return Plan(parameters, tuple(np.arange(float(length)) for length in lengths), sampled)
