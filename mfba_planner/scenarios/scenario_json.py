# SPDX-License-Identifier: Apache-2.0
"""Scenario to plain data and JSON, and back: the form that nodes and bags use."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import Any

from ..core.errors import ConfigError
from ..core.geometry import Point
from ..core.option_specs import override
from ..core.segments import Segment
from ..simulation.footprint import parse_footprint
from ..simulation.obstacle_motion import Obstacle, Turn, Walls
from ..simulation.recorded_motion import Knot
from ..simulation.robot_model import Robot
from ..simulation.scenario import FleetRobot, Kidnapping, Scenario
from ..simulation.triggered_motion import with_trigger

EXAMPLE = "compare config/scenarios/case1.yaml"


LIMIT = 1e6  # no number in a scenario is larger
FOOTPRINT = "footprint_m"  # of a robot, left out where it is a disc
# Keys of an obstacle that are left out where unused.
OPTIONAL = ("turns", "trajectory", "loop", "stays", "appears_s", "vanishes_s", "trigger")
TRIGGER = ("within_m", "point_m", "absent_before")  # of a trigger, the last one if true


def scenario_to_dict(scenario: Scenario) -> dict[str, Any]:
    """The scenario as plain data; load_scenario makes an equal one of it."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(scenario), default=lambda e: e.value))
    # Unused keys are left out, as recordings compare scenarios as text.
    if scenario.robot == Robot():
        del plain["robot"]
    elif not scenario.robot.footprint_m:
        del plain["robot"]["footprint_m"]
    if not scenario.kidnappings:
        del plain["kidnappings"]
    if not scenario.robots:
        del plain["robots"]
    if not scenario.segments_m:
        del plain["segments_m"]
    plain["obstacles"] = [_plain_obstacle(obstacle) for obstacle in plain["obstacles"]]
    return plain


def _plain_obstacle(written: dict[str, Any]) -> dict[str, Any]:
    """An obstacle as configured: of one with a trigger its motion, not that of a run."""
    trigger = written["trigger"]
    obstacle = trigger["motion"] if trigger else written
    if trigger:
        obstacle["trigger"] = {key: trigger[key] for key in TRIGGER if trigger[key] is not False}
    return {
        name: value
        for name, value in obstacle.items()
        if name not in OPTIONAL or value not in ([], False, None, 0.0)
    }


def scenario_to_json(scenario: Scenario) -> str:
    """One line of JSON for load_scenario; equal scenarios give equal text."""
    return json.dumps(scenario_to_dict(scenario), sort_keys=True)


def parse_robot(options: dict[str, Any]) -> Robot:
    """The robot from options of simulation.robot_model, nested or dotted, and its footprint_m.

    Raises ConfigError for an unknown option or a bad value.
    """
    single = {name: value for name, value in options.items() if name != FOOTPRINT}
    try:
        for name in single:
            if "footprint" in str(name):
                raise ConfigError(f"{name}: unknown option; did you mean {FOOTPRINT!r}?")
        footprint = parse_footprint(options.get(FOOTPRINT, []))
        return replace(override(Robot(), dict(_dotted(single))), footprint_m=footprint)
    except ConfigError as error:
        raise ConfigError(f"robot.{error}") from None


def _dotted(options: dict[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in options.items():
        if isinstance(value, dict):
            yield from _dotted(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


class UnusualError(Exception):
    """Data that scenario_to_dict would not write: invalid, or written by hand."""


def as_written(data: dict[str, Any]) -> Scenario:
    """The scenario from data as scenario_to_dict writes it, without the slow yaml_schema.

    Raises UnusualError for any other data; yaml_schema.checked accepts all that this accepts.
    """
    name, description, walls = data.get("name"), data.get("description"), data.get("walls")
    if not isinstance(name, str) or not re.fullmatch(r"\w[\w .+-]{0,99}", name, re.ASCII):
        raise UnusualError
    if not isinstance(description, str):
        raise UnusualError
    _require_keys(data, Scenario, "robot", "kidnappings", "robots", "segments_m")
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
        robot=parse_robot(robot),
        kidnappings=tuple(_kidnapping(entry) for entry in _list(data.get("kidnappings", []))),
        robots=tuple(_member(entry) for entry in _list(data.get("robots", []))),
        segments_m=tuple(_segment(entry) for entry in _list(data.get("segments_m", []))),
    )


def parse_segments(text: str) -> tuple[Segment, ...]:
    """Wall segments from a text, [[x0, y0, x1, y1], ...]; none from an empty one.

    Raises ConfigError for anything else.
    """
    if not text.strip():
        return ()
    try:
        return tuple(
            _segment([float(x) for x in _list(entry)]) for entry in _list(json.loads(text))
        )
    except (ValueError, TypeError, RecursionError, UnusualError):
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        raise ConfigError(
            f"segments_m={shown!r}: not a list of segments; give [[x0, y0, x1, y1], ...], m"
        ) from None


def segments_text(segments: tuple[Segment, ...]) -> str:
    """The text from which parse_segments() makes these segments."""
    return json.dumps(segments)


def _segment(data: Any) -> Segment:
    if len(_list(data)) != 4:
        raise UnusualError
    return (_number(data[0]), _number(data[1]), _number(data[2]), _number(data[3]))


def _member(data: Any) -> FleetRobot:
    _require_keys(data, FleetRobot)
    if not isinstance(data["name"], str):
        raise UnusualError
    return FleetRobot(
        name=data["name"], start_m=_point(data["start_m"]), goal_m=_point(data["goal_m"])
    )


def _kidnapping(data: Any) -> Kidnapping:
    _require_keys(data, Kidnapping)
    return Kidnapping(at_s=_positive(data["at_s"]), to_m=_point(data["to_m"]))


def _obstacle(data: Any) -> Obstacle:
    _require_keys(data, Obstacle, *OPTIONAL)
    motion = Obstacle(
        center_m=_point(data["center_m"]),
        radius_m=_positive(data["radius_m"]),
        speed_mps=_not_negative(data["speed_mps"]),
        heading_rad=_number(data["heading_rad"]),
        turns=tuple(_turn(entry) for entry in _list(data.get("turns", []))),
        trajectory=tuple(_knot(entry) for entry in _list(data.get("trajectory", []))),
        loop=_flag(data.get("loop", False)),
        stays=_flag(data.get("stays", False)),
        appears_s=_not_negative(data.get("appears_s", 0.0)),
        vanishes_s=_positive(data["vanishes_s"]) if "vanishes_s" in data else None,
    )
    if "trigger" not in data:
        return motion
    trigger = data["trigger"]
    if not isinstance(trigger, dict) or not {*TRIGGER[:2]} <= set(trigger) <= {*TRIGGER}:
        raise UnusualError
    return with_trigger(
        motion,
        _positive(trigger["within_m"]),
        _point(trigger["point_m"]),
        absent_before=_flag(trigger.get("absent_before", False)),
    )


def _knot(data: Any) -> Knot:
    if len(_list(data)) != 3:
        raise UnusualError
    return (_number(data[0]), _number(data[1]), _number(data[2]))


def _flag(value: Any) -> bool:
    if type(value) is not bool:
        raise UnusualError
    return value


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
    # NaN is in no range; bool is a kind of int.
    if type(value) not in (float, int) or not -LIMIT <= value <= LIMIT:
        raise UnusualError
    return float(value)


def _not_negative(value: Any) -> float:
    if _number(value) < 0.0:
        raise UnusualError
    return float(value)


def _positive(value: Any) -> float:
    if _number(value) <= 0.0:
        raise UnusualError
    return float(value)
