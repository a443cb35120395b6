# SPDX-License-Identifier: Apache-2.0
"""One drive through the real graph: physics, virtual_sensor, planner and recorder as processes.

Run: python examples/mujoco_robot/run.py [--world K] [--out DIR] [--film] [--real-time]
Writes DIR/bag, DIR/world.yaml (the same world for `mfba sim`), DIR/robot.json (what the engine has
counted), DIR/log.txt and with --film DIR/film.webp. The exit code is 0 if the robot has arrived
without contact and every decision of the bag is verified.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import yaml
from crowded_room import PEOPLE, TIME_LIMIT_S, Room, Walk, draw_room
from film import load_frames, write_film
from physics_world import Lifted, PhysicsWorld
from planner_in_process import planner_params, robot_rng
from rclpy.context import Context
from std_srvs.srv import Trigger

from mfba_planner.core.errors import ConfigError, GraphError
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.output_files import refuse_existing
from mfba_planner.core.planner_types import NANO, Mode
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.launcher.forked_process import ForkServer
from mfba_planner.launcher.graph_monitor import ServiceCall
from mfba_planner.launcher.node_processes import NodeProcesses, parameters_yaml
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.recording.from_messages import decision_field, stamp_ns
from mfba_planner.ros.interface.to_messages import pose_stamped_msg
from mfba_planner.ros.interface.topics import DECISION, GOAL_POSE
from mfba_planner.ros.runtime.base_node import GraphNode
from mfba_planner.ros.runtime.spin_node import make_executor
from mfba_planner.scenarios.scenario_json import scenario_to_dict
from mfba_planner.verification.verify_bag import verify

READY_TIMEOUT_S = 30.0
SILENCE_S = 30.0  # without a decision
NODES = ("recorder", "virtual_sensor", "planner")
ROBOT = Path(__file__).with_name("physics_node.py")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """What is driven, and how."""

    world: int = 0
    people: int = PEOPLE
    walk: Walk = Walk.WAYPOINTS
    kidnapped: bool = False
    lifted: Lifted = Lifted.JUMPS
    real_time: bool = False
    input_timeout_s: float = 0.25  # in real time
    time_limit_s: float = TIME_LIMIT_S
    film: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What came of it."""

    arrived: bool
    robot: dict[str, Any]
    verified: int
    decisions: int
    faults: tuple[str, ...]


class Operator(GraphNode):
    """Gives the goal, as RViz does, and follows the planner's decisions."""

    def __init__(self, room: Room, **kwargs: Any) -> None:
        """Publish the goal, latched."""
        super().__init__("operator", start_parameter_services=False, **kwargs)
        self.first_ns = self.last_ns = 0
        self.mode = ""
        self.received_at = time.monotonic()
        goal = self.create_publisher(GOAL_POSE.type, GOAL_POSE.name, GOAL_POSE.qos)
        goal.publish(pose_stamped_msg(room.scenario.goal_m, 0, "odom"))
        self.ready = {
            name: ServiceCall(
                self.create_client(Trigger, f"{name}/ready"), Trigger.Request(), 0.05
            )
            for name in NODES
        }
        self.create_subscription(DECISION.type, DECISION.name, self._on_decision, DECISION.qos)

    def _on_decision(self, message: Any) -> None:
        self.last_ns = stamp_ns(message.header.stamp)
        self.first_ns = self.first_ns or self.last_ns
        self.mode = decision_field(message, "mode")
        self.received_at = time.monotonic()

    def all_ready(self) -> bool:
        """Whether every node has said that it is ready."""
        for name, call in list(self.ready.items()):
            response = call.response()
            if response is not None and response.success:
                del self.ready[name]
        return not self.ready

    @property
    def time_s(self) -> float:
        """Time of the drive by its stamps."""
        return (self.last_ns - self.first_ns) * NANO


@contextmanager
def opened_operator(room: Room, domain: int) -> Iterator[tuple[Operator, Callable[[], None]]]:
    """The operator's node, and a call that lets it receive."""
    context = Context()
    context.init(domain_id=domain)
    operator = Operator(room, context=context)
    executor = make_executor(context)
    executor.add_node(operator)
    try:
        yield operator, lambda: executor.spin_once(timeout_sec=0.02)
    finally:
        executor.shutdown()
        operator.destroy_node()
        context.try_shutdown()
        context.destroy()


@contextmanager
def physics_process(
    options: RunOptions, directory: Path, log: IO[str]
) -> Iterator[subprocess.Popen[str]]:
    """The robot's process; it ends with the block and writes its results then."""
    parameters: dict[str, Any] = {
        "world": options.world,
        "people": options.people,
        "walk": options.walk.value,
        "kidnapped": options.kidnapped,
        "lifted": options.lifted.value,
        "real_time": options.real_time,
        "wait_for": ",".join(NODES),
        "result": str(directory / "robot.json"),
        "film": str(directory / "frames.npz") if options.film else "",
    }
    values = directory / "robot_parameters.yaml"
    values.write_text(parameters_yaml(parameters), encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(ROBOT), "--ros-args", "--params-file", str(values)],
        stdout=log,
        stderr=log,
        text=True,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(timeout=20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        values.unlink()


def node_parameters(room: Room, options: RunOptions, bag: Path) -> dict[str, dict[str, Any]]:
    """Parameters of the project's nodes, as on a robot with a lidar."""
    params = planner_params(room)
    # Where time stands while the planner decides, no input gets old by itself.
    timeout = {"input_timeout_s": options.input_timeout_s if options.real_time else SILENCE_S}
    return {
        "recorder": {
            "output": str(bag),
            "nodes": "planner,virtual_sensor",
            "enable_stamped_cmd_vel": True,
        },
        "virtual_sensor": timeout
        | {"source": "scan", "robot_radius_m": params.robot_radius_m}
        | {"wait_for": "planner,recorder"},
        "planner": flatten(params)
        | timeout
        | {"seed": options.world, "enable_stamped_cmd_vel": True, "wait_for": "recorder"},
    }


def run_graph(options: RunOptions, directory: Path) -> RunResult:
    """Drive through the graph and write the run directory. GraphError when the graph is stuck."""
    room = draw_room(
        options.world, people=options.people, walk=options.walk, kidnapped=options.kidnapped
    )
    directory.mkdir(parents=True)
    text = yaml.safe_dump(scenario_to_dict(room.scenario), sort_keys=False)
    (directory / "world.yaml").write_text(text, encoding="utf-8")
    with (directory / "log.txt").open("w", encoding="utf-8") as log:

        def print_node_line(name: str, line: str) -> None:
            log.write(f"[{name}] {line}\n")

        with (
            ForkServer() as server,
            private_domain() as domain,
            opened_operator(room, domain) as (operator, spin),
            NodeProcesses(server, print_node_line, lambda: False) as nodes,
        ):
            nodes.start(node_parameters(room, options, directory / "bag"), {})
            _wait(operator.all_ready, spin, nodes, READY_TIMEOUT_S, operator)
            with physics_process(options, directory, log) as robot:
                _drive(operator, spin, nodes, robot, options.time_limit_s)
    result = _result(directory, operator.mode == Mode.ARRIVED.value)
    if options.film:
        _film(room, directory, result)
    return result


def _wait(
    done: Callable[[], bool],
    spin: Callable[[], None],
    nodes: NodeProcesses,
    timeout_s: float,
    operator: Operator,
) -> None:
    deadline = time.monotonic() + timeout_s
    while not done():
        nodes.check()
        if time.monotonic() > deadline:
            missing = ", ".join(operator.ready)
            raise GraphError(f"not ready after {timeout_s:g} s: {missing}; see log.txt")
        spin()


def _drive(
    operator: Operator,
    spin: Callable[[], None],
    nodes: NodeProcesses,
    robot: subprocess.Popen[str],
    limit_s: float,
) -> None:
    operator.received_at = time.monotonic()
    while operator.mode != Mode.ARRIVED.value and operator.time_s < limit_s:
        nodes.check()
        if robot.poll() is not None:
            raise GraphError(f"the robot's process ended with {robot.returncode}; see log.txt")
        if time.monotonic() - operator.received_at > SILENCE_S:
            raise GraphError(f"no decision for {SILENCE_S:g} s; see log.txt")
        spin()


def _result(directory: Path, arrived: bool) -> RunResult:
    robot = json.loads((directory / "robot.json").read_text(encoding="utf-8"))
    report = verify(directory / "bag")
    faults = report.faults
    if report.divergence is not None:
        faults = (*faults, str(report.divergence))
    count = len(report.recorded)
    return RunResult(
        arrived=arrived,
        robot=robot,
        verified=count if report.is_identical else 0,
        decisions=count,
        faults=faults,
    )


def _film(room: Room, directory: Path, result: RunResult) -> None:
    path = directory / "frames.npz"
    times_s = [event["time_s"] for event in result.robot["contacts"]]
    write_film(
        directory / "film.webp", PhysicsWorld(room, robot_rng(0)), load_frames(path), times_s
    )
    path.unlink()


def main() -> int:
    """Drive, verify, and print one line each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--world", type=int, default=0, help="number of the world")
    parser.add_argument("--people", type=int, default=PEOPLE)
    parser.add_argument(
        "--walk",
        choices=[walk.value for walk in Walk],
        default=Walk.WAYPOINTS.value,
        help="people walk to random waypoints, or straight across the room and back",
    )
    parser.add_argument(
        "--kidnapped",
        choices=[lifted.value for lifted in Lifted],
        help="lift the robot and put it elsewhere: its odometry jumps too, or does not notice",
    )
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="by the clock, as a robot; else as fast as possible",
    )
    parser.add_argument(
        "--time-limit", type=float, default=TIME_LIMIT_S, metavar="S", help="end after this time"
    )
    parser.add_argument("--film", action="store_true", help="render DIR/film.webp")
    parser.add_argument("--out", type=Path, default=Path("runs/physics"), metavar="DIR")
    given = parser.parse_args()
    if given.world < 0 or given.people < 0 or not given.time_limit > 0.0:
        raise ConfigError(
            f"--world {given.world} --people {given.people} --time-limit {given.time_limit:g}: "
            "give numbers from 0 up, and a time above 0"
        )
    refuse_existing(given.out)
    options = RunOptions(
        world=given.world,
        people=given.people,
        walk=Walk(given.walk),
        kidnapped=given.kidnapped is not None,
        lifted=Lifted(given.kidnapped or Lifted.JUMPS.value),
        real_time=given.real_time,
        time_limit_s=given.time_limit,
        film=given.film,
    )
    result = run_graph(options, given.out)
    robot, contacts = result.robot, result.robot["contacts"]
    print(f"{'arrived' if result.arrived else 'did not arrive'} after {robot['time_s']:.1f} s")
    print(
        f"goal missed by {robot['off_goal_m']:.2f} m; odometry off {robot['odometry_off_m']:.2f} m"
    )
    print(f"contacts: {len(contacts)}")
    for event in contacts:
        print(f"  {event['time_s']:.1f} s: {event['touched']}, {event['side']}")
    print(f"verified {result.verified} of {result.decisions} decisions of {given.out / 'bag'}")
    for fault in result.faults[:5]:
        print(f"  {fault}")
    return int(not (result.arrived and not contacts and result.verified))


if __name__ == "__main__":
    sys.exit(run_and_return_exit_code(main, "run.py"))
