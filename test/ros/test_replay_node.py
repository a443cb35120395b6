# SPDX-License-Identifier: Apache-2.0
"""replay on the executor of its readers: messages, their sequence, services and errors."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.serialization import serialize_message
from recorded_bags import FOREIGN, LATCHED, SECOND, START_NS, odometry, scan, write_bag
from ros_graph import Graph
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger

from mfba_planner.core.errors import BagError, ConfigError, GraphError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Mode
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.from_messages import decision, sector_ranges
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import (
    clock_msg,
    odometry_msg,
    pose_stamped_msg,
    sectors_msg,
)
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.replay import Replay
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.replaying import bag_player
from mfba_planner.ros.replaying.replay_arguments import parse
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.verification.redecide import RedecideParams, redecide_recording

COUNT = 40
LATCHED_QOS = topics.LATCHED_QOS


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """/odom and /scan, 40 of each, 10 ms apart; /goal_pose is latched before them."""
    write_bag(tmp_path / "bag", COUNT)
    return tmp_path / "bag"


def start(graph: Graph, bag: Path, line: str = "") -> Replay:
    return graph.start(Replay, {}, settings=parse([str(bag), *line.split()]))


def until(
    graph: Graph, replay: Replay, condition: Callable[[], bool], timeout_s: float = 20.0
) -> None:
    """Spin replay and all other nodes until a condition holds."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"not true after {timeout_s} s"
        graph.executor.spin_once(timeout_sec=min(replay.advance(), 0.002))


def play(graph: Graph, replay: Replay, timeout_s: float = 20.0) -> None:
    until(graph, replay, lambda: replay.finished, timeout_s)
    for _ in range(4 * COUNT):  # messages the readers have not taken yet
        graph.executor.spin_once(timeout_sec=0.0)


def collect(graph: Graph, kind: Any, name: str, qos: QoSProfile | int = 1000) -> list[Any]:
    received: list[Any] = []
    graph.probe.create_subscription(kind, name, received.append, qos)
    return received


def call(graph: Graph, replay: Replay, name: str) -> Trigger.Response:
    client = graph.probe.create_client(Trigger, f"replay/{name}")
    until(graph, replay, client.service_is_ready)
    future = client.call_async(Trigger.Request())
    until(graph, replay, future.done)
    return future.result()


@pytest.mark.parametrize(
    ("line", "depth"), [("--rate 20", 1000), ("--rate 1000", 1000), ("--as-fast-as-possible", 10)]
)
def test_every_message_arrives_unchanged_and_in_sequence(
    graph: Graph, bag: Path, line: str, depth: int
) -> None:
    odoms, scans = (
        collect(graph, Odometry, "odom", depth),
        collect(graph, LaserScan, "scan", depth),
    )
    goals = collect(graph, PoseStamped, "goal_pose", LATCHED_QOS)
    replay = start(graph, bag, line)
    play(graph, replay)
    assert odoms == [odometry(i) for i in range(COUNT)]
    assert scans == [scan(i) for i in range(COUNT)]
    assert goals == [PoseStamped()]
    assert replay.player.counts == {"/odom": COUNT, "/scan": COUNT, "/goal_pose": 1}


def test_a_bare_file_is_a_bag(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom")
    play(graph, start(graph, bag / "bag_0.mcap", "--rate 100"))
    assert len(odoms) == COUNT


def test_the_recorded_qos_is_offered(graph: Graph, tmp_path: Path) -> None:
    sensor = OfferedQos(depth=5, reliability="best_effort", deadline_ns=SECOND // 10)
    with BagWriter(tmp_path / "bag") as writer:
        for name, qos in (("/a", sensor), ("/b", LATCHED), ("/c", OfferedQos())):
            writer.add_topic(name, "nav_msgs/msg/Odometry", qos)
            writer.write(name, serialize_message(odometry(1)), START_NS, START_NS)
    start(graph, tmp_path / "bag", "--start-paused")
    a, b, c = (
        graph.probe.get_publishers_info_by_topic(name)[0].qos_profile
        for name in ("/a", "/b", "/c")
    )
    assert (a.reliability, a.durability) == (
        ReliabilityPolicy.BEST_EFFORT,
        DurabilityPolicy.VOLATILE,
    )
    assert a.deadline == Duration(nanoseconds=SECOND // 10)
    assert (b.reliability, b.durability) == (
        ReliabilityPolicy.RELIABLE,
        DurabilityPolicy.TRANSIENT_LOCAL,
    )
    assert (c.reliability, c.durability) == (ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE)


def test_after_an_offset_what_was_latched_is_sent_again(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom")
    goals = collect(graph, PoseStamped, "goal_pose", LATCHED_QOS)
    replay = start(graph, bag, "--start-offset 0.195 --rate 50")
    play(graph, replay)
    assert odoms == [odometry(i) for i in range(20, COUNT)]
    assert len(goals) == 1
    late = collect(graph, PoseStamped, "goal_pose", LATCHED_QOS)
    graph.until(lambda: len(late) == 1)


def test_topics_can_be_left_out_and_renamed(graph: Graph, bag: Path) -> None:
    odoms, renamed = collect(graph, Odometry, "odom"), collect(graph, Odometry, "robot/odom")
    scans = collect(graph, LaserScan, "scan")
    play(graph, start(graph, bag, "--rate 100 --exclude scan --remap odom:=robot/odom"))
    assert (len(odoms), len(renamed), len(scans)) == (0, COUNT, 0)


def test_it_pauses_steps_and_resumes(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom")
    replay = start(graph, bag, "--start-paused --rate 100 --topics odom")
    assert call(graph, replay, "pause").success
    assert not odoms
    for count in range(1, 4):
        done = call(graph, replay, "step")
        assert done.success
        assert done.message == f"/odom at {(count - 1) / 100:.6f} s"
        graph.settle()
        assert odoms == [odometry(i) for i in range(count)]
    assert call(graph, replay, "resume").success
    refused = call(graph, replay, "step")
    assert not refused.success
    assert "pause first" in refused.message
    play(graph, replay)
    assert odoms == [odometry(i) for i in range(COUNT)]


class ManualClock:
    """A player's clock that advances only when a test advances it."""

    def __init__(self) -> None:
        self.now_ns = SECOND

    def monotonic_ns(self) -> int:
        return self.now_ns


def test_a_pause_shifts_what_follows(
    graph: Graph, bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the nanosecond: no burst, nothing skipped or late, on a machine of any speed."""
    clock = ManualClock()
    monkeypatch.setattr(bag_player, "time", clock)
    odoms = collect(graph, Odometry, "odom")
    replay = start(graph, bag, "--topics odom --rate 2")
    played, period_ns = replay.player.counts, SECOND // 100 // 2

    def played_after(wait_ns: int) -> int:
        clock.now_ns += wait_ns
        replay.advance()
        return played["/odom"]

    until(graph, replay, lambda: played["/odom"] > 0)
    assert [played_after(period_ns) for _ in range(4)] == [2, 3, 4, 5]
    assert played_after(period_ns // 4) == 5
    call(graph, replay, "pause")
    assert played_after(10 * COUNT * period_ns) == 5
    call(graph, replay, "resume")
    rest_ns = period_ns - period_ns // 4
    assert (played_after(0), played_after(rest_ns - 1), played_after(1)) == (5, 5, 6)
    rest = range(7, COUNT + 1)
    assert [n for _ in rest for n in (played_after(period_ns - 1), played_after(1))] == [
        n for after in rest for n in (after - 1, after)
    ]
    play(graph, replay)
    assert odoms == [odometry(i) for i in range(COUNT)]


def test_at_the_end_a_step_is_refused(graph: Graph, bag: Path) -> None:
    replay = start(graph, bag, "--start-paused --topics goal_pose")
    assert call(graph, replay, "step").success
    assert not call(graph, replay, "step").success
    play(graph, replay)


def test_a_loop_restarts_with_what_is_latched(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom")
    goals = collect(graph, PoseStamped, "goal_pose", LATCHED_QOS)
    clocks = collect(graph, Clock, "/clock")
    replay = start(graph, bag, "--loop --rate 4 --start-offset 0.2 --clock 200")
    until(graph, replay, lambda: len(odoms) > 2 * COUNT)
    assert not replay.finished
    assert odoms[:COUNT] == [odometry(i) for i in range(20, COUNT)] * 2
    assert len(goals) > 3
    times = [c.clock.sec * SECOND + c.clock.nanosec for c in clocks]
    assert any(later < earlier for earlier, later in zip(times, times[1:]))
    assert min(times) >= START_NS + SECOND // 5


@pytest.mark.parametrize("line", ["--rate 5", "--as-fast-as-possible --wait-for-subscribers odom"])
def test_the_clock_rises_and_never_overtakes_a_message(
    graph: Graph, tmp_path: Path, line: str
) -> None:
    step = SECOND // 50
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/odom", "nav_msgs/msg/Odometry", OfferedQos(depth=1000))
        writer.add_topic("/clock", "rosgraph_msgs/msg/Clock", OfferedQos())
        for i in range(COUNT):
            time_ns = START_NS + i * step
            writer.write("/odom", serialize_message(odometry(i)), time_ns, time_ns)
            writer.write("/clock", serialize_message(clock_msg(1)), time_ns, time_ns)
    received: list[tuple[int, str, int]] = []  # send time, topic, log time

    def on_clock(message: Clock, info: Any) -> None:
        stamp_ns = message.clock.sec * SECOND + message.clock.nanosec
        received.append((info["source_timestamp"], "clock", stamp_ns))

    def on_odom(message: Odometry, info: Any) -> None:
        stamp_ns = START_NS + message.header.stamp.sec * step
        received.append((info["source_timestamp"], "odom", stamp_ns))

    subscribe: Any = graph.probe.create_subscription
    subscribe(Clock, "/clock", on_clock, 1000)
    subscribe(Odometry, "odom", on_odom, 1000)
    play(graph, start(graph, tmp_path / "bag", f"{line} --clock 200"))
    if "rate" in line:  # a reader may lag behind; only --as-fast-as-possible waits for it
        received.sort()
    clocks = [stamp for _, what, stamp in received if what == "clock"]
    assert clocks == sorted(clocks)
    assert clocks[0] == START_NS
    assert len(clocks) > COUNT / 4
    following = START_NS
    for _, what, stamp in received:
        if what == "odom":
            following = min(stamp + step, START_NS + (COUNT - 1) * step)
        assert stamp <= following


def tick_bag(path: Path, ticks: int) -> Path:
    """A planner's inputs tick by tick, with a latched goal at the time of the first tick."""
    params = SensorParams()
    tick = OfferedQos(depth=1000)
    with BagWriter(path) as writer:
        writer.add_topic("/odom", "nav_msgs/msg/Odometry", tick)
        writer.add_topic("/sectors", "sensor_msgs/msg/LaserScan", tick)
        writer.add_topic("/goal_pose", "geometry_msgs/msg/PoseStamped", LATCHED)
        goal = serialize_message(pose_stamped_msg((12.0, 12.0), 1, "odom"))
        writer.write("/goal_pose", goal, SECOND, SECOND)
        for k in range(ticks):
            stamp = SECOND + k * PlannerParams().tick_ns
            odom = odometry_msg(Pose2D(k * 1e-4, 0.0), (0.0, 0.0), stamp, "odom", "base_link")
            sectors = sectors_msg((float("inf"),) * params.sectors, params, 0.3, stamp, "odom")
            writer.write("/odom", serialize_message(odom), stamp, stamp)
            writer.write("/sectors", serialize_message(sectors), stamp, stamp)
    return path


def test_at_full_speed_a_planner_decides_every_tick_of_a_bag_longer_than_its_history(
    graph: Graph, tmp_path: Path
) -> None:
    ticks = topics.TICK_QOS.depth + 200
    decisions = graph.collect(topics.DECISION)
    # The robot of this bag stands still: no progress.
    graph.start(PlannerNode, {"lockstep": True, "progress.time_allowance_s": 0.0})
    replay = start(
        graph,
        tick_bag(tmp_path / "bag", ticks),
        "--as-fast-as-possible --inputs-of planner",
    )
    play(graph, replay, timeout_s=120.0)
    assert len(decisions) == ticks
    modes = {decision(message, ()).mode for message in decisions}
    assert modes == {Mode.PATH_GENERATION}, "the goal must be known before the first tick"


@pytest.mark.parametrize("line", ["--rate 10", "--as-fast-as-possible"])
def test_sensor_and_planner_decide_on_every_scan_of_the_foreign_bag(
    graph: Graph, line: str
) -> None:
    decisions, vectors = graph.collect(topics.DECISION), graph.collect(topics.SENSORY_VECTOR)
    sectors = graph.collect(topics.SECTORS)
    # Its /tf_static says so; the nodes read it only where tf2_msgs is installed.
    extrinsics = {"scan_x": 0.1}
    sensing = {"source": "scan", "lockstep": True, "wait_for": "planner"}
    graph.start(VirtualSensor, {**sensing, **extrinsics})
    graph.start(PlannerNode, {"lockstep": True, **extrinsics})
    nodes = "--inputs-of virtual_sensor planner --wait-for-subscribers"
    play(graph, start(graph, FOREIGN, f"{line} {nodes}"), timeout_s=60.0)
    graph.until(lambda: len(decisions) >= 133)
    graph.settle()
    assert (len(decisions), len(vectors)) == (133, 133)
    found = [decision(why, sector_ranges(ring)) for why, ring in zip(decisions, sectors)]
    assert {tick.mode for tick in found} == {Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE}
    redecided = redecide_recording(FOREIGN, RedecideParams(robot_radius_m=0.3))
    assert digest(found) == redecided.digest, "verify decides as the nodes do"


def test_it_waits_for_subscribers_and_names_the_topics(graph: Graph, bag: Path) -> None:
    replay = start(graph, bag, "--as-fast-as-possible --topics odom scan --wait-timeout 0.2")
    with pytest.raises(GraphError) as raised:
        play(graph, replay)
    assert str(raised.value) == (
        "too few subscribers on /odom, /scan after 0.2 s; start the readers or raise "
        "--wait-timeout"
    )
    assert not replay.player.counts


def test_it_waits_until_the_last_of_them_is_there(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom")
    replay = start(graph, bag, "--rate 100 --wait-for-subscribers 2 --topics odom")
    start_s = time.monotonic()
    until(graph, replay, lambda: time.monotonic() > start_s + 0.2)
    assert not odoms
    second = collect(graph, Odometry, "odom", qos_profile_sensor_data)
    play(graph, replay)
    assert len(odoms) == COUNT
    assert second


def test_it_waits_until_the_nodes_are_ready_for_each_other(graph: Graph) -> None:
    graph.start(VirtualSensor, {"source": "scan", "wait_for": "planner"})
    replay = start(graph, FOREIGN, "--inputs-of virtual_sensor --wait-for-subscribers")
    start_s = time.monotonic()
    until(graph, replay, lambda: time.monotonic() > start_s + 0.2)
    assert not replay.player.counts
    graph.start(PlannerNode, {})
    until(graph, replay, lambda: bool(replay.player.counts))


def test_a_reader_that_hangs_is_named(graph: Graph, bag: Path) -> None:
    hanging = rclpy.create_node("hanging", context=graph.context)
    hanging.create_subscription(Odometry, "odom", lambda _: None, 1000)
    replay = start(graph, bag, "--as-fast-as-possible --wait-timeout 0.3")
    with pytest.raises(GraphError, match=r"^/hanging: no response for 0\.3 s; "):
        play(graph, replay)
    hanging.destroy_node()


def test_a_reader_that_leaves_is_not_waited_for(graph: Graph, bag: Path) -> None:
    odoms = collect(graph, Odometry, "odom", 10)
    leaving = rclpy.create_node("leaving", context=graph.context)
    leaving.create_subscription(Odometry, "odom", lambda _: None, 1000)
    replay = start(graph, bag, "--as-fast-as-possible --wait-timeout 30")
    until(graph, replay, lambda: bool(replay.player.counts))
    leaving.destroy_node()
    play(graph, replay)
    assert len(odoms) == COUNT


def test_a_reader_without_parameter_services_does_not_stop_it(graph: Graph, bag: Path) -> None:
    node = rclpy.create_node("mute", context=graph.context, start_parameter_services=False)
    received: list[Any] = []
    node.create_subscription(Odometry, "odom", received.append, 1000)
    graph.executor.add_node(node)
    play(graph, start(graph, bag, "--as-fast-as-possible"))
    assert len(received) == COUNT
    graph.executor.remove_node(node)
    node.destroy_node()


@pytest.mark.parametrize(
    ("path", "line", "error", "text"),
    [
        ("none", "", BagError, "none: does not exist; "),
        ("bag", "--start-offset 9", ConfigError, "start_offset=9 s: beyond the end of "),
        ("bag", "--topics odm", ConfigError, "did you mean '/odom'?"),
        ("bag", "--remap odom:=9a", ConfigError, "'9a': no topic name"),
        ("bag", "--topics a//b", ConfigError, "'a//b': no topic name"),
    ],
)
def test_what_cannot_be_played_is_refused(
    graph: Graph, bag: Path, path: str, line: str, error: type[Exception], text: str
) -> None:
    with pytest.raises(error) as raised:
        start(graph, bag.parent / path, line)
    assert text in str(raised.value)
    assert "\n" not in str(raised.value)
