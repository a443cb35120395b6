# SPDX-License-Identifier: Apache-2.0
"""The same wall by lidars with several extrinsics: the same decisions, live and from a bag."""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_to_graph import (
    PAPER,
    PLANNERS,
    PREDICTIVE,
    RADIUS_M,
    SEED,
    TICKS,
    check_alike,
    from_bag,
    live,
    play,
)  # fmt: skip
from foreign_bags import START_NS, TICK_NS, Recorded, goal, odom, scan, transform, write
from geometry_msgs.msg import TransformStamped, Vector3
from mounted_lidars import MOUNTED, wall_ranges
from ros_graph import Graph
from std_msgs.msg import Header

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.from_messages import decision, decision_field, sector_ranges
from mfba_planner.recording.planar_poses import lidar_extrinsics
from mfba_planner.recording.transform_tree import TransformTree
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import odometry_msg, scan_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.verification.verify_bag import verify

EACH = pytest.mark.parametrize("name", MOUNTED)


def recording(mounted: LidarExtrinsics, begin_ns: int = START_NS) -> list[Recorded]:
    """A robot that creeps along the wall to its left, to a goal behind it."""
    x, y, yaw, flipped = mounted
    mount = transform(begin_ns, x=x, y=y, yaw=yaw, roll=math.pi if flipped else 0.0)
    found = [mount, goal(begin_ns, 1.0, 5.0)]
    for k in range(1, TICKS + 1):
        stamp = begin_ns + k * TICK_NS
        found += [odom(stamp, yaw=0.4), scan(stamp, wall_ranges(mounted).tolist(), range_min=0.1)]
    return found


@EACH
@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_by_parameters(graph: Graph, name: str, planner: PlannerParams, tmp_path: Path) -> None:
    mounted = MOUNTED[name]
    bag = write(tmp_path / "bag", recording(mounted)[1:])
    found = [one for _, one in live(graph, bag, planner, **mounted.parameters)]
    assert tuple(found) == from_bag(bag, planner, extrinsics=mounted)
    straight = write(tmp_path / "straight", recording(MOUNTED["straight"]))
    check_alike(found, from_bag(straight, planner), planner)


@EACH
@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_by_tf(
    graph: Graph, name: str, planner: PlannerParams, tmp_path: Path, with_tf: Any
) -> None:
    bag = write(tmp_path / "bag", recording(MOUNTED[name]))
    found = live(graph, bag, planner)
    assert tuple(one for _, one in found) == from_bag(bag, planner)
    straight = write(tmp_path / "straight", recording(MOUNTED["straight"]))
    check_alike([one for _, one in found], from_bag(straight, planner), planner)
    recorded = [decision_field(message, "scan_extrinsics") for message, _ in found]
    assert all(recorded) == (planner is PREDICTIVE)


def test_a_recording_of_the_nodes_verifies(graph: Graph, tmp_path: Path, with_tf: Any) -> None:
    """Where the lidar is stands in the decisions: a recorder need not know tf2_msgs."""
    recorder = graph.start(
        Recorder, {"output": str(tmp_path / "run"), "nodes": "planner, virtual_sensor"}
    )
    begin_ns = time.time_ns() - (TICKS + 1) * TICK_NS
    bag = write(tmp_path / "bag", recording(MOUNTED["all"], begin_ns))
    play(graph, bag, PREDICTIVE, lockstep=False, input_timeout_s=60.0)
    graph.settle()
    graph.stop(recorder)
    report = verify(tmp_path / "run")
    assert report.is_identical, (report.faults, report.divergence)
    assert len([one for one in report.recorded if one.perception == "scan"]) == TICKS
    assert report.setup.scenario.robot.lidar.extrinsics == pytest.approx(MOUNTED["all"])


def static(with_tf: Any, child: str, parent: str = "base_link", **place: float) -> Any:
    stamped = TransformStamped(header=Header(frame_id=parent), child_frame_id=child)
    stamped.transform.translation = Vector3(**place)
    return with_tf(transforms=[stamped])


class Sensor:
    """A virtual sensor in lockstep, and what it made of the last scan."""

    def __init__(self, graph: Graph, **parameters: Any) -> None:
        self.graph, self._stamp = graph, 0
        self._odom, self._scan = graph.writer(topics.ODOM), graph.writer(topics.SCAN)
        self._sectors = graph.collect(topics.SECTORS)
        given = {"source": "scan", "lockstep": True, "robot_radius_m": RADIUS_M, **parameters}
        self.node = graph.start(VirtualSensor, given)
        graph.settle()  # what tf said before is known first

    def nearest(self) -> float:
        """The nearest range by a beam that meets something 0.9 m ahead of the lidar."""
        self._stamp += 1
        ranges = [0.9] + [math.inf] * 359
        scan = Scan(
            ranges_m=np.array(ranges), angle_min_rad=0.0, angle_increment_rad=math.radians(1.0),
            range_min_m=0.1, range_max_m=3.5,
        )  # fmt: skip
        self._odom.publish(
            odometry_msg(Pose2D(0.0, 0.0), (0.0, 0.0), self._stamp, "odom", "base_link")
        )
        self._scan.publish(scan_msg(scan, self._stamp, "laser"))
        self.graph.settle()
        return min(self._sectors[-1].ranges)

    @property
    def refusal(self) -> str:
        return self.node._refused_inputs.last


def test_scans_are_refused_until_tf_tells_where_the_lidar_is(graph: Graph, with_tf: Any) -> None:
    tf, tf_static = (graph.writer(topic) for topic in topics.TRANSFORMS)
    sensor = Sensor(graph)
    tf.publish(static(with_tf, "base_link", "odom"))
    assert math.isnan(sensor.nearest())
    assert sensor.refusal == (
        "scan: frame 'laser': no /tf_static or /tf gives its pose in 'base_link'; publish it, or "
        "set scan_x, scan_y, scan_yaw, scan_flipped"
    )
    tf_static.publish(static(with_tf, "laser", x=0.1))
    graph.settle()
    assert sensor.nearest() == pytest.approx(0.7)


def test_a_robot_without_tf_has_its_lidar_at_the_centre(graph: Graph, with_tf: Any) -> None:
    assert Sensor(graph).nearest() == pytest.approx(0.6)


def test_parameters_that_are_set_count_more_than_tf(graph: Graph, with_tf: Any) -> None:
    graph.writer(topics.TRANSFORMS[1]).publish(static(with_tf, "laser", x=0.1))
    assert Sensor(graph, scan_x=-0.1).nearest() == pytest.approx(0.5)


def test_tf_may_be_required_or_left_alone(graph: Graph, with_tf: Any) -> None:
    graph.writer(topics.TRANSFORMS[1]).publish(static(with_tf, "laser", x=0.1))
    by_parameters = Sensor(graph, scan_extrinsics="parameters")
    assert by_parameters.nearest() == pytest.approx(0.6)
    graph.stop(by_parameters.node)
    assert Sensor(graph, scan_extrinsics="tf", scan_x=-0.1).nearest() == pytest.approx(0.7)


def test_tf_that_is_required_needs_tf2_msgs(graph: Graph) -> None:
    for kind in (VirtualSensor, PlannerNode):
        with pytest.raises(ConfigError, match="scan_extrinsics='tf': tf2_msgs is not installed"):
            graph.start(kind, {"scan_extrinsics": "tf"})


def test_world_sim_publishes_where_its_lidar_is(graph: Graph, with_tf: Any) -> None:
    received = graph.collect(topics.TRANSFORMS[1])
    lidar = {"beams": 12, "x_m": 0.2, "y_m": -0.1, "yaw_rad": 1.0, "flipped": True}
    parameters = {f"robot.lidar.{name}": value for name, value in lidar.items()}
    graph.start(WorldSim, {"scenario": "case2", **parameters})
    graph.until(lambda: bool(received))
    tree = TransformTree()
    tree.add(received[0])
    found = lidar_extrinsics(tree, "base_scan", "base_link")
    assert found == pytest.approx((0.2, -0.1, 1.0, True))


def test_a_simulated_run_does_not_depend_on_tf(graph: Graph, with_tf: Any) -> None:
    """A transform that is wrong changes nothing: the nodes of a run have parameters."""
    robot = Robot(lidar=Lidar(beams=360))  # at the centre, as by default
    scenario = replace(load_scenario("case1"), start_m=(9.4, 4.2), goal_m=(9.6, 8.0), robot=robot)
    config = RunConfig(scenario=scenario, planner=PREDICTIVE, seed=SEED)
    parameters = node_parameters(config, peers=())
    decisions, sectors = graph.collect(topics.DECISION), graph.collect(topics.SECTORS)
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    node = graph.start(PlannerNode, parameters["planner"])
    world = graph.start(WorldSim, parameters["world_sim"])
    graph.writer(topics.TRANSFORMS[1]).publish(static(with_tf, "base_scan", x=0.5))
    graph.until(lambda: node.goals.goal_queue.goal is not None)
    world.resume()
    graph.until(lambda: world.over)
    graph.settle()
    found = [decision(message, sector_ranges(ring)) for message, ring in zip(decisions, sectors)]
    expected = simulate(scenario, planner=PREDICTIVE, sensor=SensorParams(), seed=SEED)
    assert tuple(found) == expected.ticks


@pytest.mark.parametrize("first", [0, 5])
def test_a_goal_in_map_is_transformed(
    graph: Graph, first: int, tmp_path: Path, with_tf: Any
) -> None:
    """Live and from a bag. Its transform is there from a tick on; until then there is no goal."""
    found = [message for message in recording(MOUNTED["straight"]) if "goal" not in message.topic]
    found.append(goal(START_NS + 1, 5.0, 0.0, frame="map"))
    for k in range(first, TICKS):
        stamp = START_NS + k * TICK_NS + 2
        turned = transform(stamp, "map", "odom", x=10.0, yaw=math.pi / 2, topic="/tf")
        found.append(turned)
    bag = write(tmp_path / "bag", sorted(found, key=lambda message: message.time_ns))
    expected = from_bag(bag, PAPER)
    assert [one.goal for one in expected[:first]] == [None] * first
    # In lockstep the node waits for its first goal.
    assert tuple(one for _, one in live(graph, bag, PAPER)) == expected[first:]
    assert {one.goal for one in expected[first:]} == {expected[-1].goal}
    assert expected[-1].goal == pytest.approx((0.0, 5.0))
