# SPDX-License-Identifier: Apache-2.0
"""Robots that perceive by their lidar alone, as `mfba sim` simulates them, for sweeps.

The robot of a perception replaces that of the world; observe_scan() then gives the planner what
the sensors of that robot measure, and nothing else. With OWN_ROBOT the world keeps its robot.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..core.errors import ConfigError
from ..core.option_specs import Scalar, override
from ..core.planner_types import NANO, Observation
from ..core.robot_base import Drive
from ..perception.sensory_vector import SensorParams
from .planner_observations import observe_scan
from .robot_model import DEFAULT_BEAMS, Lidar, Noise, Robot
from .scenario import Scenario
from .world import World

LIDAR = Lidar(beams=DEFAULT_BEAMS)


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarRobot:
    """A robot, and the age of its scans (s), which their stamps tell."""

    robot: Robot
    scan_age_s: float = 0.0


LIDAR_ROBOTS: dict[str, LidarRobot] = {
    "lidar": LidarRobot(robot=Robot(lidar=LIDAR)),
    "lidar-differential": LidarRobot(robot=Robot(drive=Drive.DIFFERENTIAL, lidar=LIDAR)),
    "lidar-realistic": LidarRobot(
        robot=Robot(
            drive=Drive.DIFFERENTIAL,
            lidar=LIDAR,
            noise=Noise(scan_m=0.02, odom_m=0.02, odom_rad=0.02),
        ),
        scan_age_s=0.1,
    ),
}
# The robot of the scenario itself, as in `mfba sim`; without a lidar it gets the default one.
OWN_ROBOT = "scenario"
LIDAR_PERCEPTIONS = (*LIDAR_ROBOTS, OWN_ROBOT)


def with_lidar(
    scenario: Scenario,
    name: str,
    noise_m: float = 0.0,
    changes: Mapping[str, Scalar] | None = None,
) -> Scenario:
    """The same task for the robot of that perception, with changed options of Robot.

    Its footprint is the scenario's, as its radius is. noise_m deviates ranges further. Raises
    ConfigError for a change that is refused.
    """
    robot = scenario.robot if name == OWN_ROBOT else LIDAR_ROBOTS[name].robot
    robot = replace(override(robot, changes or {}), footprint_m=scenario.robot.footprint_m)
    if not robot.lidar.beams:
        robot = replace(robot, lidar=replace(robot.lidar, beams=DEFAULT_BEAMS))
    if noise_m:
        noise = replace(robot.noise, scan_m=math.hypot(robot.noise.scan_m, noise_m))
        robot = replace(robot, noise=noise)
    return replace(scenario, robot=robot)


class LidarPerception:
    """Observations of a robot with a lidar: observe_scan(), with scans of their true age.

    A late scan comes with the pose by odometry at its own stamp (Observation.sensed), beside the
    present pose. The age is rounded to whole ticks; the first ticks have the scan of tick 0.
    """

    def __init__(self, name: str, latency_ticks: int = 0) -> None:
        """Start before tick 0; latency_ticks are added to the age of the robot's scans."""
        if latency_ticks < 0:
            raise ConfigError(f"latency_ticks={latency_ticks}: give a whole number from 0 up")
        self._age_s = 0.0 if name == OWN_ROBOT else LIDAR_ROBOTS[name].scan_age_s
        self._ticks = latency_ticks
        self._past: deque[Observation] = deque()

    def __call__(self, world: World, sensor: SensorParams) -> Observation:
        """Observe the world at its present tick; a tick that is not later resets the latency."""
        present = observe_scan(world, sensor)
        if self._past and present.stamp_ns <= self._past[-1].stamp_ns:
            self._past.clear()
        self._past.append(present)
        ticks = self._ticks + round(self._age_s / (world.tick_ns * NANO))
        while len(self._past) > ticks + 1:
            self._past.popleft()
        late = self._past[0]
        if late is present:
            return present
        return replace(
            present,
            ranges_m=late.ranges_m,
            refused=present.refused or late.refused,
            scan=late.scan,
            sensed=(late.stamp_ns, late.pose),
        )
