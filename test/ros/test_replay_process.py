# SPDX-License-Identifier: Apache-2.0
"""replay as a program beside other processes: nothing lost, times kept, clean exits."""

import signal
import statistics
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from launched_programs import Program, complete
from nav_msgs.msg import Odometry
from recorded_bags import FOREIGN, odometry, scan, write_bag
from ros_graph import Graph
from sensor_msgs.msg import LaserScan

from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario

DEFAULT_DEPTH = 10  # of a subscription in ROS 2
FAST = ["--as-fast-as-possible", "--wait-timeout", "30"]


class Stage:
    """Starts programs in the domain of the test's own graph."""

    def __init__(self, graph: Graph, cwd: Path, env: dict[str, str]) -> None:
        self.graph = graph
        self.cwd = cwd
        self.env = {"ROS_DOMAIN_ID": env["ROS_DOMAIN_ID"]}

    def run(self, name: str, *args: str) -> Program:
        return Program(name, *args, cwd=self.cwd, more_env=self.env)

    def spin_until_exit(self, program: Program, timeout_s: float = 120.0) -> None:
        """Spin the graph until the program has exited with code 0 and without stderr."""
        self.graph.until(lambda: program.process.poll() is not None, timeout_s)
        self.graph.settle()
        assert (program.end(), program.stderr) == (0, "")

    def matched(self, topic: topics.Topic) -> bool:
        """Whether the probe's subscription to a topic has a publisher."""
        return any(
            s.get_publisher_count() > 0
            for s in self.graph.probe.subscriptions
            if s.topic_name == f"/{topic.name}"
        )


@pytest.fixture
def stage(graph: Graph, tmp_path: Path, ros_env: dict[str, str]) -> Stage:
    return Stage(graph, tmp_path, ros_env)


def test_at_full_speed_a_reader_with_a_short_history_loses_nothing(
    stage: Stage, tmp_path: Path
) -> None:
    count = 400
    write_bag(tmp_path / "bag", count)
    odoms: list[Odometry] = []
    scans: list[LaserScan] = []
    subscribe = stage.graph.probe.create_subscription
    subscribe(Odometry, "odom", odoms.append, DEFAULT_DEPTH)
    subscribe(LaserScan, "scan", scans.append, DEFAULT_DEPTH)
    with stage.run("replay", "bag", *FAST, "--wait-for-subscribers", "odom", "scan") as replay:
        stage.spin_until_exit(replay)
    assert odoms == [odometry(i) for i in range(count)]
    assert scans == [scan(i) for i in range(count)]


def test_at_full_speed_messages_larger_than_the_transport_holds_arrive(
    stage: Stage, tmp_path: Path
) -> None:
    count, beams = 40, 200_000  # 0.8 MB each; Fast DDS shares half a megabyte of memory
    write_bag(tmp_path / "bag", count, beams=beams)
    sizes: list[int] = []

    def callback(data: Any) -> None:
        sizes.append(len(data))

    stage.graph.probe.create_subscription(LaserScan, "scan", callback, DEFAULT_DEPTH, raw=True)
    with stage.run("replay", "bag", *FAST, "--topics", "scan") as replay:
        stage.spin_until_exit(replay)
    assert len(sizes) == count
    assert min(sizes) > 4 * beams


def recorded_decisions(bag: Path) -> list[Decision]:
    with BagReader(bag) as reader:
        return [decision(m.message, ()) for m in reader.decoded(["/planner/decision"])]


def test_a_fresh_planner_fed_at_full_speed_decides_as_it_was_recorded(
    stage: Stage, tmp_path: Path, domain_id: int
) -> None:
    config = RunConfig(scenario=load_scenario("case1"), seed=3)
    run_in_process(config, tmp_path / "bag", domain_id=domain_id)
    recorded = recorded_decisions(tmp_path / "bag")
    assert len(recorded) > 50
    received = stage.graph.collect(topics.DECISION)
    settings = ["lockstep:=true", "seed:=3"]
    with stage.run("planner", "--ros-args", *(x for s in settings for x in ("-p", s))):
        stage.graph.until(lambda: stage.matched(topics.DECISION))
        with stage.run("replay", "bag", *FAST, "--inputs-of", "planner") as replay:
            stage.spin_until_exit(replay)
        stage.graph.until(lambda: len(received) >= len(recorded))
    assert [decision(message, ()) for message in received] == recorded


@pytest.mark.parametrize("speed", [["--rate", "10"], FAST])
def test_sensor_and_planner_decide_on_every_scan_of_the_foreign_bag(
    stage: Stage, speed: list[str]
) -> None:
    received = stage.graph.collect(topics.DECISION)
    sensor = ["source:=scan", "lockstep:=true", "wait_for:=planner"]
    with (
        stage.run("virtual_sensor", "--ros-args", *(x for s in sensor for x in ("-p", s))),
        stage.run("planner", "--ros-args", "-p", "lockstep:=true"),
    ):
        stage.graph.until(lambda: stage.matched(topics.DECISION))
        nodes = ["--inputs-of", "virtual_sensor", "planner", "--wait-for-subscribers"]
        with stage.run("replay", str(FOREIGN), *speed, *nodes) as replay:
            stage.spin_until_exit(replay)
            assert "played 267 messages" in replay.stdout
        stage.graph.until(lambda: len(received) >= 133)
        stage.graph.settle()
    assert len(received) == 133
    modes = [decision(message, ()).mode for message in received]
    assert set(modes) == {Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE}


def test_the_foreign_bags_missing_type_is_named(stage: Stage) -> None:
    with stage.run("mfba", "replay", str(FOREIGN), "--rate", "1000") as replay:
        stage.spin_until_exit(replay)
        assert (
            "left out /tf_static (1 messages): tf2_msgs/msg/TFMessage: this message type is not "
            "installed; "
        ) in replay.stdout
        assert "/chatter 13, /goal_pose 1, /odom 133, /scan 133" in replay.stdout


def test_at_rate_one_the_times_between_messages_are_kept(stage: Stage, tmp_path: Path) -> None:
    count = 200
    write_bag(tmp_path / "bag", count)
    arrived: list[float] = []

    def callback(_: bytes) -> None:
        arrived.append(time.monotonic())

    stage.graph.probe.create_subscription(Odometry, "odom", callback, 1000, raw=True)
    with stage.run("replay", "bag", "--topics", "odom", "--wait-for-subscribers") as replay:
        stage.spin_until_exit(replay)
    assert len(arrived) == count
    errors = [abs((b - a) - 0.01) for a, b in pairwise(arrived)]
    assert statistics.median(errors) < 0.005
    assert abs((arrived[-1] - arrived[0]) - (count - 1) * 0.01) < 0.2, "the errors add up"


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("--loop --rate 10", signal.SIGINT),
        ("--start-paused --clock", signal.SIGTERM),
        (FAST[0], signal.SIGTERM),  # waiting for subscribers
    ],
)
def test_it_exits_without_output_on_a_signal(
    stage: Stage, tmp_path: Path, line: str, number: int
) -> None:
    write_bag(tmp_path / "bag", 20)
    odoms: list[Odometry] = []
    stage.graph.probe.create_subscription(Odometry, "/elsewhere", odoms.append, 1000)
    elsewhere = [] if line == FAST[0] else ["--remap", "odom:=elsewhere"]
    with stage.run("replay", "bag", *line.split(), *elsewhere) as replay:
        node = stage.graph.probe.get_node_names
        stage.graph.until(lambda: "replay" in node())
        if "loop" in line:  # the bag holds 20
            stage.graph.until(lambda: len(odoms) > 50)
        replay.process.send_signal(number)
        assert (replay.end(), replay.stderr) == (0, "")
        assert "played" not in replay.stdout


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("", "replay: the following arguments are required: BAG; see `replay --help`"),
        (
            "none",
            "replay: none: does not exist; give a bag directory, or a .mcap, .db3 or .bag file",
        ),
        ("bag --rate nan", "replay: rate=nan: not finite; give a value in [0.001, 1e+06]"),
        ("bag --topics odm", "replay: --topics /odm: not there; did you mean '/odom'?"),
        ("bag --start-offset 9", "replay: start_offset=9 s: beyond the end of bag, which lasts "),
        ("bag --ros-args -r", "replay: failed to initialize rcl: "),
        ("bag --as-fast-as-possible --wait-timeout 0.1", "replay: too few subscribers on "),
        ("torn.mcap", "replay: torn.mcap: "),
        ("empty.mcap", "replay: empty.mcap: "),
    ],
)
def test_a_mistake_is_one_line_and_one(
    tmp_path: Path, domain_id: int, line: str, text: str
) -> None:
    file = write_bag(tmp_path / "bag", 20)
    (tmp_path / "torn.mcap").write_bytes(file.read_bytes()[:-300])
    (tmp_path / "empty.mcap").touch()
    done = complete("replay", *line.split(), cwd=tmp_path, ROS_DOMAIN_ID=str(domain_id))
    assert done.process.returncode == 1
    assert done.stderr.startswith(text)
    assert done.stderr.count("\n") == 1


def test_help_needs_no_bag(tmp_path: Path) -> None:
    done = complete("mfba", "replay", "--help", cwd=tmp_path)
    assert (done.process.returncode, done.stderr) == (0, "")
    assert "--as-fast-as-possible" in done.stdout
