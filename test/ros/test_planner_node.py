# SPDX-License-Identifier: Apache-2.0
"""planner: the core's decisions, once per stamp, and rest on refused inputs."""

import math
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from nav_msgs.msg import Odometry
from planner_talk import (
    FREE,
    GOAL,
    INF,
    LOCKSTEP,
    NAN,
    NORTH_EAST,
    PlannerHarness,
    fields,
    goal,
    mode,
    odom,
    sectors,
)
from rclpy.qos import qos_profile_sensor_data, qos_profile_system_default
from ros_graph import Graph
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D, distance
from mfba_planner.core.planner_types import NANO, Decision, Mode, Observation
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_params import PlannerParams, Swarm
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import time_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.swarm.bat_swarm import Algorithm


def test_the_method_can_be_changed_while_it_drives(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    ranges = (INF,) * 3 + (0.3,) + (INF,) * 8

    def algorithm(stamp: int) -> str:
        name: str = fields(harness.decide(odom(stamp, 0.0, 0.0), sectors(stamp, ranges)))[
            "algorithm"
        ]
        return name

    assert algorithm(1) == "mfba"
    assert graph.set_parameter("planner", "method", "predictive") == ""
    assert algorithm(2) == "predictive"
    assert "method='other'" in graph.set_parameter("planner", "method", "other")
    assert graph.set_parameter("planner", "method", "paper") == ""
    assert algorithm(3) == "mfba"


@pytest.mark.parametrize(
    "params",
    [
        PlannerParams(),
        PlannerParams(speed_mps=0.5, step_length_m=0.1, swarm=Swarm.PERSISTENT),
    ],
    ids=["section6", "persistent"],
)
def test_decisions_are_the_cores_and_are_published_in_full(
    graph: Graph, params: PlannerParams
) -> None:
    settings = {"speed_mps": params.speed_mps, "step_length_m": params.step_length_m}
    harness = PlannerHarness(graph, {**LOCKSTEP, **settings, "swarm": params.swarm.value})
    core = Algorithm1(params, seed=3)
    rng = np.random.default_rng(4)
    modes = set()
    for stamp in range(1, 61):
        x, y, yaw = rng.uniform(-3.0, 3.0, 3).tolist()
        values = np.where(rng.random(12) < 0.16 * (stamp % 7), rng.uniform(0, 1, 12), INF)
        ranges = tuple(values.astype(np.float32).tolist())
        pair = [odom(stamp, x, y, yaw), sectors(stamp, ranges)]
        message = harness.decide(*(pair if stamp % 2 else reversed(pair)))
        decision = read_decision(message, ranges)
        expected = core.plan(
            Observation(
                stamp_ns=stamp, pose=decision.pose, ranges_m=ranges, goal=GOAL, now_ns=stamp
            )
        )
        assert decision == expected
        assert decision.pose == pytest.approx(Pose2D(x, y, yaw), abs=1e-12)
        modes.add(decision.mode)
        check_outputs(harness, decision)
    assert modes == {Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE, Mode.BLOCKED}


def check_outputs(harness: PlannerHarness, decision: Decision) -> None:
    """Plan, goal step and Twist agree with the decision and have its stamp."""
    plan, step = harness.plans[-1], harness.goal_steps[-1]
    assert stamp_ns(plan.header.stamp) == stamp_ns(step.header.stamp) == decision.stamp_ns
    assert plan.header.frame_id == step.header.frame_id == "odom"
    corners = [(p.pose.position.x, p.pose.position.y) for p in plan.poses]
    assert corners[0] == decision.pose.position
    assert corners[-1] == decision.goal
    assert decision.waypoint in corners
    assert (step.pose.position.x, step.pose.position.y) == decision.waypoint
    # The Twist is in the body frame: rotated by the yaw it leads to the goal step.
    vx, vy = harness.velocity
    c, s = math.cos(decision.pose.yaw), math.sin(decision.pose.yaw)
    dt = harness.node.path_planner.params.tick_ns * NANO
    moved = (
        decision.pose.x + dt * (c * vx - s * vy),
        decision.pose.y + dt * (s * vx + c * vy),
    )
    assert moved == pytest.approx(decision.waypoint, abs=1e-9)


def test_a_robot_that_looks_north_drives_east_by_moving_to_its_right(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=(10.0, 0.0))
    harness.decide(odom(1, yaw=math.pi / 2), sectors(1))
    vx, vy = harness.velocity
    assert vy < -0.5
    assert abs(vx) < 0.3


def test_the_command_is_published_first(graph: Graph) -> None:
    published = graph.collect_times(topics.GOAL_STEP, topics.PLAN, topics.DECISION, topics.CMD_VEL)
    harness = PlannerHarness(graph, LOCKSTEP)
    for stamp in range(1, 6):
        harness.decide(odom(stamp), sectors(stamp))
    names = [name for _, name in sorted(published)]
    assert names == ["goal_step", "cmd_vel", "plan", "planner/decision"] * 5


def test_each_pair_is_decided_once(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    assert not harness.decide_all(odom(1), odom(2))
    assert stamp_ns(harness.decide(sectors(2)).header.stamp) == 2
    for late in (sectors(2), sectors(1), odom(1)):
        assert not harness.decide_all(late)
    after = harness.decide(sectors(3), odom(3))
    assert fields(after)["refused_inputs"] == "2"


def test_a_repeated_pair_repeats_the_command_without_a_new_decision(graph: Graph) -> None:
    """A command may be lost during discovery: world_sim must not wait for ever."""
    harness = PlannerHarness(graph, LOCKSTEP)
    harness.decide(odom(1), sectors(1))
    harness.odom.publish(odom(1))
    harness.sectors.publish(sectors(1))
    graph.until(lambda: len(harness.cmd_vel) == 2)
    graph.settle()
    assert len(harness.decisions) == 1
    assert harness.goal_steps[0] == harness.goal_steps[1]
    assert harness.cmd_vel[0] == harness.cmd_vel[1]


def odom_with(stamp: int, position: Point | None = None, q: Quaternion | None = None) -> Odometry:
    message = odom(stamp)
    message.pose.pose.position = position or Point()
    message.pose.pose.orientation = q or Quaternion()
    return message


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
def test_it_stops_on_refused_inputs_and_counts_them(graph: Graph, bad: float) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    assert mode(harness.decide(odom(1, 1.0, 1.0), sectors(1))) is Mode.PATH_GENERATION
    assert harness.velocity != (0.0, 0.0)
    given = [
        (odom_with(2, Point(x=bad)), sectors(2), "refused input: odom position holds"),
        (odom_with(3, Point(y=bad)), sectors(3), "refused input: odom position holds"),
        (odom_with(4, q=Quaternion(z=bad)), sectors(4), "refused input: odom orientation holds"),
        (odom_with(5, q=Quaternion(w=0.0)), sectors(5), "refused input: odom orientation has"),
        (odom(6), sectors(6, (NAN,) * 12), "refused input: sector 1 holds nan"),
        (odom(7), sectors(7, (*FREE[:11], NAN)), "refused input: sector 12 holds nan"),
        (odom(8), sectors(8, (-1.0, *FREE[1:])), "refused input: sector 1 holds -1.0"),
        (odom(9), LaserScan(header=sectors(9).header, ranges=[INF, INF]), "refused input: sect"),
    ]
    for count, (pose, ring, reason) in enumerate(given, start=1):
        decision = harness.decide(pose, ring)
        assert mode(decision) is Mode.STOPPED
        assert fields(decision)["reason"].startswith(reason)
        assert fields(decision)["refused_inputs"] == str(count)
        assert harness.velocity == (0.0, 0.0)
        assert decision.status[0].level == b"\x02"
    assert mode(harness.decide(odom(10), sectors(10))) is Mode.PATH_GENERATION


def test_a_refused_pose_leaves_the_last_pose_in_the_decision(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    harness.decide(odom(1, 1.0, 2.0), sectors(1))
    decision = read_decision(harness.decide(odom(2, NAN), sectors(2)), FREE)
    assert decision.pose == Pose2D(1.0, 2.0, 0.0)
    assert decision.waypoint == (1.0, 2.0)


@pytest.mark.parametrize("bad", [NAN, INF])
def test_a_goal_that_is_not_finite_changes_nothing(graph: Graph, bad: float) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    before = fields(harness.decide(odom(1), sectors(1)))
    after = fields(harness.decide(goal(bad, 1.0), odom(2), sectors(2)))
    assert after["refused_inputs"] == "1"
    assert {key: after[key] for key in ("mode", "goal", "goal_id")} == {
        key: before[key] for key in ("mode", "goal", "goal_id")
    }


def test_in_lockstep_it_waits_for_a_goal_that_is_published(graph: Graph) -> None:
    """A planner that was restarted must not decide a tick before it has the goal."""
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    pair = odom(1), sectors(1)
    assert harness.decide_all(*pair) == []
    assert mode(harness.decide(goal(*GOAL), *pair)) is Mode.PATH_GENERATION


@pytest.mark.parametrize("lockstep", [True, False])
def test_without_a_goal_it_is_idle(graph: Graph, lockstep: bool) -> None:
    harness = PlannerHarness(graph, {"lockstep": lockstep}, at=None)
    if lockstep:
        graph.probe.destroy_publisher(harness.goal)
        graph.until(lambda: not graph.probe.count_publishers(topics.GOAL_POSE.name))
    decision = harness.decide(odom(1), sectors(1, NORTH_EAST))
    assert (mode(decision), fields(decision)["reason"]) == (Mode.IDLE, "no goal given")
    assert harness.velocity == (0.0, 0.0)


def test_the_goals_orientation_is_not_used(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    pose = Pose(position=Point(x=3.0), orientation=Quaternion(w=NAN))
    decision = harness.decide(PoseStamped(pose=pose), odom(1), sectors(1))
    assert mode(decision) is Mode.PATH_GENERATION


def test_a_goal_in_another_frame_is_refused_and_in_none_it_is_taken(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    for frame, expected in (("map", GOAL), ("", (3.0, 0.0))):
        sent = goal(3.0, 0.0)
        sent.header.frame_id = frame
        harness.goal.publish(sent)
        graph.settle()
        assert harness.node.goals.goal_queue.goal == expected


def test_a_new_goal_counts_at_once_even_after_arrival(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=(1.0, 0.0))
    assert mode(harness.decide(odom(1, 1.0, 0.0), sectors(1))) is Mode.ARRIVED
    assert mode(harness.decide(odom(2, 5.0, 0.0), sectors(2))) is Mode.ARRIVED, "the trip is over"
    decision = read_decision(harness.decide(goal(-4.0, 0.0), odom(3, 5.0), sectors(3)), FREE)
    assert (decision.mode, decision.goal) == (Mode.PATH_GENERATION, (-4.0, 0.0))
    assert distance(decision.waypoint, (-4.0, 0.0)) < 9.0


@pytest.mark.parametrize(
    "qos",
    [topics.LATCHED_QOS, topics.VIEW_QOS, qos_profile_system_default],
    ids=["latched", "rviz", "default"],
)
def test_goals_are_received_once_from_latched_and_from_rviz_like_writers(
    graph: Graph, qos: Any
) -> None:
    harness = PlannerHarness(graph, LOCKSTEP, at=None)
    harness.goal = graph.writer(topics.GOAL_POSE, qos=qos)
    decision = harness.decide(goal(NAN, 0.0), goal(2.0, 2.0), odom(1), sectors(1))
    assert fields(decision)["goal"] == "2.0,2.0"
    assert fields(decision)["refused_inputs"] == "1", "the bad one came once, not twice"


REAL_TIME = {"input_timeout_s": 0.7, "seed": 3}


def test_real_time_decides_each_sectors_with_the_newest_odom(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**REAL_TIME, "input_timeout_s": 60.0})
    blind = harness.decide(sectors(1))
    assert (mode(blind), fields(blind)["reason"]) == (Mode.STOPPED, "refused input: no odom yet")
    assert not harness.decide_all(odom(90, 1.0), odom(91, 2.0, 2.0))
    for stamp in (2, 3):
        decision = harness.decide(sectors(stamp, NORTH_EAST))
        assert stamp_ns(decision.header.stamp) == stamp
        assert fields(decision)["pose"] == "2.0,2.0,0.0"
    assert not harness.decide_all(sectors(3)), "a repeated stamp"
    assert not harness.decide_all(sectors(2)), "a stamp that goes back"
    assert not harness.decide_all(odom(5, 7.0, 7.0)), "an old pose is not taken"
    decision = harness.decide(sectors(4))
    assert fields(decision)["pose"] == "2.0,2.0,0.0"
    assert fields(decision)["refused_inputs"] == "3"


def test_real_time_receives_odom_of_best_effort_writers(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**REAL_TIME, "input_timeout_s": 60.0})
    harness.odom = graph.writer(topics.ODOM, qos=qos_profile_sensor_data)
    assert mode(harness.decide(odom(1), sectors(1))) is Mode.PATH_GENERATION


def test_real_time_stops_when_no_input_is_received_any_more(graph: Graph) -> None:
    harness = PlannerHarness(graph, REAL_TIME)
    harness.odom.publish(odom(1))
    harness.sectors.publish(sectors(1))
    graph.until(lambda: bool(harness.cmd_vel))
    assert mode(harness.decisions[0]) is Mode.PATH_GENERATION
    assert harness.velocity != (0.0, 0.0)
    graph.until(lambda: mode(harness.decisions[-1]) is Mode.STOPPED)
    assert fields(harness.decisions[-1])["reason"].endswith("s old")
    graph.until(lambda: harness.velocity == (0.0, 0.0))
    count = len(harness.decisions)
    graph.until(lambda: len(harness.decisions) > count + 2)  # again and again: Twists may be lost
    assert {mode(message) for message in harness.decisions[count:]} == {Mode.STOPPED}
    harness.odom.publish(odom(2))
    harness.sectors.publish(sectors(2))
    graph.until(lambda: mode(harness.decisions[-1]) is Mode.PATH_GENERATION)
    graph.until(lambda: harness.velocity != (0.0, 0.0))


def test_real_time_stops_when_only_odom_is_old(graph: Graph) -> None:
    harness = PlannerHarness(graph, REAL_TIME)
    harness.odom.publish(odom(1))
    stamp = 0

    def stopped() -> bool:
        nonlocal stamp
        stamp += 1
        harness.sectors.publish(sectors(stamp))
        return bool(harness.decisions) and mode(harness.decisions[-1]) is Mode.STOPPED

    graph.until(stopped)
    assert "s old" in fields(harness.decisions[-1])["reason"]
    assert stamp_ns(harness.decisions[-1].header.stamp) > 1


def test_a_timeout_set_at_run_time_is_watched_as_often_as_it_needs(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**REAL_TIME, "input_timeout_s": 60.0})
    harness.odom.publish(odom(1))
    harness.sectors.publish(sectors(1))
    graph.until(lambda: bool(harness.decisions))
    assert not graph.set_parameter("planner", "input_timeout_s", 0.04)
    graph.until(lambda: mode(harness.decisions[-1]) is Mode.STOPPED)
    count = len(harness.decisions)
    graph.until(lambda: len(harness.decisions) > count + 20, timeout_s=4.0)
    assert not graph.set_parameter("planner", "input_timeout_s", 60.0)
    assert harness.node._timer.timer_period_ns == 250_000_000


def test_before_any_sectors_it_publishes_no_command(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**REAL_TIME, "input_timeout_s": 0.01})
    harness.decide_all(odom(1))
    clocks = graph.collect(topics.CLOCK)
    ticks = iter(range(1, 10**6))
    clock = graph.writer(topics.CLOCK)

    def later() -> bool:
        clock.publish(Clock(clock=time_msg(next(ticks))))
        return len(clocks) > 100

    graph.until(later)
    assert not harness.cmd_vel


@pytest.mark.parametrize("parameters", [LOCKSTEP, {**REAL_TIME, "input_timeout_s": 60.0}])
def test_it_starts_afresh_when_time_is_set_back(graph: Graph, parameters: dict[str, Any]) -> None:
    harness = PlannerHarness(graph, {**parameters, "use_sim_time": True}, at=(1.0, 0.0))
    clock = graph.writer(topics.CLOCK)

    def set_time(stamp: int) -> None:
        clock.publish(Clock(clock=time_msg(stamp)))
        graph.until(lambda: harness.node.get_clock().now().nanoseconds == stamp)

    set_time(100)
    assert mode(harness.decide(odom(100, 1.0), sectors(100))) is Mode.ARRIVED
    assert not harness.decide_all(odom(5), sectors(5))
    set_time(5)
    decision = harness.decide(odom(6), sectors(6))
    assert mode(decision) is Mode.PATH_GENERATION, "arrival is forgotten, the goal is not"
    set_time(7)  # forward: nothing happens
    assert not harness.decide_all(sectors(6))


def test_stamped_twists_where_enabled(graph: Graph) -> None:
    harness = PlannerHarness(
        graph, {**LOCKSTEP, "enable_stamped_cmd_vel": True, "base_frame": "base"}
    )
    harness.decide(odom(7), sectors(7))
    (message,) = harness.cmd_vel
    assert stamp_ns(message.header.stamp) == 7
    assert message.header.frame_id == "base"
    assert harness.velocity != (0.0, 0.0)


def test_speed_and_algorithm_can_be_set_while_it_runs(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    slow = math.hypot(*(harness.decide(odom(1), sectors(1)) and harness.velocity))
    assert graph.set_parameter("planner", "speed_mps", 1.64) == ""
    assert graph.set_parameter("planner", "bat.algorithm", "ba") == ""
    assert harness.node.path_planner.params.bat.algorithm is Algorithm.BA
    decision = harness.decide(odom(2), sectors(2))
    assert fields(decision)["algorithm"] == "ba"
    assert math.hypot(*harness.velocity) == pytest.approx(2.0 * slow, rel=0.1)


def test_the_optimizer_can_be_set_while_it_runs(graph: Graph) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    assert graph.set_parameter("planner", "optimizer", "none") == ""
    decision = harness.decide(odom(1), sectors(1))
    assert fields(decision)["algorithm"] == "paper with none"
    vx, vy = harness.velocity
    assert math.atan2(vy, vx) == pytest.approx(math.atan2(GOAL[1], GOAL[0])), (
        "straight to the goal"
    )


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("optimizer", "randon", "optimizer 'randon': unknown; did you mean 'random'?"),
        ("speed_mps", 0.0, "Parameter speed_mps out of range Min: 0.01, Max: 100.0, value: 0.0"),
        ("speed_mps", NAN, "out of range"),
        ("speed_mps", 1, "Wrong parameter type, expected 'Type.DOUBLE' got 'Type.INTEGER'"),
        ("bat.population", 1, "Parameter bat.population out of range. Min: 2, Max: 10000"),
        ("bat.algorithm", "bee", "algorithm='bee': unknown; choose one of ba, mfba"),
        ("bat.f_min", 11.0, "f_min=11: above f_max=10; give f_min <= f_max"),
        ("seed", 4, "Trying to set a read-only parameter: seed."),
        ("lockstep", False, "Trying to set a read-only parameter: lockstep."),
        ("sped_mps", 1.0, "Invalid access to undeclared parameter"),
    ],
)
def test_what_cannot_be_set_is_refused_with_the_reason(
    graph: Graph, name: str, value: Any, reason: str
) -> None:
    harness = PlannerHarness(graph, LOCKSTEP)
    before = harness.node.path_planner.params
    assert reason in graph.set_parameter("planner", name, value)
    assert harness.node.path_planner.params is before


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"bat.population": 1}, r"^population=1: out of range; give a value in \[2, 10000\]"),
        ({"speed_mps": -1.0}, r"^speed_mps=-1.0: out of range"),
        ({"speed_mps": NAN}, r"^speed_mps=nan: "),
        ({"speed_mps": 1}, r"^parameter speed_mps=1: wrong type; give a float \(write 1.0, not"),
        ({"bat.algorithm": "bee"}, r"^algorithm='bee': unknown; choose one of ba, mfba"),
        ({"bat.f_min": 11.0}, r"^f_min=11: above f_max=10; give f_min <= f_max"),
        ({"seed": -1}, r"^seed=-1: out of range"),
    ],
)
def test_bad_parameters_are_refused_at_start(
    graph: Graph, parameters: dict[str, Any], line: str
) -> None:
    with pytest.raises(ConfigError, match=line):
        graph.start(PlannerNode, parameters)


def test_markers_show_where_the_goal_step_leads(graph: Graph) -> None:
    marks = graph.collect(topics.MARKERS)
    harness = PlannerHarness(graph, {**LOCKSTEP, "view_period_s": 2e-9})
    for stamp in range(1, 6):
        harness.decide(odom(stamp), sectors(stamp, NORTH_EAST if stamp > 3 else FREE))
    graph.settle()
    assert [stamp_ns(message.markers[0].header.stamp) for message in marks] == [1, 3, 5]
    by_name = {mark.ns: mark for mark in marks[0].markers}
    assert len(by_name["candidates"].points) == PlannerParams().bat.population
    assert by_name["sectors"].action == by_name["sectors"].DELETE, "no sector is set"
    lit = {mark.ns: mark for mark in marks[-1].markers}
    assert len(lit["sectors"].points) == 6
    assert lit["candidates"].action == lit["candidates"].DELETE


def test_markers_show_ring_sectors_gap_and_mode(graph: Graph) -> None:
    marks = graph.collect(topics.MARKERS)
    harness = PlannerHarness(graph, {**LOCKSTEP, "view_period_s": 1e-9})
    harness.decide(odom(1, 1.0, 2.0), sectors(1))
    harness.decide(odom(2, 1.0, 2.0), sectors(2, (0.5,) * 3 + FREE[3:]))
    graph.settle()
    free, lit = ({mark.ns: mark for mark in message.markers} for message in marks)
    reach_m = sectors(1).range_max
    for mark in (free["ring"], lit["ring"]):
        around = {round(math.hypot(p.x - 1.0, p.y - 2.0), 3) for p in mark.points}
        assert around == {round(reach_m, 3)}
    assert len(free["spokes"].points) == 2 * 12
    assert len(lit["lit"].points) == 3 * 3 * 4, "three sectors of four triangles"
    assert {free[name].action for name in ("lit", "gap")} == {free["lit"].DELETE}
    assert (free["mode"].text, lit["mode"].text) == ("path generation", "obstacle avoidance")
    tail, head = lit["gap"].points
    step = lit["goal_step"].points[1]
    assert (tail.x, tail.y) == (1.0, 2.0)
    along = math.atan2(head.y - tail.y, head.x - tail.x)
    assert along == pytest.approx(math.atan2(step.y - tail.y, step.x - tail.x))
    for name in ("velocity", "gap"):
        assert (lit[name].type, len(lit[name].points)) == (lit[name].ARROW, 2)
    colors = {name: (m[name].color.r, m[name].color.g) for name in ("ring", "mode") for m in [lit]}
    assert len(set(colors.values())) == 1, "the colour is the mode's"
    assert lit["ring"].color != free["ring"].color
