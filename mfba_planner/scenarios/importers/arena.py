# SPDX-License-Identifier: Apache-2.0
"""Arena (arena-rosnav) scenario files, JSON, of the three forms that its versions have.

arena-tools: robot_position, robot_goal, pedsim_agents; later: robots with start and goal,
obstacles with dynamic and static ones; first: scenarios with robot and dynamic_obstacles.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

from ...core.errors import ConfigError
from .imported import Imported, ImportOptions, Plain, Source, check_count, number, numbers, rounded

ROBOT_RADIUS_M = 0.3
TIME_LIMIT_S = 120.0
_SPEED_MPS = 0.3  # of an agent that does not say


def read_arena(source: Source, options: ImportOptions) -> Imported:
    """The scenarios of an Arena file. Raises ConfigError."""
    try:
        data = json.loads(source.text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"not JSON ({error}); mend the file") from None
    if not isinstance(data, dict):
        raise ConfigError(f"a {type(data).__name__}, not an object; give an Arena scenario")
    parts = data.get("scenarios")
    if not isinstance(parts, list):
        return _one(source.name, data, options)
    found = [_one(f"{source.name}-{k}", part, options) for k, part in enumerate(parts)]
    if not found:
        raise ConfigError("no scenario in it; give an Arena scenario")
    scenarios = [plain for imported in found for plain in imported.scenarios]
    lost = dict.fromkeys(line for imported in found for line in imported.lost)
    return Imported(scenarios=scenarios, lost=list(lost))


def _one(name: str, data: Any, options: ImportOptions) -> Imported:
    if not isinstance(data, dict):
        raise ConfigError(f"a {type(data).__name__} instead of a scenario; mend the file")
    start, goal, robots = _ends(data)
    people, standing = list(_dynamic(data)), list(_static(data))
    check_count("obstacles", len(people) + len(standing))
    circles = [_walker(agent, options) for agent in people]
    round_ones = [entry for entry in standing if "radius" in entry]
    circles += [_standing(entry) for entry in round_ones]
    scenario: Plain = {
        "name": name,
        "description": "imported from an Arena scenario",
        "start_m": list(options.start_m or start),
        "goal_m": list(options.goal_m or goal),
        "robot_radius_m": options.robot_radius_m or ROBOT_RADIUS_M,
        "time_limit_s": options.time_limit_s or TIME_LIMIT_S,
        "obstacles": circles,
    }
    lost = []
    if people:
        lost.append(f"the social forces of {len(people)} agents: they walk from point to point")
    if others := len(standing) - len(round_ones):
        lost.append(f"{others} x static model, which the file only names")
    if where := data.get("map_path") or data.get("map"):
        shown = str(where)[:60]
        lost.append(f"the map {shown}: name it as `map:` in the scenario")
    if robots > 1:
        lost.append(f"{robots - 1} further robots")
    return Imported(scenarios=[scenario], lost=lost)


def _ends(data: Plain) -> tuple[list[float], list[float], int]:
    """Start, goal, and the number of robots."""
    robots = data.get("robots")
    if isinstance(robots, list) and robots and isinstance(robots[0], dict):
        ends, count = (robots[0].get("start"), robots[0].get("goal")), len(robots)
    elif isinstance(data.get("robot"), dict):
        robot = data["robot"]
        ends, count = (robot.get("start_pos"), robot.get("goal_pos")), 1
    else:
        ends, count = (data.get("robot_position"), data.get("robot_goal")), 1
    if None in ends:
        raise ConfigError("no start and goal of a robot in it; give an Arena scenario")
    return rounded(*numbers(ends[0], 2, "start")), rounded(*numbers(ends[1], 2, "goal")), count


def _dynamic(data: Plain) -> Iterator[Plain]:
    obstacles = data.get("obstacles")
    of_obstacles = obstacles.get("dynamic") if isinstance(obstacles, dict) else None
    yield from _entries(data.get("pedsim_agents") or of_obstacles or data.get("dynamic_obstacles"))


def _static(data: Plain) -> Iterator[Plain]:
    obstacles = data.get("obstacles")
    of_obstacles = obstacles.get("static") if isinstance(obstacles, dict) else None
    yield from _entries(of_obstacles or data.get("static_obstacles"))


def _entries(given: object) -> Iterator[Plain]:
    """Obstacles of a list, or of an object by name."""
    entries = list(given.values()) if isinstance(given, dict) else given or []
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise ConfigError(f"obstacles {str(given)[:40]!r}: not a list of objects; mend the file")
    yield from entries


def _standing(entry: Plain) -> Plain:
    x, y = numbers(entry.get("pos", entry.get("start_pos")), 2, "pos")
    return {"center_m": rounded(x, y), "radius_m": number(entry["radius"], "radius")}


def _walker(agent: Plain, options: ImportOptions) -> Plain:
    """An agent that walks along its waypoints, and back (yoyo) or round again."""
    start = numbers(agent.get("pos", agent.get("start_pos")), 2, "pos")
    given = agent.get("waypoints") or []
    if not isinstance(given, list):
        raise ConfigError(f"waypoints={str(given)[:40]!r}: not a list; mend the file")
    points = [numbers(point, 2, "waypoint") for point in given]
    if agent.get("is_waypoint_relative"):
        points = [[x + start[0], y + start[1]] for x, y in points]
    radius = number(agent.get("obstacle_radius", options.person_radius_m), "obstacle_radius")
    speed = number(agent.get("vmax", agent.get("linear_velocity", _SPEED_MPS)), "vmax")
    corners = [start, *points]
    corners += reversed(corners[:-1]) if agent.get("mode") == "yoyo" else [start]
    knots = _timed(corners, speed)
    if len(knots) < 2:
        return {"center_m": rounded(*start), "radius_m": radius}
    return {"radius_m": radius, "trajectory": knots, "loop": True}


def _timed(corners: list[list[float]], speed: float) -> list[list[float]]:
    """Knots along a line of corners at one speed; without a speed the first only."""
    knots, t = [rounded(0.0, *corners[0])], 0.0
    for (ax, ay), (bx, by) in zip(corners, corners[1:]):
        step = math.hypot(bx - ax, by - ay)
        if step > 1e-6 and speed > 0.0:
            t += step / speed
            knots.append(rounded(t, bx, by))
    return knots
