# SPDX-License-Identifier: Apache-2.0
"""mfba verify of foreign recordings: the planner decides on their scans and odometry."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from edited_bags import record
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.serialization import serialize_message
from recorded_bags import FOREIGN, SECOND
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import LaserScan

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError, MfbaError
from mfba_planner.core.lidar_extrinsics import CENTRED, LidarExtrinsics
from mfba_planner.core.planner_types import Mode
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.ros.interface.serialized_message import type_name
from mfba_planner.verification.redecide import RedecideParams, redecide_recording

ROBOT = RedecideParams(robot_radius_m=0.3)
TICK_NS = SECOND // 10
Message = tuple[str, Any, int]  # topic, message, log time


def odom(stamp_ns: int, x: float = 0.0) -> Message:
    message = Odometry()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, SECOND)
    message.pose.pose.position.x = x
    return "/robot/odom", message, stamp_ns


def scan(stamp_ns: int, ahead_m: float = math.inf, beams: int = 36) -> Message:
    """A scan whose beam 0 points along +x; all other ranges are inf."""
    message = LaserScan(angle_increment=2.0 * math.pi / beams, range_max=10.0)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, SECOND)
    message.ranges = [ahead_m] + [math.inf] * (beams - 1)
    return "/front/scan", message, stamp_ns


def goal(stamp_ns: int, x: float, y: float, topic: str = "/goal_pose") -> Message:
    message = PoseStamped()
    message.pose.position.x, message.pose.position.y = x, y
    return topic, message, stamp_ns


def wall_map(stamp_ns: int, frame: str) -> Message:
    """A wall along y from -3 to 8 m at x = 5 m."""
    message = OccupancyGrid()
    message.header.frame_id = frame
    message.info.resolution, message.info.width, message.info.height = 0.05, 1, 220
    message.info.origin.position.x, message.info.origin.position.y = 5.0, -3.0
    message.data = [100] * 220
    return "/robot/map", message, stamp_ns


def bag(path: Path, *messages: Message) -> Path:
    kinds = {
        Odometry: "nav_msgs/msg/Odometry",
        LaserScan: "sensor_msgs/msg/LaserScan",
        OccupancyGrid: "nav_msgs/msg/OccupancyGrid",
    }
    with BagWriter(path) as writer:
        for topic, message, time_ns in messages:
            writer.add_topic(topic, kinds.get(type(message), "geometry_msgs/msg/PoseStamped"))
            writer.write(topic, serialize_message(message), time_ns, time_ns)
    return path


def test_each_scan_is_decided_on_the_odometry_of_its_stamp(tmp_path: Path) -> None:
    messages = [goal(0, 10.0, 0.0)]
    for k in range(1, 6):
        messages += [scan(k * TICK_NS, 0.9 if k == 3 else math.inf), odom(k * TICK_NS, 0.1 * k)]
    found = redecide_recording(bag(tmp_path / "bag", *messages), ROBOT)
    assert not found.faults
    assert not found.notes
    assert [tick.pose.x for tick in found.decided] == [0.1 * k for k in range(1, 6)]
    assert [tick.mode is Mode.OBSTACLE_AVOIDANCE for tick in found.decided] == [
        False, False, True, False, False,
    ]  # fmt: skip


def test_without_odometry_of_its_stamp_the_newest_before_is_used(tmp_path: Path) -> None:
    path = bag(
        tmp_path / "bag",
        goal(0, 10.0, 0.0),
        scan(1 * TICK_NS),
        odom(2 * TICK_NS, 1.0),
        odom(3 * TICK_NS, 2.0),
        scan(3 * TICK_NS + 5),
        odom(4 * TICK_NS, 3.0),
        scan(3 * TICK_NS + 2 * SECOND),
    )
    found = redecide_recording(path, ROBOT)
    assert [tick.pose.x for tick in found.decided] == [2.0, 3.0]
    assert [tick.mode for tick in found.decided] == [Mode.PATH_GENERATION, Mode.STOPPED]
    assert found.decided[1].reason == "input is 1.900 s old"
    assert found.notes == (
        "1 scans before the first odometry: not decided",
        "2 scans without odometry of their stamp: the newest before them was taken",
    )


def test_with_known_map_the_recorded_map_is_taken(tmp_path: Path) -> None:
    planner = replace(preset(PlannerParams()), method=Method.PREDICTIVE, known_map=True)
    params = replace(ROBOT, planner=planner)
    inputs = (odom(TICK_NS), goal(0, 9.0, 0.0), scan(TICK_NS, beams=360))
    inputs[0][1].header.frame_id = "odom"
    recorded = bag(tmp_path / "map", wall_map(0, "map"), wall_map(1, "odom"), *inputs)
    (decision,) = redecide_recording(recorded, params).decided
    assert "the way through the map is 1" in decision.reason
    without = replace(params, planner=replace(planner, known_map=False))
    (decision,) = redecide_recording(recorded, without).decided
    assert "map" not in decision.reason
    none = bag(tmp_path / "none", *inputs)
    with pytest.raises(BagError, match="known_map=true: no map was recorded"):
        redecide_recording(none, params)
    other = bag(tmp_path / "other", wall_map(0, "map"), *inputs)
    with pytest.raises(BagError, match="known_map=true: map is in frame 'map'"):
        redecide_recording(other, params)


def test_a_goal_applies_from_its_log_time(tmp_path: Path) -> None:
    path = bag(
        tmp_path / "bag",
        *(odom(k * TICK_NS) for k in range(1, 5)),
        scan(1 * TICK_NS),
        goal(2 * TICK_NS, 5.0, 0.0),
        scan(2 * TICK_NS),
        goal(3 * TICK_NS, math.nan, 0.0),
        scan(3 * TICK_NS),
        goal(4 * TICK_NS, 0.0, 5.0),
        scan(4 * TICK_NS),
    )
    goals = [tick.goal for tick in redecide_recording(path, ROBOT).decided]
    assert goals == [None, (5.0, 0.0), (5.0, 0.0), (0.0, 5.0)]
    given = redecide_recording(path, replace(ROBOT, goal=(7.0, 7.0)))
    assert {tick.goal for tick in given.decided} == {(7.0, 7.0)}


def test_robot_radius_and_scan_yaw_change_the_sectors(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", goal(0, 10.0, 0.0), odom(TICK_NS), scan(TICK_NS, 1.2))

    def bits(**changes: Any) -> list[int]:
        (tick,) = redecide_recording(path, replace(ROBOT, **changes)).decided
        return [number for number, bit in enumerate(tick.vs, start=1) if bit]

    assert bits(robot_radius_m=0.3) == []
    assert bits(robot_radius_m=0.45) == [1, 12]
    turned = LidarExtrinsics(yaw_rad=math.pi / 2)
    assert bits(robot_radius_m=0.45, extrinsics=turned) == [3, 4]
    # 1.2 m ahead of a lidar 0.4 m behind the centre is 0.8 m ahead of the robot.
    assert bits(robot_radius_m=0.3, extrinsics=LidarExtrinsics(x_m=-0.4)) == [1, 12]


def test_stamps_that_go_back_and_refused_inputs_are_named(tmp_path: Path) -> None:
    bad = odom(3 * TICK_NS, math.nan)
    path = bag(
        tmp_path / "bag",
        goal(0, 10.0, 0.0),
        odom(2 * TICK_NS),
        (*odom(1 * TICK_NS)[:2], 2 * TICK_NS),
        scan(2 * TICK_NS),
        (*scan(2 * TICK_NS)[:2], 3 * TICK_NS),
        bad,
        scan(3 * TICK_NS),
        odom(4 * TICK_NS),
        scan(4 * TICK_NS, math.nan, beams=1),
    )
    found = redecide_recording(path, ROBOT)
    assert found.faults == (
        f"/robot/odom: stamp {TICK_NS} ns comes after {2 * TICK_NS} ns",
        f"/front/scan: stamp {2 * TICK_NS} ns comes after {2 * TICK_NS} ns",
    )
    assert [tick.mode for tick in found.decided] == [
        Mode.PATH_GENERATION, Mode.STOPPED, Mode.STOPPED,
    ]  # fmt: skip
    assert found.notes == ("2 scans that the sensor refuses",)


def test_one_of_two_scan_topics_must_be_named(tmp_path: Path) -> None:
    _, message, time_ns = scan(TICK_NS, 0.9)
    path = bag(
        tmp_path / "bag", goal(0, 9.0, 0.0), odom(TICK_NS), scan(TICK_NS),
        ("/rear", message, time_ns),
    )  # fmt: skip
    with pytest.raises(BagError, match=r"2 topics of .*LaserScan, /front/scan, /rear; name one"):
        redecide_recording(path, ROBOT)
    (front,) = redecide_recording(path, replace(ROBOT, scan="/front/scan")).decided
    (rear,) = redecide_recording(path, replace(ROBOT, scan="/rear")).decided
    assert (any(front.vs), any(rear.vs)) == (False, True)


STORE = get_typestore(Stores.ROS2_JAZZY)
UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0)
SQRT_HALF = math.sqrt(0.5)


def tf_message(*transforms: tuple[str, str, tuple[float, ...], tuple[float, float]]) -> bytes:
    """A TFMessage of (frame, child frame, quaternion, position); its package is not installed."""
    make = {name.rpartition("/")[2]: kind for name, kind in STORE.types.items()}
    message = make["TFMessage"](
        [
            make["TransformStamped"](
                make["Header"](make["Time"](0, 0), parent),
                frame,
                make["Transform"](make["Vector3"](*position, 0.0), make["Quaternion"](*q)),
            )
            for parent, frame, q, position in transforms
        ]
    )
    return bytes(STORE.serialize_cdr(message, "tf2_msgs/msg/TFMessage"))


def bag_with_extrinsics(
    path: Path, *transforms: tuple[str, str, tuple[float, ...], tuple[float, float]]
) -> Path:
    """A scan in frame laser with an obstacle at 0.9 m on beam 0, odometry of base_link."""
    with BagReader(FOREIGN) as reader:
        definition = reader.definitions["tf2_msgs/msg/TFMessage"]
    with BagWriter(path) as writer:
        writer.add_topic("/tf_static", "tf2_msgs/msg/TFMessage", definition=definition)
        writer.write("/tf_static", tf_message(*transforms), 0, 0)
        for name, message, time_ns in (goal(0, 9.0, 0.0), odom(TICK_NS), scan(TICK_NS, 0.9)):
            kind = type_name(type(message))
            if kind.endswith("LaserScan"):
                message.header.frame_id = "laser"
            if kind.endswith("Odometry"):
                message.child_frame_id = "base_link"
            writer.add_topic(name, kind)
            writer.write(name, serialize_message(message), time_ns, time_ns)
    return path


LEFT = (0.0, 0.0, SQRT_HALF, SQRT_HALF)  # by 90 degrees counter-clockwise
LEVEL = (0.0, 0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0)


@pytest.mark.parametrize(
    ("transforms", "extrinsics"),
    [
        ([("base_link", "laser", LEVEL, ORIGIN)], (0.0, 0.0, 0.0)),
        ([("base_link", "laser", LEFT, ORIGIN)], (0.0, 0.0, 0.5)),
        ([("base_link", "laser", tuple(3.0 * x for x in LEFT), ORIGIN)], (0.0, 0.0, 0.5)),
        ([("base_link", "mast", LEFT, (0.2, 0.0)), ("mast", "laser", LEFT, (0.0, 0.1))],
         (0.1, 0.0, 1.0)),
        ([("footprint", "laser", LEFT, ORIGIN), ("footprint", "base_link", LEVEL, ORIGIN)],
         (0.0, 0.0, 0.5)),
        ([("laser", "base_link", LEFT, (0.1, 0.0))], (0.0, 0.1, -0.5)),
        ([("base_link", "laser", LEVEL, ORIGIN), ("base_link", "laser", LEFT, ORIGIN)],
         (0.0, 0.0, 0.5)),
        # Two lidars one above the other, both upside down: the upper one is level.
        ([("base_link", "low", UPSIDE_DOWN, ORIGIN), ("low", "laser", UPSIDE_DOWN, ORIGIN)],
         (0.0, 0.0, 0.0)),
        # Rolled, then turned: its x axis points to the right, as (LEFT, then UPSIDE_DOWN) tells.
        ([("base_link", "low", UPSIDE_DOWN, (0.1, 0.0)), ("low", "laser", LEFT, ORIGIN)],
         (0.1, 0.0, -0.5, True)),
        ([("/base_link", "/laser", LEFT, (0.0, 0.1))], (0.0, 0.1, 0.5)),
    ],
)  # fmt: skip
def test_tf_static_gives_the_extrinsics_of_the_lidar(
    transforms: list[Any], extrinsics: tuple[float, ...], tmp_path: Path
) -> None:
    """The yaw is in units of pi; the obstacle is on beam 0."""
    x, y, yaw, *flipped = extrinsics
    found = LidarExtrinsics(x, y, yaw * math.pi, *map(bool, flipped))
    path = bag_with_extrinsics(tmp_path / "bag", *transforms)
    (decided,) = redecide_recording(path, ROBOT).decided
    given = replace(ROBOT, extrinsics=found)
    (expected,) = redecide_recording(path, given).decided
    assert any(decided.vs)
    assert decided.vs == expected.vs
    assert decided.ranges_m == pytest.approx(expected.ranges_m, abs=1e-6)
    (centred,) = redecide_recording(path, replace(ROBOT, extrinsics=CENTRED)).decided
    assert (decided.vs == centred.vs) == (extrinsics[:3] == (0.0, 0.0, 0.0))


def test_the_extrinsics_of_the_lidar_is_noted(tmp_path: Path) -> None:
    transforms = (
        ("base_link", "mast", LEFT, (0.2, 0.0)),
        ("mast", "laser", LEFT, (0.15, 0.0)),
    )
    found = redecide_recording(bag_with_extrinsics(tmp_path / "bag", *transforms), ROBOT)
    # 0.2 m ahead, then 0.15 m ahead of the mast, which is to the left.
    assert found.notes == ("/tf: laser is at (0.2, 0.15) m in base_link, turned by 3.142 rad",)
    upside_down = ("base_link", "laser", UPSIDE_DOWN, ORIGIN)
    found = redecide_recording(bag_with_extrinsics(tmp_path / "flipped", upside_down), ROBOT)
    assert found.notes == ("/tf: laser is at (0, 0) m in base_link, turned by 0 rad, upside down",)
    level = bag_with_extrinsics(tmp_path / "level", ("base_link", "laser", LEVEL, ORIGIN))
    assert redecide_recording(level, ROBOT).notes == ()


@pytest.mark.parametrize(
    ("transforms", "message"),
    [
        ([("base_link", "camera", LEVEL, ORIGIN)],
         "frame 'laser': no /tf_static or /tf gives its pose in 'base_link'; give --scan-x, "),
        ([("a", "laser", LEVEL, ORIGIN), ("b", "base_link", LEVEL, ORIGIN)], "no /tf_static"),
        ([("laser", "a", LEVEL, ORIGIN), ("a", "laser", LEVEL, ORIGIN)], "no /tf_static"),
        ([("base_link", "laser", (0.0, 0.1, 0.0, 0.9), ORIGIN)], "tilted against 'base_link'"),
        ([("base_link", "laser", (0.0, 0.0, 0.0, 0.0), ORIGIN)], "tilted against 'base_link'"),
    ],
)  # fmt: skip
def test_a_lidar_with_unknown_extrinsics_is_refused(
    transforms: list[Any], message: str, tmp_path: Path
) -> None:
    path = bag_with_extrinsics(tmp_path / "bag", *transforms)
    with pytest.raises(BagError, match=re.escape(message)):
        redecide_recording(path, ROBOT)
    assert cli.main(["verify", str(path), "--scan-yaw", "0.3"]) == 0


def test_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["verify", str(FOREIGN)]) == 0
    expected = redecide_recording(FOREIGN, ROBOT)
    assert capsys.readouterr().out == (
        "note: /tf: laser is at (0.1, 0) m in base_link, turned by 0 rad\n"
        f"modes: obstacle_avoidance 67, path_generation 66\n"
        f"computed: 133 decisions, digest {expected.digest}\n"
    )
    assert cli.main(["verify", str(FOREIGN), "--set", "sensor.sensing_range_m=0.05"]) == 0
    other = capsys.readouterr().out
    assert "133 decisions" in other
    assert expected.digest not in other


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--closed-loop", "was not recorded by mfba, so there is no world to simulate"),
        ("--goal nan 1", "--goal nan 1.0: not finite"),
        ("--seed -1", "seed=-1: negative"),
        ("--robot-radius -1", "robot_radius_m=-1.0: out of range"),
        ("--odom /o", "--odom /o: no such topic; give one of /odom"),
        ("--set planner.speed=1", "unknown option; did you mean"),
    ],
)
def test_mistakes(options: str, message: str) -> None:
    with pytest.raises(MfbaError, match=message):
        cli.main(["verify", str(FOREIGN), *options.split()])


def test_faults_are_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = [(*scan(TICK_NS)[:2], TICK_NS + k) for k in range(13)]
    path = bag(tmp_path / "bag", goal(0, 9.0, 0.0), odom(TICK_NS), *again)
    with pytest.raises(BagError, match="12 faults, the first: /front/scan: stamp 100000000 ns"):
        cli.main(["verify", str(path)])
    assert "fault: ... and 2 more\n" in capsys.readouterr().out


def test_without_goal(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", odom(TICK_NS), scan(TICK_NS))
    with pytest.raises(BagError, match="no goal_pose was recorded; give one with --goal X Y"):
        cli.main(["verify", str(path)])
    assert cli.main(["verify", str(path), "--goal", "1", "2"]) == 0


def test_options_are_refused_for_a_bag_of_mfba(tmp_path: Path) -> None:
    ours = record(tmp_path / "ours", "case1", 2)
    with pytest.raises(ConfigError, match=r"--seed: .* contains that already; leave it out"):
        cli.main(["verify", str(ours), "--seed", "3"])
