"""The file beside exported functions that says how each is called."""

from __future__ import annotations

import re

from dmoc.planners.functions import Scene
from dmoc.planners.mission import MissionPlanner
from dmoc.planners.terms import TERMS

# The mass at the start, also of a body by its name, among the numbers of a mission or a team.
MASS = re.compile(r"(^|_)(?<!dry_)mass$")

README = """\
# Functions of {name}

`manifest.json` lists every function with shape, unit and meaning of its arguments, and the SHA-256 of every
file here. All values are in SI units; matrices have one column a node, a step end or a step.

A `.casadi` file is code: CasADi runs what it holds. Load one only if you trust where it comes from.

Python, with CasADi alone:

    import casadi as ca
    nominal, solver = ca.Function.load("nominal.casadi"), ca.Function.load("solver.casadi")
    inputs = nominal()                     # the problem's own numbers and its guess, by name
    inputs["mass"] *= 1.01                 # a little heavier than the problem states
    plan = solver(**inputs)
    print(plan["objective"], plan["{largest}"], plan["violation"], solver.stats()["return_status"])

The solver always returns, whatever its status. A plan can be flown if {measures} and `violation`
(of rows and bounds, scaled) are small; that it is an optimum only the status says. Where a plan fails,
{shown} for every node, `violations_...` for every bound and row, shaped like its multipliers.

Between nodes the control is the polynomial through the nodes of each step. Where that breaks a limit, as it may
at a switch, hold the mean of the step's node values with the weights of the scheme: it has the same impulse.

To plan again, hand the outputs of a plan back as the inputs `guess_...` of `warm_solver`, multipliers too,
moved on to the new times. What is no input of the solver is fixed in it.

C++: `casadi::Function::load("solver.casadi")`, called with a `DMDict`. MATLAB and Octave:
`solver = casadi.Function.load('solver.casadi'); plan = solver.call(nominal.call(struct()))`.
{body}{code}"""

TURNING = """
An attitude is a unit quaternion from body axes to space axes, scalar first; q and -q are the same one, and the
solver takes the sign that its guess has. A rate is in body axes [rad/s]. `residual_torque` [N m] is in body
axes, too, and `residual_norm` is q.q - 1. A plan whose `largest_turn` between neighbouring nodes is not far
below pi/2 is wrong, whatever its status: it has too few steps, or a guess that changes sign. `reactions` keep
quaternions unit ones and move nothing. The inertia is fixed; where propellant burns and the thrusters' law is
not "constant", it is in proportion to the mass, and is what the problem states at the problem's own mass.
"""

CODE = """
C: `c/functions.c` needs nothing but the mathematical library; `c/transfer.h` documents it and `c/main.c` is an
example: `cc -O2 main.c functions.c -lm -o transfer && ./transfer`.
"""


def readme(scene: Scene, c: bool) -> str:
    """The text for a scene, with or without C code."""
    parts = [(name, TERMS[name].unit) for name in scene.names("residual")]
    return README.format(
        name=scene.problem.name,
        largest=f"largest_{parts[0][0]}",
        measures=", ".join(f"`largest_{name}` [{unit}]" for name, unit in parts),
        shown=", ".join(f"`{name}` [{unit}]" for name, unit in parts) + (" show" if parts[1:] else " shows"),
        body=TURNING if scene.turns else "",
        code=CODE if c else "",
    )


MISSION = """\
# Functions of {name}

`manifest.json` lists every function with shape, unit and meaning of its arguments, and the SHA-256 of every
file here. All values are in SI units; matrices have one column a node, a step end or a step. The names of
arguments that belong to a {stretch} begin with that of the {stretch}: {legs}.

A `.casadi` file is code: CasADi runs what it holds. Load one only if you trust where it comes from.

Python, with CasADi alone:

    import casadi as ca
    nominal, solver = ca.Function.load("nominal.casadi"), ca.Function.load("solver.casadi")
    inputs = nominal()                     # the {kind}'s own numbers and its guess, by name
    inputs["{mass}"] *= 1.01{blank}# a little heavier than the {kind} states
    plan = solver(**inputs)
    print(plan["objective"], plan["largest_residual"], plan["violation"], solver.stats()["return_status"])

The solver always returns, whatever its status. A plan can be flown if `largest_residual` [N] and `violation`
(of rows and bounds, scaled) are small; that it is an optimum only the status says. `residual` gives the same
for any path: what is left of the rows of each {stretch} and of {others}, 0 where they hold.

`step_{leg}` is one step of a {stretch} for any step length, `rollout_{leg}` all of its steps, on the mesh that
the manifest lists. {between}

To plan again, hand the outputs of a plan back as the inputs `guess_...` of `warm_solver`, multipliers too. What
is no input of the solver is fixed in it: {fixed}.
An attitude at start or goal must have the sign that the guess has there.
{code}"""

JOINTS = {
    "others": "each joint",
    "between": """What happens between legs, such as an impulse, stands in the plan: add it to the
velocity before the next rollout.""",
    "fixed": """what events are made of, such as the limit of an impulse or a mass
that is dropped, the meshes, and which impulses are none""",
}

BODIES = {
    "others": "what holds between bodies",
    "between": """All bodies have one mesh and one clock.""",
    "fixed": "the distances that bodies keep, and the mesh",
}

PHASES = {
    "others": "each joint, and of what holds between bodies",
    "between": """All bodies have one clock, which is cut into phases where some body
has a joint, in the order that the guess has; legs of a body follow each other. What happens between them, such
as an impulse, stands in the plan: add it to the velocity before the next rollout.""",
    "fixed": """the order of joints, what events are made of, the distances that
bodies keep, and the meshes""",
}

MISSION_CODE = """
C: `c/functions.c` needs nothing but the mathematical library; `c/{kind}.h` documents it.
"""


def mission_readme(planner: MissionPlanner, c: bool) -> str:
    """The text for a mission or a team, with or without C code."""
    mass = next(name for name in planner.numbers.names if MASS.search(name))
    words = {"mission": JOINTS, "team": BODIES if planner.stretch == "body" else PHASES}
    return MISSION.format(
        name=planner.mission.name,
        legs=", ".join(f"`{name}`" for name in planner.names),
        leg=planner.names[0],
        kind=planner.kind,
        stretch=planner.stretch,
        mass=mass,
        blank=" " * max(21 - len(mass), 2),
        code=MISSION_CODE.format(kind=planner.kind) if c else "",
        **words[planner.kind],
    )
