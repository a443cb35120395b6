# SPDX-License-Identifier: Apache-2.0
"""Goals of the planner node: one or several, repeated, replaced, cancelled, refused."""

from pathlib import Path as FilePath
from typing import Any

import pytest
from edited_bags import rewrite
from nav_msgs.msg import Path
from planner_talk import (
    FREE,
    GOAL,
    LOCKSTEP,
    NAN,
    PlannerHarness,
    fields,
    goal,
    mode,
    odom,
    sectors,
)
from rclpy.qos import qos_profile_system_default
from rclpy.serialization import serialize_message
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import Mode
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.paper import readings_of_paper
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.ros.endpoints import goal_subscriptions
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import path_msg
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.verification.verify_bag import verify

A, B, C = (1.0, 0.0), (1.0, 1.0), (3.0, 1.0)


def route(*points: tuple[float, float], frame: str = "odom") -> Path:
    return path_msg(points, 1, frame)


def test_waypoints_are_visited_in_sequence_and_goal_index_is_reported(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    x, y = 0.0, 0.0
    harness.decide_all(route(A, B, C))
    visited: list[tuple[str, str]] = []
    for stamp in range(1, 40):
        message = harness.decide(odom(stamp, x, y), sectors(stamp))
        values = fields(message)
        if not visited or visited[-1][0] != values["goal_index"]:
            visited.append((values["goal_index"], values["goal"]))
        decision = read_decision(message, FREE)
        if decision.mode is Mode.ARRIVED:
            break
        assert harness.velocity != (0.0, 0.0), "it does not stop at waypoints"
        x, y = decision.waypoint
    assert visited == [("1 of 3", "1.0,0.0"), ("2 of 3", "1.0,1.0"), ("3 of 3", "3.0,1.0")]
    assert (x, y) == C


def test_a_goal_replaces_a_route_and_a_route_a_goal(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    values = fields(harness.decide(route(A, B), odom(1), sectors(1)))
    assert (values["goal"], values["goal_id"]) == ("1.0,0.0", "1")
    values = fields(harness.decide(goal(*C), odom(2), sectors(2)))
    assert (values["goal"], values["goal_index"], values["goal_id"]) == ("3.0,1.0", "1 of 1", "2")
    values = fields(harness.decide(route(B), odom(3), sectors(3)))
    assert (values["goal"], values["goal_id"]) == ("1.0,1.0", "3")


@pytest.mark.parametrize(
    ("bad", "kind", "reason"),
    [
        (route(), "waypoints: value", "waypoints are empty; give at least one, or call"),
        (route(A, B, frame="map"), "waypoints: frame", "waypoint 1 is in frame 'map', not 'odom'"),
        (route(A, (NAN, 0.0)), "waypoints: value", "waypoint 2 position holds nan"),
    ],
)
def test_a_refused_route_changes_nothing_and_is_reported(
    graph: Graph, bad: Path, kind: str, reason: str
) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    received = graph.collect(topics.DIAGNOSTICS)
    values = fields(harness.decide(bad, odom(1), sectors(1)))
    assert values["goal"] == "10.0,5.0"
    assert values["refused_inputs"] == "1"
    graph.until(lambda: bool(received))
    inputs, driving, _ = received[-1].status
    assert {item.key: item.value for item in inputs.values}[f"refused {kind}"] == "1"
    last = {item.key: item.value for item in driving.values}["last refused"]
    assert last.startswith(reason)


def test_one_pose_in_another_frame_refuses_the_route(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    mixed = route(A, B)
    mixed.poses[1].header.frame_id = "map"
    harness.decide_all(mixed)
    assert harness.node.goals.goal_queue.goal == GOAL
    mixed.poses[1].header.frame_id = ""
    harness.decide_all(mixed)
    assert harness.node.goals.goal_queue.goal == A


def test_waypoints_are_received_from_a_command_line(graph: Graph) -> None:
    """ros2 topic pub offers no history."""
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    harness.waypoints = graph.writer(topics.WAYPOINTS, qos=qos_profile_system_default)
    values = fields(harness.decide(route(A, B), odom(1), sectors(1)))
    assert (values["goal_index"], values["goal_id"]) == ("1 of 2", "1")


def test_after_cancel_it_rests_until_the_next_goal(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    assert mode(harness.decide(odom(1), sectors(1))) is Mode.PATH_GENERATION
    done = graph.call(Trigger, "planner/cancel")
    assert (done.success, done.message) == (True, "no longer driving to (10.0, 5.0)")
    idle = harness.decide(odom(2), sectors(2))
    assert (mode(idle), fields(idle)["goal_id"]) == (Mode.IDLE, "2")
    assert harness.velocity == (0.0, 0.0)
    done = graph.call(Trigger, "planner/cancel")
    assert (done.success, done.message) == (False, "there was no goal")
    assert mode(harness.decide(goal(*GOAL), odom(3), sectors(3))) is Mode.PATH_GENERATION


def test_a_goal_that_was_skipped_is_asked_for(
    graph: Graph, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """As `ros2 bag play --start-offset` does: goal_pose is offered, but nothing is sent."""
    monkeypatch.setattr(goal_subscriptions, "_LONG_WAIT_S", 0.0)
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    assert harness.decide_all(odom(1), sectors(1)) == []
    response = graph.call(Trigger, "planner/ready")
    assert (response.success, response.message) == (True, "no goal_pose yet")
    assert "ticks are not answered: no goal_pose was received" in "".join(capfd.readouterr())
    harness.goal.publish(goal(*A))
    graph.settle()
    assert graph.call(Trigger, "planner/ready").message == ""
    assert fields(harness.decide(odom(2), sectors(2)))["goal"] == "1.0,0.0"


def test_the_same_goal_again_is_new_only_after_arrival(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=A)
    assert fields(harness.decide(odom(1), sectors(1)))["goal_id"] == "1"
    assert fields(harness.decide(goal(*A), odom(2), sectors(2)))["goal_id"] == "1"
    assert mode(harness.decide(odom(3, *A), sectors(3))) is Mode.ARRIVED
    assert mode(harness.decide(odom(4, 5.0), sectors(4))) is Mode.ARRIVED
    again = harness.decide(goal(*A), odom(5, 5.0), sectors(5))
    assert (mode(again), fields(again)["goal_id"]) == (Mode.PATH_GENERATION, "2")


@pytest.fixture(scope="module")
def persistent(tmp_path_factory: pytest.TempPathFactory) -> FilePath:
    """A bag of a run with a persistent swarm."""
    planner = override(readings_of_paper.planner("fig1"), {"step_length_m": 0.3})
    scenario = load_scenario("case1")
    config = RunConfig(scenario=scenario, planner=planner, driver=Driver.IN_PROCESS, seed=2)
    bag = tmp_path_factory.mktemp("goals") / "bag"
    with private_domain() as domain:
        run_in_process(config, bag, domain_id=domain)
    return bag


def test_a_bag_with_the_same_goal_twice_verifies(persistent: FilePath, tmp_path: FilePath) -> None:
    """Nothing was reset: a persistent swarm decides the same."""
    assert verify(persistent).is_identical

    def twice(messages: list[Any]) -> list[Any]:
        (first,) = [m for m in messages if m.topic == "/goal_pose"]
        later = messages[len(messages) // 2].log_time_ns
        again = first._replace(log_time_ns=later, publish_time_ns=later)
        return sorted([*messages, again], key=lambda m: m.log_time_ns)

    assert verify(rewrite(persistent, tmp_path / "twice", twice)).is_identical


def drive(
    graph: Graph, harness: PlannerHarness, stamps: range, x: float = 0.0, y: float = 0.0
) -> Any:
    for stamp in stamps:
        x, y = read_decision(harness.decide(odom(stamp, x, y), sectors(stamp)), FREE).waypoint
    return x, y


def test_goals_repeated_cancelled_and_replaced_are_redecided_identically(
    graph: Graph, persistent: FilePath, tmp_path: FilePath
) -> None:
    """On the real node with a persistent swarm; its decisions go into a bag for mfba verify."""
    parameters = {**LOCKSTEP, "seed": 2, "swarm": "persistent", "bat.iterations": 1}
    received = {name: graph.collect(topic) for name, topic in TOPICS.items()}
    harness = PlannerHarness(graph, parameters, at=None)
    harness.decide_all(goal(*GOAL))
    at = drive(graph, harness, range(1, 6))
    harness.decide_all(goal(*GOAL))
    at = drive(graph, harness, range(6, 11), *at)
    graph.call(Trigger, "planner/cancel")
    at = drive(graph, harness, range(11, 13), *at)
    harness.decide_all(goal(*GOAL))
    at = drive(graph, harness, range(13, 18), *at)
    harness.decide_all(route(A, B, C))
    drive(graph, harness, range(18, 40), *at)
    assert len(received["/planner/decision"]) == 39
    values = {
        name: graph_value(harness, name) for name in harness.node.get_parameters_by_prefix("")
    }

    def replaced(messages: list[Any]) -> list[Any]:
        template = messages[0]
        return [
            template._replace(topic=name, data=serialize_message(message))
            for name, found in received.items()
            for message in found
        ]

    def configured(content: Any) -> Any:
        content["nodes"]["planner"] = values
        return content

    report = verify(rewrite(persistent, tmp_path / "bag", replaced, configure=configured))
    assert report.divergence is None
    assert not [fault for fault in report.faults if "goal" in fault]
    assert len(report.recorded) == 39


def graph_value(harness: PlannerHarness, name: str) -> Any:
    return harness.node.get_parameter(name).value


TOPICS = {
    "/odom": topics.ODOM,
    "/sectors": topics.SECTORS,
    "/goal_pose": topics.GOAL_POSE,
    "/waypoints": topics.WAYPOINTS,
    "/planner/decision": topics.DECISION,
    "/goal_step": topics.GOAL_STEP,
    "/cmd_vel": topics.CMD_VEL,
}
