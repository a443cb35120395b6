# SPDX-License-Identifier: Apache-2.0
"""Scenes for the local map: discs in motion, a robot on a path, noise, tracker and map."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.scan_to_sectors import aligned
from mfba_planner.perception.static_map import StaticMap, StaticMapParams
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import scan_at

Disc = tuple[float, float, float]


def wall(start: Point, end: Point, radius_m: float = 0.05) -> list[Disc]:
    """A wall as a row of discs that touch."""
    n = math.ceil(math.dist(start, end) / radius_m)
    return [
        (
            start[0] + (end[0] - start[0]) * k / n,
            start[1] + (end[1] - start[1]) * k / n,
            radius_m,
        )
        for k in range(n + 1)
    ]


def room(half_m: float) -> list[Disc]:
    """Four walls around the origin."""
    a = half_m
    corners = [(-a, -a), (a, -a), (a, a), (-a, a), (-a, -a)]
    return [disc for one, two in zip(corners, corners[1:]) for disc in wall(one, two)]


@dataclass
class Scene:
    """Scans a world tick by tick; discs(t) are what stands and moves at that time."""

    discs: Callable[[float], Sequence[Disc]]
    beams: int = 360
    reach_m: float = 10.0
    fov_rad: float = 6.2832
    tick_s: float = 0.1
    scan_m: float = 0.0
    odom_m: float = 0.0
    odom_rad: float = 0.0
    seed: int = 0
    params: StaticMapParams = field(default_factory=StaticMapParams)

    def __post_init__(self) -> None:
        """Start with an empty map."""
        self.map, self.tracker = StaticMap(self.params), Tracker()
        self.rng = np.random.default_rng(self.seed)
        self.tick = 0
        self.pose = self.given = Pose2D(0.0, 0.0)

    def step(self, pose: Pose2D) -> np.ndarray:
        """One scan from the true pose; the map's points (n, 2) as seen from it, in the truth."""
        lidar = Lidar(
            beams=self.beams, range_max_m=self.reach_m, range_min_m=0.05, fov_rad=self.fov_rad
        )
        scan = scan_at(pose, lidar, list(self.discs(self.tick * self.tick_s)), None)
        noise = self.rng.normal(size=self.beams) * self.scan_m
        scan = replace(scan, ranges_m=np.maximum(scan.ranges_m + noise, 0.06))
        dx, dy, turn = (
            self.rng.normal(size=3) * (self.odom_m, self.odom_m, self.odom_rad)
        ).tolist()
        given = Pose2D(pose.x + dx, pose.y + dy, pose.yaw + turn)
        self.tick += 1
        stamp_ns = round(self.tick * self.tick_s * 1e9)
        self.tracker.update(stamp_ns, given, aligned(scan, given.yaw))
        moving, surely = self.tracker.moving()
        beams = self.tracker.beams
        assert beams is not None
        self.map.update(stamp_ns, given, beams, moving, surely, self.tracker.pose_error)
        self.pose, self.given = pose, given
        return self.points()

    def points(self) -> np.ndarray:
        """The map's points (n, 2) as seen from the robot, in the true frame."""
        points, p, g = self.map.points(), self.pose, self.given
        c, s = math.cos(p.yaw - g.yaw), math.sin(p.yaw - g.yaw)
        dx, dy = points[:, 0] - g.x, points[:, 1] - g.y
        return np.stack((p.x + c * dx - s * dy, p.y + s * dx + c * dy), axis=1)


def off_surface(points: np.ndarray, discs: Sequence[Disc]) -> np.ndarray:
    """Signed distances (n,) of points from the nearest of the discs' outlines."""
    d = np.array(discs)
    away = np.hypot(points[:, None, 0] - d[:, 0], points[:, None, 1] - d[:, 1]) - d[:, 2]
    nearest: np.ndarray = away[np.arange(points.shape[0]), np.abs(away).argmin(axis=1)]
    return nearest


def near(points: np.ndarray, disc: Disc, margin_m: float = 0.1) -> int:
    """How many points are on a disc or near it."""
    return int(
        (np.hypot(points[:, 0] - disc[0], points[:, 1] - disc[1]) < disc[2] + margin_m).sum()
    )
