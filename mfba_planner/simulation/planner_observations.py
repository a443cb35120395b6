# SPDX-License-Identifier: Apache-2.0
"""Observations of the simulated world: sectors, circles with velocities, or a scan.

Perception holds the sensing range (SR) equal for comparisons; the lidar of a robot, which sees
as far as it sees, is observed by observe_scan().
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..core.errors import ConfigError, InputError
from ..core.geometry import Pose2D, distance
from ..core.option_specs import did_you_mean
from ..core.planner_types import Circle, Observation, Ranges, RefusalReason, Scan, observe
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sense_segments import sense_circles_and_segments
from ..perception.sensory_vector import SensorParams, blind, sense_circles
from .sensor_noise import Reading
from .simulated_lidar import cast_rays, cast_segments
from .world import World

SENSOR_STREAM = 2  # spawn key of the noise's SeedSequence child; the planner's is 1
BEAMS = {"scan-12": 12, "scan-360": 360}
NAMES = ("sectors", "known", *BEAMS)
# What an Observation holds of the obstacles, beside the sectors.
INPUTS = {"sectors": "sectors", "known": "circles"} | dict.fromkeys(BEAMS, "scan")

Sensed = tuple[tuple[Circle, ...] | None, Scan | None]


class Perception:
    """Builds the Observations of simulation.run_episode.run, by name of the perception.

    sectors: sector ranges only. known: the circles whose enlarged edge is within SR, with their
    true velocities, and no wall segments. scan-12, scan-360: beams from the robot's centre along
    the middles of equal sectors to the real circles and segments, up to SR + robot radius. A
    surface at that range has its enlarged edge at SR, so all sense the same region: these hold SR
    equal, and see less far than a lidar (lidar_perception). Beams do not detect Scenario.walls.

    noise_m is the standard deviation of ranges (of centres for known), drawn from a child of the
    seed named by the stamp. With a latency, circles and scan are that many ticks old (the first
    ticks get those of tick 0); Observation.sensed holds their stamp and pose, and the pose is the
    present one. Sector ranges come with every perception: from the scan where there is one, else
    without noise and latency. sectors=False saves their cost for planners that do not read them.
    """

    def __init__(
        self,
        name: str,
        *,
        noise_m: float = 0.0,
        latency_ticks: int = 0,
        seed: int = 0,
        sectors: bool = True,
    ) -> None:
        """Start before tick 0. Raises ConfigError for an unknown name or a number out of range."""
        if name not in NAMES:
            raise ConfigError(f"perception {name!r}: unknown; {did_you_mean(name, list(NAMES))}")
        if not (math.isfinite(noise_m) and noise_m >= 0.0):
            raise ConfigError(f"noise_m={noise_m}: give a finite standard deviation from 0 m up")
        if latency_ticks < 0 or seed < 0:
            raise ConfigError(
                f"latency_ticks={latency_ticks}, seed={seed}: give whole numbers from 0 up"
            )
        self.name = name
        self.noise_m = noise_m
        self.seed = seed
        self._beams = BEAMS.get(name, 0)
        self._sectors = sectors or name == "sectors"
        self._past: deque[tuple[int, Pose2D, Sensed]] = deque(maxlen=latency_ticks + 1)

    def __call__(self, world: World, sensor: SensorParams) -> Observation:
        """Observe the world at its present tick; a tick that is not later resets the latency."""
        now_ns = world.stamp_ns
        if self._past and now_ns <= self._past[-1][0]:
            self._past.clear()
        self._past.append((now_ns, world.pose, self._sense(world, sensor)))
        stamp_ns, pose, (circles, scan) = self._past[0]
        late = stamp_ns != now_ns
        ranges: Ranges = ()
        if self._sectors:
            if scan is None:
                ranges = sense(world, sensor)
            else:
                ranges = sense_scan(scan, 0.0, world.scenario.robot_radius_m, sensor)
        return Observation(
            stamp_ns=now_ns,
            pose=world.pose,
            ranges_m=ranges,
            goal=world.scenario.goal_m,
            now_ns=now_ns,
            circles=circles,
            scan=scan,
            sensed=(stamp_ns, pose) if late else None,
        )

    def _sense(self, world: World, sensor: SensorParams) -> Sensed:
        if self._beams:
            return None, self._scan(world, sensor)
        if self.name == "known":
            return self._circles(world, sensor), None
        return None, None

    def _circles(self, world: World, sensor: SensorParams) -> tuple[Circle, ...]:
        reach, (px, py) = sensor.sensing_range_m, world.pose.position
        circles = []
        for index, (center, radius) in zip(*world.near(reach)):
            dx, dy = center[0] - px, center[1] - py
            if math.sqrt(dx * dx + dy * dy) <= radius + reach:
                velocity = world.velocity(index)
                circles.append(Circle(center_m=center, radius_m=radius, velocity_mps=velocity))
        if not self.noise_m or not circles:
            return tuple(circles)
        offsets = self._noise(world.stamp_ns, 2 * len(circles)).reshape(-1, 2).tolist()
        return tuple(
            replace(c, center_m=(c.center_m[0] + dx, c.center_m[1] + dy))
            for c, (dx, dy) in zip(circles, offsets)
        )

    def _scan(self, world: World, sensor: SensorParams) -> Scan:
        longest = sensor.sensing_range_m + world.scenario.robot_radius_m
        near = []
        for index, (center, _) in zip(*world.near(sensor.sensing_range_m)):
            radius = world.radius_m(index)
            if distance(world.pose.position, center) <= longest + radius:
                near.append((*center, radius))
        ranges = cast_rays(world.pose.position, near, self._beams, longest)
        if world.scenario.segments_m:
            segments = world.segments.near(world.pose.position, longest)
            to_walls = cast_segments(world.pose.position, segments, self._beams)
            ranges = np.minimum(ranges, np.where(to_walls <= longest, to_walls, np.inf))
        if self.noise_m:
            noisy = np.maximum(ranges + self._noise(world.stamp_ns, self._beams), 0.0)
            ranges = np.where(noisy <= longest, noisy, np.inf)
        increment = 2.0 * math.pi / self._beams
        return Scan(
            ranges_m=ranges.astype(np.float32).astype(np.float64),
            angle_min_rad=0.5 * increment,
            angle_increment_rad=increment,
            range_min_m=0.0,
            range_max_m=float(np.nextafter(np.float32(longest), np.float32(np.inf))),
        )

    def _noise(self, stamp_ns: int, count: int) -> np.ndarray:
        sequence = np.random.SeedSequence(self.seed, spawn_key=(SENSOR_STREAM, stamp_ns))
        return np.random.Generator(np.random.PCG64(sequence)).normal(0.0, self.noise_m, count)


def sense(world: World, params: SensorParams) -> Ranges:
    """Sector ranges of the virtual sensors at the present tick, from circles or a scan.

    Raises InputError for a scan that cannot be used.
    """
    return _sensed(world, world.read(), params)


def _sensed(world: World, reading: Reading, params: SensorParams) -> Ranges:
    if reading.scan is None:
        position = reading.received.position
        _, circles = world.near(params.sensing_range_m, position)
        scenario = world.scenario
        if scenario.segments_m:
            return sense_circles_and_segments(
                position, circles, world.segments, scenario.robot_radius_m, params
            )
        return sense_circles(position, circles, params)
    scenario = world.scenario
    return sense_scan(
        reading.scan,
        reading.received.yaw,
        scenario.robot_radius_m,
        params,
        scenario.robot.lidar.extrinsics,
    )


def observe_sectors(world: World, sensor: SensorParams) -> Observation:
    """Observation of the paper's planner at the present tick: pose, sectors, goal."""
    reading = world.read()
    ranges: Ranges | RefusalReason
    try:
        ranges = _sensed(world, reading, sensor)
    except InputError:
        ranges = blind(1, math.nan)  # NaN sectors: the sensor refused the scan
    pose = reading.received
    return observe(world.stamp_ns, pose, ranges, world.scenario.goal_m, pose)


def observe_scan(world: World, sensor: SensorParams) -> Observation:
    """observe_sectors(), with the scan itself in a frame aligned with odom."""
    obs, scan = observe_sectors(world, sensor), world.read().scan
    if scan is None or obs.refused:
        return obs
    return replace(obs, scan=aligned(scan, obs.pose.yaw, world.scenario.robot.lidar.extrinsics))


Observe = Callable[[World, SensorParams], Observation]
