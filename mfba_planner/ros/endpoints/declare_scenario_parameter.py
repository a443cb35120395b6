# SPDX-License-Identifier: Apache-2.0
"""world_sim's scenario, its robot changed by the parameters robot.*."""

from __future__ import annotations

from dataclasses import replace

from ...scenarios.scenario_files import load_scenario
from ...scenarios.scenario_json import scenario_to_json
from ...simulation.scenario import Scenario
from ..interface import parameters
from ..node_settings import RobotParameters
from ..runtime.base_node import GraphNode


def declare_scenario(node: GraphNode, source: str) -> Scenario:
    """Load a scenario, declare robot.* and the whole as scenario_json; ConfigError if bad."""
    scenario = load_scenario(source)
    declared = parameters.declare(node, RobotParameters(robot=scenario.robot), read_only=True)
    scenario = replace(scenario, robot=declared.robot)
    parameters.state(node, "scenario_json", scenario_to_json(scenario), "scenario in full")
    return scenario
