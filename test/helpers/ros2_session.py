# SPDX-License-Identifier: Apache-2.0
"""`ros2` commands that a page shows, done as its reader would: real processes, in one domain."""

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
SOON_S = 60.0  # a busy machine is not a failure
Words = list[str]


class Session:
    """A reader who types `ros2` commands, one after the other; ends what would be there twice."""

    def __init__(self, domain_id: int, cwd: Path) -> None:
        self.domain_id, self.cwd = domain_id, cwd
        self.env = {"ROS_DOMAIN_ID": str(domain_id)}
        self.running: dict[str, Program] = {}
        self.scan = "scan"  # where virtual_sensor hears it
        self._stamp = 0

    def __enter__(self) -> "Session":
        self._look()
        return self

    def __exit__(self, *_: object) -> None:
        for program in self.running.values():
            program.__exit__()
        self._look_away()

    def _look(self) -> None:
        """See the graph as it is now: a name that has gone can stay in an older view for long."""
        self._context = Context()
        self._context.init(domain_id=self.domain_id)
        self.graph = Graph(self._context)
        self.decisions = self.graph.collect(topics.DECISION)
        self.twists = self.graph.collect(topics.CMD_VEL)
        self.odoms = self.graph.collect(topics.ODOM)
        self.health = self.graph.collect(topics.DIAGNOSTICS)

    def _look_away(self) -> None:
        self.graph.close()
        self._context.try_shutdown()
        self._context.destroy()

    def do(self, words: Words) -> None:
        """Do one command; AssertionError where it does not do what it says."""
        kind = kind_of(words)
        KINDS[kind](self, words[1 + len(kind) :])

    # ros2 run, ros2 launch

    def run(self, words: Words) -> None:
        package, program, *args = words
        assert package == PACKAGE
        if program == "replay":
            self._replay(args, bag=args[0])
            return
        self._make_way({program})
        self._start(program, program, args)
        if program == "virtual_sensor":
            self.scan = "scan"
        told = [args[i + 1].partition(":=") for i, word in enumerate(args) if word == "-p"]
        self._await({program: {name: yaml.safe_load(value) for name, _, value in told}})

    def launch(self, words: Words) -> None:
        package, file, *args = words
        assert package == PACKAGE
        given = dict(word.split(":=", 1) for word in args)
        nodes = launched(file, given)
        assert {node.package for node in nodes} == {PACKAGE}
        self._make_way({node.full_name for node in nodes})
        staying = {node.full_name: node for node in nodes if node.name != "replay"}
        for name, node in staying.items():
            self._start(name, node.executable, node.command_line(self.cwd))
        self._await({name: _last_word(node) for name, node in staying.items()})
        for node in set_apart(nodes, "replay"):
            self._replay(node.command_line(self.cwd), bag=given["bag"])
            self.end()
        self.scan = dict(rule for node in nodes for rule in node.remappings).get("scan", "scan")

    def _start(self, name: str, program: str, args: Words) -> None:
        assert (INSTALLED / program).is_file(), f"{program}: no such executable"
        self.running[name] = Program(
            program, *args, cwd=self.cwd, more_env=self.env, installed=True
        )

    def _make_way(self, names: set[str]) -> None:
        if names & set(self.running):
            self.end()

    def _await(self, nodes: dict[str, dict[str, Any]]) -> None:
        """Wait until nodes are seen in the graph, with the parameters they were told."""
        for name, told in nodes.items():
            self._until(lambda name=name: name in self._seen())  # type: ignore[misc]
            if told:
                assert self.graph.parameters(name, list(told)) == list(told.values())

    def _seen(self) -> set[str]:
        """The nodes in the graph, by their names below their namespaces."""
        found = self.graph.probe.get_node_names_and_namespaces()
        return {f"{namespace}/{name}".lstrip("/") for name, namespace in found}

    def _until(self, condition: Callable[[], bool]) -> None:
        def so() -> bool:
            for name, program in self.running.items():
                assert program.process.poll() is None, f"{name}: {program.end()} {program.stderr}"
            return condition()

        self.graph.until(so, SOON_S)

    def _replay(self, args: Words, bag: str) -> None:
        """To its end; a planner in lockstep decides what was recorded."""
        heard = self.decisions
        decides = "planner" in self.running
        if decides:
            assert self.graph.parameters("planner", ["lockstep"]) == [True]
            (reader,) = (s for s in self.graph.probe.subscriptions if "decision" in s.topic_name)
            self._until(lambda: reader.get_publisher_count() > 0)
            heard.clear()
        with Program("replay", *args, cwd=self.cwd, more_env=self.env, installed=True) as replay:
            self.graph.until(lambda: replay.process.poll() is not None, SOON_S)
            assert (replay.end(), replay.stderr) == (0, "")
            assert "played" in replay.stdout
        if decides:
            with BagReader(self.cwd / bag) as recording:
                decoded = recording.decoded([f"/{topics.DECISION.name}"])
                recorded = [decision(message.message, ()) for message in decoded]
            self._until(lambda: len(heard) >= len(recorded))
            assert [decision(message, ()) for message in heard] == recorded

    # Ctrl-C

    def end(self) -> None:
        """End everything, the last one first; each must end well."""
        while self.running:
            name, program = self.running.popitem()
            program.process.send_signal(signal.SIGINT)
            with program:
                code = program.end()
                assert (code, program.stderr) == (0, ""), f"{name}: {code} {program.stderr}"
        self._look_away()
        self._look()

    # What talks to nodes

    def _talk_to(self, node: str) -> str:
        """Start a node by itself if it is not there: there must be somebody to talk to."""
        name = node.strip("/").split("/")[0]
        if name not in self.running:
            self.run([PACKAGE, name])
        return name

    def set_parameter(self, words: Words) -> None:
        name, parameter, text = words
        value = yaml.safe_load(text)
        assert self.graph.set_parameter(self._talk_to(name), parameter, value) == ""
        assert self.graph.parameters(name, [parameter]) == [value]

    def describe_parameter(self, words: Words) -> None:
        name, parameter = words
        self._talk_to(name)
        request = DescribeParameters.Request(names=[parameter])
        answer = self.graph.call(DescribeParameters, f"{name}/describe_parameters", request)
        assert [d.name for d in answer.descriptors if d.description] == [parameter]

    def set_state(self, words: Words) -> None:
        name, label = words
        self._talk_to(name)
        request = ChangeState.Request(transition=Transition(label=label))
        assert self.graph.call(ChangeState, f"{name}/change_state", request).success

    def get_state(self, words: Words) -> None:
        (name,) = words
        self._talk_to(name)
        assert self.graph.call(GetState, f"{name}/get_state").current_state.label == "active"

    def publish(self, words: Words) -> None:
        once, name, kind, text = words
        assert once == "--once"
        self._talk_to("planner")
        message = filled(_type(kind)(), yaml.safe_load(text))
        writer = self.graph.probe.create_publisher(type(message), name, 10)
        self._until(lambda: writer.get_subscription_count() > 0)
        writer.publish(message)
        segments = f"1 of {len(message.poses)}"
        self._until(lambda: segments in (v.value for s in self._driving() for v in s.values))

    def _driving(self) -> list[Any]:
        return [s for m in self.health for s in m.status if s.name == "planner: driving"]

    def call(self, words: Words) -> None:
        name, kind = words
        self._talk_to(name)
        assert self.graph.call(_type(kind), name).success

    # What it is all for

    def prove(self) -> None:
        """Where the graph is complete, the robot drives."""
        if "world_sim" in self.running:
            planners = [name for name in self.running if name.endswith("planner")]
            least = 3 if planners else 0  # who is told nothing stays where it is
            for name in planners or self._robots():
                odoms = self._odoms_of(name.rpartition("/")[0])
                self._until(lambda heard=odoms: len({_place(m) for m in heard}) > least)  # type: ignore[misc]
        elif {"virtual_sensor", "planner"} <= set(self.running):
            self._drive_on_a_scan()
        elif "planner" in self.running:
            assert self.graph.call(GetState, "planner/get_state").current_state.label == "active"

    def _robots(self) -> list[str]:
        """The topics of odometry there are, one for each robot."""
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

    def _drive_on_a_scan(self) -> None:
        odoms, goals = self.graph.writer(topics.ODOM), self.graph.writer(topics.GOAL_POSE)
        scans = self.graph.probe.create_publisher(topics.SCAN.type, self.scan, topics.SCAN.qos)
        goals.publish(goal(10.0, 0.0))
        self.twists.clear()

        def moves() -> bool:
            self._stamp += 1
            here = odom(self._stamp)
            odoms.publish(here)
            scan = topics.SCAN.type(range_min=0.1, range_max=10.0, ranges=[INF] * 360)
            scan.header.stamp, scan.angle_increment = here.header.stamp, 0.0174533
            scans.publish(scan)
            return any(twist.linear.x > 0.0 for twist in self.twists)

        self._until(moves)
        for made in (odoms, goals, scans):
            self.graph.probe.destroy_publisher(made)


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
    """Which kind of command it is; AssertionError for one that nothing here can do."""
    for length in (1, 2):
        if tuple(words[1 : 1 + length]) in KINDS:
            return tuple(words[1 : 1 + length])
    raise AssertionError(f"{' '.join(words)}: nobody runs it; add its kind to KINDS")


def set_apart(nodes: list[Node], name: str) -> list[Node]:
    """Those of this name."""
    return [node for node in nodes if node.name == name]


def _last_word(node: Node) -> dict[str, Any]:
    """The parameters that a node must end up with."""
    told: dict[str, Any] = {}
    for part in node.parameters:
        if isinstance(part, dict):
            told |= {name: getattr(value, "value", value) for name, value in part.items()}
        else:
            content = yaml.safe_load(Path(part).read_text(encoding="utf-8"))
            told |= content.get(f"/**/{node.name}", {}).get("ros__parameters", {})
    return {name: value for name, value in told.items() if not _is_text_of(value)}


def _is_text_of(value: Any) -> bool:
    """JSON text, which a node may write another way."""
    return isinstance(value, str) and value.startswith("{") and json.loads(value) is not None


def _type(name: str) -> Any:
    package, kind, what = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), what)


def filled(message: Any, content: dict[str, Any]) -> Any:
    """The message with what a YAML text says of it, as `ros2 topic pub` understands it."""
    kinds = message.get_fields_and_field_types()
    for name, value in content.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        elif isinstance(value, list):
            package, what = kinds[name].removeprefix("sequence<").rstrip(">").split("/")
            setattr(message, name, [filled(_type(f"{package}/msg/{what}")(), v) for v in value])
        else:
            setattr(message, name, value)
    return message


def _place(message: Any) -> tuple[float, float]:
    return (message.pose.pose.position.x, message.pose.pose.position.y)


def holds(bag: Path, topic: str, scratch: Path) -> bool:
    """Whether a bag that is still being recorded holds messages of a topic yet."""
    try:
        recover(bag, scratch)
    except MfbaError:  # nothing at all so far
        return False
    with BagReader(scratch) as reader:
        return topic in reader.topics and reader.topics[topic].message_count > 0
