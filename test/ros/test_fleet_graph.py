# SPDX-License-Identifier: Apache-2.0
"""world_sim with a fleet: one tick for all, which ends when all commands are received."""

from dataclasses import replace
from typing import Any

import pytest
from geometry_msgs.msg import Twist, Vector3
from ros_graph import Graph
from std_srvs.srv import SetBool, Trigger

from mfba_planner.core.errors import ConfigError, GraphError
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.from_messages import obstacle_centers, robot_pose, stamp_ns
from mfba_planner.ros.endpoints.robot_namespace import below
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_stamped_msg
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import FleetRobot, Scenario

TICK_NS = PlannerParams().tick_ns
TICK_S = TICK_NS * 1e-9
STONE = Obstacle(center_m=(5.0, 5.0), radius_m=0.5)
PAIR = Scenario(
    name="pair",
    start_m=(0.0, 0.0),
    goal_m=(9.0, 0.0),
    obstacles=(STONE,),
    robots=(
        FleetRobot(name="a", start_m=(0.0, 0.0), goal_m=(9.0, 0.0)),
        FleetRobot(name="b", start_m=(0.0, 3.0), goal_m=(0.3, 3.0)),
    ),
)


class Pair:
    """A world of two robots whose commands are published by hand."""

    def __init__(self, graph: Graph, **parameters: Any) -> None:
        self.graph = graph
        self.clock = graph.collect(topics.CLOCK)
        self.odom = {name: graph.collect(below(name, topics.ODOM)) for name in "ab"}
        self.obstacles = {name: graph.collect(below(name, topics.OBSTACLES)) for name in "ab"}
        self.ends = {name: graph.collect(below(name, topics.OUTCOME)) for name in "ab"}
        self.goal_steps = {name: graph.writer(below(name, topics.GOAL_STEP)) for name in "ab"}
        self.twists = {name: graph.writer(below(name, topics.CMD_VEL)) for name in "ab"}
        defaults = {"lockstep": True, "answer_timeout_s": 60.0, "scenario": scenario_to_json(PAIR)}
        self.world = graph.start(WorldSim, {**defaults, **parameters})
        graph.until(lambda: all(self.odom.values()))

    def command(self, name: str, vx: float, vy: float = 0.0) -> None:
        stamp = stamp_ns(self.odom[name][-1].header.stamp)
        self.goal_steps[name].publish(pose_stamped_msg((0.0, 0.0), stamp, "odom"))
        self.twists[name].publish(Twist(linear=Vector3(x=vx, y=vy)))

    def until_tick(self, count: int) -> None:
        """Wait for this many ticks of robot a, and for all messages of them."""
        self.graph.until(lambda: len(self.odom["a"]) == count)
        self.graph.settle()

    def stamps(self, name: str) -> list[int]:
        return [stamp_ns(message.header.stamp) for message in self.odom[name]]


def test_a_tick_ends_when_all_commands_are_received(graph: Graph) -> None:
    pair = Pair(graph)
    pair.command("b", 0.1)
    graph.settle()
    pair.command("b", 0.7)  # sent twice: the first counts
    graph.settle()
    assert pair.stamps("a") == pair.stamps("b") == [TICK_NS]
    pair.command("a", 0.5, -0.25)
    pair.until_tick(2)
    assert pair.stamps("a") == pair.stamps("b") == [TICK_NS, 2 * TICK_NS]
    assert len(pair.clock) == 2
    a, b = (robot_pose(pair.odom[name][-1]).position for name in "ab")
    assert a == (0.5 * TICK_S, -0.25 * TICK_S)
    assert b == (0.1 * TICK_S, 3.0)
    assert obstacle_centers(pair.obstacles["a"][-1]) == [STONE.center_m, b]
    assert obstacle_centers(pair.obstacles["b"][-1]) == [STONE.center_m, a]
    assert pair.odom["a"][-1].child_frame_id == "a/base_link"


def test_a_robot_that_has_arrived_gets_one_more_tick_and_then_none(graph: Graph) -> None:
    pair = Pair(graph)
    pair.command("a", 0.0)
    pair.command("b", 0.3 / TICK_S)
    pair.until_tick(2)
    assert pair.ends["b"][-1].message == "running"
    pair.command("a", 0.0)
    graph.settle()
    assert len(pair.odom["a"]) == 2  # b has to command its last tick
    pair.command("b", 0.0)
    pair.until_tick(3)
    assert pair.ends["b"][-1].message == "goal_reached"
    pair.command("a", 9.0 / TICK_S)
    pair.until_tick(4)
    assert len(pair.odom["b"]) == 2
    assert obstacle_centers(pair.obstacles["a"][-1])[1] == pytest.approx((0.3, 3.0))
    pair.command("a", 0.0)
    graph.until(lambda: pair.world.over)
    graph.settle()
    assert pair.ends["a"][-1].message == "goal_reached"


def test_a_tick_is_repeated_for_the_robot_without_command_and_not_for_ever(graph: Graph) -> None:
    pair = Pair(graph, answer_timeout_s=0.05, answer_retries=2)
    pair.command("a", 0.1)
    with pytest.raises(GraphError, match="published 3 times"):
        graph.until(lambda: False)
    assert pair.stamps("a")[0] == TICK_NS
    assert pair.stamps("b") == [TICK_NS] * 3


def test_a_refused_twist_stops_only_its_robot(graph: Graph) -> None:
    pair = Pair(graph)
    pair.command("a", float("nan"))
    pair.command("b", 0.2)
    pair.until_tick(2)
    a, b = (robot_pose(pair.odom[name][-1]).position for name in "ab")
    assert a == (0.0, 0.0)
    assert b == (0.2 * TICK_S, 3.0)


def test_a_fleet_cannot_run_on(graph: Graph) -> None:
    with pytest.raises(ConfigError, match="run_on=True: a fleet's run ends; give false"):
        graph.start(WorldSim, {"scenario": scenario_to_json(PAIR), "run_on": True})


def test_a_fleet_can_be_paused_stepped_and_reset(graph: Graph) -> None:
    pair = Pair(graph, start_paused=False)

    def command_both() -> None:
        pair.command("a", 0.5)
        pair.command("b", 0.1)

    assert graph.call(SetBool, "world_sim/pause", SetBool.Request(data=True)).success
    command_both()
    graph.settle()
    assert pair.stamps("a") == pair.stamps("b") == [TICK_NS]
    assert graph.call(Trigger, "world_sim/step").message == "tick 1"
    pair.until_tick(2)
    assert not graph.call(Trigger, "world_sim/step").success  # no command yet
    command_both()
    graph.settle()
    assert len(pair.odom["a"]) == 2
    assert graph.call(Trigger, "world_sim/reset").message == f"tick 0 at stamp {3 * TICK_NS} ns"
    assert graph.call(SetBool, "world_sim/pause", SetBool.Request(data=False)).success
    pair.until_tick(3)
    assert pair.stamps("b") == [TICK_NS, 2 * TICK_NS, 3 * TICK_NS]
    assert robot_pose(pair.odom["b"][-1]).position == (0.0, 3.0)


def test_in_real_time_all_robots_tick_until_the_last_has_arrived(graph: Graph) -> None:
    a, b = PAIR.robots
    near = replace(PAIR, goal_m=(1.0, 0.0), robots=(replace(a, goal_m=(1.0, 0.0)), b))
    parameters = {"lockstep": False, "speed_factor": 4.0, "scenario": scenario_to_json(near)}
    pair = Pair(graph, cmd_vel_timeout_s=0.0, **parameters)
    pair.twists["b"].publish(Twist(linear=Vector3(x=0.29 / TICK_S)))
    graph.until(lambda: pair.ends["b"][-1].message == "goal_reached")
    ended = len(pair.odom["b"])
    graph.until(lambda: len(pair.odom["b"]) > ended + 2)
    assert robot_pose(pair.odom["b"][-1]).position == robot_pose(pair.odom["b"][ended]).position
    assert pair.ends["a"][-1].message == "running"
    pair.twists["a"].publish(Twist(linear=Vector3(x=0.33 / TICK_S)))
    graph.until(lambda: pair.world.over)
    graph.settle()
    assert pair.ends["a"][-1].message == "goal_reached"
    assert pair.stamps("a") == pair.stamps("b")
    assert len(pair.clock) == len(pair.odom["a"])
