# SPDX-License-Identifier: Apache-2.0
"""What the planner would decide on a recording of /scan and /odom that is not ours."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..core.errors import BagError, FrameError, InputError
from ..core.geometry import Point, Pose2D
from ..core.types import Decision, Ranges, Refused, observe
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sensory_vector import SensorParams
from ..planning.planner_factory import make_planner
from ..planning.planner_params import PlannerParams
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.decisions import DECISION, SECTORS, robots_with_decisions
from ..recording.file_integrity import check_data
from ..recording.from_messages import goal_point, laser_scan, or_refused, robot_pose, stamp_ns
from ..recording.robot_topics import NO_NAMESPACE
from ..simulation.decision_digest import digest
from .lidar_extrinsics import StaticFrames

ODOMETRY, SCAN, GOAL = (
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/LaserScan",
    "geometry_msgs/msg/PoseStamped",
)
GOAL_TOPIC = "goal_pose"


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """What a recording does not say; goal and scan_yaw_rad None: as recorded."""

    robot_radius_m: float
    scan_yaw_rad: float | None = None
    goal: Point | None = None
    scan: str = ""
    odom: str = ""
    planner: PlannerParams = field(default_factory=PlannerParams)
    sensor: SensorParams = field(default_factory=SensorParams)
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Redecided:
    """The decisions on every scan; faults speak against the recording, notes do not."""

    decided: tuple[Decision, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Decision digest."""
        return digest(self.decided)


def is_foreign(reader: BagReader) -> bool:
    """Whether a bag has scans and odometry, but neither decisions nor sectors of ours."""
    types = {topic.type_name for topic in reader.topics.values()}
    ours = (
        SECTORS in reader.topics
        or DECISION in reader.topics
        or robots_with_decisions(reader) != [NO_NAMESPACE]
    )
    return not ours and {ODOMETRY, SCAN} <= types


def redecide_recording(path: str | Path, robot: Robot) -> Redecided:
    """Decide on every scan with the odometry of its stamp, or the newest recorded before it.

    As virtual_sensor (source: scan) and planner do when the bag is replayed, with the lidar as
    /tf_static has it. Raises BagError for a bag that cannot be read, without goal, where topics
    must be named, and where nobody says how the lidar is mounted.
    """
    with BagReader(path) as reader:
        for file in reader.file_paths:
            check_data(file)
        scan = _topic(reader, SCAN, robot.scan, "--scan")
        odom = _topic(reader, ODOMETRY, robot.odom, "--odom")
        faults: list[str] = []
        poses = _Poses(reader, odom, faults)
        goals = _goals(reader, robot)
        mounted = _Mounted(reader, robot, odom)
        return _Decider(robot, poses, goals, faults, mounted).on(reader, scan)


def _topic(reader: BagReader, kind: str, wanted: str, option: str) -> str:
    found = sorted(name for name, topic in reader.topics.items() if topic.type_name == kind)
    if wanted in found:
        return wanted
    if wanted or len(found) > 1:
        what = f"{option} {wanted}: not one of" if wanted else f"{len(found)} topics of {kind},"
        raise BagError(f"{reader.path}: {what} {', '.join(found)}; name one with {option}")
    return found[0]


def _goals(reader: BagReader, robot: Robot) -> list[tuple[int, Point]]:
    """Goals and when they were recorded, rising."""
    if robot.goal is not None:
        return [(-1, robot.goal)]
    names = [
        name
        for name, topic in reader.topics.items()
        if topic.type_name == GOAL and name.rpartition("/")[2] == GOAL_TOPIC
    ]
    goals = []
    for message in reader.decoded(names) if names else ():
        try:
            goals.append((message.log_time_ns, goal_point(message.message)))
        except InputError:  # the planner would refuse it as well
            continue
    if not goals:
        raise BagError(f"{reader.path}: no {GOAL_TOPIC} was recorded; give one with --goal X Y")
    return goals


def _rising(
    reader: BagReader, topic: str, faults: list[str]
) -> Iterator[tuple[int, DecodedMessage]]:
    """Messages with their stamps; one whose stamp does not rise is a fault and left out."""
    last_ns = -1
    for message in reader.decoded([topic]):
        stamp = stamp_ns(message.message.header.stamp)
        if stamp <= last_ns:
            faults.append(f"{topic}: stamp {stamp} ns comes after {last_ns} ns")
            continue
        last_ns = stamp
        yield stamp, message


class _Poses:
    """All poses of a recording: by stamp, and by when they were recorded."""

    def __init__(self, reader: BagReader, topic: str, faults: list[str]) -> None:
        self.by_stamp: dict[int, Pose2D | Refused] = {}
        self._times_ns: list[int] = []
        self._all: list[tuple[int, Pose2D | Refused]] = []
        for stamp, message in _rising(reader, topic, faults):
            pose = or_refused(robot_pose, message.message)
            self.by_stamp[stamp] = pose
            self._times_ns.append(message.log_time_ns)
            self._all.append((stamp, pose))

    def newest(self, log_time_ns: int) -> tuple[int, Pose2D | Refused] | None:
        """(stamp, pose) recorded last before a time."""
        place = bisect_right(self._times_ns, log_time_ns)
        return self._all[place - 1] if place else None


class _Mounted:
    """How the lidar of each scan is turned against the robot."""

    def __init__(self, reader: BagReader, robot: Robot, odom: str) -> None:
        self.notes: list[str] = []
        self._told = robot.scan_yaw_rad
        self._path, self._frames = reader.path, StaticFrames(reader)
        self._base = next((m.message.child_frame_id for m in reader.decoded([odom])), "")
        self._yaws: dict[str, float] = {}

    def yaw_rad(self, scan: Any) -> float:
        """Raises BagError where nothing says it."""
        if self._told is not None:
            return self._told
        frame = scan.header.frame_id
        if frame not in self._yaws:
            try:
                yaw, offset_m = self._frames.extrinsics(frame, self._base)
            except FrameError as error:
                raise BagError(f"{self._path}: {error}") from None
            self._yaws[frame] = yaw
            if yaw or offset_m:
                self.notes.append(
                    f"/tf_static: {frame} is turned by {yaw:.4g} rad in {self._base}, "
                    f"{offset_m:.4g} m off its middle: --robot-radius must allow for that"
                )
        return self._yaws[frame]


class _Decider:
    """Takes the scans one by one."""

    def __init__(
        self,
        robot: Robot,
        poses: _Poses,
        goals: list[tuple[int, Point]],
        faults: list[str],
        mounted: _Mounted,
    ) -> None:
        self._robot = robot
        self._mounted = mounted
        self._poses = poses
        self._goals = goals
        self._faults = faults
        self._path_planner = make_planner(robot.planner, robot.sensor, robot.seed)
        self._pose = Pose2D(0.0, 0.0)
        self._counts: Counter[str] = Counter()

    def on(self, reader: BagReader, topic: str) -> Redecided:
        decided = []
        for stamp, message in _rising(reader, topic, self._faults):
            decision = self._decide(stamp, message.log_time_ns, message.message)
            if decision is not None:
                decided.append(decision)
        return Redecided(
            decided=tuple(decided),
            faults=tuple(self._faults),
            notes=(
                *self._mounted.notes,
                *(f"{count} scans {what}" for what, count in self._counts.items()),
            ),
        )

    def _decide(self, stamp: int, log_time_ns: int, scan: Any) -> Decision | None:
        if stamp in self._poses.by_stamp:
            posed_ns, pose = stamp, self._poses.by_stamp[stamp]
        elif newest := self._poses.newest(log_time_ns):
            posed_ns, pose = newest
            self._counts["without odometry of their stamp: the newest before them was taken"] += 1
        else:
            self._counts["before the first odometry: not decided"] += 1
            return None
        ranges = self._measure(pose, scan)
        if isinstance(ranges, str):
            self._counts["that the sensor refuses"] += 1
        goal = next((g for t, g in reversed(self._goals) if t <= log_time_ns), None)
        seen = observe(stamp, pose, ranges, goal, self._pose, max(stamp - posed_ns, 0))
        self._pose = seen.pose
        if self._robot.planner.tracks_scan and not seen.refused:
            yaw = seen.pose.yaw + self._mounted.yaw_rad(scan)
            seen = replace(seen, scan=aligned(laser_scan(scan), yaw))
        return self._path_planner.plan(seen)

    def _measure(self, pose: Pose2D | Refused, scan: Any) -> Ranges | Refused:
        if isinstance(pose, str):
            return pose
        robot = self._robot
        yaw = pose.yaw + self._mounted.yaw_rad(scan)
        return or_refused(
            lambda x: sense_scan(laser_scan(x), yaw, robot.robot_radius_m, robot.sensor), scan
        )
