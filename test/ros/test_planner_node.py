# SPDX-License-Identifier: Apache-2.0
"""planner: the core's decisions, once per stamp, and never a move on inputs that are not sound."""

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
    Talk,
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
from mfba_planner.core.types import NANO, Decision, Mode, Observation
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_params import PlannerParams, Swarm
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import time_msg
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.swarm.bat_swarm import Algorithm


def test_the_method_can_be_changed_while_it_drives(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    ranges = (INF,) * 3 + (0.3,) + (INF,) * 8

    def who(stamp: int) -> str:
        told: str = fields(talk.answer(odom(stamp, 0.0, 0.0), sectors(stamp, ranges)))["algorithm"]
        return told

    assert who(1) == "mfba"
    assert graph.set_parameter("planner", "method", "predictive") == ""
    assert who(2) == "predictive"
    assert "method='other'" in graph.set_parameter("planner", "method", "other")
    assert graph.set_parameter("planner", "method", "paper") == ""
    assert who(3) == "mfba"


@pytest.mark.parametrize(
    "params",
    [
        PlannerParams(),
        PlannerParams(speed_mps=0.5, step_length_m=0.1, swarm=Swarm.PERSISTENT),
    ],
    ids=["section6", "persistent"],
)
def test_decisions_are_the_cores_and_travel_whole(graph: Graph, params: PlannerParams) -> None:
    told = {"speed_mps": params.speed_mps, "step_length_m": params.step_length_m}
    talk = Talk(graph, {**LOCKSTEP, **told, "swarm": params.swarm.value})
    core = Algorithm1(params, seed=3)
    rng = np.random.default_rng(4)
    modes = set()
    for stamp in range(1, 61):
        x, y, yaw = rng.uniform(-3.0, 3.0, 3).tolist()
        seen = np.where(rng.random(12) < 0.16 * (stamp % 7), rng.uniform(0, 1, 12), INF)
        ranges = tuple(seen.astype(np.float32).tolist())
        pair = [odom(stamp, x, y, yaw), sectors(stamp, ranges)]
        message = talk.answer(*(pair if stamp % 2 else reversed(pair)))
        answer = read_decision(message, ranges)
        expected = core.plan(
            Observation(stamp_ns=stamp, pose=answer.pose, ranges_m=ranges, goal=GOAL, now_ns=stamp)
        )
        assert answer == expected
        assert answer.pose == pytest.approx(Pose2D(x, y, yaw), abs=1e-12)
        modes.add(answer.mode)
        check_the_rest(talk, answer)
    assert modes == {Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE, Mode.BLOCKED}


def check_the_rest(talk: Talk, answer: Decision) -> None:
    """Plan, goal step and Twist say the same as the decision, under the same stamp."""
    plan, step = talk.plans[-1], talk.steps[-1]
    assert stamp_ns(plan.header.stamp) == stamp_ns(step.header.stamp) == answer.stamp_ns
    assert plan.header.frame_id == step.header.frame_id == "odom"
    corners = [(p.pose.position.x, p.pose.position.y) for p in plan.poses]
    assert corners[0] == answer.pose.position
    assert corners[-1] == answer.goal
    assert answer.waypoint in corners
    assert (step.pose.position.x, step.pose.position.y) == answer.waypoint
    # The Twist is in the body frame: turned by the yaw it is the way to the goal step.
    vx, vy = talk.velocity
    c, s = math.cos(answer.pose.yaw), math.sin(answer.pose.yaw)
    dt = talk.node.path_planner.params.tick_ns * NANO
    there = (
        answer.pose.x + dt * (c * vx - s * vy),
        answer.pose.y + dt * (s * vx + c * vy),
    )
    assert there == pytest.approx(answer.waypoint, abs=1e-9)


def test_a_robot_that_looks_north_drives_east_by_moving_to_its_right(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=(10.0, 0.0))
    talk.answer(odom(1, yaw=math.pi / 2), sectors(1))
    vx, vy = talk.velocity
    assert vy < -0.5
    assert abs(vx) < 0.3


def test_what_the_world_waits_for_comes_first(graph: Graph) -> None:
    heard = graph.hear_when(topics.GOAL_STEP, topics.PLAN, topics.DECISION, topics.CMD_VEL)
    talk = Talk(graph, LOCKSTEP)
    for stamp in range(1, 6):
        talk.answer(odom(stamp), sectors(stamp))
    order = [name for _, name in sorted(heard)]
    assert order == ["goal_step", "cmd_vel", "plan", "planner/decision"] * 5


def test_each_pair_is_answered_once(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    assert not talk.answers(odom(1), odom(2))
    assert stamp_ns(talk.answer(sectors(2)).header.stamp) == 2
    for late in (sectors(2), sectors(1), odom(1)):
        assert not talk.answers(late)
    after = talk.answer(sectors(3), odom(3))
    assert fields(after)["refused_inputs"] == "2"


def test_asked_again_it_sends_the_same_answer_and_decides_nothing(graph: Graph) -> None:
    """What it sent may be lost while the two discover each other: nobody must wait for ever."""
    talk = Talk(graph, LOCKSTEP)
    talk.answer(odom(1), sectors(1))
    talk.odom.publish(odom(1))
    talk.sectors.publish(sectors(1))
    graph.until(lambda: len(talk.cmd_vel) == 2)
    graph.settle()
    assert len(talk.decisions) == 1
    assert talk.steps[0] == talk.steps[1]
    assert talk.cmd_vel[0] == talk.cmd_vel[1]


def odom_with(stamp: int, position: Point | None = None, q: Quaternion | None = None) -> Odometry:
    message = odom(stamp)
    message.pose.pose.position = position or Point()
    message.pose.pose.orientation = q or Quaternion()
    return message


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
def test_it_stops_on_inputs_that_are_not_sound_and_counts_them(graph: Graph, bad: float) -> None:
    talk = Talk(graph, LOCKSTEP)
    assert mode(talk.answer(odom(1, 1.0, 1.0), sectors(1))) is Mode.PATH_GENERATION
    assert talk.velocity != (0.0, 0.0)
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
    for count, (pose, seen, reason) in enumerate(given, start=1):
        answer = talk.answer(pose, seen)
        assert mode(answer) is Mode.STOPPED
        assert fields(answer)["reason"].startswith(reason)
        assert fields(answer)["refused_inputs"] == str(count)
        assert talk.velocity == (0.0, 0.0)
        assert answer.status[0].level == b"\x02"
    assert mode(talk.answer(odom(10), sectors(10))) is Mode.PATH_GENERATION


def test_a_refused_pose_does_not_move_where_the_robot_is_said_to_be(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    talk.answer(odom(1, 1.0, 2.0), sectors(1))
    answer = read_decision(talk.answer(odom(2, NAN), sectors(2)), FREE)
    assert answer.pose == Pose2D(1.0, 2.0, 0.0)
    assert answer.waypoint == (1.0, 2.0)


@pytest.mark.parametrize("bad", [NAN, INF])
def test_a_goal_that_is_not_finite_changes_nothing(graph: Graph, bad: float) -> None:
    talk = Talk(graph, LOCKSTEP)
    before = fields(talk.answer(odom(1), sectors(1)))
    after = fields(talk.answer(goal(bad, 1.0), odom(2), sectors(2)))
    assert after["refused_inputs"] == "1"
    assert {key: after[key] for key in ("mode", "goal", "goal_id")} == {
        key: before[key] for key in ("mode", "goal", "goal_id")
    }


def test_in_lockstep_it_waits_for_a_goal_that_somebody_gives(graph: Graph) -> None:
    """A planner that was restarted must not answer a tick before it knows the goal."""
    talk = Talk(graph, LOCKSTEP, at=None)
    pair = odom(1), sectors(1)
    assert talk.answers(*pair) == []
    assert mode(talk.answer(goal(*GOAL), *pair)) is Mode.PATH_GENERATION


@pytest.mark.parametrize("lockstep", [True, False])
def test_without_a_goal_it_is_idle(graph: Graph, lockstep: bool) -> None:
    talk = Talk(graph, {"lockstep": lockstep}, at=None)
    if lockstep:
        graph.probe.destroy_publisher(talk.goal)
        graph.until(lambda: not graph.probe.count_publishers(topics.GOAL_POSE.name))
    answer = talk.answer(odom(1), sectors(1, NORTH_EAST))
    assert (mode(answer), fields(answer)["reason"]) == (Mode.IDLE, "no goal given")
    assert talk.velocity == (0.0, 0.0)


def test_the_goals_orientation_is_not_used(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=None)
    place = Pose(position=Point(x=3.0), orientation=Quaternion(w=NAN))
    answer = talk.answer(PoseStamped(pose=place), odom(1), sectors(1))
    assert mode(answer) is Mode.PATH_GENERATION


def test_a_goal_in_another_frame_is_refused_and_in_none_it_is_taken(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    for frame, expected in (("map", GOAL), ("", (3.0, 0.0))):
        sent = goal(3.0, 0.0)
        sent.header.frame_id = frame
        talk.goal.publish(sent)
        graph.settle()
        assert talk.node.goals.goal_queue.goal == expected


def test_a_new_goal_counts_at_once_even_after_arrival(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=(1.0, 0.0))
    assert mode(talk.answer(odom(1, 1.0, 0.0), sectors(1))) is Mode.ARRIVED
    assert mode(talk.answer(odom(2, 5.0, 0.0), sectors(2))) is Mode.ARRIVED, "the trip is over"
    answer = read_decision(talk.answer(goal(-4.0, 0.0), odom(3, 5.0), sectors(3)), FREE)
    assert (answer.mode, answer.goal) == (Mode.PATH_GENERATION, (-4.0, 0.0))
    assert distance(answer.waypoint, (-4.0, 0.0)) < 9.0


@pytest.mark.parametrize(
    "qos",
    [topics.LATCHED_QOS, topics.VIEW_QOS, qos_profile_system_default],
    ids=["latched", "rviz", "default"],
)
def test_goals_are_heard_once_from_latched_and_from_rviz_like_writers(
    graph: Graph, qos: Any
) -> None:
    talk = Talk(graph, LOCKSTEP, at=None)
    talk.goal = graph.writer(topics.GOAL_POSE, qos=qos)
    answer = talk.answer(goal(NAN, 0.0), goal(2.0, 2.0), odom(1), sectors(1))
    assert fields(answer)["goal"] == "2.0,2.0"
    assert fields(answer)["refused_inputs"] == "1", "the bad one came once, not twice"


REAL_TIME = {"input_timeout_s": 0.7, "seed": 3}


def test_real_time_answers_each_sectors_with_the_newest_odom(graph: Graph) -> None:
    talk = Talk(graph, {**REAL_TIME, "input_timeout_s": 60.0})
    blind = talk.answer(sectors(1))
    assert (mode(blind), fields(blind)["reason"]) == (Mode.STOPPED, "refused input: no odom yet")
    assert not talk.answers(odom(90, 1.0), odom(91, 2.0, 2.0))
    for stamp in (2, 3):
        answer = talk.answer(sectors(stamp, NORTH_EAST))
        assert stamp_ns(answer.header.stamp) == stamp
        assert fields(answer)["pose"] == "2.0,2.0,0.0"
    assert not talk.answers(sectors(3)), "a repeated stamp"
    assert not talk.answers(sectors(2)), "a stamp that goes back"
    assert not talk.answers(odom(5, 7.0, 7.0)), "an old pose is not taken"
    answer = talk.answer(sectors(4))
    assert fields(answer)["pose"] == "2.0,2.0,0.0"
    assert fields(answer)["refused_inputs"] == "3"


def test_real_time_hears_odom_of_best_effort_writers(graph: Graph) -> None:
    talk = Talk(graph, {**REAL_TIME, "input_timeout_s": 60.0})
    talk.odom = graph.writer(topics.ODOM, qos=qos_profile_sensor_data)
    assert mode(talk.answer(odom(1), sectors(1))) is Mode.PATH_GENERATION


def test_real_time_stops_when_nothing_comes_any_more(graph: Graph) -> None:
    talk = Talk(graph, REAL_TIME)
    talk.odom.publish(odom(1))
    talk.sectors.publish(sectors(1))
    graph.until(lambda: bool(talk.cmd_vel))
    assert mode(talk.decisions[0]) is Mode.PATH_GENERATION
    assert talk.velocity != (0.0, 0.0)
    graph.until(lambda: mode(talk.decisions[-1]) is Mode.STOPPED)
    assert fields(talk.decisions[-1])["reason"].endswith("s old")
    graph.until(lambda: talk.velocity == (0.0, 0.0))
    count = len(talk.decisions)
    graph.until(lambda: len(talk.decisions) > count + 2)  # again and again: Twists may be lost
    assert {mode(message) for message in talk.decisions[count:]} == {Mode.STOPPED}
    talk.odom.publish(odom(2))
    talk.sectors.publish(sectors(2))
    graph.until(lambda: mode(talk.decisions[-1]) is Mode.PATH_GENERATION)
    graph.until(lambda: talk.velocity != (0.0, 0.0))


def test_real_time_stops_when_only_odom_is_old(graph: Graph) -> None:
    talk = Talk(graph, REAL_TIME)
    talk.odom.publish(odom(1))
    stamp = 0

    def stopped() -> bool:
        nonlocal stamp
        stamp += 1
        talk.sectors.publish(sectors(stamp))
        return bool(talk.decisions) and mode(talk.decisions[-1]) is Mode.STOPPED

    graph.until(stopped)
    assert "s old" in fields(talk.decisions[-1])["reason"]
    assert stamp_ns(talk.decisions[-1].header.stamp) > 1


def test_before_any_sectors_it_says_nothing(graph: Graph) -> None:
    talk = Talk(graph, {**REAL_TIME, "input_timeout_s": 0.01})
    talk.answers(odom(1))
    seen = graph.hear(topics.CLOCK)
    ticks = iter(range(1, 10**6))
    clock = graph.writer(topics.CLOCK)

    def later() -> bool:
        clock.publish(Clock(clock=time_msg(next(ticks))))
        return len(seen) > 100

    graph.until(later)
    assert not talk.cmd_vel


@pytest.mark.parametrize("parameters", [LOCKSTEP, {**REAL_TIME, "input_timeout_s": 60.0}])
def test_it_starts_afresh_when_time_is_set_back(graph: Graph, parameters: dict[str, Any]) -> None:
    talk = Talk(graph, {**parameters, "use_sim_time": True}, at=(1.0, 0.0))
    clock = graph.writer(topics.CLOCK)

    def set_time(stamp: int) -> None:
        clock.publish(Clock(clock=time_msg(stamp)))
        graph.until(lambda: talk.node.get_clock().now().nanoseconds == stamp)

    set_time(100)
    assert mode(talk.answer(odom(100, 1.0), sectors(100))) is Mode.ARRIVED
    assert not talk.answers(odom(5), sectors(5))
    set_time(5)
    answer = talk.answer(odom(6), sectors(6))
    assert mode(answer) is Mode.PATH_GENERATION, "arrival is forgotten, the goal is not"
    set_time(7)  # forward: nothing happens
    assert not talk.answers(sectors(6))


def test_stamped_twists_where_they_are_asked_for(graph: Graph) -> None:
    talk = Talk(graph, {**LOCKSTEP, "enable_stamped_cmd_vel": True, "base_frame": "base"})
    talk.answer(odom(7), sectors(7))
    (message,) = talk.cmd_vel
    assert stamp_ns(message.header.stamp) == 7
    assert message.header.frame_id == "base"
    assert talk.velocity != (0.0, 0.0)


def test_speed_and_algorithm_can_be_set_while_it_runs(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    slow = math.hypot(*(talk.answer(odom(1), sectors(1)) and talk.velocity))
    assert graph.set_parameter("planner", "speed_mps", 1.64) == ""
    assert graph.set_parameter("planner", "bat.algorithm", "ba") == ""
    assert talk.node.path_planner.params.bat.algorithm is Algorithm.BA
    answer = talk.answer(odom(2), sectors(2))
    assert fields(answer)["algorithm"] == "ba"
    assert math.hypot(*talk.velocity) == pytest.approx(2.0 * slow, rel=0.1)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
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
    talk = Talk(graph, LOCKSTEP)
    before = talk.node.path_planner.params
    assert reason in graph.set_parameter("planner", name, value)
    assert talk.node.path_planner.params is before


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
def test_parameters_are_judged_at_the_door(
    graph: Graph, parameters: dict[str, Any], line: str
) -> None:
    with pytest.raises(ConfigError, match=line):
        graph.start(PlannerNode, parameters)


def test_markers_show_where_the_goal_step_leads(graph: Graph) -> None:
    marks = graph.hear(topics.MARKERS)
    talk = Talk(graph, {**LOCKSTEP, "view_period_s": 2e-9})
    for stamp in range(1, 6):
        talk.answer(odom(stamp), sectors(stamp, NORTH_EAST if stamp > 3 else FREE))
    graph.settle()
    assert [stamp_ns(message.markers[0].header.stamp) for message in marks] == [1, 3, 5]
    by_name = {mark.ns: mark for mark in marks[0].markers}
    assert len(by_name["candidates"].points) == PlannerParams().bat.population
    assert by_name["sectors"].action == by_name["sectors"].DELETE, "nothing is lit"
    lit = {mark.ns: mark for mark in marks[-1].markers}
    assert len(lit["sectors"].points) == 6
    assert lit["candidates"].action == lit["candidates"].DELETE


def test_markers_read_at_a_glance(graph: Graph) -> None:
    marks = graph.hear(topics.MARKERS)
    talk = Talk(graph, {**LOCKSTEP, "view_period_s": 1e-9})
    talk.answer(odom(1, 1.0, 2.0), sectors(1))
    talk.answer(odom(2, 1.0, 2.0), sectors(2, (0.5,) * 3 + FREE[3:]))
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
