# SPDX-License-Identifier: Apache-2.0
"""In the real graph: enclosed, with returns inside the robot, or without progress, it rests."""

import json
import math
from dataclasses import replace
from itertools import groupby
from typing import Any

import pytest
from message_relay import RelayedGraph
from planner_talk import goal
from ros_graph import Graph

from mfba_planner.core.option_specs import override
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.run_config import RunConfig, node_parameters
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

INF = math.inf
FAR = json.dumps(
    {"name": "far", "start_m": [0.0, 0.0], "goal_m": [50.0, 0.0], "time_limit_s": 600.0}
)
SOON_S = 0.3  # of simulated time
WARN, ERROR = b"\x01", b"\x02"
METHODS = pytest.mark.parametrize("method", ["paper", "predictive"])


def values(status: Any) -> dict[str, str]:
    return {item.key: item.value for item in status.values}


def posts() -> list[float]:
    """Four returns of the robot itself, 0.2 m from the lidar; its radius is 0.3 m."""
    return [0.2 if k % 90 == 45 else INF for k in range(360)]


@METHODS
def test_returns_inside_the_robot_keep_it_at_rest_by_name(graph: Graph, method: str) -> None:
    relayed = RelayedGraph(graph, FAR, method=method)
    relayed.beams = posts()
    graph.until(lambda: len(relayed.decisions) > 10)
    graph.until(lambda: relayed.status("driving").level == WARN)
    assert {(m.linear.x, m.linear.y) for m in relayed.cmd_vel} == {(0.0, 0.0)}
    assert values(relayed.status("driving"))["mode"] == "blocked"
    if method == "predictive":
        assert relayed.status("driving").message.endswith(
            "inside the robot's radius; "
            "check robot_radius_m, and range_min or the mask of the robot's own returns"
        )
    relayed.beams = [INF] * 360
    relayed.drive()


@METHODS
@pytest.mark.parametrize("away_m", [0.31, 0.5])
def test_with_returns_all_around_it_rests_and_drives_on_through_a_gap(
    graph: Graph, method: str, away_m: float
) -> None:
    relayed = RelayedGraph(graph, FAR, method=method)
    since_ns = relayed.drive()
    relayed.beams = [away_m] * 360
    assert relayed.rest_after(since_ns) <= SOON_S
    graph.until(lambda: relayed.status("driving").level == WARN)
    assert values(relayed.status("driving"))["mode"] == "blocked"
    count = len(relayed.cmd_vel)
    graph.until(lambda: len(relayed.cmd_vel) > count + 5)
    assert {(m.linear.x, m.linear.y) for m in relayed.cmd_vel[count:]} == {(0.0, 0.0)}
    relayed.beams = [INF] * 360
    graph.until(relayed.is_moving)


def test_enclosed_predictive_recovers_and_gives_up(graph: Graph) -> None:
    relayed = RelayedGraph(
        graph,
        FAR,
        method="predictive",
        **{
            "recovery.enabled": True,
            "recovery.wait_s": 0.3,
            "recovery.back_off_s": 0.3,
            "recovery.back_off_mps": 0.1,
            "recovery.attempts": 1,
        },
    )
    relayed.beams = [0.5] * 180 + [0.6] * 180  # more room behind
    graph.until(lambda: len(relayed.diagnostics()) > 1)
    graph.until(lambda: values(relayed.status("driving"))["recovery"] == "given_up")
    assert relayed.status("driving").level == ERROR
    assert relayed.status("driving").message.startswith("gave up after 1 attempts, enclosed by ")
    phases = [values(m.status[1])["recovery"] for m in relayed.diagnostics()]
    sequence = [name for name, _ in groupby(phases)]
    assert sequence[-5:] == ["wait", "back_off", "replan", "wait", "given_up"]
    moving = [m for m in relayed.cmd_vel if m.linear.x or m.linear.y]
    assert moving, "it backed off"
    assert all(m.linear.y < 0.0 for m in moving), "the beams from pi on have more room"


def before_a_wall() -> Scenario:
    wall = tuple(
        Obstacle(center_m=(2.0, 0.5 * k), radius_m=0.3, speed_mps=0.0, heading_rad=0.0)
        for k in range(-16, 17)
    )
    return Scenario(
        name="wall", start_m=(0.0, 0.0), goal_m=(9.0, 0.0), obstacles=wall, time_limit_s=600.0
    )


@METHODS
def test_to_and_fro_before_a_wall_ends_by_name_until_a_new_goal(graph: Graph, method: str) -> None:
    chosen = PlannerParams(method=Method(method), speed_mps=0.8)
    if chosen.method is Method.PREDICTIVE:
        chosen = preset(chosen)
    quick = {
        "progress.time_allowance_s": 3.0,
        "progress.detour_allowance_s": 20.0,
        "recovery.wait_s": 0.5,
        "recovery.attempts": 1,
    }
    config = replace(RunConfig(scenario=before_a_wall(), planner=override(chosen, quick)), seed=1)
    twists, diagnostics = graph.collect(topics.CMD_VEL), graph.collect(topics.DIAGNOSTICS)
    decisions, odom = graph.collect(topics.DECISION), graph.collect(topics.ODOM)
    parameters = node_parameters(config, peers=())
    graph.start(VirtualSensor, parameters["virtual_sensor"])
    planner = graph.start(PlannerNode, parameters["planner"])
    world = graph.start(WorldSim, parameters["world_sim"])
    graph.until(lambda: planner.goals.goal_queue.goal is not None)
    world.resume()

    def driving() -> list[Any]:
        return [
            s for m in diagnostics for s in m.status if s.name == "planner: driving" and s.values
        ]

    def given_up() -> bool:
        return any(values(s)["recovery"] == "given_up" for s in driving()[-1:])

    graph.until(given_up, timeout_s=60.0)
    assert stamp_ns(odom[-1].header.stamp) < 40 * 10**9
    assert driving()[-1].level == ERROR
    message = driving()[-1].message
    assert message.startswith("gave up after 1 attempts, no progress: 0.")
    assert message.endswith("; send a goal to go on")
    warned = [s.message for s in driving() if s.level == WARN]
    assert any(text.startswith("no progress: 0.") for text in warned)
    count = len(decisions)
    graph.until(lambda: len(decisions) > count + 5)
    assert {(m.linear.x, m.linear.y) for m in twists[-5:]} == {(0.0, 0.0)}
    assert min(math.hypot(2.0 - m.pose.pose.position.x, 0.0) for m in odom) > 0.6
    graph.writer(topics.GOAL_POSE).publish(goal(-4.0, 0.0))
    graph.until(lambda: odom[-1].pose.pose.position.x < -1.0)
