# SPDX-License-Identifier: Apache-2.0
"""The planner that the parameters name, as the nodes run it: on sectors, maybe with a scan."""

from __future__ import annotations

from dataclasses import replace

from ..perception.sensory_vector import SensorParams
from .planner_params import Method, PlannerParams
from .supervised_planner import Guarded, algorithm_1

USUAL = Method.PREDICTIVE  # of the programs and launch files: the robot that does not collide


def named(method: str | None, params: PlannerParams, *, algorithm_1: bool) -> PlannerParams:
    """The given options for the method of that name, with the step and swarm it is made for.

    None: USUAL; or the paper's, where something was said that is about Algorithm 1 alone.
    """
    usual = Method.PAPER if algorithm_1 else USUAL
    if Method(method or usual) is Method.PAPER:
        return params
    from .predictive import preset

    return preset(replace(params, method=Method.PREDICTIVE))


def brain(params: PlannerParams, sensor: SensorParams | None = None, seed: int = 0) -> Guarded:
    """A fresh planner of params.method. Raises ConfigError for a negative seed."""
    if params.method is Method.PREDICTIVE:
        from .predictive import Predictive  # much to load, and mostly not asked for

        return Guarded(Predictive(params, sensor or SensorParams(), seed))
    return algorithm_1(params, seed)
