# SPDX-License-Identifier: Apache-2.0
"""Simulated odometry and scan with the noise, loss and latency of robot_model.Noise."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.geometry import Pose2D, pose_as_in_message
from ..core.planner_types import NANO, Scan
from .scenario import Scenario
from .simulated_lidar import limited, scan_at

ODOM_STREAM, SCAN_STREAM = 4, 5  # spawn keys of SeedSequence children; one number per purpose

Surfaces = Sequence[tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class Reading:
    """Odometry and, of a robot with a lidar, the scan of one tick."""

    pose: Pose2D
    scan: Scan | None

    @property
    def received(self) -> Pose2D:
        """The pose as a subscriber to the odometry receives it."""
        return pose_as_in_message(self.pose)


class NoisySensors:
    """Odometry and lidar of one robot over a run; call read() once per tick, stamps ascending.

    With a latency the reading of an earlier tick carries the present stamp; the first ticks get
    the reading of tick 0. All draws of a tick come from children of the seed named by purpose
    and stamp.
    """

    def __init__(self, scenario: Scenario, tick_ns: int, seed: int) -> None:
        """Start before tick 0."""
        robot = scenario.robot
        self._robot, self._walls, self._seed = robot, scenario.walls, seed
        self._segments = scenario.segments
        noise, tick_s = robot.noise, tick_ns * NANO
        self._poses: deque[Pose2D] = deque(maxlen=1 + round(noise.odom_latency_s / tick_s))
        self._scans: deque[Scan] = deque(maxlen=1 + round(noise.scan_latency_s / tick_s))
        self._last: Pose2D | None = None

    def read(self, stamp_ns: int, pose: Pose2D, surfaces: Surfaces) -> Reading:
        """Odometry and scan at the true pose among circles (x, y, radius)."""
        self._poses.append(pose)
        scan = None
        if self._robot.lidar.beams:
            self._scans.append(self._scan_at(pose, surfaces))
            scan = self._noisy_scan(self._scans[0], stamp_ns)
        self._last = self._noisy_pose(self._poses[0], stamp_ns)
        return Reading(self._last, scan)

    def _scan_at(self, pose: Pose2D, surfaces: Surfaces) -> Scan:
        return scan_at(pose, self._robot.lidar, surfaces, self._walls, self._segments)

    def _noisy_pose(self, pose: Pose2D, stamp_ns: int) -> Pose2D:
        noise = self._robot.noise
        if not (noise.odom_m or noise.odom_rad or noise.odom_loss):
            return pose
        rng = self._stream(ODOM_STREAM, stamp_ns)
        dx, dy, turn = rng.normal(size=3).tolist()
        if rng.random() < noise.odom_loss and self._last is not None:
            return self._last
        m, rad = noise.odom_m, noise.odom_rad
        return Pose2D(pose.x + m * dx, pose.y + m * dy, pose.yaw + rad * turn)

    def _noisy_scan(self, scan: Scan, stamp_ns: int) -> Scan:
        noise, ranges = self._robot.noise, scan.ranges_m
        if not (noise.scan_m or noise.scan_dropout or noise.scan_loss):
            return scan
        rng = self._stream(SCAN_STREAM, stamp_ns)
        errors, lots = rng.normal(size=ranges.size), rng.random(ranges.size)
        noisy = limited(np.maximum(ranges + noise.scan_m * errors, 0.0), self._robot.lidar)
        lost = lots < noise.scan_dropout
        if rng.random() < noise.scan_loss:
            lost[:] = True
        return replace(scan, ranges_m=np.where(lost, np.nan, noisy))

    def _stream(self, purpose: int, stamp_ns: int) -> np.random.Generator:
        sequence = np.random.SeedSequence(self._seed, spawn_key=(purpose, stamp_ns))
        return np.random.Generator(np.random.PCG64(sequence))
