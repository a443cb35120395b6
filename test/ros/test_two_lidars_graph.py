# SPDX-License-Identifier: Apache-2.0
"""One wall by two lidars: the decisions by one that sees all of it, live and from a bag."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from bag_to_graph import (
    PAPER,
    PLANNERS,
    PREDICTIVE,
    TICKS,
    check_alike,
    from_bag,
    live,
    play,
)  # fmt: skip
from foreign_bags import START_NS, TICK_NS, Recorded, goal, odom, scan, transform, write
from geometry_msgs.msg import TransformStamped
from mounted_lidars import FRONT, MOUNTED, REAR, front_scan, rear_scan, wall_ranges
from planner_talk import mode
from real_time_robot import (
    BEAMS,
    DRIVES,
    FREE,
    STOPS,
    TRACKING,
    RealTimeRobot,
    scan_of,
    stamp,
)  # fmt: skip
from ros_graph import Graph
from std_msgs.msg import Header

from mfba_planner.core.errors import BagError
from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.core.planner_types import Decision
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision_field
from mfba_planner.recording.scan_parts import FIELD, parts_in
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.verification.verify_bag import verify

EACH_PLANNER = pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
EACH_SEQUENCE = pytest.mark.parametrize(
    "frames", [("front", "rear"), ("rear", "front"), ("front", "rear", "in turn")], ids="-".join
)
AFTER_FIRST_NS = TICK_NS + TICK_NS // 2  # a new goal: the planner begins anew
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"


def mount(frame: str, mounted: LidarExtrinsics, begin_ns: int) -> Recorded:
    roll = math.pi if mounted.flipped else 0.0
    return transform(begin_ns, child=frame, x=mounted.x_m, yaw=mounted.yaw_rad, roll=roll)


def recording(
    frames: Sequence[str] = ("front", "rear"),
    begin_ns: int = START_NS,
    topics_by_frame: dict[str, str] | None = None,
    rear_ms: int = 0,
    goal_ns: int = 2,
) -> list[Recorded]:
    """Two lidars that measure at the same time; who sends first may change from tick to tick."""
    names = topics_by_frame or {"front": "/scan", "rear": "/scan"}
    ranges = {"front": front_scan().ranges_m, "rear": rear_scan().ranges_m}
    found = [mount("front", FRONT, begin_ns), mount("rear", REAR, begin_ns + 1)]
    found.append(goal(begin_ns + goal_ns, 1.0, 5.0))
    for k in range(1, TICKS + 1):
        stamp_ns = begin_ns + k * TICK_NS
        found.append(odom(stamp_ns, yaw=0.4))
        sequence = frames[:2][:: 1 - 2 * (len(frames) > 2 and k % 2)]
        for place, frame in enumerate(sequence, start=1):
            later_ns = rear_ms * 1_000_000 * (frame == "rear")
            found.append(
                scan(
                    stamp_ns + later_ns, ranges[frame].tolist(), frame=frame, range_min=0.1,
                    topic=names[frame], time_ns=stamp_ns + later_ns + place,
                )
            )  # fmt: skip
    return found


def by_one_lidar(path: Path, planner: PlannerParams) -> tuple[Decision, ...]:
    straight = wall_ranges(MOUNTED["straight"]).tolist()
    found = [transform(START_NS), goal(START_NS + AFTER_FIRST_NS, 1.0, 5.0)]
    for k in range(1, TICKS + 1):
        stamp_ns = START_NS + k * TICK_NS
        found += [odom(stamp_ns, yaw=0.4), scan(stamp_ns, straight, range_min=0.1)]
    return from_bag(write(path, found), planner)


@EACH_SEQUENCE
@EACH_PLANNER
def test_two_lidars_decide_as_one(
    graph: Graph, planner: PlannerParams, frames: tuple[str, ...], tmp_path: Path, with_tf: Any
) -> None:
    bag = write(tmp_path / "bag", recording(frames, goal_ns=AFTER_FIRST_NS))
    found = live(graph, bag, planner)
    first, *decided = from_bag(bag, planner)
    assert [one for _, one in found] == decided, "a node in lockstep waits for its goal"
    assert 3 < first.ranges_m.count(0.0) < 8, "nothing is known of the other lidar yet"
    expected = by_one_lidar(tmp_path / "one", planner)[1:]
    check_alike(decided, expected, planner, ticks=TICKS - 1)
    merged = [bool(decision_field(message, FIELD)) for message, _ in found]
    assert merged == [planner is PREDICTIVE] * (TICKS - 1)


@EACH_PLANNER
def test_a_lidar_that_measures_a_little_later_decides_with_the_first(
    planner: PlannerParams, tmp_path: Path
) -> None:
    bag = write(tmp_path / "bag", recording(rear_ms=20))
    found = from_bag(bag, planner)
    begun = [one for one in found if one.stamp_ns > START_NS + 2 * TICK_NS]
    stamps = [(one.stamp_ns - START_NS) // 1_000_000 for one in begun]
    assert stamps == [100 * k + 20 for k in range(2, TICKS + 1)]
    assert not any(0.0 in one.ranges_m for one in begun)


def test_lidars_on_two_topics_are_named_for_the_bag(tmp_path: Path) -> None:
    names = {"front": "/front/scan", "rear": "/rear/scan"}
    bag = write(tmp_path / "bag", recording(topics_by_frame=names))
    same = write(tmp_path / "same", recording())
    expected = from_bag(same, PREDICTIVE)
    assert from_bag(bag, PREDICTIVE, scan="/front/scan,/rear/scan") == expected
    assert from_bag(bag, PREDICTIVE, scan="/rear/scan, /front/scan") == expected
    assert from_bag(bag, PREDICTIVE, scan="/front/scan") != expected


def test_a_recording_of_the_nodes_verifies(graph: Graph, tmp_path: Path, with_tf: Any) -> None:
    """The scans of a decision, and where their lidars are, stand in it."""
    recorder = graph.start(
        Recorder, {"output": str(tmp_path / "run"), "nodes": "planner, virtual_sensor"}
    )
    begin_ns = time.time_ns() - (TICKS + 1) * TICK_NS
    bag = write(tmp_path / "bag", recording(begin_ns=begin_ns))
    play(graph, bag, PREDICTIVE, lockstep=False, input_timeout_s=60.0)
    graph.settle()
    graph.stop(recorder)
    report = verify(tmp_path / "run")
    assert report.is_identical, (report.faults, report.divergence)
    assert len([one for one in report.recorded if one.perception == "scan"]) == TICKS
    with BagReader(tmp_path / "run") as reader:
        named_parts = [
            parts_in(message.message) for message in reader.decoded(["/planner/decision"])
        ]
    assert [[part.frame for part in parts] for parts in named_parts if parts] == [
        ["front", "rear"]
    ] * (TICKS - 1)
    assert named_parts[-1][1].extrinsics == pytest.approx(REAR)


FRONT_HALF = (math.nan,) * 23 + FREE[23:68] + (math.nan,) * 22  # of beams from -pi on
REAR_HALF = FREE[:23] + (math.nan,) * 45 + FREE[68:]


class TwoLidarRobot(RealTimeRobot):
    """A robot in real time whose lidars see half of its surroundings each."""

    def __init__(self, graph: Graph, tf_type: Any, frames: Sequence[str], **more: Any) -> None:
        self.scan_rear = graph.writer(topics.SCAN)
        self._static = graph.writer(topics.TRANSFORMS[1])
        identity = TransformStamped(header=Header(frame_id="base_link"))
        identity.transform.rotation.w = 1.0
        for frame in frames:
            identity.child_frame_id = frame
            self._static.publish(tf_type(transforms=[identity]))
        super().__init__(graph, **more)
        graph.settle()

    def drive_by_both(self, offset_s: float = 0.0, rear: Any = REAR_HALF) -> str:
        """Odometry and both scans, one after the other; the mode of the last decision.

        A scan may wait for that of the other lidar, by the times that passed between them.
        """
        self.send_odom(stamp(offset_s))
        self.send_scan(scan_of(stamp(offset_s), FRONT_HALF))
        self.send_rear(offset_s, rear)
        return mode(self.decisions[-1]).value

    def send_rear(
        self, offset_s: float = 0.0, ranges: Any = REAR_HALF, frame: str = "rear"
    ) -> str:
        return self.send_scan(scan_of(stamp(offset_s), ranges, frame), self.scan_rear)

    @property
    def unknown(self) -> int:
        """How many sectors are not known to be free."""
        return sum(range_m == 0.0 for range_m in self.sectors[-1].ranges)


@pytest.mark.parametrize("planner", [{}, TRACKING], ids=["paper", "predictive"])
def test_two_lidars_with_a_publisher_each_drive_the_robot(
    graph: Graph, with_tf: Any, planner: dict[str, Any]
) -> None:
    robot = TwoLidarRobot(graph, with_tf, ("base_scan", "rear"), planner=planner)
    for _ in range(2):
        robot.drive_by_both()
    assert robot.unknown == 0
    count = len(robot.decisions)
    for _ in range(6):
        assert robot.drive_by_both() == DRIVES
        assert robot.unknown == 0
    assert len(robot.decisions) >= count + 3, "at least every other pair"
    for node in ("virtual_sensor", "planner"):
        assert robot.inputs(node).level == OK, robot.inputs(node).message
        assert robot.value(node, "odom: dropped") == "0"
    for _ in range(2):
        robot.drive_by_both(rear=(0.4,) * BEAMS)
    assert robot.drive_by_both(rear=(0.4,) * BEAMS) not in (DRIVES, STOPS), "the rear one counts"


@pytest.mark.parametrize("planner", [{}, TRACKING], ids=["paper", "predictive"])
def test_a_lidar_that_falls_silent_makes_its_part_unknown(
    graph: Graph, with_tf: Any, planner: dict[str, Any]
) -> None:
    robot = TwoLidarRobot(graph, with_tf, ("base_scan", "rear"), planner=planner)
    for _ in range(3):
        robot.drive_by_both()
    assert robot.unknown == 0
    for _ in range(3):
        robot.drive(scan_s=2.5, odom_s=2.5, ranges=FRONT_HALF)
    assert robot.unknown > 3
    named = ["virtual_sensor", *(["planner"] if planner else [])]
    for node in named:
        assert robot.inputs(node).level == WARN
        assert robot.inputs(node).message.endswith(
            "no scan in frame 'rear' for more than 2 s: what only that lidar covers is not known"
        )
    robot.drive_by_both(2.6)
    assert robot.drive_by_both(2.7) == DRIVES
    assert robot.unknown == 0
    for node in named:
        assert robot.inputs(node).level == OK


def test_a_recording_of_both_while_the_robot_moves_verifies(
    graph: Graph, tmp_path: Path, with_tf: Any
) -> None:
    """Odometry between the two scans: the older one is moved, and the decisions say how far."""
    recorder = graph.start(
        Recorder, {"output": str(tmp_path / "run"), "nodes": "planner, virtual_sensor"}
    )
    robot = TwoLidarRobot(graph, with_tf, ("base_scan", "rear"), planner=TRACKING)
    for k in range(8):
        robot.send_odom(stamp(), x=0.04 * k)
        robot.send_rear(ranges=REAR_HALF[:-9] + (0.9,) * 9)
        robot.send_odom(stamp(), x=0.04 * k + 0.02)
        robot.send_scan(scan_of(stamp(), FRONT_HALF))
    graph.settle()
    graph.stop(recorder)
    report = verify(tmp_path / "run")
    assert report.is_identical, (report.faults, report.divergence)
    assert len([one for one in report.recorded if one.perception == "scan"]) >= 8
    with BagReader(tmp_path / "run") as reader:
        found = [parts_in(message.message) for message in reader.decoded(["/planner/decision"])]
    moved = [part.robot.x for parts in found for part in parts]
    assert min(moved) < -0.01
    assert max(moved) == 0.0


def test_a_second_lidar_at_an_unknown_pose_stops_the_robot(graph: Graph, with_tf: Any) -> None:
    robot = TwoLidarRobot(graph, with_tf, ("base_scan",))
    assert robot.drive() == DRIVES
    assert robot.send_rear() == STOPS
    assert robot.inputs("virtual_sensor").level == ERROR
    assert robot.inputs("virtual_sensor").message.startswith(
        "refused: scan changes its frame from 'base_scan' to 'rear'; give each lidar a frame"
    )


def test_two_publishers_in_the_frame_of_one_lidar_stop_the_robot(
    graph: Graph, with_tf: Any
) -> None:
    robot = TwoLidarRobot(graph, with_tf, ("base_scan", "rear"))
    for _ in range(4):
        robot.drive_by_both()
    other = graph.writer(topics.SCAN)
    for _ in range(3):
        robot.drive_by_both()
        robot.send_scan(scan_of(stamp(), REAR_HALF, "rear"), other)
    assert robot.drive_by_both() == STOPS
    assert robot.inputs("virtual_sensor").message.startswith(
        "refused: scan has 3 publishers that send in turn (probe, probe, probe); give each lidar"
    )


def test_in_lockstep_two_lidars_without_tf_are_refused(graph: Graph, tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", recording()[2:])
    _, sectors = play(graph, bag, PAPER, scan_x=0.1)
    assert any(all(map(math.isnan, ring.ranges)) for ring in sectors)
    sensor = next(node for node in graph.nodes if isinstance(node, VirtualSensor))
    assert "scan changes its frame from 'front' to 'rear'" in sensor._refused_inputs.last
    with pytest.raises(BagError, match="scans in frames 'front' and 'rear', but one pose"):
        from_bag(bag, PAPER, extrinsics=LidarExtrinsics(x_m=0.1))
