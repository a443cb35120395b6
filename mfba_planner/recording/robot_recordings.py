# SPDX-License-Identifier: Apache-2.0
"""Setups of robots whose world was not simulated: the scenario is the trip that was recorded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from ..core.errors import BagError, InputError
from ..core.geometry import Point, Pose2D
from ..core.lidar_extrinsics import LidarExtrinsics
from ..core.option_specs import flatten, override
from ..core.robot_base import Base
from ..perception.no_return import NoReturn
from ..perception.sensory_vector import SensorParams
from ..planning.planner_params import PlannerParams
from ..simulation.robot_model import DEFAULT_BEAMS, Lidar, Robot
from ..simulation.scenario import Scenario
from .bag_reader import BagReader
from .decisions_with_sectors import DECISION, require_decisions
from .fleet_topics import NO_NAMESPACE, messages_by_robot
from .from_messages import decision, extrinsics_in
from .run_setup import Setup

T = TypeVar("T")

_PLANNER, _SENSOR = "planner", "virtual_sensor"
_OUT_OF_REACH_M = 1e-3  # of a trip without a goal, or one that ends where it starts


class Trip(NamedTuple):
    """What a scenario needs of a recorded drive; stamps in ns."""

    start: Pose2D
    goal: Point
    first_ns: int
    last_ns: int
    extrinsics: LidarExtrinsics | None = None  # of the lidar, where the decisions say it


def robot_setups(
    reader: BagReader, nodes: Mapping[str, Mapping[str, Any]], run: Mapping[str, Any]
) -> dict[str, Setup]:
    """A Setup by robot, from the parameters of its planner and its sensor.

    Raises BagError without parameters of a planner, and for a bag without its decisions.
    """
    names = [name.strip("/").rpartition("/") for name in nodes]
    robots = [namespace for namespace, _, node in names if node == _PLANNER]
    if not robots:
        raise BagError(
            f"{reader.path}: its configuration holds no parameters of a {_PLANNER}; give them "
            "with `mfba verify --params-file FILE`, or decide anew with `mfba decide`"
        )
    by_name = {name.strip("/"): values for name, values in nodes.items()}
    require_decisions(reader, robots)
    driver, name = str(run.get("driver", "robot")), str(run.get("name") or name_of(reader.path))
    return {
        robot: _setup(reader, robot, by_name, driver, name if robot == NO_NAMESPACE else robot)
        for robot in robots
    }


def name_of(path: Path) -> str:
    """The name of a recording: its file or directory, of a bag in a run directory that one."""
    return path.absolute().parent.name if path.name == "bag" else path.stem


def _setup(
    reader: BagReader,
    robot: str,
    nodes: Mapping[str, Mapping[str, Any]],
    driver: str,
    name: str,
) -> Setup:
    prefix = f"{robot}/" if robot != NO_NAMESPACE else ""
    given, sensing = dict(nodes[prefix + _PLANNER]), dict(nodes.get(prefix + _SENSOR, {}))
    planner = _options(PlannerParams(), given)
    trip = read_trip(reader, robot)
    lockstep = bool(given.get("lockstep", False))
    has_lidar = sensing.get("source") == "scan" or planner.reads_scan
    return Setup(
        scenario=trip_scenario(
            name,
            trip,
            planner,
            lidar_of(
                trip.extrinsics or LidarExtrinsics.of_parameters(given),
                DEFAULT_BEAMS if has_lidar else 0,
            ),
        ),
        sensor=_options(SensorParams(), sensing),
        planner=planner,
        seed=int(given.get("seed", 0)),
        driver=driver,
        lockstep=lockstep,
        odom_frame=str(given.get("odom_frame", "")),
        scan_frame=str(sensing.get("scan_frame", "")),
        scan_no_return=NoReturn(sensing.get("scan_no_return", NoReturn.INF.value)),
        is_simulated=False,
        start_ns=None if lockstep else trip.first_ns,
    )


def lidar_of(extrinsics: LidarExtrinsics, beams: int = DEFAULT_BEAMS) -> Lidar:
    """A lidar with these extrinsics, else as any."""
    return Lidar(
        beams=beams,
        x_m=extrinsics.x_m,
        y_m=extrinsics.y_m,
        yaw_rad=extrinsics.yaw_rad,
        flipped=extrinsics.flipped,
    )


def _options(defaults: T, values: Mapping[str, Any]) -> T:
    """The options of one dataclass, from parameters of a node; the others are its defaults."""
    return override(defaults, {name: values[name] for name in flatten(defaults) if name in values})


def trip_scenario(name: str, trip: Trip, planner: PlannerParams, lidar: Lidar) -> Scenario:
    """The trip as a scenario without obstacles, which are not known."""
    base = {item.name: getattr(planner, item.name) for item in fields(Base)}
    return Scenario(
        name=name,
        start_m=trip.start.position,
        goal_m=trip.goal,
        robot_radius_m=planner.robot_radius_m,
        time_limit_s=max(1.0, math.ceil((trip.last_ns - trip.first_ns) * 1e-9)),
        description="a recorded drive",
        robot=replace(Robot(**base), lidar=lidar),
    )


def read_trip(reader: BagReader, robot: str) -> Trip:
    """The trip of a robot: its first pose, and its last goal. Raises BagError."""
    start: Pose2D | None = None
    goal: Point | None = None
    extrinsics: LidarExtrinsics | None = None
    first_ns = last_ns = 0
    for _, message in messages_by_robot(reader, [robot], [DECISION]):
        try:
            found = decision(message.message, ())
            extrinsics = extrinsics or extrinsics_in(message.message)
        except InputError as error:
            raise BagError(f"{reader.path}: {error}") from None
        if start is None and all(map(math.isfinite, found.pose)):
            start = found.pose
        goal = found.goal or goal
        first_ns, last_ns = first_ns or found.stamp_ns, found.stamp_ns
    start = start or Pose2D(0.0, 0.0)
    return Trip(start, apart(start, goal), first_ns, last_ns, extrinsics)


def apart(start: Pose2D, goal: Point | None) -> Point:
    """The goal; without one, or at one, a point beside the start, which a scenario needs."""
    beside = (start.x + _OUT_OF_REACH_M, start.y)
    return beside if goal is None or goal == start.position else goal
