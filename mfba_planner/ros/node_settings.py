# SPDX-License-Identifier: Apache-2.0
"""The nodes' own parameters, besides those of planner and sensor; fixed once a node runs.

No ROS here: the launcher, the documentation and the nodes read the same declarations.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from typing import Any

from ..core.errors import ConfigError
from ..core.option_specs import check, option
from ..core.planner_types import ROBOT_RADIUS_M
from ..perception.no_return import NoReturn
from ..planning.planner_params import PlannerParams
from ..simulation.robot_model import Robot

_WAIT_FOR = "names of the nodes that ~/ready waits for, separated by commas"
_WORLD_WAITS_FOR = f"{_WAIT_FOR}; tick 0 waits too, unless ~/pause (false) starts it"
_NO_RETURN = "the range by which the lidar reports that nothing is there; inf: REP-117"
_DIAGNOSTICS = "period of /diagnostics"
_SCAN_FRAME = "frame that scans must be in; empty: any"
_BASE_FRAME = "frame of the robot (REP-105), where the odometry names none"
_SCAN_X = "where the lidar is on the robot, ahead of base_frame"
_SCAN_Y = "where the lidar is on the robot, to the left of base_frame"
_SCAN_YAW = "yaw of the scan's frame in base_frame"
_SCAN_FLIPPED = "the lidar is mounted upside down"
_SCAN_EXTRINSICS = (
    "where the pose of the lidar on the robot is from; auto: scan_x, scan_y, scan_yaw and "
    "scan_flipped if one of them is set, else tf where it is published"
)
_ODOM_SOURCE = (
    "where the robot's pose is from; auto: odom where something publishes it, else base_frame in "
    "odom_frame by tf"
)
_HARDWARE = "hardware_id of /diagnostics, to tell robots apart"


class ExtrinsicsSource(Enum):
    """Where the pose of the lidar on the robot is from."""

    AUTO = "auto"
    PARAMETERS = "parameters"
    TF = "tf"


class OdomSource(Enum):
    """Where the robot's pose is from."""

    AUTO = "auto"
    TOPIC = "topic"
    TF = "tf"


class Source(Enum):
    """Which topic the virtual sensor measures from."""

    OBSTACLES = "obstacles"
    SCAN = "scan"


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSimSettings:
    """Settings of world_sim."""

    scenario: str = option("case1", "scenario: a shipped name, a .yaml file, or JSON text")
    lockstep: bool = option(False, "wait for each tick's cmd_vel; false: tick on a wall timer")
    speed_factor: float = option(
        1.0, "simulated seconds per wall second, not in lockstep", minimum=0.01, maximum=1000.0
    )
    tick_ns: int = option(
        PlannerParams().tick_ns, "duration of a tick", unit="ns", minimum=1000, maximum=10**12
    )
    goal_tolerance_m: float = option(
        PlannerParams().goal_tolerance_m,
        "distance at which the run is over",
        unit="m",
        minimum=1e-6,
        maximum=10.0,
    )
    run_on: bool = option(False, "keep ticking at the goal and past the time limit")
    start_paused: bool = option(False, "wait for ~/pause (false) or ~/step before tick 0")
    answer_timeout_s: float = option(
        2.0, "lockstep: publish a tick again after this", unit="s", minimum=0.05, maximum=3600.0
    )
    answer_retries: int = option(
        4, "lockstep: give up after this many repetitions", minimum=0, maximum=1_000_000
    )
    publish_map: bool = option(False, "publish map: the cells that the scenario's walls pass")
    cmd_vel_timeout_s: float = option(
        0.5,
        "real time: rest after this time without cmd_vel, but not within a tick; 0: never",
        unit="s",
        minimum=0.0,
        maximum=3600.0,
    )
    enable_stamped_cmd_vel: bool = option(False, "cmd_vel is a TwistStamped, as in Nav2")
    seed: int = option(0, "seed of the sensor noise", minimum=0, maximum=2**63 - 1)
    odom_frame: str = option("odom", "frame of all poses (REP-105)")
    base_frame: str = option("base_link", "frame of the robot (REP-105)")
    scan_frame: str = option("base_scan", "frame of the simulated lidar")
    view_period_s: float = option(
        0.2, "period of markers and trail, simulated time", unit="s", minimum=0.0, maximum=3600.0
    )
    diagnostics_period_s: float = option(1.0, _DIAGNOSTICS, unit="s", minimum=0.01, maximum=3600.0)
    hardware_id: str = option("none", _HARDWARE)
    wait_for: str = option("", _WORLD_WAITS_FOR)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotParameters:
    """The robot of world_sim's scenario, option by option: its parameters robot.*."""

    robot: Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class VirtualSensorSettings:
    """Settings of virtual_sensor."""

    source: Source = option(Source.OBSTACLES, "obstacles (the paper) or scan (any LaserScan)")
    robot_radius_m: float = option(
        ROBOT_RADIUS_M,
        "radius of the robot: every obstacle is enlarged by it (Fig. 4)",
        unit="m",
        minimum=0.0,
        maximum=100.0,
    )
    segments_m: str = option(
        "",
        "walls beside obstacles, [[x0, y0, x1, y1], ...] in odom_frame; a scan has its own",
    )
    scan_x: float = option(0.0, _SCAN_X, unit="m", minimum=-10.0, maximum=10.0)
    scan_y: float = option(0.0, _SCAN_Y, unit="m", minimum=-10.0, maximum=10.0)
    scan_yaw: float = option(0.0, _SCAN_YAW, unit="rad", minimum=-6.4, maximum=6.4)
    scan_flipped: bool = option(False, _SCAN_FLIPPED)
    scan_extrinsics: ExtrinsicsSource = option(ExtrinsicsSource.AUTO, _SCAN_EXTRINSICS)
    scan_frame: str = option("", _SCAN_FRAME)
    scan_no_return: NoReturn = option(NoReturn.INF, _NO_RETURN)
    lockstep: bool = option(False, "pair odom with scan by stamp; false: newest odom")
    odom_frame: str = option("odom", "frame the sectors are aligned with")
    base_frame: str = option("base_link", _BASE_FRAME)
    odom_source: OdomSource = option(OdomSource.AUTO, _ODOM_SOURCE)
    input_timeout_s: float = option(
        1.0,
        "age at which odometry, sectors or scan are stale, since their arrival or by their stamps",
        unit="s",
        minimum=0.001,
        maximum=3600.0,
    )
    diagnostics_period_s: float = option(1.0, _DIAGNOSTICS, unit="s", minimum=0.01, maximum=3600.0)
    hardware_id: str = option("none", _HARDWARE)
    wait_for: str = option("", _WAIT_FOR)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSettings:
    """Settings of planner; PlannerParams are its parameters too."""

    seed: int = option(0, "seed of all random draws", minimum=0, maximum=2**63 - 1)
    lockstep: bool = option(False, "pair inputs by stamp; false: newest odom, stop on stale")
    enable_stamped_cmd_vel: bool = option(False, "cmd_vel is a TwistStamped, as in Nav2")
    odom_frame: str = option("odom", "frame of all poses (REP-105)")
    base_frame: str = option("base_link", "frame of the robot (REP-105)")
    odom_source: OdomSource = option(OdomSource.AUTO, _ODOM_SOURCE)
    view_period_s: float = option(
        0.2, "period of the markers", unit="s", minimum=0.0, maximum=3600.0
    )
    map_period_s: float = option(
        1.0, "least time between two local_map; 0: none", unit="s", minimum=0.0, maximum=3600.0
    )
    scan_x: float = option(0.0, _SCAN_X, unit="m", minimum=-10.0, maximum=10.0)
    scan_y: float = option(0.0, _SCAN_Y, unit="m", minimum=-10.0, maximum=10.0)
    scan_yaw: float = option(0.0, _SCAN_YAW, unit="rad", minimum=-6.4, maximum=6.4)
    scan_flipped: bool = option(False, _SCAN_FLIPPED)
    scan_extrinsics: ExtrinsicsSource = option(ExtrinsicsSource.AUTO, _SCAN_EXTRINSICS)
    scan_frame: str = option("", _SCAN_FRAME)
    scan_no_return: NoReturn = option(NoReturn.INF, _NO_RETURN)
    diagnostics_period_s: float = option(1.0, _DIAGNOSTICS, unit="s", minimum=0.01, maximum=3600.0)
    hardware_id: str = option("none", _HARDWARE)
    autostart: bool = option(
        True, "configure and activate at once; false: wait for ~/change_state"
    )
    wait_for: str = option("", _WAIT_FOR)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecorderSettings:
    """Settings of recorder."""

    output: str = option("", "bag directory to create; empty: a new one below ./runs")
    nodes: str = option("", "nodes whose parameters go into the bag, separated by commas")
    namespaces: str = option("", "fleets: the robots' namespaces, separated by commas")
    sim_time: bool = option(False, "log times are /clock's (as rosbag2 --use-sim-time)")
    run: str = option("{}", "JSON object with more facts of the run (driver, versions)")
    enable_stamped_cmd_vel: bool = option(False, "cmd_vel is a TwistStamped, as in Nav2")
    wait_for: str = option("", _WAIT_FOR)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
        self.facts()

    def facts(self) -> dict[str, Any]:
        """The object in `run`."""
        try:
            facts = json.loads(self.run)
        except ValueError:
            facts = None
        if not isinstance(facts, dict):
            raise ConfigError(
                f"parameter run={self.run!r}: not JSON of an object; give '{{}}' or more"
            )
        return facts


def names(text: str) -> set[str]:
    """Split a comma-separated setting."""
    return {name.strip() for name in text.split(",") if name.strip()}
