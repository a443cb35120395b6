# SPDX-License-Identifier: Apache-2.0
"""Run the `ros2` commands that a page shows as real processes in one ROS domain."""

import json
import signal
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import yaml
from launch_standin import Node, launched
from launched_programs import INSTALLED, Program
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from planner_talk import INF, goal, odom
from rcl_interfaces.srv import DescribeParameters
from rclpy.context import Context
from ros_graph import Graph

from mfba_planner.core.errors import MfbaError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision
from mfba_planner.recording.recover import recover
from mfba_planner.ros.interface import topics

PACKAGE = "mfba_planner"
TIMEOUT_S = 60.0  # long enough for a busy machine
Words = list[str]


class Session:
    """Runs `ros2` commands one after the other; ends programs that would run twice."""

    def __init__(self, domain_id: int, cwd: Path) -> None:
        self.domain_id, self.cwd = domain_id, cwd
        self.env = {"ROS_DOMAIN_ID": str(domain_id)}
        self.running: dict[str, Program] = {}
        self.scan = "scan"  # the topic that virtual_sensor subscribes to
        self._stamp = 0

    def __enter__(self) -> "Session":
        self._open_graph()
        return self

    def __exit__(self, *_: object) -> None:
        for program in self.running.values():
            program.__exit__()
        self._close_graph()

    def _open_graph(self) -> None:
        """Open a new view of the graph: an older one can keep names of ended nodes for long."""
        self._context = Context()
        self._context.init(domain_id=self.domain_id)
        self.graph = Graph(self._context)
        self.decisions = self.graph.collect(topics.DECISION)
        self.twists = self.graph.collect(topics.CMD_VEL)
        self.odoms = self.graph.collect(topics.ODOM)
        self.health = self.graph.collect(topics.DIAGNOSTICS)

    def _close_graph(self) -> None:
        self.graph.close()
        self._context.try_shutdown()
        self._context.destroy()

    def do(self, words: Words) -> None:
        """Run one command; AssertionError if its effect is missing."""
        kind = kind_of(words)
        KINDS[kind](self, words[1 + len(kind) :])

    # ros2 run, ros2 launch

    def run(self, words: Words) -> None:
        package, program, *args = words
        assert package == PACKAGE
        if program == "replay":
            self._replay(args, bag=args[0])
            return
        self._end_if_running({program})
        self._start(program, program, args)
        if program == "virtual_sensor":
            self.scan = "scan"
        given = [args[i + 1].partition(":=") for i, word in enumerate(args) if word == "-p"]
        self._await_nodes({program: {name: yaml.safe_load(value) for name, _, value in given}})

    def launch(self, words: Words) -> None:
        package, file, *args = words
        assert package == PACKAGE
        arguments = dict(word.split(":=", 1) for word in args)
        nodes = launched(file, arguments)
        assert {node.package for node in nodes} == {PACKAGE}
        self._end_if_running({node.full_name for node in nodes})
        staying = {node.full_name: node for node in nodes if node.name != "replay"}
        for name, node in staying.items():
            self._start(name, node.executable, node.command_line(self.cwd))
        self._await_nodes({name: _final_parameters(node) for name, node in staying.items()})
        for node in named(nodes, "replay"):
            self._replay(node.command_line(self.cwd), bag=arguments["bag"])
            self.end()
        self.scan = dict(rule for node in nodes for rule in node.remappings).get("scan", "scan")

    def _start(self, name: str, program: str, args: Words) -> None:
        assert (INSTALLED / program).is_file(), f"{program}: no such executable"
        self.running[name] = Program(
            program, *args, cwd=self.cwd, more_env=self.env, installed=True
        )

    def _end_if_running(self, names: set[str]) -> None:
        if names & set(self.running):
            self.end()

    def _await_nodes(self, nodes: dict[str, dict[str, Any]]) -> None:
        """Wait until nodes are in the graph, with the expected parameters."""
        for name, expected in nodes.items():
            self._until(lambda name=name: name in self._node_names())  # type: ignore[misc]
            if expected:
                assert self.graph.parameters(name, list(expected)) == list(expected.values())

    def _node_names(self) -> set[str]:
        """Names of the nodes in the graph, with their namespaces."""
        found = self.graph.probe.get_node_names_and_namespaces()
        return {f"{namespace}/{name}".lstrip("/") for name, namespace in found}

    def _until(self, condition: Callable[[], bool]) -> None:
        def holds_now() -> bool:
            for name, program in self.running.items():
                assert program.process.poll() is None, f"{name}: {program.end()} {program.stderr}"
            return condition()

        self.graph.until(holds_now, TIMEOUT_S)

    def _replay(self, args: Words, bag: str) -> None:
        """Replay to the end; a planner in lockstep must repeat the recorded decisions."""
        received = self.decisions
        decides = "planner" in self.running
        if decides:
            assert self.graph.parameters("planner", ["lockstep"]) == [True]
            (reader,) = (s for s in self.graph.probe.subscriptions if "decision" in s.topic_name)
            self._until(lambda: reader.get_publisher_count() > 0)
            received.clear()
        with Program("replay", *args, cwd=self.cwd, more_env=self.env, installed=True) as replay:
            self.graph.until(lambda: replay.process.poll() is not None, TIMEOUT_S)
            code = replay.end()
            assert (code, replay.stderr) == (0, ""), replay.stderr
            assert "played" in replay.stdout
        if decides:
            with BagReader(self.cwd / bag) as recording:
                decoded = recording.decoded([f"/{topics.DECISION.name}"])
                recorded = [decision(message.message, ()) for message in decoded]
            self._until(lambda: len(received) >= len(recorded))
            assert [decision(message, ()) for message in received] == recorded

    # Ctrl-C

    def end(self) -> None:
        """End all programs, the last one first; each must exit without an error."""
        while self.running:
            name, program = self.running.popitem()
            # A node of this name in the graph can be one that ended before.
            program.wait_for_signal_handlers()
            program.process.send_signal(signal.SIGINT)
            with program:
                code = program.end()
                assert (code, program.stderr) == (0, ""), f"{name}: {code} {program.stderr}"
        self._close_graph()
        self._open_graph()

    # Commands that call nodes

    def _ensure_running(self, node: str) -> str:
        """Start a node if it does not run; return its name."""
        name = node.strip("/").split("/")[0]
        if name not in self.running:
            self.run([PACKAGE, name])
        return name

    def set_parameter(self, words: Words) -> None:
        name, parameter, text = words
        value = yaml.safe_load(text)
        assert self.graph.set_parameter(self._ensure_running(name), parameter, value) == ""
        assert self.graph.parameters(name, [parameter]) == [value]

    def describe_parameter(self, words: Words) -> None:
        name, parameter = words
        self._ensure_running(name)
        request = DescribeParameters.Request(names=[parameter])
        response = self.graph.call(DescribeParameters, f"{name}/describe_parameters", request)
        assert [d.name for d in response.descriptors if d.description] == [parameter]

    def set_state(self, words: Words) -> None:
        name, label = words
        self._ensure_running(name)
        request = ChangeState.Request(transition=Transition(label=label))
        assert self.graph.call(ChangeState, f"{name}/change_state", request).success

    def get_state(self, words: Words) -> None:
        (name,) = words
        self._ensure_running(name)
        assert self.graph.call(GetState, f"{name}/get_state").current_state.label == "active"

    def publish(self, words: Words) -> None:
        once, name, kind, text = words
        assert once == "--once"
        self._ensure_running("planner")
        message = filled(_type(kind)(), yaml.safe_load(text))
        publisher = self.graph.probe.create_publisher(type(message), name, 10)
        self._until(lambda: publisher.get_subscription_count() > 0)
        publisher.publish(message)
        segments = f"1 of {len(message.poses)}"
        self._until(lambda: segments in (v.value for s in self._driving() for v in s.values))

    def _driving(self) -> list[Any]:
        return [s for m in self.health for s in m.status if s.name == "planner: driving"]

    def call(self, words: Words) -> None:
        name, kind = words
        self._ensure_running(name)
        assert self.graph.call(_type(kind), name).success

    # Check

    def check(self) -> None:
        """If the graph is complete, the robot must move."""
        if "world_sim" in self.running:
            planners = [name for name in self.running if name.endswith("planner")]
            least = 3 if planners else 0  # without commands a robot stays where it is
            for name in planners or self._robots():
                odoms = self._odoms_of(name.rpartition("/")[0])
                self._until(lambda received=odoms: len({_position(m) for m in received}) > least)  # type: ignore[misc]
        elif {"virtual_sensor", "planner"} <= set(self.running):
            self._check_motion_on_a_scan()
        elif "planner" in self.running:
            assert self.graph.call(GetState, "planner/get_state").current_state.label == "active"

    def _robots(self) -> list[str]:
        """Odometry topics, one per robot."""
        ends = f"/{topics.ODOM.name}"
        self._until(lambda: any(n.endswith(ends) for n in self._topics_of_world_sim()))
        return [n.lstrip("/") for n in self._topics_of_world_sim() if n.endswith(ends)]

    def _topics_of_world_sim(self) -> list[str]:
        found = self.graph.probe.get_publisher_names_and_types_by_node("world_sim", "/")
        return [name for name, _ in found]

    def _odoms_of(self, robot: str) -> list[Any]:
        if not robot:
            return self.odoms
        return self.graph.collect(replace(topics.ODOM, name=f"{robot}/{topics.ODOM.name}"))

    def _check_motion_on_a_scan(self) -> None:
        odoms, goals = self.graph.writer(topics.ODOM), self.graph.writer(topics.GOAL_POSE)
        scans = self.graph.probe.create_publisher(topics.SCAN.type, self.scan, topics.SCAN.qos)
        goals.publish(goal(10.0, 0.0))
        self.twists.clear()

        def moves() -> bool:
            self._stamp += 1
            message = odom(self._stamp)
            odoms.publish(message)
            scan = topics.SCAN.type(range_min=0.1, range_max=10.0, ranges=[INF] * 360)
            scan.header.stamp, scan.angle_increment = message.header.stamp, 0.0174533
            scans.publish(scan)
            return any(twist.linear.x > 0.0 for twist in self.twists)

        self._until(moves)
        for publisher in (odoms, goals, scans):
            self.graph.probe.destroy_publisher(publisher)


KINDS: dict[tuple[str, ...], Callable[[Session, Words], None]] = {
    ("run",): Session.run,
    ("launch",): Session.launch,
    ("param", "set"): Session.set_parameter,
    ("param", "describe"): Session.describe_parameter,
    ("lifecycle", "set"): Session.set_state,
    ("lifecycle", "get"): Session.get_state,
    ("topic", "pub"): Session.publish,
    ("service", "call"): Session.call,
}


def kind_of(words: Words) -> tuple[str, ...]:
    """The kind of a command; AssertionError for an unknown one."""
    for length in (1, 2):
        if tuple(words[1 : 1 + length]) in KINDS:
            return tuple(words[1 : 1 + length])
    raise AssertionError(f"{' '.join(words)}: no test runs it; add its kind to KINDS")


def named(nodes: list[Node], name: str) -> list[Node]:
    """The nodes of this name."""
    return [node for node in nodes if node.name == name]


def _final_parameters(node: Node) -> dict[str, Any]:
    """The parameters that a node must have after launch."""
    expected: dict[str, Any] = {}
    for source in node.parameters:
        if isinstance(source, dict):
            expected |= {name: getattr(value, "value", value) for name, value in source.items()}
        else:
            content = yaml.safe_load(Path(source).read_text(encoding="utf-8"))
            expected |= content.get(f"/**/{node.name}", {}).get("ros__parameters", {})
    return {name: value for name, value in expected.items() if not _is_json_object(value)}


def _is_json_object(value: Any) -> bool:
    """JSON text of an object, which a node may format differently."""
    return isinstance(value, str) and value.startswith("{") and json.loads(value) is not None


def _type(name: str) -> Any:
    package, kind, type_name = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), type_name)


def filled(message: Any, content: dict[str, Any]) -> Any:
    """The message with fields from a YAML text, as in `ros2 topic pub`."""
    kinds = message.get_fields_and_field_types()
    for name, value in content.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        elif isinstance(value, list):
            package, kind = kinds[name].removeprefix("sequence<").rstrip(">").split("/")
            setattr(message, name, [filled(_type(f"{package}/msg/{kind}")(), v) for v in value])
        else:
            setattr(message, name, value)
    return message


def _position(message: Any) -> tuple[float, float]:
    return (message.pose.pose.position.x, message.pose.pose.position.y)


def holds(bag: Path, topic: str, copy: Path) -> bool:
    """Whether a bag that is still being recorded already has messages of a topic."""
    try:
        recover(bag, copy)
    except MfbaError:  # empty so far
        return False
    with BagReader(copy) as reader:
        return topic in reader.topics and reader.topics[topic].message_count > 0
