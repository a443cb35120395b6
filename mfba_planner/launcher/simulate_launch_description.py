# SPDX-License-Identifier: Apache-2.0
"""Arguments of simulate.launch.py and the node parameters they give; needs no `launch`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.errors import ConfigError, InputError
from ..core.option_specs import override
from ..paper import readings_of_paper
from ..planning.planner_factory import DEFAULT_METHOD, params_for_method
from ..planning.planner_params import Method
from ..scenarios.run_config import (
    NODES,
    Parameters,
    RunConfig,
    graph_parameters,
    recorder_parameters,
    with_perception,
)
from ..scenarios.scenario_files import load_scenario
from ..swarm.bat_swarm import Algorithm
from .run_arguments import RECORDER

_TRUE_OR_FALSE = ("true", "false")
_MFBA = Algorithm.MFBA.value


@dataclass(frozen=True, slots=True)
class LaunchArgument:
    """A launch argument; choices are empty where there are too many to list."""

    default: str
    description: str
    choices: tuple[str, ...] = ()


ARGUMENTS = {
    "scenario": LaunchArgument("case1", "a shipped scenario's name, or a .yaml file"),
    "seed": LaunchArgument("0", "seed of all randomness"),
    "planner": LaunchArgument(
        "",
        f"planning method; empty: {DEFAULT_METHOD.value}, or {Method.PAPER.value} for another "
        "algorithm or reading than the default ones",
        ("", *(method.value for method in Method)),
    ),
    "algorithm": LaunchArgument(_MFBA, "law of beta in eq. 4", tuple(a.value for a in Algorithm)),
    "reading": LaunchArgument(
        readings_of_paper.DEFAULT_METHOD,
        "interpretation of section 6.2",
        tuple(readings_of_paper.PLANNERS),
    ),
    "real_time": LaunchArgument(
        "true", "tick on a wall timer; false: as fast as possible", _TRUE_OR_FALSE
    ),
    "speed_factor": LaunchArgument("1.0", "simulated seconds per wall second, in real time"),
    "record": LaunchArgument("false", "write a bag", _TRUE_OR_FALSE),
    "bag": LaunchArgument("", "bag directory to create; empty: a new one below ./runs"),
    "namespace": LaunchArgument("", "namespace of all nodes and their topics"),
    "params_file": LaunchArgument(
        "", "a --params-file for all nodes; it overrides the other arguments"
    ),
}


def launch_parameters(given: Mapping[str, str]) -> Parameters:
    """Each node's parameters, the recorder's first; ConfigError for values that are refused."""
    planner = override(
        readings_of_paper.planner(given["reading"]), {"bat.algorithm": given["algorithm"]}
    )
    algorithm_1 = (given["algorithm"], given["reading"]) != (
        _MFBA,
        readings_of_paper.DEFAULT_METHOD,
    )
    scenario, planner = with_perception(
        load_scenario(given["scenario"]),
        params_for_method(given["planner"] or None, planner, algorithm_1=algorithm_1),
    )
    config = RunConfig(
        scenario=scenario,
        planner=planner,
        seed=_number("seed", given["seed"], int),
        real_time=given["real_time"] == "true",
        speed_factor=_number("speed_factor", given["speed_factor"], float),
    )
    recorders = (RECORDER,) if given["record"] == "true" else ()
    if given["bag"] and not recorders:
        raise ConfigError(f"bag:={given['bag']}: nothing is recorded; add record:=true")
    parameters = graph_parameters(config, (*NODES, *recorders))
    parameters["world_sim"]["start_paused"] = False  # no launcher resumes it
    recorder = recorder_parameters(config, given["bag"], parameters)
    return {**dict.fromkeys(recorders, recorder), **parameters}


def params_files(given: str) -> tuple[str, ...]:
    """The file of a params_file:= argument, if any. InputError where it does not exist."""
    if given and not Path(given).is_file():
        raise InputError(f"params_file:={given}: does not exist; give a YAML file")
    return (given,) if given else ()


def _number(name: str, text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        raise ConfigError(f"{name}:={text}: not a number; give one") from None
