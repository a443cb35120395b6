# SPDX-License-Identifier: Apache-2.0
"""The planner that the parameters name, as the nodes run it: on sectors, maybe with a scan."""

from __future__ import annotations

from dataclasses import replace

from ..perception.sensory_vector import SensorParams
from .planner_params import Method, PlannerParams
from .supervised_planner import SupervisedPlanner, supervised_algorithm_1

DEFAULT_METHOD = (
    Method.PREDICTIVE
)  # of the programs and launch files: the robot that does not collide


def params_for_method(
    method: str | None, params: PlannerParams, *, algorithm_1: bool
) -> PlannerParams:
    """The given options for the method of that name, with the step and swarm it is made for.

    None: USUAL; or the paper's, where something was said that is about Algorithm 1 alone.
    """
    usual = Method.PAPER if algorithm_1 else DEFAULT_METHOD
    if Method(method or usual) is Method.PAPER:
        return params
    from .predictive import preset

    return preset(replace(params, method=Method.PREDICTIVE))


def make_planner(
    params: PlannerParams, sensor: SensorParams | None = None, seed: int = 0
) -> SupervisedPlanner:
    """A fresh planner of params.method. Raises ConfigError for a negative seed."""
    if params.method is Method.PREDICTIVE:
        from .predictive import Predictive  # much to load, and mostly not asked for

        return SupervisedPlanner(Predictive(params, sensor or SensorParams(), seed))
    return supervised_algorithm_1(params, seed)
