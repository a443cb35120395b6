# SPDX-License-Identifier: Apache-2.0
"""Makes the planner that PlannerParams.method names; used by the planner node."""

from __future__ import annotations

from dataclasses import replace

from ..optimizers.registry import require_optimizer
from ..perception.sensory_vector import SensorParams
from .planner_params import Method, PlannerParams
from .supervised_planner import SupervisedPlanner, supervised_algorithm_1

DEFAULT_METHOD = Method.PREDICTIVE  # of the programs and launch files, as it avoids collisions


def params_for_method(
    method: str | None, params: PlannerParams, *, algorithm_1: bool
) -> PlannerParams:
    """The given options for the method of that name, with its preset of step and swarm.

    For None: DEFAULT_METHOD, or the paper's if an option of Algorithm 1 was given.
    """
    usual = Method.PAPER if algorithm_1 else DEFAULT_METHOD
    if Method(method or usual) is Method.PAPER:
        return params
    from .predictive_planner import preset

    return preset(replace(params, method=Method.PREDICTIVE))


def check_usable(params: PlannerParams) -> None:
    """Raise ConfigError for an optimiser that is unknown or not installed."""
    require_optimizer(params.optimizer)


def make_planner(
    params: PlannerParams, sensor: SensorParams | None = None, seed: int = 0
) -> SupervisedPlanner:
    """A new planner of params.method. Raises ConfigError for a negative seed."""
    if params.method is Method.PREDICTIVE:
        from .predictive_planner import Predictive  # slow to import, and not always needed

        return SupervisedPlanner(Predictive(params, sensor or SensorParams(), seed))
    return supervised_algorithm_1(params, seed)


def make_loaded_planner(params: PlannerParams, seed: int) -> SupervisedPlanner:
    """make_planner(), with all imported that otherwise the first decision imports that needs it.

    It takes 0.1 s and more, for which no decision on a robot should wait.
    """
    if params.method is Method.PREDICTIVE:
        import eikonalfm  # noqa: F401
        import scipy.ndimage  # noqa: F401
    return make_planner(params, seed=seed)
