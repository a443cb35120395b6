# SPDX-License-Identifier: Apache-2.0
"""What simulate.launch.py offers and tells the nodes; here it can be tested without launch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..core.errors import ConfigError
from ..core.options import override
from ..paper import readings
from ..planning.planner_factory import DEFAULT_METHOD, params_for_method
from ..planning.planner_params import Method
from ..scenarios.run_config import (
    NODES,
    Parameters,
    RunConfig,
    graph_parameters,
    recorder_parameters,
)
from ..scenarios.scenario_files import load_scenario
from ..swarm.bat_swarm import Algorithm
from .run_arguments import RECORDER

_TRUE_OR_FALSE = ("true", "false")
_MFBA = Algorithm.MFBA.value


@dataclass(frozen=True, slots=True)
class Argument:
    """A launch argument; choices are empty where there are too many to list."""

    default: str
    description: str
    choices: tuple[str, ...] = ()


ARGUMENTS = {
    "scenario": Argument("case1", "a shipped scenario's name, or a .yaml file"),
    "seed": Argument("0", "seed of all randomness"),
    "planner": Argument(
        "",
        f"who decides; empty: {DEFAULT_METHOD.value}, or {Method.PAPER.value} for another "
        "algorithm or reading than the usual ones",
        ("", *(method.value for method in Method)),
    ),
    "algorithm": Argument(_MFBA, "law of beta in eq. 4", tuple(a.value for a in Algorithm)),
    "reading": Argument(
        readings.DEFAULT_METHOD, "how section 6.2 is read", tuple(readings.PLANNERS)
    ),
    "real_time": Argument(
        "true", "tick on a wall timer; false: as fast as it goes", _TRUE_OR_FALSE
    ),
    "speed_factor": Argument("1.0", "simulated seconds per wall second, in real time"),
    "record": Argument("false", "write a bag", _TRUE_OR_FALSE),
    "bag": Argument("", "bag directory to create; empty: a new one below ./runs"),
    "params_file": Argument("", "a --params-file for all nodes, which has the last word"),
}


def launch_parameters(given: Mapping[str, str]) -> Parameters:
    """Every node's parameters, the recorder's first if there is one; ConfigError if refused."""
    planner = override(readings.planner(given["reading"]), {"bat.algorithm": given["algorithm"]})
    algorithm_1 = (given["algorithm"], given["reading"]) != (_MFBA, readings.DEFAULT_METHOD)
    config = RunConfig(
        scenario=load_scenario(given["scenario"]),
        planner=params_for_method(given["planner"] or None, planner, algorithm_1=algorithm_1),
        seed=_number("seed", given["seed"], int),
        real_time=given["real_time"] == "true",
        speed_factor=_number("speed_factor", given["speed_factor"], float),
    )
    recorders = (RECORDER,) if given["record"] == "true" else ()
    told = graph_parameters(config, (*NODES, *recorders))
    told["world_sim"]["start_paused"] = False  # nobody is there to let it go
    recorder = recorder_parameters(config, given["bag"], told)
    return {**dict.fromkeys(recorders, recorder), **told}


def _number(name: str, text: str, kind: type) -> Any:
    try:
        return kind(text)
    except ValueError:
        raise ConfigError(f"{name}:={text}: not a number; give one") from None
