# SPDX-License-Identifier: Apache-2.0
"""recorder: every message once, with the right log time, and the configuration."""

import json
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from edited_bags import record as record_run
from geometry_msgs.msg import TwistStamped
from launched_programs import Program
from rcl_interfaces.srv import ListParameters
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from ros_graph import Graph
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.planner_types import Mode
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.configuration_attachment import read_configuration
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.recording.message_definitions import definition_of
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import parameters as params
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.qos_conversion import offered
from mfba_planner.ros.interface.to_messages import (
    clock_msg,
    odometry_msg,
    path_msg,
    pose_stamped_msg,
    time_msg,
)
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.ros.runtime import parameter_client
from mfba_planner.scenarios.run_config import NODES
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import episode, run_episode


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One recorded run of case study 2."""
    return record_run(tmp_path_factory.mktemp("recorder") / "bag", "case2", 9)


def counts(path: Path) -> Counter[str]:
    with BagReader(path) as reader:
        return Counter({name: topic.message_count for name, topic in reader.topics.items()})


def in_bag(topic: topics.Topic) -> str:
    return f"/{topic.name.lstrip('/')}"


def test_there_is_one_message_per_tick(bag: Path) -> None:
    ticks = len(run_episode.run(load_scenario("case2"), seed=9).ticks)
    found = counts(bag)
    for topic in topics.GRAPH:
        if topic.every_tick:
            assert found[in_bag(topic)] == ticks, topic.name
    assert found["/goal_pose"] == 1
    assert found["/outcome"] == 2
    assert found["/trail"] > 3
    assert found["/markers"] > 3


def test_every_topic_with_a_writer_is_recorded_with_its_type_and_qos(bag: Path) -> None:
    with BagReader(bag) as reader:
        found = dict(reader.topics)
    # The paper's robot has neither a lidar nor odometry noise, and its planner no map.
    others = (topics.SCAN, topics.GROUND_TRUTH, topics.MAP)
    written = [topic for topic in topics.GRAPH if topic.writers and topic not in others]
    assert set(found) == {in_bag(topic) for topic in written}
    for topic in written:
        recorded = found[in_bag(topic)]
        package = topic.type.__module__.split(".")[0]
        assert recorded.type_name == f"{package}/msg/{topic.type.__name__}"
        assert recorded.type_hash == definition_of(recorded.type_name).type_hash
        assert recorded.qos == (offered(topic.qos),)


def test_log_times_are_simulated_time(bag: Path) -> None:
    tick_ns = PlannerParams().tick_ns
    with BagReader(bag) as reader:
        messages = list(reader.decoded())
    now = 0
    for message in messages:
        assert message.log_time_ns % tick_ns == 0
        assert message.log_time_ns >= now
        now = message.log_time_ns
        header = getattr(message.message, "header", None)
        # A goal has the stamp of its request, diagnostics that of the present time.
        if header is not None and message.topic not in ("/goal_pose", "/diagnostics"):
            assert message.log_time_ns == stamp_ns(header.stamp), message.topic
    latched = [m for m in messages if m.topic in ("/goal_pose", "/outcome")]
    assert [m.log_time_ns for m in latched] == [tick_ns, tick_ns, now]


def test_the_bag_holds_all_parameters_and_the_facts(bag: Path) -> None:
    with BagReader(bag) as reader:
        configuration = read_configuration(reader)
    nodes, facts = configuration["nodes"], configuration["run"]
    assert set(nodes) == set(NODES)
    assert nodes["planner"].items() >= {**flatten(PlannerParams()), "seed": 9}.items()
    assert nodes["virtual_sensor"].items() >= flatten(SensorParams()).items()
    assert nodes["virtual_sensor"]["obstacle_radii_m"] == [0.3] * 5
    assert load_scenario(nodes["world_sim"]["scenario_json"]) == load_scenario("case2")
    assert facts["driver"] == "in-process"
    assert {"python", "numpy", "mfba_planner"} <= set(facts)


def test_parameters_are_read_across_processes(
    graph: Graph, domain_id: int, tmp_path: Path
) -> None:
    given: dict[str, dict[str, Any]] = {
        "world_sim": {"scenario": "walled", "start_paused": True, "speed_factor": 2.5},
        "virtual_sensor": {"sectors": 24, "obstacle_radii_m": [0.5, 0.3, 0.2, 0.4]},
        "planner": {"seed": 5, "bat.algorithm": "ba"},
    }
    with ExitStack() as programs:
        for name, values in given.items():
            words = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
            programs.enter_context(
                Program(
                    name,
                    "--ros-args",
                    *words,
                    cwd=tmp_path,
                    more_env={"ROS_DOMAIN_ID": str(domain_id)},
                )
            )
        recorder = graph.start(
            Recorder,
            {"output": str(tmp_path / "bag"), "nodes": ",".join(NODES), "run": '{"a": 1}'},
        )
        assert recorder.missing().startswith("parameters of planner, virtual_sensor, world_sim")
        graph.until(lambda: not recorder.missing(), 60.0)
        listed = {
            name: graph.call(ListParameters, f"{name}/list_parameters").result.names
            for name in given
        }
        graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        configuration = read_configuration(reader)
    nodes = configuration["nodes"]
    assert {name: set(values) for name, values in nodes.items()} == {
        name: set(names) for name, names in listed.items()
    }
    for name, values in given.items():
        assert {key: nodes[name][key] for key in values} == values
    assert configuration["run"] == {"a": 1}


def test_a_parameter_client_that_gets_no_response_is_replaced(
    graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when the server has never discovered it."""
    monkeypatch.setattr(parameter_client, "RENEW_S", 0.3)
    monkeypatch.setattr(parameter_client, "PUBLISHED_S", 0.1)
    made: list[Any] = []
    create = Recorder.create_client

    def create_client(self: Recorder, kind: Any, name: str) -> Any:
        client = create(self, kind, name)
        if kind is ListParameters:
            made.append(client)
            if client is made[0]:
                monkeypatch.setattr(client, "call_async", lambda _: Future())
        return client

    monkeypatch.setattr(Recorder, "create_client", create_client)
    graph.probe.declare_parameter("gains", [0.5, 2.0])  # of a node that does not publish them
    recorder = record(graph, tmp_path / "bag", nodes="probe")
    assert recorder.missing() == "parameters of probe not read yet"
    graph.until(lambda: not recorder.missing())
    assert len(made) > 1
    graph.until(lambda: not list(recorder.clients))
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        assert read_configuration(reader)["nodes"]["probe"]["gains"] == [0.5, 2.0]


def test_what_our_nodes_publish_needs_no_service(graph: Graph, tmp_path: Path) -> None:
    graph.start(PlannerNode, {"seed": 3}, start_parameter_services=False, namespace="robot1")
    graph.start(PlannerNode, {"seed": 4})  # publishes too, but nobody asked for it
    recorder = record(graph, tmp_path / "bag", nodes="robot1/planner", namespaces="robot1")
    graph.until(lambda: not recorder.missing() and recorder.writer.message_count == 2)
    assert not list(recorder.clients)
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        configuration = read_configuration(reader)
        assert reader.topics["/robot1/planner/parameters"].message_count == 1
    assert set(configuration["nodes"]) == {"robot1/planner"}
    assert configuration["nodes"]["robot1/planner"]["seed"] == 3


def test_a_recording_has_the_parameters_as_they_are_when_it_begins(
    graph: Graph, tmp_path: Path
) -> None:
    """Also one by rosbag2, which knows of no service: the topic is all that it gets."""
    graph.start(PlannerNode, {})
    assert graph.set_parameter("planner", "speed_mps", 0.4) == ""
    assert graph.set_parameter("planner", "speed_mps", -1.0) != ""
    published = graph.collect(topics.PARAMETERS["planner"])
    recorder = record(graph, tmp_path / "bag", nodes="planner")
    graph.until(lambda: not recorder.missing() and bool(published))
    graph.stop(recorder)
    assert json.loads(published[-1].data)["speed_mps"] == 0.4
    with BagReader(tmp_path / "bag") as reader:
        assert read_configuration(reader)["nodes"]["planner"]["speed_mps"] == 0.4


@pytest.mark.parametrize(("name", "namespace"), [("probe", "/"), ("/probe", "/robot1")])
def test_parameters_of_others_nodes_are_requested_where_they_are(
    graph: Graph, tmp_path: Path, name: str, namespace: str
) -> None:
    settings = {"output": str(tmp_path / "bag"), "nodes": name}
    recorder = graph.start(Recorder, settings, namespace=namespace)
    graph.until(lambda: not recorder.missing())
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        assert set(read_configuration(reader)["nodes"]) == {"probe"}


@pytest.mark.parametrize("text", ["no JSON", "[1]"])
def test_parameters_that_cannot_be_read_are_requested(
    graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setattr(parameter_client, "PUBLISHED_S", 0.0)
    topic = topics.PARAMETERS["planner"]
    graph.writer(topic).publish(topic.type(data=text))
    recorder = record(graph, tmp_path / "bag", nodes="planner")
    graph.until(lambda: recorder.writer.message_count == 1)
    assert recorder.missing() == "parameters of planner not read yet"
    graph.start(PlannerNode, {})
    graph.until(lambda: not recorder.missing())


def record(graph: Graph, path: Path, **parameters: Any) -> Recorder:
    return graph.start(Recorder, {"output": str(path), **parameters})


def test_log_times_are_wall_times_where_time_is_not_simulated(
    graph: Graph, tmp_path: Path
) -> None:
    recorder = record(graph, tmp_path / "bag")
    before = time.time_ns()
    graph.writer(topics.CLOCK).publish(clock_msg(5))
    graph.settle()
    after = time.time_ns()
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        (message,) = reader.messages()
    assert before <= message.log_time_ns <= after


def test_what_comes_before_the_first_clock_is_held_for_it(graph: Graph, tmp_path: Path) -> None:
    recorder = record(graph, tmp_path / "bag", sim_time=True)
    graph.writer(topics.GOAL_POSE).publish(pose_stamped_msg((1.0, 2.0), 0, "odom"))
    graph.settle()
    assert recorder.writer.message_count == 0
    graph.writer(topics.CLOCK).publish(clock_msg(77))
    graph.settle()
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        assert [(m.topic, m.log_time_ns) for m in reader.messages()] == [
            ("/goal_pose", 77),
            ("/clock", 77),
        ]


def test_what_is_published_after_the_next_tick_is_logged_under_its_own_tick(
    graph: Graph, tmp_path: Path
) -> None:
    """The planner publishes decisions after cmd_vel; other stamps belong to no tick."""
    recorder = record(graph, tmp_path / "bag", sim_time=True)
    plan, clock = graph.writer(topics.PLAN), graph.writer(topics.CLOCK)
    for stamp in (10, 20, 30):
        clock.publish(clock_msg(stamp))
    for stamp in (20, 30, 10, 0, 99, -5):
        plan.publish(path_msg([], stamp, "odom"))
    graph.settle()
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        plans = [m for m in reader.decoded() if m.topic == "/plan"]
    logged = {stamp_ns(m.message.header.stamp): m.log_time_ns for m in plans}
    assert logged == {20: 20, 30: 30, 10: 30, 0: 30, 99: 30, -5: 30}


def test_what_was_held_is_not_lost_without_any_clock(graph: Graph, tmp_path: Path) -> None:
    recorder = record(graph, tmp_path / "bag", sim_time=True)
    graph.writer(topics.GOAL_POSE).publish(pose_stamped_msg((1.0, 2.0), 0, "odom"))
    graph.settle()
    graph.stop(recorder)
    assert counts(tmp_path / "bag") == {"/goal_pose": 1}


@pytest.mark.parametrize("sim_time", [False, True])
def test_foreign_writers_are_recorded_once(graph: Graph, tmp_path: Path, sim_time: bool) -> None:
    """A best-effort lidar and RViz's volatile goals, beside reliable and latched ones."""
    recorder = record(graph, tmp_path / "bag", sim_time=sim_time)
    graph.writer(topics.CLOCK).publish(clock_msg(1))
    goal = pose_stamped_msg((1.0, 2.0), 0, "odom")
    scan = LaserScan(header=Header(stamp=time_msg(1)), ranges=[1.0] * 300)
    for qos in (topics.LATCHED_QOS, topics.VIEW_QOS):
        graph.writer(topics.GOAL_POSE, qos=qos).publish(goal)
    for qos in (topics.TICK_QOS, qos_profile_sensor_data):
        graph.writer(topics.SCAN, qos=qos).publish(scan)
    graph.settle()
    graph.stop(recorder)
    assert counts(tmp_path / "bag") == {"/clock": 1, "/goal_pose": 2, "/scan": 2}


def test_on_a_robot_odom_of_best_effort_is_recorded_too(graph: Graph, tmp_path: Path) -> None:
    recorder = record(graph, tmp_path / "bag")
    message = odometry_msg(episode.Pose2D(0.0, 0.0), (0.0, 0.0), 1, "odom", "base_link")
    for qos in (topics.TICK_QOS, qos_profile_sensor_data):
        graph.writer(topics.ODOM, qos=qos).publish(message)
    graph.settle()
    graph.stop(recorder)
    assert counts(tmp_path / "bag") == {"/odom": 2}


def test_an_episode_in_real_time_keeps_the_decision_not_the_later_stops(
    graph: Graph, tmp_path: Path
) -> None:
    nodes = [
        graph.start(WorldSim, {"start_paused": True, "scenario": "empty"}),
        graph.start(VirtualSensor, {"obstacle_radii_m": [0.3]}),
        planner := graph.start(PlannerNode, {"input_timeout_s": 0.1, "seed": 2}),
    ]
    recorder = record(graph, tmp_path / "bag")
    recorder.attach_parameters({node.get_name(): params.values(node) for node in nodes})
    outcomes = graph.collect(topics.DECISION)
    graph.until(lambda: planner.goals.goal_queue.goal is not None)
    for _ in range(2):
        graph.call(Trigger, "world_sim/step")
        count = len(outcomes)
        graph.until(lambda count=count: len(outcomes) > count + 3)  # type: ignore[misc]
    graph.stop(recorder)
    ticks = read_episode(tmp_path / "bag").ticks
    assert [tick.mode for tick in ticks] == [Mode.PATH_GENERATION] * 2
    assert [tick.stamp_ns for tick in ticks] == [PlannerParams().tick_ns * k for k in (1, 2)]


def test_stamped_twists_are_recorded_as_such(graph: Graph, tmp_path: Path) -> None:
    recorder = record(graph, tmp_path / "bag", enable_stamped_cmd_vel=True)
    graph.writer(topics.CMD_VEL, TwistStamped).publish(TwistStamped())
    graph.settle()
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        assert reader.topics["/cmd_vel"].type_name == "geometry_msgs/msg/TwistStamped"


def test_a_namespace_is_recorded_under_its_names(graph: Graph, tmp_path: Path) -> None:
    recorder = graph.start(Recorder, {"output": str(tmp_path / "bag")}, namespace="robot1")
    pub = graph.probe.create_publisher(topics.ODOM.type, "/robot1/odom", topics.TICK_QOS)
    pub.publish(odometry_msg(episode.Pose2D(0.0, 0.0), (0.0, 0.0), 1, "odom", "base_link"))
    graph.writer(topics.CLOCK).publish(clock_msg(1))
    graph.settle()
    graph.stop(recorder)
    assert counts(tmp_path / "bag") == {"/robot1/odom": 1, "/clock": 1}


def test_a_long_message_is_recorded_whole(graph: Graph, tmp_path: Path) -> None:
    recorder = record(graph, tmp_path / "bag")
    scan = LaserScan(ranges=[float(k) for k in range(100_000)])
    graph.writer(topics.SCAN).publish(scan)
    graph.until(lambda: recorder.writer.message_count == 1)
    graph.stop(recorder)
    with BagReader(tmp_path / "bag") as reader:
        (message,) = reader.decoded()
        assert list(message.message.ranges) == list(scan.ranges)


def test_without_a_name_each_recording_gets_a_new_one(
    graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        graph.stop(graph.start(Recorder, {}))
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["run-001", "run-002"]
    assert counts(Path("runs/run-002")) == {}


def test_what_is_there_is_never_overwritten(graph: Graph, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=f"^{tmp_path}: exists already and is never overwritten"):
        record(graph, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_facts_must_be_json(graph: Graph, tmp_path: Path) -> None:
    for text in ("{", "", "nan?", "[1]", "null"):
        with pytest.raises(
            ConfigError, match=r"^parameter run=.*: not JSON of an object; give '{"
        ):
            record(graph, tmp_path / "bag", run=text)
    assert not (tmp_path / "bag").exists()
