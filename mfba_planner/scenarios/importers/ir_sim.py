# SPDX-License-Identifier: Apache-2.0
"""IR-SIM worlds (YAML): the first robot, and obstacles whose place the file says."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from ...core.errors import ConfigError
from ...core.input_files import MOST_YAML_BYTES
from .imported import (
    Imported,
    ImportOptions,
    Plain,
    Source,
    check_count,
    number,
    numbers,
    rounded,
    static_shapes,
)
from .rectangle_circles import rectangle_circles

TIME_LIMIT_S = 120.0
_SPEED_MPS = 1.0  # IR-SIM's default of vel_max
_DRIVES = {"omni": "omnidirectional", "omni_angular": "omnidirectional", "diff": "differential",
           "acker": "differential"}  # fmt: skip
_FULL_CIRCLE_RAD = 6.2832  # the largest angle of view of a scenario's lidar
_MOST_BEAMS = 1080


@dataclass(slots=True)
class _Found:
    """The obstacles by kind, and what is lost."""

    circles: list[Plain] = field(default_factory=list)
    boxes: list[Plain] = field(default_factory=list)
    polygons: list[list[list[float]]] = field(default_factory=list)
    segments: list[list[float]] = field(default_factory=list)
    lost: Counter[str] = field(default_factory=Counter)


def read_ir_sim(source: Source, options: ImportOptions) -> Imported:
    """The world as one scenario. Raises ConfigError."""
    data = _yaml(source.text)
    robots = list(_objects(data.get("robot"), "robot"))
    if not robots:
        raise ConfigError("no robot in it; give an IR-SIM world with robot and obstacle")
    found = _Found()
    robot, radius = _robot(robots[0], found)
    if options.robot_radius_m:  # a disc instead
        robot.pop("footprint_m", None)
        radius = options.robot_radius_m
    count = sum(_count(entry) for entry in robots)
    if count > 1:
        found.lost["further robot"] += count - 1
    check_count("obstacles", sum(_count(entry) for entry in _objects(data.get("obstacle"), "")))
    for entry in _objects(data.get("obstacle"), "obstacle"):
        _add_obstacles(entry, found)
    world = data.get("world") if isinstance(data.get("world"), dict) else {}
    if isinstance(world, dict) and world.get("obstacle_map"):
        found.lost["obstacle_map: name it as `map:` in the scenario"] += 1
    state = _first(robots[0].get("state"), [1.0, 1.0])
    goal = _first(robots[0].get("goal"), [1.0, 9.0])
    scenario: Plain = {
        "name": source.name,
        "description": "imported from an IR-SIM world",
        "start_m": list(options.start_m or rounded(*numbers(state, 2, "robot state"))),
        "goal_m": list(options.goal_m or rounded(*numbers(goal, 2, "robot goal"))),
        **({"robot_radius_m": radius} if radius else {}),
        "time_limit_s": options.time_limit_s or TIME_LIMIT_S,
        **({"robot": robot} if robot else {}),
        "obstacles": found.circles,
        **static_shapes(found.boxes, found.polygons, found.segments),
    }
    return Imported(scenarios=[scenario], lost=[f"{n} x {what}" for what, n in found.lost.items()])


def _yaml(text: str) -> Plain:
    if len(text) > MOST_YAML_BYTES:
        raise ConfigError(f"more than {MOST_YAML_BYTES // 10**6} MB; take a part of the file")
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # in C where it is built
    try:
        data = yaml.load(text, Loader=loader)
    except (yaml.YAMLError, ValueError, RecursionError, AttributeError, LookupError) as error:
        reason = " ".join(str(error).split())[:80]
        raise ConfigError(f"not YAML ({reason}); give an IR-SIM world") from None
    if isinstance(data, dict) and isinstance(data.get("irsim"), dict):
        data = data["irsim"]
    if not isinstance(data, dict):
        raise ConfigError("no mapping; give an IR-SIM world with robot and obstacle")
    return data


def _objects(given: object, what: str) -> Iterator[Plain]:
    """The entries of robot or obstacle: one mapping, or a list of them."""
    entries = given if isinstance(given, list) else [] if given is None else [given]
    for entry in entries:
        if not isinstance(entry, dict):
            raise ConfigError(f"{what} {str(entry)[:40]!r}: not a mapping; mend the file")
        yield entry


def _count(entry: Plain) -> int:
    return max(1, int(number(entry.get("number", 1), "number")))


def _named(given: object) -> Plain:
    """A setting such as {name: diff}; of a list the first."""
    if isinstance(given, list) and given:
        given = given[0]
    return given if isinstance(given, dict) else {}


def _first(given: object, default: list[float]) -> object:
    """A state, or the first of a list of states."""
    if isinstance(given, list) and given and isinstance(given[0], list):
        return given[0]
    return default if given is None else given


def _robot(entry: Plain, found: _Found) -> tuple[Plain, float | None]:
    """Drive, limits, lidar and footprint as a scenario says them, and the radius of a disc."""
    robot: Plain = {}
    kinematics = _named(entry.get("kinematics")).get("name", "diff")
    drive = _DRIVES.get(str(kinematics))
    if drive is None or kinematics == "acker":
        found.lost[f"kinematics {str(kinematics)[:20]}: a differential drive"] += 1
    if drive != "omnidirectional":
        robot["drive"] = "differential"
        limits = entry.get("vel_max")
        if isinstance(limits, list) and len(limits) == 2:
            speed, turn = (number(value, "vel_max") for value in limits)
            robot |= {"max_speed_mps": speed, "max_turn_radps": turn}
    for sensor in _objects(entry.get("sensors"), "sensors"):
        if sensor.get("name") == "lidar2d" and "lidar" not in robot:
            robot["lidar"] = _lidar(sensor)
        else:
            found.lost[f"sensor {str(sensor.get('name'))[:20]}"] += 1
    shape = _named(entry.get("shape"))
    name = shape.get("name", "circle")
    if name == "circle":
        return robot, number(shape.get("radius", 0.2), "radius")
    if name == "rectangle":
        length, width = (number(shape.get(key), f"robot {key}") for key in ("length", "width"))
        # With a wheelbase the origin is the rear axle, else the middle.
        ahead = 0.5 * number(shape.get("wheelbase") or 0.0, "robot wheelbase")
        robot["footprint_m"] = rectangle_circles(length, width, ahead)
        return robot, None
    raise ConfigError(f"robot shape {str(name)[:20]!r}: not a circle or rectangle; change it")


def _lidar(sensor: Plain) -> Plain:
    beams = int(number(sensor.get("number", 100), "lidar number"))
    view = number(sensor.get("angle_range", math.pi), "lidar angle_range")
    return {
        "beams": min(beams, _MOST_BEAMS),
        "range_min_m": number(sensor.get("range_min", 0.0), "lidar range_min"),
        "range_max_m": number(sensor.get("range_max", 10.0), "lidar range_max"),
        "fov_rad": min(round(view, 4), _FULL_CIRCLE_RAD),
    }


def _add_obstacles(entry: Plain, found: _Found) -> None:
    count = _count(entry)
    placed = _named(entry.get("distribution")).get("name", "manual")
    if placed != "manual":
        found.lost[f"obstacle with a distribution ({str(placed)[:20]}), drawn anew each time"] += (
            count
        )
        return
    shapes = entry.get("shape", {"name": "circle"})
    states, goals = entry.get("state", [1.0, 1.0, 0.0]), entry.get("goal")
    for k in range(count):
        is_list = isinstance(shapes, list) and shapes
        shape = _named(shapes[min(k, len(shapes) - 1)] if is_list else shapes)
        _add_obstacle(
            entry, shape, _of(states, k), None if goals is None else _of(goals, k), found
        )


def _of(given: object, k: int) -> object:
    """State k of a list of states, the last one for more; or the only one."""
    if isinstance(given, list) and given and isinstance(given[0], list):
        return given[min(k, len(given) - 1)]
    return given


def _add_obstacle(entry: Plain, shape: Plain, state: object, goal: object, found: _Found) -> None:
    x, y = numbers(state, 2, "obstacle state")
    yaw = number(state[2], "obstacle state") if isinstance(state, list) and len(state) > 2 else 0.0
    name, moves = (
        shape.get("name", "circle"),
        bool(entry.get("kinematics")) and not entry.get("static"),
    )
    if moves and name != "circle":
        found.lost[f"motion of a {str(name)[:20]}: it stands"] += 1
    if name == "circle":
        radius = number(shape.get("radius", 0.2), "radius")
        motion = _motion(entry, (x, y), goal, found) if moves else None
        found.circles.append({**(motion or {"center_m": rounded(x, y)}), "radius_m": radius})
    elif name == "rectangle":
        size = rounded(*(number(shape.get(key), key) for key in ("length", "width")))
        box = {"center_m": rounded(x, y), "size_m": size}
        found.boxes.append({**box, **({"yaw_deg": rounded(math.degrees(yaw))[0]} if yaw else {})})
    elif name in ("polygon", "linestring") and isinstance(shape.get("vertices"), list):
        corners = [_placed(numbers(v, 2, "vertex"), x, y, yaw) for v in shape["vertices"]]
        if name == "polygon":
            found.polygons.append(corners)
        else:
            found.segments.extend([*a, *b] for a, b in zip(corners, corners[1:]))
    else:
        found.lost[f"obstacle of shape {str(name)[:20]}"] += 1


def _placed(vertex: list[float], x: float, y: float, yaw: float) -> list[float]:
    c, s = math.cos(yaw), math.sin(yaw)
    return rounded(x + c * vertex[0] - s * vertex[1], y + s * vertex[0] + c * vertex[1])


def _motion(entry: Plain, start: tuple[float, float], goal: object, found: _Found) -> Plain | None:
    """Straight to its goal at its highest speed, where it stays; None: it stands."""
    behavior = _named(entry.get("behavior")).get("name")
    if behavior != "dash":
        found.lost[
            f"behaviour {str(behavior)[:20]} of a moving obstacle: straight to its goal"
        ] += 1
    if goal is None:
        return None
    limits: Any = entry.get("vel_max", [_SPEED_MPS])
    speed = number(limits[0] if isinstance(limits, list) and limits else limits, "vel_max")
    x, y = numbers(goal, 2, "obstacle goal")
    length_m = math.dist(start, (x, y))
    if speed <= 0.0 or length_m < 1e-6:
        return None
    knots = [rounded(0.0, *start), rounded(length_m / speed, x, y)]
    return {"trajectory": knots, "stays": True}
