# SPDX-License-Identifier: Apache-2.0
"""Gazebo .world and .sdf files: cylinders, spheres and boxes that stand, as in BARN's worlds.

Models that a plugin moves along keyframes are those of DynaBARN, with its task (dynabarn.py).

Start, goal, robot and time limit of such a file are those of the BARN challenge (Perille et al.,
SSRR 2020; Xiao et al. 2022): a Jackal that starts at (-2.25, 3), heading +y, and drives 10 m along
+y within 100 s. Its radius is that of a circle as wide as the robot.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ...core.errors import ConfigError
from .dynabarn import LOST, motion_of_plugin, task
from .imported import (
    MOST_OBSTACLES,
    Imported,
    ImportOptions,
    Plain,
    Source,
    check_count,
    number,
    rounded,
    static_shapes,
)

START_M, GOAL_M = (-2.25, 3.0), (-2.25, 13.0)
ROBOT_RADIUS_M = 0.22
TIME_LIMIT_S = 100.0
LOST_HEADING = "the heading +y at the start: scenarios begin with +x"
LEAST_HEIGHT_M = 0.05  # what ends lower is floor
TILT_RAD = 0.01  # a cylinder leaning further has no circle as its footprint
_GROUND = {"model://sun", "model://ground_plane"}
_MODELS = 20 * MOST_OBSTACLES  # more elements are not read


class Pose(NamedTuple):
    """x, y, z in metres and the yaw in radians; the tilt is that from the vertical."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0
    tilt: float = 0.0

    def __mul__(self, inner: Pose) -> Pose:  # type: ignore[override]
        """The pose of inner, which is given in this pose's frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + c * inner.x - s * inner.y,
            self.y + s * inner.x + c * inner.y,
            self.z + inner.z,
            self.yaw + inner.yaw,
            max(self.tilt, inner.tilt),
        )


@dataclass(slots=True)
class _Found:
    """What a world holds."""

    folder: Path  # of the file, for sources of plugins
    circles: list[Plain] = field(default_factory=list)
    moving: bool = False
    boxes: list[Plain] = field(default_factory=list)
    lost: Counter[str] = field(default_factory=Counter)


def read_world(source: Source, options: ImportOptions) -> Imported:
    """The world as one scenario. Raises ConfigError for what is no world or has no obstacle."""
    world = _world(source.text)
    models = list(islice(world.iter("model"), _MODELS))
    check_count("models", sum(1 for model in models if model.find("link") is not None))
    found, moved = _Found(folder=source.folder), _state(world)
    for model in world.findall("model"):
        _add_model(model, Pose(), moved, found)
    for kind in ("include", "actor", "population"):
        named = [e.findtext("uri") or e.get("name") or "" for e in world.iter(kind)]
        for what in sorted(set(named) - _GROUND):
            found.lost[f"<{kind}> of {what}, which is not in the file"] = named.count(what)
    if not found.circles and not found.boxes:
        lost = f" (lost: {_sentence(found.lost)})" if found.lost else ""
        raise ConfigError(f"no cylinder, sphere or box in it{lost}; give a world of such models")
    if found.moving:
        scenario = {**task(source.name, found.circles, options), **static_shapes(found.boxes)}
        return Imported(scenarios=[scenario], lost=[*LOST, *_lines(found.lost)])
    scenario = {
        "name": source.name,
        "description": "imported from a Gazebo world",
        "start_m": list(options.start_m or START_M),
        "goal_m": list(options.goal_m or GOAL_M),
        "robot_radius_m": options.robot_radius_m or ROBOT_RADIUS_M,
        "time_limit_s": options.time_limit_s or TIME_LIMIT_S,
        "obstacles": found.circles,
        **static_shapes(found.boxes),
    }
    heading = [] if options.start_m else [LOST_HEADING]
    return Imported(scenarios=[scenario], lost=[*heading, *_lines(found.lost)])


def _world(text: str) -> ElementTree.Element:
    # SDF has no document type; one could define entities that expand without end.
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text):
        raise ConfigError("a document type (<!DOCTYPE ...>), which no world needs; take it away")
    if not text.strip():
        raise ConfigError("empty; give a Gazebo world")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise ConfigError(f"not XML ({error}); give a Gazebo world") from None
    world = root if root.tag == "world" else root.find("world")
    if world is None and root.tag == "sdf":
        world = root  # a file of models only
    if world is None:
        raise ConfigError(f"<{root.tag}> without a <world>; give a Gazebo world")
    return world


def _state(world: ElementTree.Element) -> dict[str, Pose]:
    """Poses of models that a saved state replaces: {name: pose}."""
    models = world.findall("state/model")
    return {
        model.get("name", ""): _pose(model) for model in models if model.find("pose") is not None
    }


def _pose(element: ElementTree.Element) -> Pose:
    given = element.find("pose")
    words = (given.text or "").split() if given is not None else []
    if not words:
        return Pose()
    if len(words) != 6:
        raise ConfigError(f"pose {' '.join(words)[:60]!r}: not six numbers; mend the file")
    x, y, z, roll, pitch, yaw = (number(word, "pose") for word in words)
    # The vertical of the body against that of the world.
    tilt = math.acos(max(-1.0, min(1.0, abs(math.cos(roll) * math.cos(pitch)))))
    return Pose(x, y, z, yaw, tilt)


def _add_model(
    model: ElementTree.Element, frame: Pose, moved: dict[str, Pose], found: _Found
) -> None:
    pose = moved.get(model.get("name", "")) or frame * _pose(model)
    plugin = model.find("plugin")
    if plugin is not None:
        _add_moving(model, plugin.get("filename", ""), found)
        return
    for link in model.findall("link"):
        at = pose * _pose(link)
        for collision in link.findall("collision"):
            geometry = collision.find("geometry")
            if geometry is not None:
                _add_shape(geometry, at * _pose(collision), found)
    for inner in model.findall("model"):
        _add_model(inner, pose, {}, found)


def _add_moving(model: ElementTree.Element, file_name: str, found: _Found) -> None:
    """A model that a plugin moves: its keyframes are in the plugin's source."""
    motion = motion_of_plugin(file_name, found.folder)
    radius = model.findtext("link/collision/geometry/cylinder/radius")
    if motion is None or radius is None:
        found.lost["model that a plugin moves, without its source NAME.cc in a folder here"] += 1
        return
    size = _above_zero(number(radius, "radius"), "radius")
    found.circles.append({"radius_m": size, **motion})
    found.moving = True


def _add_shape(geometry: ElementTree.Element, at: Pose, found: _Found) -> None:
    for shape in geometry:
        if shape.tag == "cylinder":
            height = _size(shape, "length")
            if at.tilt > TILT_RAD:
                found.lost["cylinder that lies or leans"] += 1
            elif _is_floor(at, height, found):
                continue
            else:
                _add_circle(at, _size(shape, "radius"), found)
        elif shape.tag == "sphere":
            _add_circle(at, _size(shape, "radius"), found)
        elif shape.tag == "box":
            _add_box(shape, at, found)
        elif shape.tag not in ("plane", "empty"):  # a plane is the ground
            found.lost[f"<{shape.tag}> as a shape"] += 1


def _add_circle(at: Pose, radius: float, found: _Found) -> None:
    x, y, r = rounded(at.x, at.y, radius)
    found.circles.append({"center_m": [x, y], "radius_m": r})


def _add_box(shape: ElementTree.Element, at: Pose, found: _Found) -> None:
    words = (shape.findtext("size") or "").split()
    if len(words) != 3:
        raise ConfigError(f"box of size {' '.join(words)[:60]!r}: not three numbers")
    a, b, height = (_above_zero(number(word, "size"), "size") for word in words)
    if at.tilt > TILT_RAD:
        found.lost["box that leans"] += 1
        return
    if _is_floor(at, height, found):
        return
    box: Plain = {"center_m": rounded(at.x, at.y), "size_m": rounded(a, b)}
    if yaw := rounded(math.degrees(math.remainder(at.yaw, math.tau)))[0]:
        box["yaw_deg"] = yaw
    found.boxes.append(box)


def _is_floor(at: Pose, height: float, found: _Found) -> bool:
    if at.z + 0.5 * height > LEAST_HEIGHT_M:
        return False
    found.lost[f"shape that ends below {LEAST_HEIGHT_M:g} m, as a floor does"] += 1
    return True


def _size(shape: ElementTree.Element, what: str) -> float:
    return _above_zero(number(shape.findtext(what), what), what)


def _above_zero(value: float, what: str) -> float:
    if value <= 0.0:
        raise ConfigError(f"{what}={value:g}: not above 0; mend the file")
    return value


def _lines(lost: Counter[str]) -> list[str]:
    return [f"{count} x {what}" for what, count in lost.items()]


def _sentence(lost: Counter[str]) -> str:
    return "; ".join(_lines(lost))
