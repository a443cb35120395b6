# SPDX-License-Identifier: Apache-2.0
"""The planner node publishes its local map: what is in it, when, and to whom."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planner_talk import LOCKSTEP, PlannerHarness, odom, sectors
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ros_graph import Graph

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.planner_types import NANO, Scan
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.from_messages import occupancy_grid, stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import scan_msg
from mfba_planner.ros.nodes.planner import PlannerNode

TICK_NS = 100_000_000
WALL_M = 2.0
SCANNING = replace(
    preset(PlannerParams()), method=Method.PREDICTIVE, perception=PerceptionInput.SCAN
)
LIDAR = {**flatten(SCANNING), **LOCKSTEP}


def wall_ahead(x: float, wall_m: float = WALL_M) -> Scan:
    """A scan from (x, 0), yaw 0, of a wall along y from -1 to 1 m at wall_m."""
    angles = math.radians(1.0) * np.arange(-180, 180)
    ahead = wall_m - x
    hit = np.abs(angles) < math.atan2(1.0, ahead)
    ranges = np.where(hit, ahead / np.where(hit, np.cos(angles), 1.0), math.inf)
    return Scan(
        ranges_m=ranges, angle_min_rad=-math.pi, angle_increment_rad=math.radians(1.0),
        range_min_m=0.05, range_max_m=5.0,
    )  # fmt: skip


class Lidar:
    """A planner node that gets odometry, sectors and scans tick by tick."""

    def __init__(self, graph: Graph, **parameters: Any) -> None:
        self.graph, self.tick = graph, 0
        self.maps = graph.collect(topics.LOCAL_MAP)
        self.harness = PlannerHarness(graph, LIDAR | parameters, at=(9.0, 0.0))
        self.scans = graph.writer(topics.SCAN)
        graph.settle()

    def decide(self, count: int, x: float = 0.0, wall_m: float = WALL_M) -> None:
        for _ in range(count):
            self.tick += 1
            stamp = self.tick * TICK_NS
            self.scans.publish(scan_msg(wall_ahead(x, wall_m), stamp, "base_scan"))
            self.harness.decide(odom(stamp, x), sectors(stamp))

    @property
    def stamps(self) -> list[int]:
        return [stamp_ns(message.header.stamp) // TICK_NS for message in self.maps]


def test_the_wall_is_in_the_map(graph: Graph) -> None:
    robot = Lidar(graph)
    robot.decide(25)
    message = robot.maps[-1]
    assert message.header.frame_id == "odom"
    assert message.info.map_load_time == message.header.stamp
    assert message.info.resolution == pytest.approx(0.05)
    assert message.info.width * message.info.height == len(message.data) < 200 * 200
    points = occupancy_grid(message).occupied()
    assert np.abs(points[:, 0] - WALL_M).max() < 0.05
    assert points[:, 1].min() == pytest.approx(-1.0, abs=0.1)
    assert points[:, 1].max() == pytest.approx(1.0, abs=0.1)
    assert set(message.data) == {-1, 0, 100}


def test_it_is_published_once_a_period_of_the_stamps_and_only_when_it_changes(
    graph: Graph,
) -> None:
    robot = Lidar(graph, map_period_s=0.5)
    robot.decide(20)
    assert robot.stamps == [1], "the same scan again marks nothing new"
    for k in range(20):
        robot.decide(1, x=0.02 * k)
    assert len(robot.stamps) >= 3
    assert min(np.diff(robot.stamps)) >= 5


def test_the_period_is_a_second_by_default(graph: Graph) -> None:
    robot = Lidar(graph)
    for k in range(40):
        robot.decide(1, x=0.02 * k)
    assert 3 <= len(robot.stamps) <= 4
    assert min(np.diff(robot.stamps)) * TICK_NS * NANO >= 1.0


def test_a_later_subscriber_gets_the_newest(graph: Graph) -> None:
    robot = Lidar(graph)
    robot.decide(25)
    (info,) = graph.probe.get_publishers_info_by_topic("/local_map")
    assert info.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert info.qos_profile.reliability is ReliabilityPolicy.RELIABLE
    late = graph.collect(topics.LOCAL_MAP)
    graph.until(lambda: bool(late))
    assert [message.header.stamp for message in late] == [robot.maps[-1].header.stamp]


def test_after_a_reset_the_new_map_replaces_the_old_one(graph: Graph) -> None:
    robot = Lidar(graph)
    robot.decide(25)
    robot.harness.node.path_planner.reset()
    robot.decide(25, wall_m=2.5)
    points = occupancy_grid(robot.maps[-1]).occupied()
    assert np.abs(points[:, 0] - 2.5).max() < 0.05


@pytest.mark.parametrize(
    "parameters",
    [{"map_period_s": 0.0}, flatten(PlannerParams()), {"perception": "sectors"}],
    ids=["off", "paper", "sectors"],
)
def test_no_map(graph: Graph, parameters: dict[str, Any]) -> None:
    robot = Lidar(graph, **parameters)
    robot.decide(15)
    assert robot.maps == []
    off = parameters.get("map_period_s") == 0.0
    assert bool(graph.probe.count_publishers("/local_map")) == (not off)


def test_a_negative_period_is_refused(graph: Graph) -> None:
    with pytest.raises(ConfigError, match=r"^map_period_s=-1.0: out of range"):
        graph.start(PlannerNode, LIDAR | {"map_period_s": -1.0})


def test_a_robot_among_nothing_publishes_nothing(graph: Graph) -> None:
    robot = Lidar(graph)
    robot.decide(15, wall_m=100.0)
    assert robot.maps == []
