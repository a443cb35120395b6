# SPDX-License-Identifier: Apache-2.0
"""Shared types: Scan, Circle, Mode, Observation, Decision, and the PathPlanner interface."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from .geometry import Point, Pose2D

NANO = 1e-9  # seconds in a nanosecond
ROBOT_RADIUS_M = 0.3  # default
Bits = tuple[int, ...]
Ranges = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """A planar laser scan: beam k points along angle_min_rad + k * angle_increment_rad.

    It was measured k * time_increment_s after the stamp; 0: all beams at once. Its beams begin at
    origin_m, seen from the robot, in a frame aligned with that of the angles. bearings_rad (n,)
    are the exact directions, from angle_min_rad on, of beams that only nearly point there.
    """

    ranges_m: np.ndarray
    angle_min_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float
    time_increment_s: float = 0.0
    origin_m: Point = (0.0, 0.0)
    bearings_rad: np.ndarray | None = None

    def angles_rad(self, beams: np.ndarray) -> np.ndarray:
        """The directions of beams, given by their numbers (k,)."""
        if self.bearings_rad is not None:
            beams = self.bearings_rad[beams]
            return self.angle_min_rad + beams
        angles: np.ndarray = self.angle_min_rad + self.angle_increment_rad * beams
        return angles

    def taken_from(self, pose: Pose2D) -> Pose2D:
        """Where the beams begin, of a scan aligned with odom and a robot at this pose."""
        return Pose2D(pose.x + self.origin_m[0], pose.y + self.origin_m[1], pose.yaw)


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
    """An obstacle enlarged by the robot's radius, with its velocity, in the odom frame.

    velocity_sd_mps is the velocity's standard deviation per axis; 0 where it is known exactly.
    """

    center_m: Point
    radius_m: float
    velocity_mps: Point = (0.0, 0.0)
    velocity_sd_mps: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """The planner's inputs at one tick; now_ns - stamp_ns is their age.

    The paper's planner reads only the sectors (ranges_m). Other planners may use circles (within
    SR) or scan (obstacle surfaces, in a frame aligned with odom). If these are older than the
    pose, sensed is their stamp and the pose at that stamp. pose_stamp_ns is the stamp of the pose
    if it is later than stamp_ns, which identifies the tick. refused is the reason for refusing
    the inputs, "" if they are valid.
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
    pose_stamp_ns: int | None = None

    @property
    def pose_ns(self) -> int:
        """The stamp of the pose: the moment for which a planner decides."""
        return self.stamp_ns if self.pose_stamp_ns is None else self.pose_stamp_ns


RefusalReason = str  # the reason why an input was refused, in place of the input


def observe(
    stamp_ns: int,
    pose: Pose2D | RefusalReason,
    ranges_m: Ranges | RefusalReason,
    goal: Point | None,
    last_pose: Pose2D,
    age_ns: int = 0,
) -> Observation:
    """Build an Observation from pose and ranges; last_pose replaces a pose that was refused."""
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
    """One decision and its reason; gap counts from 1, 0 means none; lengths in metres.

    perception is what obstacles were perceived by: sectors, scan or circles; "" for none or, in
    an old recording, unknown. The decision digest leaves it out.
    """

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
    perception: str = ""


class PathPlanner(Protocol):
    """Interface of every planner: Observation in, Decision out; it may keep state."""

    def plan(self, obs: Observation) -> Decision:
        """Decide on one observation; called once per tick, with rising stamps."""
        ...
