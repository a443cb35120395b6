# SPDX-License-Identifier: Apache-2.0
"""Types and QoS that do not fit are named on /diagnostics, in the log and by ~/ready."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped, PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from planner_talk import GOAL, PlannerHarness, goal
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from ros_graph import Graph
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger

from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.topics import LATCHED_QOS, VIEW_QOS
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.ros.runtime.connection_check import QUERIES, ConnectionCheck

OK, WARN, ERROR = b"\0", b"\1", b"\2"
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
SCAN_SENSOR = {"source": "scan", "diagnostics_period_s": 0.05}
PLANNER = {"diagnostics_period_s": 0.05, "input_timeout_s": 0.1}
WORLD = {"diagnostics_period_s": 0.05, "start_paused": True}


@pytest.fixture
def other(graph: Graph) -> Iterator[Node]:
    """A node of another process: within one, rclpy refuses a second type on a topic."""
    context = Context()
    context.init(domain_id=graph.context.get_domain_id())
    node = Node("base", context=context, enable_rosout=False)
    yield node
    node.destroy_node()
    context.try_shutdown()
    context.destroy()


class Connections:
    """A node under test, its status "connections" and what is logged."""

    capfd: pytest.CaptureFixture[str]
    _log = ""

    def __init__(self, graph: Graph, node_type: Any, parameters: dict[str, Any]) -> None:
        self.graph = graph
        self._received = graph.collect(topics.DIAGNOSTICS)
        self.node = graph.start(node_type, parameters)
        self._name = f"{self.node.get_name()}: connections"

    def statuses(self) -> list[Any]:
        return [s for m in self._received for s in m.status if s.name == self._name]

    def named(self, level: bytes, *words: str) -> str:
        """Wait for a status of this level; all words must be in it, and in one log line."""

        def is_there() -> bool:
            return bool(self.statuses()) and self.statuses()[-1].level == level

        self.graph.until(is_there, timeout_s=10.0)
        text = str(self.statuses()[-1].message)
        assert all(word in text for word in words), text
        assert text.count("\n") == 0
        assert self.log().count(text) == 1
        return text

    def log(self) -> str:
        """All that was logged so far, by any node."""
        self._log += self.capfd.readouterr().err
        return self._log

    def stays_ok(self) -> None:
        """Check every topic of the node more than once; nothing may be named."""
        self.checked_twice()
        assert {status.level for status in self.statuses()} == {OK}
        assert "nothing arrives" not in self.log()

    def checked_twice(self) -> None:
        node: Any = self.node
        check: ConnectionCheck = node._diagnostics._publisher._connections
        for _ in range(40):
            check.check()
        assert len(check._counts) > 4
        count = len(self.statuses())
        self.graph.until(lambda: len(self.statuses()) > count + 1)

    def ready(self) -> Any:
        return self.graph.call(Trigger, f"{self.node.get_name()}/ready")


@pytest.fixture(autouse=True)
def _captured(capfd: pytest.CaptureFixture[str]) -> None:
    Connections.capfd = capfd


@pytest.mark.parametrize(
    ("stamped", "base", "remedy"),
    [
        (False, TwistStamped, "-p enable_stamped_cmd_vel:=true (launch: stamped:=true)"),
        (True, Twist, "-p enable_stamped_cmd_vel:=false (launch: stamped:=false)"),
    ],
)
def test_a_base_that_expects_the_other_twist_is_named(
    graph: Graph, other: Node, stamped: bool, base: Any, remedy: str
) -> None:
    planner = Connections(graph, PlannerNode, {**PLANNER, "enable_stamped_cmd_vel": stamped})
    assert planner.ready().success
    subscription = other.create_subscription(base, "cmd_vel", lambda _: None, 10)
    text = planner.named(ERROR, "/cmd_vel: /base subscribes to ", remedy)
    response = planner.ready()
    assert (response.success, response.message) == (False, text)
    planner.checked_twice()
    assert planner.log().count(text) == 1, "once in the log"
    other.destroy_subscription(subscription)
    graph.until(lambda: planner.statuses()[-1].level == OK)
    assert planner.ready().success


def test_a_base_that_subscribes_with_several_profiles_needs_one_that_fits(
    graph: Graph, other: Node
) -> None:
    planner = Connections(graph, PlannerNode, PLANNER)
    for profile in (LATCHED_QOS, VIEW_QOS):
        other.create_subscription(Twist, "cmd_vel", lambda _: None, profile)
    graph.until(lambda: planner.node.count_subscribers("cmd_vel") == 2)
    planner.stays_ok()


def test_world_sim_names_a_planner_that_sends_the_other_twist(graph: Graph, other: Node) -> None:
    world = Connections(graph, WorldSim, WORLD)
    other.create_publisher(TwistStamped, "cmd_vel", 10)
    world.named(ERROR, "/cmd_vel: /base publishes", "start /world_sim with", ":=true")
    assert not world.ready().success


def test_virtual_sensor_names_a_source_of_another_type(graph: Graph, other: Node) -> None:
    sensor = Connections(graph, VirtualSensor, SCAN_SENSOR)
    other.create_publisher(PointStamped, "scan", 10)
    remedy = "let both use sensor_msgs/msg/LaserScan, or remap one of them"
    sensor.named(ERROR, "/scan: /base publishes geometry_msgs/msg/PointStamped", remedy)
    assert "/scan: /base publishes" in sensor.ready().message


def qos(**policies: Any) -> QoSProfile:
    return QoSProfile(depth=10, **policies)


def publish(kind: Any, name: str) -> Callable[[Node, QoSProfile], Any]:
    return lambda other, profile: other.create_publisher(kind, name, profile)


def subscribe(kind: Any, name: str) -> Callable[[Node, QoSProfile], Any]:
    return lambda other, profile: other.create_subscription(kind, name, lambda _: None, profile)


MANUAL = qos(liveliness=LivelinessPolicy.MANUAL_BY_TOPIC)
LEASE = qos(liveliness_lease_duration=Duration(seconds=2))


@pytest.mark.parametrize(
    ("make", "profile", "words"),
    [
        (
            publish(LaserScan, "sectors"),
            BEST_EFFORT,
            "/sectors: /base publishes with QoS that does not fit /planner (best_effort for "
            "reliable): nothing arrives; let /base offer reliable",
        ),
        (
            subscribe(Twist, "cmd_vel"),
            LATCHED_QOS,
            "/cmd_vel: /base subscribes with QoS that does not fit /planner (volatile for "
            "transient_local): nothing arrives; let /base request volatile",
        ),
        (
            subscribe(Twist, "cmd_vel"),
            qos(deadline=Duration(seconds=0.5)),
            "(no deadline of 0.5 s): nothing arrives; let /base request no deadline",
        ),
        (
            subscribe(Twist, "cmd_vel"),
            MANUAL,
            "(automatic liveliness for manual): nothing arrives; let /base request automatic",
        ),
        (
            subscribe(Twist, "cmd_vel"),
            LEASE,
            "(no lease of 2 s): nothing arrives; let /base request no lease duration",
        ),
    ],
)
def test_qos_that_does_not_fit_is_named(
    graph: Graph,
    other: Node,
    make: Callable[[Node, QoSProfile], Any],
    profile: QoSProfile,
    words: str,
) -> None:
    planner = Connections(graph, PlannerNode, PLANNER)
    make(other, profile)
    planner.named(WARN, words)
    assert planner.ready().success, "only types are sure to be a fault"


def test_types_are_named_before_qos_and_the_rest_is_counted(graph: Graph, other: Node) -> None:
    planner = Connections(graph, PlannerNode, PLANNER)
    other.create_publisher(LaserScan, "sectors", BEST_EFFORT)
    other.create_publisher(PointStamped, "goal_pose", 10)

    def both() -> bool:
        last = planner.statuses()[-1:]
        return bool(last) and {v.key: v.value for v in last[0].values}["mismatches"] == "2"

    graph.until(both, timeout_s=10.0)
    status = planner.statuses()[-1]
    assert (status.level, status.message[:11]) == (ERROR, "/goal_pose:")
    assert status.message.endswith(" (and 1 more)")


def test_what_connects_raises_no_alarm(graph: Graph, other: Node, tmp_path: Any) -> None:
    """A best-effort lidar and base, latched and volatile goals, viewers, the other nodes."""
    planner = Connections(graph, PlannerNode, PLANNER)
    sensor = Connections(graph, VirtualSensor, SCAN_SENSOR)
    world = graph.start(WorldSim, WORLD)
    recorder = graph.start(Recorder, {"output": str(tmp_path / "bag")})
    for profile in (qos_profile_sensor_data, BEST_EFFORT):
        other.create_publisher(LaserScan, "scan", profile)
        other.create_publisher(Odometry, "odom", profile)
    for profile in (LATCHED_QOS, VIEW_QOS):
        other.create_publisher(PoseStamped, "goal_pose", profile)
    for name in ("cmd_vel", "odom", "sectors"):
        kind = {"cmd_vel": Twist, "odom": Odometry, "sectors": LaserScan}[name]
        other.create_subscription(kind, name, lambda _: None, BEST_EFFORT)
        other.create_subscription(
            kind, name, lambda _: None, qos(durability=DurabilityPolicy.VOLATILE)
        )
    planner.stays_ok()
    sensor.stays_ok()
    for node in (planner.node, sensor.node, world, recorder):
        graph.until(lambda node=node: not node.missing())  # type: ignore[misc]


def test_the_latched_goal_of_a_best_effort_robot_is_used_and_sound(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**PLANNER, "input_timeout_s": 60.0}, at=None)
    diagnostics = graph.collect(topics.DIAGNOSTICS)
    writer = graph.writer(topics.GOAL_POSE, qos=LATCHED_QOS)
    writer.publish(goal(*GOAL))
    graph.until(lambda: harness.node.goals.goal_queue.goal == GOAL)
    graph.until(lambda: len(diagnostics) > 3)
    assert {s.level for m in diagnostics for s in m.status if "connections" in s.name} == {OK}


def test_a_check_reads_few_topics(graph: Graph) -> None:
    """A tick must not wait for many queries of the graph, at the start of a fleet either."""
    node: Any = graph.start(PlannerNode, {})
    check = ConnectionCheck(node)
    calls: list[str] = []
    original = node.get_publishers_info_by_topic

    def counted(name: str, *more: Any) -> Any:
        calls.append(name)
        return original(name, *more)

    node.get_publishers_info_by_topic = counted
    passes = 0
    while len(check._counts) < 10 and passes < 10:
        check.check()
        passes += 1
        assert len(calls) <= passes * QUERIES
    assert len(set(calls)) == len(calls) >= 10, "each was read once"
    calls.clear()
    for _ in range(3):
        check.check()
    assert len(calls) == len(set(calls)) == 3, "nothing has changed: one at a time, in turn"
