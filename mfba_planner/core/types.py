# SPDX-License-Identifier: Apache-2.0
"""What rooms hand to each other: scan, circle, observation, decision; the planner interface."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from .geometry import Point, Pose2D

NANO = 1e-9  # seconds in a nanosecond
ROBOT_RADIUS_M = 0.3  # of a robot of which nothing else is known
Bits = tuple[int, ...]
Ranges = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """A planar laser scan: beam k looks along angle_min_rad + k * angle_increment_rad."""

    ranges_m: np.ndarray
    angle_min_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float


class Mode(Enum):
    """What the planner is doing."""

    IDLE = "idle"
    PATH_GENERATION = "path_generation"
    OBSTACLE_AVOIDANCE = "obstacle_avoidance"
    BLOCKED = "blocked"
    STOPPED = "stopped"
    ARRIVED = "arrived"


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """An obstacle as a planner may know it, enlarged by the robot: m and m/s in the odom frame."""

    center_m: Point
    radius_m: float
    velocity_mps: Point = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """What the planner knows at one tick; now_ns - stamp_ns is the age of the inputs.

    The paper's planner reads the sectors alone. circles (what is within SR) and scan (real
    surfaces, in a frame aligned with odom) are for planners that want more than bits; where
    they are older than the pose, sensed says since when and from where.
    """

    stamp_ns: int
    pose: Pose2D
    ranges_m: Ranges
    goal: Point | None
    now_ns: int
    refused: str = ""
    circles: tuple[Circle, ...] | None = None
    scan: Scan | None = None
    sensed: tuple[int, Pose2D] | None = None


Refused = str  # an input that was refused travels as its reason


def observe(
    stamp_ns: int,
    pose: Pose2D | Refused,
    ranges_m: Ranges | Refused,
    goal: Point | None,
    last_pose: Pose2D,
    age_ns: int = 0,
) -> Observation:
    """Join what was read into an Observation; last_pose stands in for a pose that was refused."""
    refused = ""
    if isinstance(ranges_m, str):
        refused, ranges_m = ranges_m, ()
    if isinstance(pose, str):
        refused, pose = pose, last_pose
    return Observation(
        stamp_ns=stamp_ns,
        pose=pose,
        ranges_m=ranges_m,
        goal=goal,
        now_ns=stamp_ns + age_ns,
        refused=refused,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """One answer of the planner and why; gap counts from 1, 0 is none; lengths in metres."""

    stamp_ns: int
    mode: Mode
    reason: str
    pose: Pose2D
    goal: Point | None
    ranges_m: Ranges
    vs: Bits
    vg: Bits
    gap: int
    waypoint: Point
    velocity: Point
    candidates: tuple[Point, ...] = ()


class PathPlanner(Protocol):
    """What may drive the robot: one Observation in, one Decision out; it may remember."""

    def plan(self, obs: Observation) -> Decision:
        """Answer one observation; called once per tick, stamps rising."""
        ...
