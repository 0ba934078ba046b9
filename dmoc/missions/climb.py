"""Solve a mission, coarse to fine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dmoc.missions.guess import guessed
from dmoc.missions.mission import Mission
from dmoc.missions.program import MissionPath, MissionProgram
from dmoc.motion.mesh import uniform_mesh

def first_try(mission, order, steps, given=None, options=None):
    meshes=[(uniform_mesh(leg.steps or steps), leg.order or order) for leg in mission.plan]
    path=guessed(mission, meshes, given)
    t=time.perf_counter()
    program=MissionProgram.of(mission, mission.stretches, path)
    b=time.perf_counter()
    answer=program.solve(path, options or {})
    print('build',b-t,'solve',time.perf_counter()-b, answer.status, answer.iterations, answer.objective*program.cost)
    return program, answer, program.path(answer)
