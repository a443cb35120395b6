# SPDX-License-Identifier: Apache-2.0
"""Which topics are played, with which name and type, and which subscribers are awaited."""

import sys

import pytest
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from recorded_bags import FOREIGN, LATCHED, SENSOR

from mfba_planner.core.errors import ConfigError
from mfba_planner.recording.bag_metadata import BagTopic
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.message_definitions import definition_of
from mfba_planner.ros.interface import topics as graph
from mfba_planner.ros.replaying.replay_arguments import parse
from mfba_planner.ros.replaying.topic_selection import PlayedTopic, awaited, choose

PLANNER_TOPICS = ("/cmd_vel", "/goal_step", "/plan", "/planner/decision")


def resolve(name: str) -> str:
    return "/" + name.lstrip("/")


def topic(name: str, type_name: str = "std_msgs/msg/String", **more: object) -> BagTopic:
    return BagTopic(name=name, type_name=type_name, **{"message_count": 3, **more})  # type: ignore[arg-type]


def chosen(recorded: list[BagTopic], line: str = "") -> tuple[list[PlayedTopic], list[str]]:
    return choose({t.name: t for t in recorded}, parse(["bag", *line.split()]), resolve)


def names(recorded: list[BagTopic], line: str = "") -> list[str]:
    return [topic.name for topic in chosen(recorded, line)[0]]


def whole_graph() -> list[BagTopic]:
    return [
        topic(resolve(t.name), f"{t.type.__module__.split('.')[0]}/msg/{t.type.__name__}")
        for t in graph.GRAPH
    ]


def test_some_topics_others_not_and_another_name() -> None:
    recorded = [topic("/a"), topic("/b"), topic("/c")]
    assert names(recorded) == ["/a", "/b", "/c"]
    assert names(recorded, "--topics c /a") == ["/a", "/c"]
    assert names(recorded, "--exclude a") == ["/b", "/c"]
    assert names(recorded, "--topics a b --exclude /b") == ["/a"]
    assert names(recorded, "--remap a:=x /c:=y/z") == ["/x", "/b", "/y/z"]


def test_the_inputs_of_a_node_are_what_it_reads_and_none_of_them_writes() -> None:
    recorded = whole_graph()
    goals = {"/goal_pose", "/waypoints"}
    assert set(names(recorded, "--inputs-of planner")) == {
        "/odom", "/sectors", "/map", *goals
    }  # fmt: skip
    assert set(names(recorded, "--inputs-of virtual_sensor planner")) == {
        "/odom",
        "/obstacles",
        "/scan",
        "/map",
        *goals,
    }
    for name in PLANNER_TOPICS:
        assert name not in names(recorded, "--inputs-of planner")


def test_with_a_clock_of_its_own_the_recorded_one_is_left_out() -> None:
    recorded = [topic("/clock", "rosgraph_msgs/msg/Clock"), topic("/a")]
    assert names(recorded) == ["/clock", "/a"]
    assert names(recorded, "--clock") == ["/a"]


def test_types_that_cannot_be_played_are_named() -> None:
    other = "RIHS01_" + "0" * 64
    played, left_out = chosen(
        [
            topic("/tf_static", "tf2_msgs/msg/TFMessage"),
            topic("/no_type", ""),
            topic("/service", "std_srvs/srv/Trigger_Event"),
            topic("/module", "os/path/join"),
            topic("/relative", "./msg/x"),
            topic("/other", type_hash=other),
            topic("/odom", "nav_msgs/msg/Odometry", type_hash="RIHS01"),
            topic("/same", type_hash=definition_of("std_msgs/msg/String").type_hash),
        ]
    )
    assert [t.recorded for t in played] == ["/odom", "/same"]
    assert played[0].type is Odometry
    assert [line.split("; ")[0].removeprefix("left out ") for line in left_out] == [
        "/tf_static (3 messages): tf2_msgs/msg/TFMessage: this message type is not installed",
        "/no_type (3 messages): '': not a message type",
        "/service (3 messages): 'std_srvs/srv/Trigger_Event': not a message type",
        "/module (3 messages): 'os/path/join': not a message type",
        "/relative (3 messages): ./msg/x: this message type is not installed",
        "/other (3 messages): std_msgs/msg/String was another type when it was recorded",
    ]


def test_a_bag_cannot_have_modules_imported() -> None:
    chosen([topic("/a"), topic("/b", "antigravity/msg/Flying")])
    assert "antigravity" not in sys.modules


def test_the_foreign_bag_lacks_one_type() -> None:
    with BagReader(FOREIGN) as bag:
        played, left_out = chosen(list(bag.topics.values()))
    assert {t.name for t in played} == {"/scan", "/odom", "/goal_pose", "/chatter"}
    assert len(left_out) == 1
    assert {t.name: t.latched for t in played} == {
        "/scan": False,
        "/odom": False,
        "/goal_pose": True,
        "/chatter": False,
    }


def test_the_recorded_qos_is_offered() -> None:
    (sensor, latched, unknown), _ = chosen(
        [topic("/a", qos=(SENSOR,)), topic("/b", qos=(LATCHED,)), topic("/c")]
    )
    assert sensor.qos.reliability == ReliabilityPolicy.BEST_EFFORT
    assert (sensor.qos.depth, sensor.qos.deadline.nanoseconds) == (5, SENSOR.deadline_ns)
    assert latched.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert latched.qos.depth == 1
    assert unknown.qos.depth > 100


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("--topics odm", "--topics /odm: not there; did you mean '/odom'?"),
        ("--exclude odm", "--exclude /odm: not there; did you mean '/odom'?"),
        ("--remap odm:=x", "--remap /odm: not there; did you mean '/odom'?"),
        ("--inputs-of plnner", "--inputs-of plnner: not there; did you mean 'planner'?"),
        ("--exclude odom text", "bag: no message to play; topics there: /odom, /text"),
        ("--inputs-of world_sim", "bag: no message to play; topics there: /odom, /text"),
        ("--remap odom:=text", "--remap: /odom and /text would both be /text, but their types"),
    ],
)
def test_a_bad_selection_is_refused(line: str, text: str) -> None:
    with pytest.raises(ConfigError) as raised:
        chosen([topic("/odom", "nav_msgs/msg/Odometry"), topic("/text")], line)
    assert str(raised.value).startswith(text)


def test_an_empty_selection_names_the_missing_types() -> None:
    with pytest.raises(ConfigError, match=r"left out /tf .* not installed; .* there: /tf"):
        chosen([topic("/tf", "tf2_msgs/msg/TFMessage")])


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("", None),
        ("--wait-for-subscribers", {}),
        ("--wait-for-subscribers 2", {"/odom": 2, "/goal_pose": 2}),
        ("--wait-for-subscribers odom", {"/odom": 1}),
        ("--as-fast-as-possible", {}),
        ("--as-fast-as-possible --wait-for-subscribers 0", {"/odom": 0, "/goal_pose": 0}),
        ("--as-fast-as-possible --inputs-of planner", {"/odom": 1, "/goal_pose": 1}),
    ],
)
def test_which_subscribers_are_awaited(line: str, wanted: dict[str, int] | None) -> None:
    settings = parse(["bag", *line.split()])
    recorded = {
        "/odom": topic("/odom", "nav_msgs/msg/Odometry"),
        "/goal_pose": topic("/goal_pose", "geometry_msgs/msg/PoseStamped"),
    }
    if settings.inputs_of:  # not every planner reads it
        recorded["/map"] = topic("/map", "nav_msgs/msg/OccupancyGrid")
    played, _ = choose(recorded, settings, resolve)
    assert len(played) == len(recorded)
    assert awaited(played, settings, resolve) == wanted


@pytest.mark.parametrize(("scans", "needed"), [(0, {"/obstacles"}), (3, {"/scan"})])
def test_a_sensor_reads_scans_or_else_obstacles(scans: int, needed: set[str]) -> None:
    settings = parse(["bag", "--as-fast-as-possible", "--inputs-of", "virtual_sensor"])
    recorded = {
        "/odom": topic("/odom", "nav_msgs/msg/Odometry"),
        "/obstacles": topic("/obstacles", "geometry_msgs/msg/PoseArray"),
    }
    if scans:
        recorded["/scan"] = topic("/scan", "sensor_msgs/msg/LaserScan")
    played, _ = choose(recorded, settings, resolve)
    assert set(awaited(played, settings, resolve) or {}) == {"/odom", *needed}


def test_only_played_topics_can_be_awaited() -> None:
    settings = parse(["bag", "--wait-for-subscribers", "odm"])
    played, _ = choose({"/odom": topic("/odom")}, settings, resolve)
    with pytest.raises(ConfigError, match=r"--wait-for-subscribers /odm: .* '/odom'"):
        awaited(played, settings, resolve)
