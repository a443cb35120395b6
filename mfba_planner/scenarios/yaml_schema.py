# SPDX-License-Identifier: Apache-2.0
"""Schema of scenario files written by hand: YAML, degrees or radians, defaults, error messages.

A module of its own, because pydantic and yaml take 0.15 s to import and files written by programs
do not need them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from ..core.errors import ConfigError
from ..core.option_specs import did_you_mean
from ..simulation.footprint import circumscribed_radius_m
from ..simulation.obstacle_motion import Obstacle, Trigger, Turn, Walls
from ..simulation.scenario import FleetRobot, Kidnapping, Scenario
from ..simulation.triggered_motion import with_trigger
from .place_schema import MEANINGS as _PLACE_MEANINGS
from .place_schema import SHAPES as _PLACE_SHAPES
from .place_schema import Box, Place
from .scenario_json import EXAMPLE, parse_robot
from .schema_types import STRICT
from .schema_types import NotNegative as _NotNegative
from .schema_types import Number as _Number
from .schema_types import Point as _Point
from .schema_types import Positive as _Positive
from .schema_types import default as _default

_Knot = tuple[_Number, _Number, _Number]
# Names appear in messages and file names.
_Name = Annotated[str, Field(max_length=100, pattern=r"^\w[\w .+-]*$")]


class _Strict(BaseModel):
    model_config = STRICT


class _Heading(_Strict):
    heading_deg: _Number | None = None
    heading_rad: _Number | None = None  # written by programs: degrees would lose the last bit

    def heading(self) -> float:
        if self.heading_deg is not None and self.heading_rad is not None:
            raise ConfigError(
                f"heading_deg={self.heading_deg:g}: heading_rad={self.heading_rad:g} is given "
                "as well; keep one of them"
            )
        if self.heading_rad is None:
            return math.radians(self.heading_deg or 0.0)
        return self.heading_rad


class _Turn(_Heading):
    at_s: _Positive
    speed_mps: _NotNegative

    def build(self) -> Turn:
        return Turn(at_s=self.at_s, speed_mps=self.speed_mps, heading_rad=self.heading())


class _Trigger(_Strict):
    within_m: _Positive
    point_m: _Point | None = None
    absent_before: bool = _default(Trigger, "absent_before")


class _Obstacle(_Heading):
    center_m: _Point
    radius_m: _Positive
    speed_mps: _NotNegative = _default(Obstacle, "speed_mps")
    turns: list[_Turn] = []
    # A file's name is replaced by its points before: trajectory_file.py.
    trajectory: list[_Knot] = []
    loop: bool = _default(Obstacle, "loop")
    stays: bool = _default(Obstacle, "stays")
    appears_s: _NotNegative = _default(Obstacle, "appears_s")
    vanishes_s: _Positive | None = _default(Obstacle, "vanishes_s")
    trigger: _Trigger | None = _default(Obstacle, "trigger")

    def build(self) -> Obstacle:
        trigger, motion = self.trigger, self._motion()
        if trigger is None:
            return motion
        return with_trigger(
            motion, trigger.within_m, trigger.point_m, absent_before=trigger.absent_before
        )

    def _motion(self) -> Obstacle:
        return Obstacle(
            center_m=self.center_m,
            radius_m=self.radius_m,
            speed_mps=self.speed_mps,
            heading_rad=self.heading(),
            turns=tuple(turn.build() for turn in self.turns),
            trajectory=tuple(self.trajectory),
            loop=self.loop,
            stays=self.stays,
            appears_s=self.appears_s,
            vanishes_s=self.vanishes_s,
        )


class _Walls(_Strict):
    lower_m: _Point
    upper_m: _Point


class _Kidnapping(_Strict):
    at_s: _Positive
    to_m: _Point

    def build(self) -> Kidnapping:
        return Kidnapping(at_s=self.at_s, to_m=self.to_m)


class _Member(_Strict):
    name: str
    start_m: _Point
    goal_m: _Point

    def build(self) -> FleetRobot:
        return FleetRobot(name=self.name, start_m=self.start_m, goal_m=self.goal_m)


class _Scenario(Place, _Strict):
    name: _Name
    description: str = _default(Scenario, "description")
    start_m: _Point
    goal_m: _Point
    robot_radius_m: _Positive = _default(Scenario, "robot_radius_m")
    obstacles: list[_Obstacle] = []
    walls: _Walls | None = None
    time_limit_s: _Positive = _default(Scenario, "time_limit_s")
    robot: dict[str, Any] = {}
    kidnappings: list[_Kidnapping] = []
    robots: list[_Member] = []

    def positions(self) -> list[tuple[str, Any]]:
        """Where a robot is to be: key and point."""
        found: list[tuple[str, Any]] = [("start_m", self.start_m), ("goal_m", self.goal_m)]
        found += [("kidnapping to_m", kidnapping.to_m) for kidnapping in self.kidnappings]
        for member in self.robots:
            found += [(f"robot {member.name} start_m", member.start_m)]
            found += [(f"robot {member.name} goal_m", member.goal_m)]
        return found

    def build(self, directory: Path) -> Scenario:
        walls, robot, radius_m = self.walls, parse_robot(self.robot), self.robot_radius_m
        if robot.footprint_m and "robot_radius_m" not in self.model_fields_set:
            radius_m = circumscribed_radius_m(robot.footprint_m)
        return Scenario(
            name=self.name,
            description=self.description,
            start_m=self.start_m,
            goal_m=self.goal_m,
            robot_radius_m=radius_m,
            obstacles=tuple(obstacle.build() for obstacle in self.obstacles),
            walls=Walls(lower_m=walls.lower_m, upper_m=walls.upper_m) if walls else None,
            time_limit_s=self.time_limit_s,
            robot=robot,
            kidnappings=tuple(kidnapping.build() for kidnapping in self.kidnappings),
            robots=tuple(member.build() for member in self.robots),
            segments_m=self.segments(directory, self.positions()),
        )


_MEANINGS = {
    "name": "name in figures and bags: letters, digits, spaces and _ . + -",
    "description": "purpose, in a sentence",
    "start_m": "start of the robot, m",
    "goal_m": "goal of the robot, m",
    "robot_radius_m": "added to every obstacle (Fig. 4), m; with a footprint at least the radius "
    "around it, which is the default",
    "obstacles": "circles at rest or moving",
    "walls": "a rectangle that reflects obstacles; the robot may cross it",
    "time_limit_s": "simulated time after which the run fails, s",
    "center_m": "centre, of an obstacle at t = 0, m; left out with a trajectory",
    "radius_m": "radius, m",
    "speed_mps": "speed, m/s",
    "heading_deg": "heading, degrees from +x, counter-clockwise",
    "heading_rad": "heading in radians, instead",
    "robots": "several robots in one world; leave out start_m and goal_m above",
    "turns": "changes of speed and heading, sorted by time",
    "trajectory": "instead of center_m and speed: points [t, x, y] in s and m, sorted by time, "
    "straight in between, or the name of a CSV file of them; there from the first to the last one",
    "loop": "the trajectory begins anew at its end",
    "stays": "it stands at the ends of its trajectory before and afterwards",
    "appears_s": "simulated time from which it is there, s",
    "vanishes_s": "simulated time until which it is there, s",
    "trigger": "it waits for a robot; all its times count from then",
    "within_m": "it starts at the first tick with the centre of a robot as near to the point, m",
    "point_m": "the point; left out, the centre of the obstacle at its t = 0, m",
    "absent_before": "it is absent before it starts, instead of standing there",
    "at_s": "simulated time since the start, s",
    "robot": "base, lidar and noise, where they differ from the paper, and footprint_m: "
    "circles [x, y, radius] in base_link, m",
    "kidnappings": "times at which the robot is moved elsewhere, sorted by time",
    "to_m": "position it is moved to, m",
    "lower_m": "corner with the smaller x and y, m",
    "upper_m": "corner with the larger x and y, m",
    **_PLACE_MEANINGS,
}


def schema() -> dict[str, Any]:
    """The JSON schema of a scenario file, with a description of each key."""
    found = _Scenario.model_json_schema()
    for model in (found, *found["$defs"].values()):
        for key, entry in model["properties"].items():
            entry["description"] = _MEANINGS[key]
    return found


def checked(data: dict[Any, Any], directory: Path = Path()) -> Scenario:
    """The scenario from plain data; a map's path is relative to the directory.

    Raises ConfigError: key, value, reason, remedy.
    """
    try:
        return _Scenario.model_validate(_with_centers(_with_ends(data))).build(directory)
    except ValidationError as error:
        raise ConfigError(_explain(error)) from None


def _with_ends(data: dict[Any, Any]) -> dict[Any, Any]:
    """Fill in start and goal of a fleet from its first robot."""
    robots = data.get("robots")
    if not (isinstance(robots, list) and robots and isinstance(robots[0], dict)):
        return data
    ends = {key: robots[0][key] for key in ("start_m", "goal_m") if key in robots[0]}
    return ends | data


def _with_centers(data: dict[Any, Any]) -> dict[Any, Any]:
    """Fill in the centre of an obstacle from the first point of its trajectory."""
    obstacles = data.get("obstacles")
    if not isinstance(obstacles, list):
        return data
    return data | {"obstacles": [_with_center(entry) for entry in obstacles]}


def _with_center(entry: Any) -> Any:
    if not isinstance(entry, dict) or not entry.get("trajectory") or "center_m" in entry:
        return entry
    points = entry["trajectory"]
    first = points[0] if isinstance(points, list) else None
    is_knot = isinstance(first, list) and len(first) == 3
    numbers = first[1:] if is_knot and isinstance(first, list) else []
    are_finite = bool(numbers) and all(isinstance(v, int | float) and v - v == 0 for v in numbers)
    # Points that are none are refused as such.
    return entry | {"center_m": numbers if are_finite else [0.0, 0.0]}


_REMEDIES = {
    "finite_number": "give a finite number",
    "dict_type": "give a mapping of options, such as {drive: differential}",
    "float_type": "give a number",
    "list_type": "give a list ([] for none)",
    "missing": f"add it ({EXAMPLE})",
    "model_type": f"give a mapping ({EXAMPLE})",
    "string_pattern_mismatch": "give a name of letters, digits, spaces and _ . + -",
    "string_too_long": "give at most 100 characters",
    "string_type": "give a text",
    "too_long": "give two numbers, [x, y]",
    "tuple_type": "give two numbers, [x, y]",
}


def _explain(error: ValidationError) -> str:
    """One fault in one line: key, value, reason, remedy.

    An unknown key is reported first: misspelt, it is why another key is missing.
    """
    faults = error.errors(include_url=False)
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    kind, location = fault["type"], fault["loc"]
    if kind == "invalid_key":
        return f"key {location[-1]}: not a word; remove it ({EXAMPLE})"
    path = ".".join(str(item + 1 if isinstance(item, int) else item) for item in location)
    if kind == "extra_forbidden":
        return f"{path}: unknown key; {did_you_mean(str(location[-1]), _keys_at(location))}"
    if kind == "missing":
        return f"{path}: missing; {_REMEDIES[kind]}"
    remedy = _REMEDIES.get(kind) or fault["msg"].replace("Input should be", "give a number")
    if location[0] in _PLACE_SHAPES and kind in ("tuple_type", "too_long"):
        remedy = _PLACE_SHAPES[location[0]]
    value = repr(fault["input"])
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    return f"{path}={shown}: refused; {remedy}"


def _keys_at(location: tuple[Any, ...]) -> list[str]:
    models: dict[Any, type[BaseModel]] = {
        "obstacles": _Obstacle,
        "turns": _Turn,
        "trigger": _Trigger,
        "kidnappings": _Kidnapping,
        "robots": _Member,
        "walls": _Walls,
        "boxes": Box,
    }
    within = [models[item] for item in location[:-1] if item in models]
    return list((within or [_Scenario])[-1].model_fields)
