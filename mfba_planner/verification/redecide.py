# SPDX-License-Identifier: Apache-2.0
"""Run the planner on any recording of a scan and odometry, scan by scan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from ..core.errors import BagError, InputError
from ..core.geometry import Point, Pose2D
from ..core.lidar_extrinsics import LidarExtrinsics
from ..core.planner_types import NANO, Decision, Mode, Ranges, RefusalReason, Scan, observe
from ..perception.known_map import KnownMap
from ..perception.no_return import NoReturn
from ..perception.obstacle_tracker import Track
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sensory_vector import SensorParams
from ..perception.static_map import StaticMap
from ..planning.planner_factory import make_planner
from ..planning.planner_params import PlannerParams
from ..recording.bag_reader import BagReader, DecodedMessage
from ..recording.configuration_attachment import has_configuration
from ..recording.decisions_with_sectors import DECISION, SECTORS, robots_with_decisions
from ..recording.fleet_topics import NO_NAMESPACE
from ..recording.from_messages import (
    known_map_from,
    laser_scan,
    robot_pose,
    stamp_ns,
    value_or_refusal,
)
from ..recording.odometry_from_tf import BASE_FRAME, ODOM_FRAME
from ..recording.scan_parts import LidarMerging, MountedScan
from ..recording.transform_tree import frame_name
from ..simulation.decision_digest import digest
from .recorded_poses import RecordedPoses
from .recorded_topics import named_or_only, of_robot, recorded, require_same_robot
from .recorded_transforms import TF, TF_STATIC, TRANSFORMS, RecordedExtrinsics, RecordedTransforms

ODOMETRY, SCAN, GOAL, GRID = (
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/LaserScan",
    "geometry_msgs/msg/PoseStamped",
    "nav_msgs/msg/OccupancyGrid",
)
GOAL_TOPIC, MAP_TOPIC = "goal_pose", "map"
CLOCKS_APART_S = 0.5  # more than a lidar or its driver takes
FEWEST_SAMPLES, CLOCK_SAMPLES = 10, 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class RedecideParams:
    """Parameters that a recording lacks; goal and extrinsics None: as recorded."""

    robot_radius_m: float
    scan_no_return: NoReturn = NoReturn.INF
    extrinsics: LidarExtrinsics | None = None
    goal: Point | None = None
    scan: str = ""
    odom: str = ""
    goal_topic: str = ""
    base_frame: str = ""  # of the robot, where the odometry names none
    odom_frame: str = ""  # required frame of the odometry; "": that of the first message
    scan_frame: str = ""  # required frame of the scans; "": any
    planner: PlannerParams = field(default_factory=PlannerParams)
    sensor: SensorParams = field(default_factory=SensorParams)
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class RedecideResult:
    """The decisions on every scan; faults are errors of the recording, notes are not."""

    decided: tuple[Decision, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    nothing: str = ""  # why no scan led to a decision about the way, "" if one did

    @property
    def digest(self) -> str:
        """Digest of the decisions."""
        return digest(self.decided)


def is_foreign(reader: BagReader) -> bool:
    """Whether a bag has no configuration, no decisions and no sectors of ours.

    A topic without messages counts as not recorded.
    """
    written = {name: topic for name, topic in reader.topics.items() if topic.message_count}
    ours = (
        SECTORS in written
        or DECISION in written
        or robots_with_decisions(reader) != [NO_NAMESPACE]
    )
    return not ours and not has_configuration(reader)


def redecide_recording(path: str | Path, params: RedecideParams) -> RedecideResult:
    """Decide on every scan with the odometry of its stamp, or the newest recorded before it.

    Same as virtual_sensor (source: scan) and planner on a replay of the bag, with the extrinsics
    of the lidar by tf and the frame of the odometry as odom_frame. Raises BagError for a bag that
    cannot be read or has no goal, if topics must be named, for a lidar of unknown extrinsics, and
    where known_map finds no map.
    """
    with BagReader(path) as reader:
        reader.check_data()
        run = RecordingDecider(reader, params)
        decided = tuple(step.decision for step in run.decide())
        return RedecideResult(
            decided=decided, faults=run.faults, notes=run.notes, nothing=run.nothing
        )


class DecidedScan(NamedTuple):
    """A decision, and the scan it was made on in a frame aligned with odom; None if refused.

    fields are the keys of planner/decision that say what the scan was made of.
    """

    decision: Decision
    scan: Scan | None
    log_time_ns: int
    fields: Mapping[str, str]


class RecordingDecider:
    """Decides on the scans of an open bag one by one; holds no decision.

    Faults and notes are complete after the last decision.
    """

    def __init__(self, reader: BagReader, params: RedecideParams) -> None:
        """Choose the topics and read odometry and goals. Raises as redecide_recording()."""
        self._reader, self._params = reader, params
        wanted = [name.strip() for name in params.scan.split(",")]
        self.scans = tuple(named_or_only(reader, SCAN, name, "--scan") for name in wanted)
        self.odom = self._odometry_topic()
        self._faults: list[str] = []
        self._counts: Counter[str] = Counter()
        self._decided: Counter[bool] = Counter()  # by whether the robot is stopped
        self._reasons: Counter[str] = Counter()  # why it is
        self._ahead_s: list[float] = []  # scan stamps against odometry at the same log time
        transforms = RecordedTransforms(
            reader, self._topics(TRANSFORMS, TF_STATIC), self._topics(TRANSFORMS, TF)
        )
        self.odometry = self.odom or ", ".join(transforms.moving)  # the topics
        self.frame, self.base = self._frames()
        messages = (
            self._rising(self.odom) if self.odom else transforms.odometry(self.frame, self.base)
        )
        self._poses = RecordedPoses(
            messages, partial(value_or_refusal, partial(robot_pose, frame=self.frame))
        )
        if not self._poses:
            raise BagError(
                f"{reader.path}: no message of type {ODOMETRY}, and {self.odometry or '/tf'} does "
                f"not give {self.base!r} in {self.frame!r}; give odom_frame and base_frame with "
                "--params-file, or a recording with odometry"
            )
        self.goals, refused = self._goals(transforms)
        self._notes = [refused] if refused else []
        self._extrinsics = RecordedExtrinsics(reader, transforms, self.base, params.extrinsics)
        self._lidars = LidarMerging(
            self._extrinsics.of, self._extrinsics.name, self._laser_scan,
            lambda: params.robot_radius_m, params.scan_frame,
        )  # fmt: skip
        self._followed_ns = -1  # log time of the newest pose that the lidars have
        planner = replace(params.planner, robot_radius_m=params.robot_radius_m)
        self._planner = make_planner(planner, params.sensor, params.seed)
        self.planner = self._planner.params
        self.goal_id = 0
        self._goal: Point | None = None
        self._pose = Pose2D(0.0, 0.0)
        if params.planner.reads_known_map:
            self._planner.set_known_map(self._known_map())

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The obstacles that the planner tracks since its last decision, () if it does not."""
        return self._planner.tracks

    @property
    def local_map(self) -> StaticMap | None:
        """The planner's map, None if it keeps none."""
        return self._planner.local_map

    @property
    def extrinsics(self) -> LidarExtrinsics:
        """Where the lidar of the last scan is on the robot."""
        return self._extrinsics.last

    @property
    def faults(self) -> tuple[str, ...]:
        """Errors of the recording."""
        return tuple(self._faults)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out or taken otherwise."""
        counts = (f"{count} {what}" for what, count in self._counts.items())
        return (*self._notes, *self._extrinsics.notes, *self._clock_notes(), *counts)

    @property
    def nothing(self) -> str:
        """Why no scan led to a decision about the way, "" if one did."""
        if self._decided[False]:
            return ""
        if not self._decided:
            return f"nothing was decided: {'; '.join(self.notes) or 'no scan'}"
        reason, count = self._reasons.most_common(1)[0]
        return f"no scan could be used, {count} of {self._decided.total()} because: {reason}"

    def decide(self) -> Iterator[DecidedScan]:
        """Yield the decision on each scan. Raises BagError."""
        for stamp, message in self._rising(*self.scans):
            step = self._decide(stamp, message.log_time_ns, message.message)
            if step is None:
                continue
            is_stopped = step.decision.mode is Mode.STOPPED
            self._decided[is_stopped] += 1
            if is_stopped:
                self._reasons[step.decision.reason] += 1
            yield step

    def _odometry_topic(self) -> str:
        """The topic of the odometry; "" where the robot sends it on /tf only."""
        reader, wanted, scan = self._reader, self._params.odom, self.scans[0]
        if not wanted and not recorded(reader, ODOMETRY) and recorded(reader, TRANSFORMS):
            return ""
        found = named_or_only(reader, ODOMETRY, wanted, "--odom", near=scan)
        if not wanted:
            require_same_robot(reader, SCAN, scan, found)
        return found

    def _frames(self) -> tuple[str, str]:
        """The frames of the odometry and of the robot, "" where the odometry names none."""
        params = self._params
        if not self.odom:
            return params.odom_frame or ODOM_FRAME, params.base_frame or BASE_FRAME
        first = next(m.message for m in self._reader.decoded([self.odom]))
        return (
            params.odom_frame or frame_name(first.header.frame_id),
            frame_name(first.child_frame_id) or params.base_frame,
        )

    def _topics(self, type_name: str, name: str) -> list[str]:
        """The topics of this name that belong to the robot."""
        robot = [*self.scans, *filter(None, [self.odom])]
        return of_robot(recorded(self._reader, type_name), name, robot)

    def _rising(self, *topics: str) -> Iterator[tuple[int, DecodedMessage]]:
        """Yield (stamp, message) of rising stamps; of scans those of each frame rise.

        A message that does not rise is skipped: it is a fault, but for odometry sent twice.
        """
        last: dict[str, int] = {}
        for message in self._reader.decoded(topics):
            stamp = stamp_ns(message.message.header.stamp)
            lidar = "" if topics == (self.odom,) else message.message.header.frame_id
            last_ns = last.get(lidar, -1)
            if stamp > last_ns:
                last[lidar] = stamp
                yield stamp, message
            elif stamp == last_ns and message.topic == self.odom:
                self._counts[f"messages of {message.topic} that repeat a stamp: left out"] += 1
            else:
                self._faults.append(f"{message.topic}: stamp {stamp} ns comes after {last_ns} ns")

    def _known_map(self) -> KnownMap:
        """The first map that the planner would take, in the frame of the odometry."""
        names, refusal = self._topics(GRID, MAP_TOPIC), f"no {MAP_TOPIC} was recorded"
        for message in self._reader.decoded(names) if names else ():
            try:
                return known_map_from(message.message, self.frame)
            except InputError as error:  # the planner would refuse it as well
                refusal = str(error)
        raise BagError(f"{self._reader.path}: known_map=true: {refusal}")

    def _goals(self, transforms: RecordedTransforms) -> tuple[list[tuple[int, Point]], str]:
        """(log time in ns, goal), sorted by time, and a note about those that are refused."""
        if self._params.goal is not None:
            return [(-1, self._params.goal)], ""
        wanted = self._params.goal_topic
        all_names = recorded(self._reader, GOAL)
        if wanted:
            names = [named_or_only(self._reader, GOAL, wanted, "--goal-topic")]
        else:
            names = self._topics(GOAL, GOAL_TOPIC)
        goals, refused, refusal = transforms.goals(names, self.frame)
        if goals:
            return goals, f"{refused} goals are refused: {refusal}" if refused else ""
        others = [name for name in all_names if name not in names]
        remedy = "give one with --goal X Y" + (f", in metres in {self.frame!r}" if refusal else "")
        if others:
            remedy += f", or one of {', '.join(others)} with --goal-topic"
        problem = (
            f"no {GOAL_TOPIC} can be used: {refusal}"
            if refusal
            else (f"no {GOAL_TOPIC} was recorded" + (" for this robot" if others else ""))
        )
        raise BagError(f"{self._reader.path}: {problem}; {remedy}")

    def _clock_notes(self) -> Iterator[str]:
        if len(self._ahead_s) < FEWEST_SAMPLES:
            return
        ahead_s = median(self._ahead_s)
        if abs(ahead_s) > CLOCKS_APART_S:
            yield (
                f"the stamps of {', '.join(self.scans)} are {abs(ahead_s):.3g} s "
                f"{'ahead of' if ahead_s > 0.0 else 'behind'} those of {self.odometry} received "
                "at the same time: their clocks differ (synchronise them, and record again)"
            )

    def _decide(self, stamp: int, log_time_ns: int, scan: Any) -> DecidedScan | None:
        newest = self._poses.newest(log_time_ns)
        if newest and len(self._ahead_s) < CLOCK_SAMPLES:
            self._ahead_s.append((stamp - newest.stamp_ns) * NANO)
        if (found := self._poses.at(stamp) or newest) is None:
            self._counts["scans before the first odometry: not decided"] += 1
            return None
        try:
            if not isinstance(found.pose, str):
                if not self._is_due(stamp, log_time_ns, scan):
                    return None  # another lidar's scan is about to come
                stamp = self._lidars.sets.newest_ns
                found = self._poses.at(stamp) or newest or found
            mounted, ranges = self._measure(found.pose)
        except InputError as error:
            mounted, ranges = None, str(error)
        pose_stamp, pose = found
        if pose_stamp != stamp:
            self._counts[
                "scans without odometry of their stamp: the newest before them was taken"
            ] += 1
        if isinstance(ranges, str):
            self._counts["scans that the sensor refuses"] += 1
        goal = next((g for t, g in reversed(self.goals) if t <= log_time_ns), None)
        if goal != self._goal:
            self._goal, self.goal_id = goal, self.goal_id + 1
            self._planner.reset()  # as the node does
        observation = observe(stamp, pose, ranges, goal, self._pose, max(stamp - pose_stamp, 0))
        self._pose = observation.pose
        sensed, fields = None, {}
        if mounted is not None and not observation.refused:
            sensed = aligned(mounted.scan, observation.pose.yaw, mounted.extrinsics)
            fields = mounted.fields
            if self._params.planner.reads_scan:
                observation = replace(observation, scan=sensed)
        decision = self._planner.plan(observation)
        return DecidedScan(decision, sensed, log_time_ns, fields)

    def _is_due(self, stamp: int, log_time_ns: int, scan: Any) -> bool:
        """Take a scan; whether to decide now, or with the next one of another lidar."""
        lidars = self._lidars
        for found in self._poses.between(self._followed_ns, log_time_ns):
            if not isinstance(found.pose, str):
                lidars.poses.add(found.stamp_ns, found.pose)
        self._followed_ns = log_time_ns
        own = self._poses.at(stamp)
        if own and not isinstance(own.pose, str) and stamp > lidars.poses.newest_ns:
            lidars.poses.add(stamp, own.pose)  # in lockstep it is waited for
        return lidars.add(scan, self._params.planner.input_timeout_s)

    def _laser_scan(self, scan: Any) -> Scan:
        return laser_scan(scan, self._params.scan_frame, self._params.scan_no_return)

    def _measure(
        self, pose: Pose2D | RefusalReason
    ) -> tuple[MountedScan | None, Ranges | RefusalReason]:
        """The newest scan, and the ranges by it from a pose. Raises InputError."""
        if isinstance(pose, str):
            return None, pose
        params = self._params
        mounted = self._lidars.newest(params.planner.input_timeout_s)
        ranges = sense_scan(
            mounted.scan, pose.yaw, params.robot_radius_m, params.sensor, mounted.extrinsics
        )
        return mounted, ranges
