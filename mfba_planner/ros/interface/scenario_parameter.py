# SPDX-License-Identifier: Apache-2.0
"""The scenario that world_sim is told, its robot changed by the parameters robot.*."""

from __future__ import annotations

from dataclasses import replace

from ..core.world import Scenario
from ..node_settings import Rig
from ..scenarios import load_scenario, scenario_to_json
from . import params
from .runtime import GraphNode


def declare_scenario(node: GraphNode, source: str) -> Scenario:
    """Load a scenario, declare its robot's options and state the whole; ConfigError if bad."""
    scenario = load_scenario(source)
    rig = params.declare(node, Rig(robot=scenario.robot), read_only=True)
    scenario = replace(scenario, robot=rig.robot)
    params.state(node, "scenario_json", scenario_to_json(scenario), "scenario in full")
    return scenario
