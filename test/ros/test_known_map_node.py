# SPDX-License-Identifier: Apache-2.0
"""The planner node and a map known before: it waits for it, takes the first, refuses others."""

from typing import Any

import numpy as np
import pytest
from nav_msgs.msg import OccupancyGrid as GridMessage
from planner_talk import LOCKSTEP, PlannerHarness, fields, odom, sectors
from rclpy.publisher import Publisher
from ros_graph import Graph
from test_local_map_publisher import SCANNING, TICK_NS, wall_ahead

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.occupancy_grid import OccupancyGrid
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import occupancy_grid_msg, scan_msg

NONE_YET = "no map yet; start a map server, or set known_map to false"


def wall_map(frame: str = "odom", x: float = 5.0) -> GridMessage:
    """A wall along y from -3 to 8 m."""
    cells = np.full((220, 1), 100, dtype=np.int8)
    return occupancy_grid_msg(OccupancyGrid(0, Pose2D(x, -3.0, 0.0), 0.05, cells), frame)


class Robot:
    """A planner node with known_map, in the open."""

    def __init__(self, graph: Graph, **parameters: Any) -> None:
        self.graph, self.tick = graph, 0
        self.diagnostics = graph.collect(topics.DIAGNOSTICS)
        values = {
            **flatten(SCANNING),
            **LOCKSTEP,
            "known_map": True,
            "wait_for": "probe",
        } | parameters
        self.harness = PlannerHarness(graph, values, at=(9.0, 0.0))
        self.node = self.harness.node
        self.scans: Publisher = graph.writer(topics.SCAN)
        self.maps: Publisher = graph.writer(topics.MAP)
        graph.settle()

    def publish(self, message: GridMessage) -> None:
        self.maps.publish(message)
        self.graph.settle()

    def decide(self) -> list[Any]:
        self.tick += 1
        stamp = self.tick * TICK_NS
        scan: Scan = wall_ahead(0.0, 100.0)
        self.scans.publish(scan_msg(scan, stamp, "base_scan"))
        return self.harness.decide_all(odom(stamp), sectors(stamp))

    @property
    def statuses(self) -> list[Any]:
        """Of all diagnostics."""
        return [status for message in self.diagnostics for status in message.status]

    @property
    def inputs(self) -> Any:
        """The newest status of the inputs."""
        return [status for status in self.statuses if status.name.endswith("inputs")][-1]


def refused(robot: Robot) -> dict[str, int]:
    return dict(robot.node._refused_inputs.by_kind)


def test_in_lockstep_it_waits_for_the_map_and_then_drives_round_the_wall(graph: Graph) -> None:
    robot = Robot(graph)
    assert robot.node.missing() == NONE_YET
    assert robot.decide() + robot.decide() == []
    robot.publish(wall_map())
    assert robot.node.missing() == ""
    assert len(robot.harness.decisions) == 2, "of the ticks before, as a replay does not repeat"
    (decision,) = robot.decide()
    assert "the way through the map is 1" in fields(decision)["reason"]
    assert robot.harness.velocity[1] < -0.1, "towards its near end"


def test_without_peers_ready_does_not_wait_for_the_map(graph: Graph) -> None:
    """A replay that waits for ~/ready is what publishes it."""
    assert Robot(graph, wait_for="").node.missing() == ""


def test_diagnostics_name_what_it_waits_for(graph: Graph) -> None:
    robot = Robot(graph, diagnostics_period_s=0.05)
    graph.until(lambda: any(s.name.endswith("inputs") for s in robot.statuses))
    assert NONE_YET in robot.inputs.message
    robot.publish(wall_map())
    robot.decide()
    graph.until(lambda: NONE_YET not in robot.inputs.message)


def test_in_real_time_it_stands_until_there_is_a_map(graph: Graph) -> None:
    robot = Robot(graph, lockstep=False)
    (decision,) = robot.decide()
    assert fields(decision)["reason"] == f"refused input: {NONE_YET}"
    assert robot.harness.velocity == (0.0, 0.0)
    robot.publish(wall_map())
    (decision,) = robot.decide()
    assert "the way through the map" in fields(decision)["reason"]


def test_a_map_in_another_frame_is_refused_by_name(graph: Graph) -> None:
    robot = Robot(graph)
    robot.publish(wall_map("map"))
    assert robot.node.missing() == (
        "no map yet: map is in frame 'map', not 'odom', and no tf is read; set the map server's "
        "frame_id to 'odom' if the robot starts at the map's origin"
    )
    assert refused(robot) == {"map: frame": 1}
    assert robot.decide() == []
    robot.publish(wall_map())
    assert len(robot.decide()) == 1


def test_the_same_map_again_is_fine_and_another_one_is_refused(graph: Graph) -> None:
    robot = Robot(graph)
    robot.publish(wall_map())
    robot.decide()
    first = robot.node.path_planner.inner._known_map  # type: ignore[attr-defined]
    robot.publish(wall_map())
    assert refused(robot) == {}
    robot.publish(wall_map(x=3.0))
    assert refused(robot) == {"map: value": 1}
    assert "restart the planner, or clean it up" in robot.node._refused_inputs.last
    assert robot.node.missing() == "", "it drives on with the first"
    assert len(robot.decide()) == 1
    assert robot.node.path_planner.inner._known_map is first  # type: ignore[attr-defined]


def test_the_map_stays_after_a_reset_of_the_planner(graph: Graph) -> None:
    robot = Robot(graph)
    robot.publish(wall_map())
    robot.node.path_planner.reset()
    (decision,) = robot.decide()
    assert "the way through the map" in fields(decision)["reason"]


@pytest.mark.parametrize(
    "parameters", [{"known_map": False}, {"perception": "sectors"}, {"method": "paper"}]
)
def test_without_need_of_a_map_it_is_not_subscribed_to(
    parameters: dict[str, Any], graph: Graph
) -> None:
    robot = Robot(graph, **{"perception": "auto"} | parameters)
    assert graph.probe.count_subscribers("/map") == 0
    assert robot.node.missing() == ""


def test_it_may_be_switched_on_and_off(graph: Graph) -> None:
    robot = Robot(graph, known_map=False)
    assert graph.set_parameter("planner", "known_map", True) == ""
    assert robot.node.missing() == NONE_YET
    robot.publish(wall_map())
    (decision,) = robot.decide()
    assert "the way through the map" in fields(decision)["reason"]
    assert graph.set_parameter("planner", "known_map", False) == ""
    (decision,) = robot.decide()
    assert "map" not in fields(decision)["reason"]
