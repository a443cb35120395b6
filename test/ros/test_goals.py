# SPDX-License-Identifier: Apache-2.0
"""Where to go: one goal or several in a row, again, elsewhere, nowhere; and what is refused."""

from pathlib import Path as FilePath
from typing import Any

import pytest
from edited_bags import rewrite
from nav_msgs.msg import Path
from planner_talk import FREE, GOAL, LOCKSTEP, NAN, Talk, fields, goal, mode, odom, sectors
from rclpy.qos import qos_profile_system_default
from rclpy.serialization import serialize_message
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.core.options import override
from mfba_planner.core.types import Mode
from mfba_planner.launcher.in_process import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.paper import readings
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import path_msg
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.verification.verify_bag import verify

A, B, C = (1.0, 0.0), (1.0, 1.0), (3.0, 1.0)


def route(*points: tuple[float, float], frame: str = "odom") -> Path:
    return path_msg(points, 1, frame)


def test_waypoints_are_visited_in_order_and_the_leg_is_told(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=None)
    x, y = 0.0, 0.0
    talk.answers(route(A, B, C))
    visited: list[tuple[str, str]] = []
    for stamp in range(1, 40):
        message = talk.answer(odom(stamp, x, y), sectors(stamp))
        told = fields(message)
        if not visited or visited[-1][0] != told["goal_index"]:
            visited.append((told["goal_index"], told["goal"]))
        answer = read_decision(message, FREE)
        if answer.mode is Mode.ARRIVED:
            break
        assert talk.velocity != (0.0, 0.0), "it does not stop on its way"
        x, y = answer.waypoint
    assert visited == [("1 of 3", "1.0,0.0"), ("2 of 3", "1.0,1.0"), ("3 of 3", "3.0,1.0")]
    assert (x, y) == C


def test_a_goal_takes_the_place_of_a_route_and_the_other_way_round(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=None)
    told = fields(talk.answer(route(A, B), odom(1), sectors(1)))
    assert (told["goal"], told["goal_id"]) == ("1.0,0.0", "1")
    told = fields(talk.answer(goal(*C), odom(2), sectors(2)))
    assert (told["goal"], told["goal_index"], told["goal_id"]) == ("3.0,1.0", "1 of 1", "2")
    told = fields(talk.answer(route(B), odom(3), sectors(3)))
    assert (told["goal"], told["goal_id"]) == ("1.0,1.0", "3")


@pytest.mark.parametrize(
    ("bad", "kind", "reason"),
    [
        (route(), "waypoints: value", "waypoints are empty; give at least one, or call"),
        (route(A, B, frame="map"), "waypoints: frame", "waypoints is in frame 'map', not 'odom'"),
        (route(A, (NAN, 0.0)), "waypoints: value", "waypoint 2 position holds nan"),
    ],
)
def test_a_route_that_cannot_be_used_changes_nothing_and_is_named(
    graph: Graph, bad: Path, kind: str, reason: str
) -> None:
    talk = Talk(graph, LOCKSTEP)
    heard = graph.hear(topics.DIAGNOSTICS)
    told = fields(talk.answer(bad, odom(1), sectors(1)))
    assert told["goal"] == "10.0,5.0"
    assert told["refused_inputs"] == "1"
    graph.until(lambda: bool(heard))
    inputs, driving = heard[-1].status
    assert {item.key: item.value for item in inputs.values}[f"refused {kind}"] == "1"
    last = {item.key: item.value for item in driving.values}["last refused"]
    assert last.startswith(reason)


def test_one_pose_in_another_frame_spoils_the_route(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    mixed = route(A, B)
    mixed.poses[1].header.frame_id = "map"
    talk.answers(mixed)
    assert talk.node.goals.goal_queue.goal == GOAL
    mixed.poses[1].header.frame_id = ""
    talk.answers(mixed)
    assert talk.node.goals.goal_queue.goal == A


def test_waypoints_are_heard_from_a_command_line(graph: Graph) -> None:
    """ros2 topic pub offers no history."""
    talk = Talk(graph, LOCKSTEP, at=None)
    talk.waypoints = graph.writer(topics.WAYPOINTS, qos=qos_profile_system_default)
    told = fields(talk.answer(route(A, B), odom(1), sectors(1)))
    assert (told["goal_index"], told["goal_id"]) == ("1 of 2", "1")


def test_cancelled_it_rests_until_the_next_goal(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    assert mode(talk.answer(odom(1), sectors(1))) is Mode.PATH_GENERATION
    done = graph.call(Trigger, "planner/cancel")
    assert (done.success, done.message) == (True, "no longer on the way to (10.0, 5.0)")
    idle = talk.answer(odom(2), sectors(2))
    assert (mode(idle), fields(idle)["goal_id"]) == (Mode.IDLE, "2")
    assert talk.velocity == (0.0, 0.0)
    done = graph.call(Trigger, "planner/cancel")
    assert (done.success, done.message) == (False, "there was no goal")
    assert mode(talk.answer(goal(*GOAL), odom(3), sectors(3))) is Mode.PATH_GENERATION


def test_the_same_goal_again_is_a_new_one_only_after_arrival(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=A)
    assert fields(talk.answer(odom(1), sectors(1)))["goal_id"] == "1"
    assert fields(talk.answer(goal(*A), odom(2), sectors(2)))["goal_id"] == "1"
    assert mode(talk.answer(odom(3, *A), sectors(3))) is Mode.ARRIVED
    assert mode(talk.answer(odom(4, 5.0), sectors(4))) is Mode.ARRIVED
    again = talk.answer(goal(*A), odom(5, 5.0), sectors(5))
    assert (mode(again), fields(again)["goal_id"]) == (Mode.PATH_GENERATION, "2")


@pytest.fixture(scope="module")
def persistent(tmp_path_factory: pytest.TempPathFactory) -> FilePath:
    """A bag of a run whose swarm lives over the trip."""
    planner = override(readings.planner("fig1"), {"step_length_m": 0.3})
    scenario = load_scenario("case1")
    config = RunConfig(scenario=scenario, planner=planner, driver=Driver.IN_PROCESS, seed=2)
    bag = tmp_path_factory.mktemp("goals") / "bag"
    with private_domain() as domain:
        run_in_process(config, bag, domain_id=domain)
    return bag


def test_a_bag_in_which_a_goal_was_given_twice_is_sound(
    persistent: FilePath, tmp_path: FilePath
) -> None:
    """Nothing was reset, so that a swarm which lives over the trip decides the same."""
    assert verify(persistent).is_identical

    def twice(messages: list[Any]) -> list[Any]:
        (first,) = [m for m in messages if m.topic == "/goal_pose"]
        later = messages[len(messages) // 2].log_time_ns
        again = first._replace(log_time_ns=later, publish_time_ns=later)
        return sorted([*messages, again], key=lambda m: m.log_time_ns)

    assert verify(rewrite(persistent, tmp_path / "twice", twice)).is_identical


def drive(graph: Graph, talk: Talk, stamps: range, x: float = 0.0, y: float = 0.0) -> Any:
    for stamp in stamps:
        x, y = read_decision(talk.answer(odom(stamp, x, y), sectors(stamp)), FREE).waypoint
    return x, y


def test_what_was_given_twice_cancelled_and_given_anew_is_decided_again_alike(
    graph: Graph, persistent: FilePath, tmp_path: FilePath
) -> None:
    """On the real node with a persistent swarm, its answers put into a bag for mfba verify."""
    told = {**LOCKSTEP, "seed": 2, "swarm": "persistent", "bat.iterations": 1}
    heard = {name: graph.hear(topic) for name, topic in TOPICS.items()}
    talk = Talk(graph, told, at=None)
    talk.answers(goal(*GOAL))
    at = drive(graph, talk, range(1, 6))
    talk.answers(goal(*GOAL))
    at = drive(graph, talk, range(6, 11), *at)
    graph.call(Trigger, "planner/cancel")
    at = drive(graph, talk, range(11, 13), *at)
    talk.answers(goal(*GOAL))
    at = drive(graph, talk, range(13, 18), *at)
    talk.answers(route(A, B, C))
    drive(graph, talk, range(18, 40), *at)
    assert len(heard["/planner/decision"]) == 39
    values = {name: graph_value(talk, name) for name in talk.node.get_parameters_by_prefix("")}

    def instead(messages: list[Any]) -> list[Any]:
        some = messages[0]
        return [
            some._replace(topic=name, data=serialize_message(message))
            for name, found in heard.items()
            for message in found
        ]

    def configured(content: Any) -> Any:
        content["nodes"]["planner"] = values
        return content

    report = verify(rewrite(persistent, tmp_path / "bag", instead, configure=configured))
    assert report.divergence is None
    assert not [fault for fault in report.faults if "goal" in fault]
    assert len(report.recorded) == 39


def graph_value(talk: Talk, name: str) -> Any:
    return talk.node.get_parameter(name).value


TOPICS = {
    "/odom": topics.ODOM,
    "/sectors": topics.SECTORS,
    "/goal_pose": topics.GOAL_POSE,
    "/waypoints": topics.WAYPOINTS,
    "/planner/decision": topics.DECISION,
    "/goal_step": topics.GOAL_STEP,
    "/cmd_vel": topics.CMD_VEL,
}
