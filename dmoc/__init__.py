"""Discrete mechanics and optimal control of translating bodies with CasADi.

State a transfer with `TransferProblem`, `solve` it, `verify` it. Everything public imports from here.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# The one list of public names, for type checkers and editors as for Python. Python itself imports a name
# on its first use only, so that `dmoc --help` answers before CasADi is loaded.
if TYPE_CHECKING:
    from dmoc.basics.unknown import Unknown as Unknown
    from dmoc.bodies.ball_torques import BallTorque as BallTorque
    from dmoc.bodies.pointing import PointingKeepIn as PointingKeepIn
    from dmoc.bodies.pointing import PointingKeepOut as PointingKeepOut
    from dmoc.bodies.pointing import RateLimit as RateLimit
    from dmoc.bodies.thrusters import Thrusters as Thrusters
    from dmoc.bodies.torques import Torque as Torque
    from dmoc.bodies.torques import Wrench as Wrench
    from dmoc.bodies.wheels import MomentumLimit as MomentumLimit
    from dmoc.bodies.wheels import Wheels as Wheels
    from dmoc.checks.evidence import Evidence as Evidence
    from dmoc.checks.verification import Check as Check
    from dmoc.checks.verification import Report as Report
    from dmoc.conversions.convert import convert as convert
    from dmoc.effects.air import TabulatedAtmosphere as TabulatedAtmosphere
    from dmoc.effects.air import msis_atmosphere as msis_atmosphere
    from dmoc.effects.atmosphere import Atmosphere as Atmosphere
    from dmoc.effects.atmosphere import Drag as Drag
    from dmoc.effects.atmosphere import ExponentialAtmosphere as ExponentialAtmosphere
    from dmoc.effects.atmosphere import LinearDrag as LinearDrag
    from dmoc.effects.atmosphere import UniformAtmosphere as UniformAtmosphere
    from dmoc.effects.atmosphere import Wind as Wind
    from dmoc.effects.base import Body as Body
    from dmoc.effects.base import BodyConservative as BodyConservative
    from dmoc.effects.base import BodyForce as BodyForce
    from dmoc.effects.base import Conservative as Conservative
    from dmoc.effects.base import Effect as Effect
    from dmoc.effects.base import Force as Force
    from dmoc.effects.bodies import GravityGradient as GravityGradient
    from dmoc.effects.bodies import PivotGravity as PivotGravity
    from dmoc.effects.bodies import PlateDrag as PlateDrag
    from dmoc.effects.bodies import PlateRadiation as PlateRadiation
    from dmoc.effects.bodies import Plates as Plates
    from dmoc.effects.frames import ClohessyWiltshire as ClohessyWiltshire
    from dmoc.effects.frames import RotatingFrame as RotatingFrame
    from dmoc.effects.frames import three_body as three_body
    from dmoc.effects.gravity import J2 as J2
    from dmoc.effects.gravity import PointGravity as PointGravity
    from dmoc.effects.gravity import Spring as Spring
    from dmoc.effects.gravity import UniformGravity as UniformGravity
    from dmoc.effects.motion import circular_motion as circular_motion
    from dmoc.effects.motion import kepler_motion as kepler_motion
    from dmoc.effects.motion import tabulated_motion as tabulated_motion
    from dmoc.effects.radiation import ConicalShadow as ConicalShadow
    from dmoc.effects.radiation import CylindricalShadow as CylindricalShadow
    from dmoc.effects.radiation import RadiationPressure as RadiationPressure
    from dmoc.effects.radiation import Shadow as Shadow
    from dmoc.effects.third_body import ThirdBody as ThirdBody
    from dmoc.ends.base import Boundary as Boundary
    from dmoc.ends.base import State as State
    from dmoc.ends.conditions import Condition as Condition
    from dmoc.ends.joint_states import JointState as JointState
    from dmoc.ends.moving import Moving as Moving
    from dmoc.ends.orbits import CircularOrbit as CircularOrbit
    from dmoc.ends.orbits import Orbit as Orbit
    from dmoc.ends.poses import Attitude as Attitude
    from dmoc.ends.poses import Pose as Pose
    from dmoc.ends.poses import rotation as rotation
    from dmoc.exports.export import export as export
    from dmoc.films.film import animate as animate
    from dmoc.flights.flight import Flight as Flight
    from dmoc.flights.flown import fly as fly
    from dmoc.identification.estimate import Estimate as Estimate
    from dmoc.identification.identify import identify as identify
    from dmoc.identification.plans import foresee as foresee
    from dmoc.identification.plans import plan_for as plan_for
    from dmoc.legs.encounters import Bounce as Bounce
    from dmoc.legs.encounters import Flyby as Flyby
    from dmoc.legs.encounters import Frame as Frame
    from dmoc.legs.ends import Free as Free
    from dmoc.legs.ends import Periodic as Periodic
    from dmoc.legs.events import Drop as Drop
    from dmoc.legs.events import Impulse as Impulse
    from dmoc.legs.events import Via as Via
    from dmoc.legs.legs import Coast as Coast
    from dmoc.legs.legs import Leg as Leg
    from dmoc.legs.objectives import DeltaV as DeltaV
    from dmoc.legs.together import Apart as Apart
    from dmoc.legs.together import Meet as Meet
    from dmoc.legs.together import Together as Together
    from dmoc.links.holonomic import Holonomic as Holonomic
    from dmoc.links.joint import Joint as Joint
    from dmoc.links.joint_limits import JointLimit as JointLimit
    from dmoc.links.joints import Fixed as Fixed
    from dmoc.links.joints import Prismatic as Prismatic
    from dmoc.links.joints import Revolute as Revolute
    from dmoc.links.joints import Spherical as Spherical
    from dmoc.links.push import JointForce as JointForce
    from dmoc.links.push import JointTorque as JointTorque
    from dmoc.links.push import On as On
    from dmoc.links.rods import Rod as Rod
    from dmoc.links.rods import Slider as Slider
    from dmoc.links.rods import Surface as Surface
    from dmoc.links.several import Several as Several
    from dmoc.links.springs import JointDamper as JointDamper
    from dmoc.links.springs import JointSpring as JointSpring
    from dmoc.links.system import Member as Member
    from dmoc.links.system import System as System
    from dmoc.missions.solution import MissionSolution as MissionSolution
    from dmoc.motion.march import Trajectory as Trajectory
    from dmoc.nlp.solving import NLP as NLP
    from dmoc.nlp.transcription import transcribe as transcribe
    from dmoc.pages.report import report as report
    from dmoc.parts.actuator import Actuator as Actuator
    from dmoc.parts.constraint import Constraint as Constraint
    from dmoc.parts.detours import KeepOut as KeepOut
    from dmoc.parts.engines import Engine as Engine
    from dmoc.parts.engines import Nozzles as Nozzles
    from dmoc.parts.forces import BallForce as BallForce
    from dmoc.parts.forces import BoxForce as BoxForce
    from dmoc.parts.forces import FreeForce as FreeForce
    from dmoc.parts.forces import Unpowered as Unpowered
    from dmoc.parts.largest import FinalHeight as FinalHeight
    from dmoc.parts.largest import FinalRadius as FinalRadius
    from dmoc.parts.largest import Information as Information
    from dmoc.parts.objectives import Effort as Effort
    from dmoc.parts.objectives import FinalMass as FinalMass
    from dmoc.parts.objectives import Fuel as Fuel
    from dmoc.parts.objectives import Objective as Objective
    from dmoc.parts.objectives import Time as Time
    from dmoc.parts.objectives import WeightedSum as WeightedSum
    from dmoc.parts.rows import Row as Row
    from dmoc.parts.speed import SpeedLimit as SpeedLimit
    from dmoc.parts.zones import ApproachCone as ApproachCone
    from dmoc.parts.zones import KeepIn as KeepIn
    from dmoc.planets.planet import planet as planet
    from dmoc.results.solution import Solution as Solution
    from dmoc.results.solution import SolveError as SolveError
    from dmoc.scene.mission import Mission as Mission
    from dmoc.scene.problem import TransferProblem as TransferProblem
    from dmoc.scene.team import Team as Team
    from dmoc.sensitivity.dispersion import Dispersion as Dispersion
    from dmoc.sensitivity.dispersion import disperse as disperse
    from dmoc.sensitivity.feedback import feedback as feedback
    from dmoc.sensitivity.predict import predict as predict
    from dmoc.sensitivity.symmetries import Symmetry as Symmetry
    from dmoc.sensitivity.symmetries import symmetries as symmetries
    from dmoc.sensitivity.worth import Worth as Worth
    from dmoc.sensitivity.worth import worth as worth
    from dmoc.structure.front import load as load
    from dmoc.structure.front import solve as solve
    from dmoc.structure.front import verify as verify
    from dmoc.studies.accuracy import Formulation as Formulation
    from dmoc.studies.accuracy import work_precision as work_precision
    from dmoc.studies.drift import drift as drift
    from dmoc.studies.flights import simulate as simulate
    from dmoc.studies.flights import simulate_team as simulate_team
    from dmoc.sweeps.sweep import sweep as sweep
    from dmoc.teams.solution import TeamSolution as TeamSolution


@cache
def _homes() -> dict[str, str]:
    """The module of each public name, as the imports above say; this file may stand in a zip file.

    A parser of Python would take 20 times as long, a twentieth of a small solve from the command line.
    """
    from pkgutil import get_data

    text = (get_data(__name__, "__init__.py") or b"").decode()
    listed = re.findall(r"^    from (dmoc\.\S+) import (\w+) as \2$", text, re.MULTILINE)
    return {name: home for home, name in listed}


# a type checker that saw this would take a misspelt name for one found here
if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name == "__all__":
            return sorted(_homes())
        if name.startswith("__") or name not in _homes():
            raise AttributeError(f"module 'dmoc' has no attribute {name!r}")
        return getattr(import_module(_homes()[name]), name)


def __dir__() -> list[str]:
    return [*sorted(_homes()), "__version__"]
