# SPDX-License-Identifier: Apache-2.0
"""In real time the real graph refuses, by name, inputs that are late, ahead, doubled or odd."""

import math
from typing import Any

import pytest
from planner_talk import PlannerHarness, fields, mode
from planner_talk import odom as ns_odom
from planner_talk import sectors as ns_sectors
from rclpy.qos import qos_profile_sensor_data
from real_time_robot import (
    BEAMS,
    DRIVES,
    FREE,
    STOPS,
    TIMEOUT_S,
    TRACKING,
    WALL,
    RealTimeRobot,
    scan_of,
    stamp,
)
from ros_graph import Graph
from rosgraph_msgs.msg import Clock

from mfba_planner.core.planner_types import Mode
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import time_msg
from mfba_planner.ros.runtime.input_monitor import PAIRED
from mfba_planner.ros.runtime.reception import HELD_S

OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
LATE_S, HOURS_S = 6.0 * TIMEOUT_S, 3.0 * 3600.0
SECOND = 10**9


def test_punctual_inputs_drive_and_their_latency_is_reported(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    assert robot.drive(scan_s=-0.5) == DRIVES, "within the time limit"
    for node in ("planner", "virtual_sensor"):
        assert robot.inputs(node).level == OK
    assert 0.5 <= float(robot.value("virtual_sensor", "scan: latency [s]")) < TIMEOUT_S


@pytest.mark.parametrize("at_first", [True, False], ids=["from the start", "later"])
def test_scans_that_are_late_by_their_stamps_stop_the_robot(graph: Graph, at_first: bool) -> None:
    robot = RealTimeRobot(graph)
    if not at_first:
        assert robot.drive() == DRIVES
    robot.drive(scan_s=-LATE_S)
    assert robot.drive(scan_s=-LATE_S) != DRIVES
    sensed = robot.inputs("virtual_sensor")
    assert sensed.level == ERROR
    assert sensed.message.startswith("refused: scan stamp is 30.")
    assert "behind the node's clock (input_timeout_s=5); synchronise the" in sensed.message
    planned = robot.inputs("planner")
    assert planned.level == ERROR
    assert planned.message.startswith("refused: sectors stamp is 30.")
    if at_first:
        assert robot.reason.startswith("refused input: sectors stamp is 30.")
    assert robot.drive() == DRIVES, "a punctual scan counts at once"
    assert robot.inputs("virtual_sensor").level == OK


def test_odometry_that_is_late_by_its_stamps_stops_the_robot(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    assert robot.drive(odom_s=-LATE_S) == STOPS
    for node in ("planner", "virtual_sensor"):
        assert robot.inputs(node).message.startswith("refused: odom stamp is 30.")
    assert robot.drive() == DRIVES


def test_sectors_that_are_late_by_their_stamps_stop_the_robot(graph: Graph) -> None:
    harness = PlannerHarness(graph, {"input_timeout_s": TIMEOUT_S})
    decision = harness.decide(ns_odom(stamp()), ns_sectors(stamp(-LATE_S)))
    assert mode(decision) is Mode.STOPPED
    assert fields(decision)["reason"].startswith("refused input: sectors stamp is 30.")
    assert mode(harness.decide(ns_sectors(stamp()))) is Mode.PATH_GENERATION


@pytest.mark.parametrize("ahead_s", [LATE_S, HOURS_S])
def test_a_lidar_with_a_clock_in_the_future_is_refused_beside_punctual_odometry(
    graph: Graph, ahead_s: float
) -> None:
    robot = RealTimeRobot(graph, input_timeout_s=1.0)
    graph.until(lambda: robot.drive() == DRIVES)

    def is_stopped() -> bool:
        """The planner's timer decides that it stops, at any moment."""
        robot.drive(scan_s=ahead_s)
        return mode(robot.decisions[-1]) is Mode.STOPPED

    graph.until(is_stopped)
    sensed = robot.inputs("virtual_sensor")
    assert (sensed.level, sensed.message[:22]) == (ERROR, "refused: scan stamp is")
    assert "ahead of the node's clock (input_timeout_s=1); synchronise the c" in sensed.message
    graph.until(lambda: robot.drive() == DRIVES)  # the clock was set right


@pytest.mark.parametrize("ahead_s", [LATE_S, HOURS_S, 3e8])
@pytest.mark.parametrize("name", ["odom", "scan"])
def test_after_one_stamp_in_the_future_the_next_good_one_counts(
    graph: Graph, name: str, ahead_s: float
) -> None:
    robot = RealTimeRobot(graph)
    assert robot.drive() == DRIVES
    if name == "odom":
        robot.send_odom(stamp(ahead_s), x=5.0)
    else:
        assert robot.send_scan(scan_of(stamp(ahead_s))) == ""
    assert robot.inputs("virtual_sensor").message.startswith(f"refused: {name} stamp is")
    for _ in range(3):
        assert robot.drive() == DRIVES
    assert robot.value("virtual_sensor", f"refused {name}: stamp") == "1"
    assert robot.inputs("virtual_sensor").level == OK


def test_after_sectors_in_the_future_the_next_good_ones_count(graph: Graph) -> None:
    harness = PlannerHarness(graph, {"input_timeout_s": TIMEOUT_S})
    assert not harness.decide_all(ns_odom(stamp()), ns_sectors(stamp(HOURS_S)))
    assert mode(harness.decide(ns_sectors(stamp()))) is Mode.PATH_GENERATION


@pytest.mark.parametrize("name", ["odom", "scan"])
def test_a_stamp_that_is_not_set_is_refused_in_one_line(graph: Graph, name: str) -> None:
    robot = RealTimeRobot(graph)
    robot.send_odom(0 if name == "odom" else stamp())
    assert robot.send_scan(scan_of(0 if name == "scan" else stamp())) in ("", STOPS)
    text = f"refused: {name} stamp is 0 s: not set; "
    assert robot.inputs("virtual_sensor").message.startswith(text)
    assert robot.drive() == DRIVES


def test_the_clock_may_be_set_back(graph: Graph) -> None:
    robot = RealTimeRobot(graph, use_sim_time=True)
    clock = graph.writer(topics.CLOCK)

    def at(seconds: int) -> str:
        clock.publish(Clock(clock=time_msg(seconds * SECOND)))
        now = robot.planner.get_clock().now
        graph.until(lambda: bool(now().nanoseconds == seconds * SECOND))
        robot.send_odom(seconds * SECOND)
        return robot.send_scan(scan_of(seconds * SECOND))

    assert [at(seconds) for seconds in (1000, 1001, 100, 101)] == [DRIVES] * 4
    robot.send_odom(101 * SECOND + 1)
    assert robot.send_scan(scan_of(80 * SECOND)) != DRIVES
    assert robot.inputs("virtual_sensor").message.startswith("refused: scan stamp is 21.00 s beh")


def test_without_a_clock_it_names_the_topic_that_is_missing(graph: Graph) -> None:
    robot = RealTimeRobot(graph, use_sim_time=True)
    assert robot.drive() == ""
    for node in ("planner", "virtual_sensor"):
        assert "use_sim_time is true, but /clock sends nothing" in robot.inputs(node).message
        assert robot.inputs(node).level == ERROR


def test_stamps_of_another_clock_drive_with_a_warning(graph: Graph) -> None:
    """As from a simulation that starts at 0, or a replay, without use_sim_time."""
    robot = RealTimeRobot(graph)

    def at(seconds: int, scan_s: int = 0) -> str:
        robot.send_odom(seconds * SECOND)
        return robot.send_scan(scan_of((seconds + scan_s) * SECOND))

    assert [at(seconds) for seconds in (100, 101, 102)] == [DRIVES] * 3
    for node in ("planner", "virtual_sensor"):
        assert robot.inputs(node).level == WARN
        assert "years behind the node's clock, so only arrival" in robot.inputs(node).message
    assert at(103, scan_s=2 * 10**9) == "", "one stamp in the future"
    assert robot.inputs("virtual_sensor").message.startswith("refused: scan stamp is 63.4 years")
    assert at(104) == DRIVES
    assert at(106, scan_s=-20) == "", "the scan is late"
    assert robot.inputs("virtual_sensor").message.startswith("refused: scan stamp is 20.00 s beh")
    assert at(107) == DRIVES
    at(20)  # the bag starts again
    assert [at(seconds) for seconds in (21, 22)] == [DRIVES] * 2
    at(500)  # messages were missing
    assert [at(seconds) for seconds in (501, 502)] == [DRIVES] * 2


def test_in_real_time_only_the_newest_counts_and_the_others_are_counted(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    assert robot.drive(ranges=WALL) != DRIVES
    count = len(robot.sectors)
    for k in range(40):
        robot.scan.publish(scan_of(stamp(), FREE if k == 39 else WALL))
        robot.odom.publish(ns_odom(stamp()))
    graph.settle()
    assert len(robot.sectors) == count + 1
    assert robot.drive() == DRIVES
    assert robot.value("virtual_sensor", "scan: dropped") == "39"
    assert int(robot.value("planner", "odom: dropped")) >= 30


def test_in_lockstep_no_message_is_dropped_and_no_stamp_is_judged(graph: Graph) -> None:
    robot = RealTimeRobot(graph, lockstep=True)
    for k in range(1, 41):
        robot.odom.publish(ns_odom(k))
        robot.scan.publish(scan_of(k))
    graph.until(lambda: len(robot.decisions) == 40)
    assert [stamp_ns(message.header.stamp) for message in robot.decisions] == list(range(1, 41))


def test_an_obstacle_simulation_is_paired_by_stamp_in_real_time_too(graph: Graph) -> None:
    robot = RealTimeRobot(graph, {"source": "obstacles"})
    obstacles = graph.writer(topics.OBSTACLES)
    count = len(robot.sectors)
    for k in range(1, PAIRED + 1):
        message = topics.OBSTACLES.type()
        message.header.stamp = time_msg(k * SECOND)
        obstacles.publish(message)
        robot.odom.publish(ns_odom(k * SECOND))
    graph.until(lambda: len(robot.sectors) == count + PAIRED)


def test_two_lidars_on_one_topic_stop_the_robot(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    for _ in range(5):
        assert robot.drive() == DRIVES
    other = graph.writer(topics.SCAN)
    for _ in range(2):
        robot.send_scan(scan_of(stamp(), WALL), other)
        robot.drive()
    assert robot.drive() == STOPS
    assert robot.inputs("virtual_sensor").level == ERROR
    assert robot.inputs("virtual_sensor").message.startswith(
        "refused: scan has 2 publishers that send in turn (probe, probe); give each lidar a "
        "frame of its own that tf knows, or set scan_frame to the one to use"
    )
    graph.probe.destroy_publisher(other)
    graph.until(lambda: robot.drive() == DRIVES)
    assert robot.inputs("virtual_sensor").level == OK


def test_two_lidars_are_distinguished_by_their_frames(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    other = graph.writer(topics.SCAN)
    assert robot.drive() == DRIVES
    assert robot.send_scan(scan_of(stamp(), WALL, "rear"), other) == STOPS
    text = "refused: scan changes its frame from 'base_scan' to 'rear'; give each lidar a frame"
    assert robot.inputs("virtual_sensor").message.startswith(text)


def test_with_scan_frame_one_of_two_lidars_is_used(graph: Graph) -> None:
    robot = RealTimeRobot(graph, {"scan_frame": "base_scan"})
    other = graph.writer(topics.SCAN)
    assert robot.drive() == DRIVES
    for _ in range(5):
        assert robot.send_scan(scan_of(stamp(), WALL, "rear"), other) == ""
        assert robot.drive() == DRIVES
    assert robot.inputs("virtual_sensor").level == OK
    assert robot.value("virtual_sensor", "scan: ignored, other frame") == "5"


@pytest.mark.parametrize("qos", [topics.TICK_QOS, qos_profile_sensor_data])
def test_a_driver_that_is_restarted_raises_no_alarm(graph: Graph, qos: Any) -> None:
    robot = RealTimeRobot(graph)
    for _ in range(4):
        graph.probe.destroy_publisher(robot.scan)
        graph.probe.destroy_publisher(robot.odom)
        robot.scan = graph.writer(topics.SCAN, qos=qos)
        robot.odom = graph.writer(topics.ODOM, qos=qos)
        for _ in range(3):
            assert robot.drive() == DRIVES
    assert robot.inputs("virtual_sensor").level == OK


def test_a_second_publisher_that_is_silent_raises_no_alarm(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    graph.writer(topics.SCAN)
    graph.writer(topics.ODOM)
    assert [robot.drive() for _ in range(5)] == [DRIVES] * 5


def test_two_publishers_of_odometry_stop_the_robot(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    other = graph.writer(topics.ODOM)
    for _ in range(3):
        robot.drive()
        robot.send_odom(stamp(), other, x=4.0)
    assert robot.drive() == STOPS
    for node in ("planner", "virtual_sensor"):
        assert robot.inputs(node).message.startswith(
            "refused: odom has 2 publishers that send in turn (probe, probe); stop or remap"
        )
    graph.probe.destroy_publisher(other)
    graph.until(lambda: robot.drive() == DRIVES, timeout_s=10.0 + HELD_S)


def test_a_planner_that_reads_scans_itself_refuses_the_same(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=TRACKING)
    assert robot.drive() == DRIVES
    assert robot.send_scan(scan_of(stamp(HOURS_S))) == ""
    assert robot.inputs("planner").message.startswith("refused: scan stamp is 3.0 h ahead of")
    assert robot.drive() == DRIVES
    assert robot.inputs("planner").level == OK
    robot.send_odom(stamp())
    assert robot.send_scan(scan_of(stamp(), angle_increment=0.0)) == STOPS
    assert robot.drive() == DRIVES
    assert robot.send_scan(scan_of(stamp(), frame="rear")) == STOPS
    assert "scan changes its frame" in robot.inputs("planner").message


def test_a_planner_that_reads_scans_itself_uses_the_one_in_scan_frame(graph: Graph) -> None:
    frame = {"scan_frame": "base_scan"}
    robot = RealTimeRobot(graph, frame, {**TRACKING, **frame})
    other = graph.writer(topics.SCAN)
    assert robot.drive() == DRIVES
    for _ in range(3):
        assert robot.send_scan(scan_of(stamp(), WALL, "rear"), other) == ""
        assert robot.drive() == DRIVES


def test_a_slow_planner_that_reads_scans_itself_decides_on_the_newest(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=TRACKING)
    assert robot.drive() == DRIVES
    graph.executor.remove_node(robot.planner)
    count = len(robot.decisions)
    for _ in range(3 * PAIRED):
        robot.drive()
    graph.executor.add_node(robot.planner)

    def driving() -> list[int]:
        """Stamps of the decisions; on a busy machine, inputs may be stale before."""
        new = [m for m in robot.decisions[count:] if mode(m) is Mode.PATH_GENERATION]
        return [stamp_ns(message.header.stamp) for message in new]

    graph.until(lambda: bool(driving()))
    graph.settle()
    assert driving() == [stamp_ns(robot.sectors[-1].header.stamp)]
    assert robot.drive() == DRIVES
    graph.until(lambda: int(robot.value("planner", "sectors: dropped")) == 3 * PAIRED - 1)


BAD_SCANS: dict[str, tuple[dict[str, Any], str]] = {
    "increment 0": ({"angle_increment": 0.0}, "scan of 90 beams has angle_increment=0: all in"),
    "count against angles": (
        {"angle_max": 0.0},
        "scan holds 90 ranges, but angle_min=-3.14159, angle_max=0 and angle_increment="
        "0.0698132 make 46; check the lidar driver",
    ),
    "sign against angles": (
        {"angle_increment": -2.0 * math.pi / BEAMS},
        "scan holds 90 ranges, but angle_min=-3.14159, angle_max=3.07178 and angle_increment="
        "-0.0698132 make -88; check the lidar driver",
    ),
    "limits": ({"range_min": 12.0}, "scan has range_min=12, range_max=10: not 0 <= range_min"),
    "no range": ({"ranges": []}, "scan holds 0 ranges; check the lidar driver"),
    "angle": (
        {"angle_min": math.nan},
        "scan angle_min, angle_max or angle_increment holds nan; send finite numbers",
    ),
}


@pytest.mark.parametrize("bad", BAD_SCANS)
def test_a_scan_that_contradicts_itself_stops_the_robot_and_is_named(
    graph: Graph, bad: str
) -> None:
    changes, text = BAD_SCANS[bad]
    robot = RealTimeRobot(graph)
    assert robot.drive() == DRIVES
    robot.send_odom(stamp())
    assert robot.send_scan(scan_of(stamp(), **{"ranges": FREE, **changes})) == STOPS
    status = robot.inputs("virtual_sensor")
    assert status.level == ERROR
    assert status.message.startswith(f"refused: {text}")
    assert robot.drive() == DRIVES


def test_beams_that_turn_clockwise_have_their_directions(graph: Graph) -> None:
    robot = RealTimeRobot(graph)
    ranges = [math.inf] * BEAMS
    ranges[BEAMS // 8] = 0.7  # 45 degrees clockwise of the first beam
    clockwise: dict[str, Any] = {"angle_min": 0.0, "angle_increment": -2.0 * math.pi / BEAMS}
    clockwise["angle_max"] = clockwise["angle_increment"] * (BEAMS - 1)
    robot.send_odom(stamp())
    robot.send_scan(scan_of(stamp(), ranges, **clockwise))
    found = [i for i, r in enumerate(robot.sectors[-1].ranges, start=1) if r < math.inf]
    assert found == [10, 11, 12]
