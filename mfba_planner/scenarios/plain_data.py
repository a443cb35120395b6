# SPDX-License-Identifier: Apache-2.0
"""A scenario as plain data and as JSON, and back; what programs and bags hand over."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.options import override
from ..simulation.obstacle_motion import Obstacle, Turn, Walls
from ..simulation.robot_model import Robot
from ..simulation.scenario import Kidnapping, Member, Scenario

EXAMPLE = "compare config/scenarios/case1.yaml"


LIMIT = 1e6  # no number in a scenario is larger


def scenario_to_dict(scenario: Scenario) -> dict[str, Any]:
    """The scenario as plain data that load_scenario accepts and turns into an equal one."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(scenario), default=lambda e: e.value))
    # What a scenario does not use is left out: recordings compare scenarios as text.
    if scenario.robot == Robot():
        del plain["robot"]
    if not scenario.kidnappings:
        del plain["kidnappings"]
    if not scenario.robots:
        del plain["robots"]
    for obstacle in plain["obstacles"]:
        if not obstacle["turns"]:
            del obstacle["turns"]
    return plain


def scenario_to_json(scenario: Scenario) -> str:
    """One line of JSON that load_scenario accepts; the same scenario always gives the same."""
    return json.dumps(scenario_to_dict(scenario), sort_keys=True)


def robot_of(told: dict[str, Any]) -> Robot:
    """The robot of a scenario: simulation.robot_model's options, nested or with dots.

    Raises ConfigError for a bad one.
    """
    try:
        return override(Robot(), dict(_dotted(told)))
    except ConfigError as error:
        raise ConfigError(f"robot.{error}") from None


def _dotted(told: dict[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in told.items():
        if isinstance(value, dict):
            yield from _dotted(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


class UnusualError(Exception):
    """Not what scenario_to_dict writes: maybe wrong, maybe only written by hand."""


def as_written(data: dict[str, Any]) -> Scenario:
    """The scenario that scenario_to_dict wrote, without loading what explains mistakes.

    Nodes and bags hand scenarios over in this form. Whatever looks unusual raises UnusualError
    and is left to `scenario_model`, which accepts all that this accepts.
    """
    name, description, walls = data.get("name"), data.get("description"), data.get("walls")
    if not isinstance(name, str) or not re.fullmatch(r"\w[\w .+-]{0,99}", name, re.ASCII):
        raise UnusualError
    if not isinstance(description, str):
        raise UnusualError
    _require_keys(data, Scenario, "robot", "kidnappings", "robots")
    robot = data.get("robot", {})
    if not isinstance(robot, dict):
        raise UnusualError
    return Scenario(
        name=name,
        description=description,
        start_m=_point(data["start_m"]),
        goal_m=_point(data["goal_m"]),
        robot_radius_m=_positive(data["robot_radius_m"]),
        obstacles=tuple(_obstacle(entry) for entry in _list(data["obstacles"])),
        walls=None if walls is None else _walls(walls),
        time_limit_s=_positive(data["time_limit_s"]),
        robot=robot_of(robot),
        kidnappings=tuple(_kidnapping(entry) for entry in _list(data.get("kidnappings", []))),
        robots=tuple(_member(entry) for entry in _list(data.get("robots", []))),
    )


def _member(data: Any) -> Member:
    _require_keys(data, Member)
    if not isinstance(data["name"], str):
        raise UnusualError
    return Member(
        name=data["name"], start_m=_point(data["start_m"]), goal_m=_point(data["goal_m"])
    )


def _kidnapping(data: Any) -> Kidnapping:
    _require_keys(data, Kidnapping)
    return Kidnapping(at_s=_positive(data["at_s"]), to_m=_point(data["to_m"]))


def _obstacle(data: Any) -> Obstacle:
    _require_keys(data, Obstacle, "turns")
    return Obstacle(
        center_m=_point(data["center_m"]),
        radius_m=_positive(data["radius_m"]),
        speed_mps=_not_negative(data["speed_mps"]),
        heading_rad=_number(data["heading_rad"]),
        turns=tuple(_turn(entry) for entry in _list(data.get("turns", []))),
    )


def _turn(data: Any) -> Turn:
    _require_keys(data, Turn)
    return Turn(
        at_s=_positive(data["at_s"]),
        speed_mps=_not_negative(data["speed_mps"]),
        heading_rad=_number(data["heading_rad"]),
    )


def _walls(data: Any) -> Walls:
    _require_keys(data, Walls)
    return Walls(lower_m=_point(data["lower_m"]), upper_m=_point(data["upper_m"]))


def _require_keys(data: Any, kind: type, *optional: str) -> None:
    wanted = set(kind.__dataclass_fields__)  # type: ignore[attr-defined]
    if not isinstance(data, dict) or not wanted - {*optional} <= set(data) <= wanted:
        raise UnusualError


def _list(data: Any) -> list[Any]:
    if not isinstance(data, list):
        raise UnusualError
    return data


def _point(data: Any) -> Point:
    if len(_list(data)) != 2:
        raise UnusualError
    return (_number(data[0]), _number(data[1]))


def _number(value: Any) -> float:
    if type(value) is not float or not -LIMIT <= value <= LIMIT:  # NaN is neither
        raise UnusualError
    return value


def _not_negative(value: Any) -> float:
    if _number(value) < 0.0:
        raise UnusualError
    return float(value)


def _positive(value: Any) -> float:
    if _number(value) <= 0.0:
        raise UnusualError
    return float(value)
