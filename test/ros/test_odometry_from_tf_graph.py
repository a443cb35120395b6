# SPDX-License-Identifier: Apache-2.0
"""A robot that sends its odometry on /tf only: the same decisions, live and from a bag."""

import math
import time
from pathlib import Path
from typing import Any

import pytest
from bag_to_graph import PAPER, PLANNERS, PREDICTIVE, TICKS, from_bag, live, play
from foreign_bags import START_NS, TICK_NS, Recorded, goal, odom, scan, transform, write
from geometry_msgs.msg import TransformStamped
from mounted_lidars import MOUNTED, wall_ranges
from real_time_robot import DRIVES, FREE, STOPS, TRACKING, RealTimeRobot, scan_of, stamp
from ros_graph import Graph

from mfba_planner.core.errors import BagError, ConfigError
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.ros.endpoints.transform_subscription import DISCOVERY_S
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import time_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.verification.verify_bag import verify

EACH_PLANNER = pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
OK = b"\x00"


def recording(
    begin_ns: int = START_NS, *, by_tf: bool = True, base: str = "base_link"
) -> list[Recorded]:
    """A robot that turns and drives beside a wall; base_link is on base_footprint."""
    ranges = wall_ranges(MOUNTED["straight"]).tolist()
    found = [transform(begin_ns), goal(begin_ns + 1, 1.0, 5.0)]
    if by_tf:
        found.append(transform(begin_ns, "base_footprint", "base_link", x=0.1))
    for k in range(1, TICKS + 1):
        at_ns, x, yaw = begin_ns + k * TICK_NS, 0.01 * k, 0.4 + 0.01 * k
        if by_tf:
            # The pose of base_footprint by which base_link is at (x, 0).
            dx, dy = _ahead(0.1, yaw)
            found.append(
                transform(at_ns, "odom", "base_footprint", x=x - dx, y=-dy, yaw=yaw, topic="/tf")
            )
            # A wheel turns, and a localization corrects: neither is a pose of the robot.
            found.append(transform(at_ns + 2, "base_link", "wheel", yaw=0.1 * k, topic="/tf"))
            found.append(transform(at_ns + 3, "map", "odom", x=0.1 * k, topic="/tf"))
        else:
            found.append(odom(at_ns, x, yaw=yaw, child=base))
        found.append(scan(at_ns, ranges, range_min=0.1))
    return found


def _ahead(distance_m: float, yaw: float) -> tuple[float, float]:
    return distance_m * math.cos(yaw), distance_m * math.sin(yaw)


@EACH_PLANNER
def test_the_decisions_are_those_by_odom(
    graph: Graph, planner: PlannerParams, tmp_path: Path, with_tf: Any
) -> None:
    bag = write(tmp_path / "bag", recording())
    found = [one for _, one in live(graph, bag, planner)]
    assert tuple(found) == from_bag(bag, planner)
    expected = from_bag(write(tmp_path / "odom", recording(by_tf=False)), planner)
    for one, other in zip(found, expected, strict=True):
        assert one.pose == pytest.approx(other.pose)
        assert (one.mode, one.stamp_ns) == (other.mode, other.stamp_ns)
        assert one.velocity == pytest.approx(other.velocity, abs=0.02)


def test_a_recording_of_the_nodes_verifies(graph: Graph, tmp_path: Path, with_tf: Any) -> None:
    recorder = graph.start(
        Recorder, {"output": str(tmp_path / "run"), "nodes": "planner, virtual_sensor"}
    )
    begin_ns = time.time_ns() - (TICKS + 1) * TICK_NS
    bag = write(tmp_path / "bag", recording(begin_ns))
    play(graph, bag, PREDICTIVE, lockstep=False, input_timeout_s=60.0, odom_source="tf")
    graph.settle()
    graph.stop(recorder)
    report = verify(tmp_path / "run")
    assert report.is_identical, (report.faults, report.divergence)
    assert len([one for one in report.recorded if one.perception == "scan"]) == TICKS


def test_an_odometry_topic_counts_more_than_tf(tmp_path: Path) -> None:
    alone = recording(by_tf=False)
    both = [*recording(), *(one for one in alone if one.topic == "/odom")]
    found = from_bag(write(tmp_path / "both", both), PAPER)
    assert found == from_bag(write(tmp_path / "alone", alone), PAPER)


def test_tf_that_does_not_give_the_robot_is_an_error(tmp_path: Path) -> None:
    others = [one for one in recording() if "footprint" not in str(one.message)]
    with pytest.raises(BagError, match="/tf does not give 'base_link' in 'odom'; give odom_frame"):
        from_bag(write(tmp_path / "bag", others), PAPER)
    bag = write(tmp_path / "footprint", recording())
    assert len(from_bag(bag, PAPER, base_frame="base_footprint")) == TICKS
    neither = [one for one in recording() if one.topic not in ("/tf", "/tf_static")]
    with pytest.raises(BagError, match="no message of type nav_msgs/msg/Odometry"):
        from_bag(write(tmp_path / "neither", neither), PAPER)


class TfRobot(RealTimeRobot):
    """A robot in real time whose pose is sent by hand on /tf."""

    def __init__(self, graph: Graph, tf_type: Any, **both: Any) -> None:
        self._type, self._tf = tf_type, graph.writer(topics.TRANSFORMS[0])
        super().__init__(graph, scan_extrinsics="parameters", **both)

    def send_tf(self, at_ns: int, x: float = 0.0, child: str = "base_link") -> None:
        stamped = TransformStamped(child_frame_id=child)
        stamped.header.frame_id, stamped.header.stamp = "odom", time_msg(at_ns)
        stamped.transform.translation.x = x
        stamped.transform.rotation.w = 1.0
        self._tf.publish(self._type(transforms=[stamped]))
        self.graph.settle()

    def drive_by_tf(self, x: float = 0.0) -> str:
        self.send_tf(stamp(), x)
        return self.send_scan(scan_of(stamp(), FREE))


@pytest.mark.parametrize("planner", [{}, TRACKING], ids=["paper", "predictive"])
def test_in_real_time_tf_moves_the_robot_and_its_end_stops_it(
    graph: Graph, with_tf: Any, planner: dict[str, Any]
) -> None:
    robot = TfRobot(graph, with_tf, planner=planner, odom_source="tf")
    assert [robot.drive_by_tf(0.01 * k) for k in range(3)] == [DRIVES] * 3
    for node in ("virtual_sensor", "planner"):
        assert robot.inputs(node).level == OK
        assert robot.value(node, "odom: source") == "tf"
    robot.send_tf(stamp(), child="base_scan")
    assert robot.send_scan(scan_of(stamp())) == DRIVES, "the last pose is still young"
    robot.send_tf(stamp(-30.0), x=0.02)
    assert robot.inputs("planner").message.startswith("refused: odom stamp is 30.")
    assert robot.send_scan(scan_of(stamp())) == STOPS


def test_in_real_time_tf_is_read_once_no_publisher_was_found(
    graph: Graph, with_tf: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = TfRobot(graph, with_tf)
    graph.probe.destroy_publisher(robot.odom)
    began_s = time.monotonic()
    graph.until(lambda: robot.drive_by_tf() == DRIVES)
    assert time.monotonic() - began_s > 0.5 * DISCOVERY_S
    assert robot.value("planner", "odom: source") == "tf"
    robot.odom = graph.writer(topics.ODOM)
    robot.send_odom(stamp(), x=1.0)
    robot.send_tf(stamp(), x=5.0)
    assert robot.send_scan(scan_of(stamp())) == DRIVES
    assert robot.planner._last is not None
    assert robot.planner._last.pose.x == pytest.approx(1.0, abs=0.3)


def test_a_robot_with_odom_does_not_read_tf_for_it(graph: Graph, with_tf: Any) -> None:
    robot = TfRobot(graph, with_tf)
    assert robot.drive() == DRIVES
    robot.send_tf(stamp(), x=5.0)
    assert robot.send_scan(scan_of(stamp())) == DRIVES
    assert robot.planner._last is not None
    assert robot.planner._last.pose.x == 0.0
    timers = [node._inputs.odometry for node in graph.nodes if isinstance(node, PlannerNode)]
    graph.until(lambda: all(source._timer.is_canceled() for source in timers if source._timer))
    assert graph.probe.count_subscribers("/tf") == 0


def test_odometry_by_tf_alone_needs_tf2_msgs(graph: Graph) -> None:
    for kind in (VirtualSensor, PlannerNode):
        with pytest.raises(ConfigError, match="odom_source='tf': tf2_msgs is not installed here"):
            graph.start(kind, {"odom_source": "tf"})
