# SPDX-License-Identifier: Apache-2.0
"""Scenario files in the usual form, completed to what scenario_json reads without yaml_schema."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from ..simulation.obstacle_motion import Obstacle
from ..simulation.scenario import Scenario
from .scenario_json import LIMIT

HEADING_DEG, HEADING_RAD = "heading_deg", "heading_rad"


def completed(data: dict[str, Any]) -> dict[str, Any]:
    """The data with the defaults that scenario_json.as_written() requires, headings in radians.

    What is unusual stays as it is: as_written() refuses it, and yaml_schema explains why.
    """
    full = _defaults(Scenario, "description", "time_limit_s", "walls") | {"obstacles": []}
    if "robot" not in data:  # a footprint has another default radius
        full |= _defaults(Scenario, "robot_radius_m")
    robots = data.get("robots")
    if isinstance(robots, list) and robots and isinstance(robots[0], dict):
        full |= {key: robots[0][key] for key in ("start_m", "goal_m") if key in robots[0]}
    full |= data
    if isinstance(full["obstacles"], list):
        full["obstacles"] = [_completed_obstacle(entry) for entry in full["obstacles"]]
    return full


def _completed_obstacle(entry: Any) -> Any:
    if not isinstance(entry, dict):
        return entry
    full = _defaults(Obstacle, "speed_mps", HEADING_RAD) | entry
    degrees: Any = full.get(HEADING_DEG)
    if HEADING_RAD not in entry and type(degrees) in (int, float) and abs(degrees) <= LIMIT:
        full[HEADING_RAD] = math.radians(full.pop(HEADING_DEG))
    return full


def _defaults(kind: type, *names: str) -> dict[str, Any]:
    """Defaults of fields of a dataclass."""
    found = {field.name: field.default for field in fields(kind)}
    return {name: found[name] for name in names}
