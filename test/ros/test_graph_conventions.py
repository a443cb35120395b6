# SPDX-License-Identifier: Apache-2.0
"""The graph as ROS tools discover it: names, types, QoS, services, parameters, namespaces."""

from collections import Counter
from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_stamped_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import NODES, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run

# The topics: name, type, writers, readers (besides the recorder), latched.
TABLE = [
    ("/clock", "rosgraph_msgs/msg/Clock", ["world_sim"], [], False),
    ("/odom", "nav_msgs/msg/Odometry", ["world_sim"], ["virtual_sensor", "planner"], False),
    ("/obstacles", "geometry_msgs/msg/PoseArray", ["world_sim"], ["virtual_sensor"], False),
    ("/sectors", "sensor_msgs/msg/LaserScan", ["virtual_sensor"], ["planner"], False),
    ("/sensory_vector", "std_msgs/msg/UInt8MultiArray", ["virtual_sensor"], [], False),
    ("/goal_pose", "geometry_msgs/msg/PoseStamped", ["world_sim"], ["planner"], True),
    ("/waypoints", "nav_msgs/msg/Path", [], ["planner"], False),
    (
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        ["planner", "virtual_sensor", "world_sim"],
        [],
        False,
    ),
    ("/goal_step", "geometry_msgs/msg/PoseStamped", ["planner"], ["world_sim"], False),
    ("/plan", "nav_msgs/msg/Path", ["planner"], [], False),
    ("/trail", "nav_msgs/msg/Path", ["world_sim"], [], False),
    ("/cmd_vel", "geometry_msgs/msg/Twist", ["planner"], ["world_sim"], False),
    ("/planner/decision", "diagnostic_msgs/msg/DiagnosticArray", ["planner"], [], False),
    ("/local_map", "nav_msgs/msg/OccupancyGrid", ["planner"], [], True),
    ("/outcome", "diagnostic_msgs/msg/DiagnosticStatus", ["world_sim"], [], True),
    *(
        (f"/{node}/parameters", "std_msgs/msg/String", [node], [], True)
        for node in ("world_sim", "virtual_sensor", "planner")
    ),
    ("/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", [], ["world_sim"], False),
    ("/markers", "visualization_msgs/msg/MarkerArray", ["planner", "world_sim"], [], False),
    # Only the recorder subscribes: the paper's robot has neither a lidar nor odometry noise, and
    # its planner no map.
    ("/map", "nav_msgs/msg/OccupancyGrid", [], [], True),
    ("/scan", "sensor_msgs/msg/LaserScan", [], [], False),
    ("/ground_truth", "nav_msgs/msg/Odometry", [], [], False),
]
RCLPYS_OWN = {"/parameter_events", "/rosout", "/planner/transition_event"}
ABSOLUTE = {"/clock", "/diagnostics"}  # shared by all namespaces
SERVICES = {
    "/world_sim/pause": "std_srvs/srv/SetBool",
    "/world_sim/step": "std_srvs/srv/Trigger",
    "/world_sim/reset": "std_srvs/srv/Trigger",
    **{f"/{name}/ready": "std_srvs/srv/Trigger" for name in (*NODES, "recorder")},
    "/planner/cancel": "std_srvs/srv/Trigger",
    "/planner/change_state": "lifecycle_msgs/srv/ChangeState",
    "/planner/get_state": "lifecycle_msgs/srv/GetState",
    "/planner/get_available_states": "lifecycle_msgs/srv/GetAvailableStates",
    "/planner/get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "/planner/get_transition_graph": "lifecycle_msgs/srv/GetAvailableTransitions",
}


def start_all(graph: Graph, bag: Any, **options: Any) -> dict[str, Any]:
    """The graph as the launcher starts it, for case study 1."""
    parameters = node_parameters(RunConfig(scenario=load_scenario("case1")), (*NODES, "recorder"))
    recorder = {"output": str(bag), "sim_time": True, "nodes": ",".join(NODES)}
    kinds: dict[str, Any] = {
        "recorder": Recorder,
        "world_sim": WorldSim,
        "virtual_sensor": VirtualSensor,
        "planner": PlannerNode,
    }
    parameters["recorder"] = recorder
    return {name: graph.start(kind, parameters[name], **options) for name, kind in kinds.items()}


@pytest.fixture
def nodes(graph: Graph, tmp_path: Any) -> dict[str, Any]:
    """All four nodes, not yet ticking."""
    started = start_all(graph, tmp_path / "bag")
    graph.until(lambda: not any(node.missing() for node in started.values()))
    return started


def test_topics_have_the_names_and_types_of_the_table(graph: Graph, nodes: dict[str, Any]) -> None:
    found = dict(graph.probe.get_topic_names_and_types())
    ours = {name: kinds for name, kinds in found.items() if name not in RCLPYS_OWN}
    assert ours == {name: [kind] for name, kind, *_ in TABLE}


@pytest.mark.parametrize(("name", "kind", "writers", "readers", "latched"), TABLE)
def test_writers_readers_and_qos(
    graph: Graph,
    nodes: dict[str, Any],
    name: str,
    kind: str,
    writers: list[str],
    readers: list[str],
    latched: bool,
) -> None:
    offered = graph.probe.get_publishers_info_by_topic(name)
    assert sorted(info.node_name for info in offered) == writers
    for info in offered:
        assert info.topic_type == kind
        assert info.qos_profile.reliability is ReliabilityPolicy.RELIABLE
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        assert info.qos_profile.durability is durability
    asked = graph.probe.get_subscriptions_info_by_topic(name)
    assert {info.node_name for info in asked} == {*readers, "recorder"}
    for reader in {info.node_name for info in asked}:
        # At least one of a node's subscriptions loses nothing.
        reliability = [i.qos_profile.reliability for i in asked if i.node_name == reader]
        assert ReliabilityPolicy.RELIABLE in reliability


def test_in_lockstep_topics_of_every_tick_have_one_subscription_per_reader(
    graph: Graph, nodes: dict[str, Any]
) -> None:
    for topic in topics.GRAPH:
        if topic.every_tick:
            name = f"/{topic.name.lstrip('/')}"
            asked = graph.probe.get_subscriptions_info_by_topic(name)
            assert set(Counter(info.node_name for info in asked).values()) == {1}, name


def test_services_have_their_names_and_types(graph: Graph, nodes: dict[str, Any]) -> None:
    found = dict(graph.probe.get_service_names_and_types())
    own = ("describe_parameters", "get_parameter", "list_parameters", "set_parameters")
    ours = {
        name: kinds[0]
        for name, kinds in found.items()
        if not any(word in name for word in own) and "type_description" not in name
    }
    assert ours == SERVICES


def test_every_parameter_has_a_description_and_a_number_has_a_range(
    graph: Graph, nodes: dict[str, Any]
) -> None:
    rclpys = {"use_sim_time", "start_type_description_service"}
    for node in nodes.values():
        names = [name for name in node.get_parameters_by_prefix("") if name not in rclpys]
        assert len(names) > 4
        for name in names:
            descriptor = node.describe_parameter(name)
            assert len(descriptor.description) > 8, name
            if isinstance(node.get_parameter(name).value, float):
                assert len(descriptor.floating_point_range) == 1, name
            if type(node.get_parameter(name).value) is int:
                assert len(descriptor.integer_range) == 1, name


def test_a_node_is_ready_when_all_its_subscribers_are_there(graph: Graph, tmp_path: Any) -> None:
    parameters = node_parameters(RunConfig(scenario=load_scenario("case1")), (*NODES, "recorder"))
    graph.start(WorldSim, parameters["world_sim"])
    response = graph.call(Trigger, "world_sim/ready")
    assert not response.success
    assert response.message == "/clock waits for recorder"
    recorder = graph.start(Recorder, {"output": str(tmp_path / "bag")})
    message = ""

    def reports(text: str) -> bool:
        nonlocal message
        message = graph.call(Trigger, "world_sim/ready").message
        return message == text

    graph.until(lambda: reports("odom waits for planner, virtual_sensor"))
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    graph.until(lambda: reports("odom waits for planner"))
    graph.start(PlannerNode, parameters["planner"])
    graph.until(lambda: reports(""))
    assert graph.call(Trigger, "world_sim/ready").success
    graph.until(lambda: graph.call(Trigger, "planner/ready").success)
    graph.stop(recorder)
    graph.until(lambda: reports("/clock waits for recorder"))


def test_a_planner_without_goal_is_not_ready(graph: Graph) -> None:
    graph.start(PlannerNode, {"wait_for": "planner", "lockstep": True})
    assert graph.call(Trigger, "planner/ready").message == "no goal_pose yet"


def test_everything_works_in_a_namespace(graph: Graph, tmp_path: Any) -> None:
    nodes = start_all(graph, tmp_path / "bag", namespace="robot1")
    graph.until(lambda: not any(node.missing() for node in nodes.values()))
    found = dict(graph.probe.get_topic_names_and_types())
    own = {*RCLPYS_OWN, "/robot1/planner/transition_event"}
    ours = {name: kinds for name, kinds in found.items() if name not in own}
    assert set(ours) == {n if n in ABSOLUTE else f"/robot1{n}" for n, *_ in TABLE}
    world = nodes["world_sim"]
    world.resume()
    graph.until(lambda: world.over, timeout_s=60.0)
    expected = run(load_scenario("case1"))
    assert world.world.tick == len(expected.ticks) - 1
    assert world.world.pose == expected.ticks[-1].pose


def test_topics_can_be_remapped(graph: Graph) -> None:
    """To the topic names of an existing robot."""
    odom: list[Any] = []
    graph.probe.create_subscription(topics.ODOM.type, "/base/pose", odom.append, topics.TICK_QOS)
    cmd_vel = graph.probe.create_publisher(topics.CMD_VEL.type, "/base/go", topics.TICK_QOS)
    remaps = ["--ros-args", "-r", "odom:=base/pose", "-r", "cmd_vel:=/base/go"]
    graph.start(WorldSim, {"lockstep": True, "answer_timeout_s": 60.0}, cli_args=remaps)
    for tick in range(1, 4):
        graph.until(lambda tick=tick: len(odom) == tick)  # type: ignore[misc]
        stamp = PlannerParams().tick_ns * tick
        graph.writer(topics.GOAL_STEP).publish(pose_stamped_msg((0.0, 0.0), stamp, "odom"))
        cmd_vel.publish(topics.CMD_VEL.type())
