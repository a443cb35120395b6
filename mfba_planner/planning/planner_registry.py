# SPDX-License-Identifier: Apache-2.0
"""Registry of planners by name; a new planner needs one file and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module

from ..core.errors import ConfigError
from ..core.option_specs import did_you_mean
from ..core.planner_types import PathPlanner
from ..perception.sensory_vector import SensorParams
from ..swarm.bat_swarm import Algorithm
from .algorithm_1 import Algorithm1
from .planner_params import PlannerParams

Factory = Callable[[PlannerParams, SensorParams, int], PathPlanner]


def _paper(params: PlannerParams, _: SensorParams, seed: int) -> PathPlanner:
    return Algorithm1(params, seed)


def _with(algorithm: Algorithm) -> Factory:
    def planner(params: PlannerParams, _: SensorParams, seed: int) -> PathPlanner:
        return Algorithm1(replace(params, bat=replace(params.bat, algorithm=algorithm)), seed)

    return planner


# Modules below this package are imported when their planner is asked for.
PLANNERS: dict[str, Factory | str] = {
    "paper": _paper,
    "ba": _with(Algorithm.BA),
    "mfba": _with(Algorithm.MFBA),
    "straight": "peers.straight_line:Straight",
    "predictive": "predictive_planner:Predictive",
    "apf": "peers.apf:PotentialField",
    "vfh": "peers.vfh:VectorFieldHistogram",
    "dwa": "peers.dwa:DynamicWindow",
    "orca": "peers.orca:Orca",
}


def make(
    name: str,
    params: PlannerParams | None = None,
    sensor: SensorParams | None = None,
    seed: int = 0,
) -> PathPlanner:
    """A new planner by name; ba and mfba are the paper's with params.bat.algorithm replaced.

    Raises ConfigError for an unknown name, with the nearest known one, and a negative seed.
    """
    return find_factory(name)(params or PlannerParams(), sensor or SensorParams(), seed)


def find_factory(name: str) -> Factory:
    """The factory of the planner of that name. Raises ConfigError as make() does."""
    factory = PLANNERS.get(name)
    if factory is None:
        raise ConfigError(f"planner {name!r}: unknown; {did_you_mean(name, list(PLANNERS))}")
    if not isinstance(factory, str):
        return factory
    module, _, kind = factory.partition(":")
    found: Factory = getattr(import_module(f"{__package__}.{module}"), kind)
    return found


def preset_of(factory: Factory, params: PlannerParams) -> PlannerParams:
    """The options changed by the factory's function `preset`; unchanged without one."""
    preset: Callable[[PlannerParams], PlannerParams] | None = getattr(factory, "preset", None)
    return params if preset is None else preset(params)
