# SPDX-License-Identifier: Apache-2.0
"""world_sim: its ticks, its services, and its reaction to a bad Twist."""

import json
import math
import time
from typing import Any

import pytest
from geometry_msgs.msg import (
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Twist,
    TwistStamped,
    Vector3,
)
from ros_graph import Graph
from std_srvs.srv import SetBool, Trigger

from mfba_planner.core.errors import ConfigError, GraphError
from mfba_planner.core.planner_types import NANO
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.from_messages import robot_pose, stamp_ns, velocity
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_msg, pose_stamped_msg, set_header
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.scenarios.scenario_files import load_scenario

TICK_NS = PlannerParams().tick_ns
LOCKSTEP = {"lockstep": True, "answer_timeout_s": 60.0}
OBSTACLES = [{"center_m": [3.0, 9.0], "radius_m": 0.3, "speed_mps": 0.5, "heading_deg": 200.0}]
NEAR = {"name": "near", "start_m": [0.0, 0.0], "goal_m": [1.0, 0.0], "time_limit_s": 100.0}


def scenario(**changes: Any) -> str:
    return json.dumps({**NEAR, **changes})


def twist(vx: float = 0.0, vy: float = 0.0) -> Twist:
    return Twist(linear=Vector3(x=vx, y=vy))


class Driver:
    """A world whose ticks are commanded by hand."""

    def __init__(self, graph: Graph, parameters: dict[str, Any], kind: Any = Twist) -> None:
        self.graph = graph
        self.clock = graph.collect(topics.CLOCK)
        self.odom = graph.collect(topics.ODOM)
        self.obstacles = graph.collect(topics.OBSTACLES)
        self.outcome = graph.collect(topics.OUTCOME)
        self.goal_step = graph.writer(topics.GOAL_STEP)
        self.cmd_vel = graph.writer(topics.CMD_VEL, kind)
        self.world = graph.start(WorldSim, parameters)

    @property
    def stamps(self) -> list[int]:
        return [stamp_ns(message.header.stamp) for message in self.odom]

    @property
    def positions(self) -> list[tuple[float, float]]:
        return [robot_pose(message).position for message in self.odom]

    def wait_for_ticks(self, count: int) -> None:
        self.graph.until(lambda: len(self.odom) >= count)
        assert len(self.odom) == count

    def command(self, message: Any, stamp: int | None = None) -> None:
        """Publish the command of a tick, of the present one if no stamp is given."""
        stamp = self.stamps[-1] if stamp is None else stamp
        self.goal_step.publish(pose_stamped_msg((0.0, 0.0), stamp, "odom"))
        self.cmd_vel.publish(message)

    def drive(self, message: Any) -> None:
        """Publish the command of the present tick and wait for the next one."""
        count = len(self.odom)
        self.command(message)
        self.wait_for_ticks(count + 1)

    def trigger(self, name: str) -> Any:
        return self.graph.call(Trigger, f"world_sim/{name}")

    def pause(self, on: bool) -> Any:
        return self.graph.call(SetBool, "world_sim/pause", SetBool.Request(data=on))


@pytest.fixture
def driver(graph: Graph) -> Driver:
    """A lockstep world whose first tick is published."""
    started = Driver(graph, {"scenario": scenario(), **LOCKSTEP})
    started.wait_for_ticks(1)
    return started


def test_lockstep_waits_for_each_command(driver: Driver) -> None:
    for tick in range(1, 6):
        driver.graph.settle()
        assert len(driver.odom) == tick
        driver.drive(twist(0.1, -0.2))
    dt = TICK_NS * NANO
    assert driver.positions[1] == (0.1 * dt, -0.2 * dt)
    assert driver.positions[5] == pytest.approx((0.5 * dt, -1.0 * dt))


def test_a_second_twist_of_one_tick_does_not_command_the_next(driver: Driver) -> None:
    driver.pause(True)
    driver.command(twist(0.1))
    driver.graph.settle()
    driver.command(twist(50.0))
    driver.graph.settle()
    driver.trigger("step")
    driver.wait_for_ticks(2)
    assert driver.positions[1] == (0.1 * TICK_NS * NANO, 0.0)


def test_a_command_of_an_earlier_tick_does_not_command_the_present_one(driver: Driver) -> None:
    """As from a planner that received a tick twice: it commands twice."""
    driver.drive(twist(0.1))
    driver.command(twist(9.0), stamp=TICK_NS)
    driver.graph.settle()
    assert len(driver.odom) == 2
    driver.drive(twist(0.2))
    assert driver.positions[2][0] == pytest.approx(0.3 * TICK_NS * NANO)


def test_a_twist_without_a_goal_step_is_no_command(driver: Driver) -> None:
    driver.cmd_vel.publish(twist(9.0))
    driver.graph.settle()
    assert len(driver.odom) == 1
    driver.drive(twist(0.1))
    assert driver.positions[1] == (0.1 * TICK_NS * NANO, 0.0)


def test_one_stamp_per_tick_rising_from_above_zero(driver: Driver) -> None:
    for _ in range(4):
        driver.drive(twist())
    driver.graph.settle()
    assert driver.stamps == [TICK_NS * (tick + 1) for tick in range(5)]
    assert [stamp_ns(message.clock) for message in driver.clock] == driver.stamps
    assert [stamp_ns(message.header.stamp) for message in driver.obstacles] == driver.stamps
    assert {message.header.frame_id for message in driver.odom + driver.obstacles} == {"odom"}
    assert driver.odom[0].child_frame_id == "base_link"


def test_obstacles_are_the_closed_form_of_time(graph: Graph) -> None:
    for name in ("case2", "walled"):
        driver = Driver(graph, {"scenario": name, **LOCKSTEP})
        driver.wait_for_ticks(1)
        for _ in range(60):
            driver.drive(twist())
        graph.settle()
        shipped = load_scenario(name)
        for tick, message in enumerate(driver.obstacles):
            expected = shipped.centers(tick * TICK_NS * NANO)
            assert [(p.position.x, p.position.y) for p in message.poses] == expected
        graph.stop(driver.world)


def test_odometry_holds_the_velocity_of_the_last_tick(driver: Driver) -> None:
    driver.drive(twist(0.3, 0.4))
    linear = driver.odom[1].twist.twist.linear
    assert (linear.x, linear.y) == (0.3, 0.4)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_the_robot_stands_on_a_twist_that_is_not_finite(driver: Driver, bad: float) -> None:
    driver.drive(twist(0.5))
    for message in (twist(bad), twist(0.0, bad), Twist(angular=Vector3(z=bad))):
        driver.drive(message)
    assert len(set(driver.positions[1:])) == 1
    assert driver.world._refused_inputs.count == 3


def test_a_tick_without_command_is_repeated_and_then_given_up(graph: Graph) -> None:
    driver = Driver(graph, {"lockstep": True, "answer_timeout_s": 0.05, "answer_retries": 2})
    line = r"^tick 0: no goal_step of its stamp and cmd_vel though published 3 times, 0\.05 s"
    with pytest.raises(GraphError, match=line):
        graph.until(lambda: len(driver.odom) > 3)
    assert driver.stamps == [TICK_NS] * 3
    assert len({str(message) for message in driver.obstacles}) == 1


def test_a_late_command_of_a_repeated_tick_counts_once(graph: Graph) -> None:
    driver = Driver(graph, {"lockstep": True, "answer_timeout_s": 0.05, "answer_retries": 10**6})
    graph.until(lambda: len(driver.odom) >= 3)
    driver.command(twist(0.1))
    graph.until(lambda: driver.stamps[-1] > TICK_NS)
    assert driver.stamps[-1] == 2 * TICK_NS


def test_lockstep_starts_when_odom_has_a_subscriber(graph: Graph) -> None:
    """Started by hand, a world may run long without subscribers: that is no fault."""
    world = graph.start(
        WorldSim, {"lockstep": True, "answer_timeout_s": 0.05, "answer_retries": 0}
    )
    started = time.monotonic()
    graph.until(lambda: time.monotonic() > started + 0.3)
    assert world.world.tick == 0
    odom = graph.collect(topics.ODOM)
    graph.until(lambda: len(odom) == 1)


def test_lockstep_starts_when_the_nodes_of_wait_for_are_there(graph: Graph) -> None:
    parameters = {"lockstep": True, "answer_timeout_s": 0.05, "wait_for": "virtual_sensor"}
    graph.start(WorldSim, parameters)
    odom = graph.collect(topics.ODOM)  # odom has a subscriber, but virtual_sensor is missing
    started = time.monotonic()
    graph.until(lambda: time.monotonic() > started + 0.5)
    assert odom == []
    graph.start(VirtualSensor, {})
    graph.until(lambda: len(odom) > 0)


def test_pause_stops_the_world_until_it_ends(driver: Driver) -> None:
    response = driver.pause(True)
    assert (response.success, response.message) == (True, "paused")
    driver.command(twist(0.1))
    driver.graph.settle()
    assert len(driver.odom) == 1
    response = driver.pause(False)
    assert (response.success, response.message) == (True, "running")
    driver.wait_for_ticks(2)
    assert driver.positions[1] == (0.1 * TICK_NS * NANO, 0.0)
    assert driver.pause(False).message == "running"
    driver.graph.settle()
    assert len(driver.odom) == 2, "ending no pause is no command"


def test_step_is_one_tick(driver: Driver) -> None:
    assert driver.trigger("step").message == "refused: not paused; pause first"
    driver.pause(True)
    refused = driver.trigger("step")
    assert not refused.success
    assert refused.message == "refused: the present tick has no command yet"
    for tick in range(1, 4):
        driver.command(twist(0.1))
        driver.graph.settle()
        response = driver.trigger("step")
        assert (response.success, response.message) == (True, f"tick {tick}")
        driver.graph.settle()
        assert len(driver.odom) == tick + 1


def test_started_paused_nothing_moves_before_the_first_step(graph: Graph) -> None:
    driver = Driver(graph, {"start_paused": True, **LOCKSTEP})
    graph.settle()
    assert not driver.clock
    assert driver.trigger("step").message == "tick 0"
    driver.wait_for_ticks(1)
    assert driver.stamps == [TICK_NS]


def test_reset_restores_everything_but_the_stamps(graph: Graph) -> None:
    driver = Driver(graph, {"scenario": scenario(obstacles=OBSTACLES), **LOCKSTEP})
    goals = graph.collect(topics.GOAL_POSE)
    driver.wait_for_ticks(1)
    driver.drive(twist(0.5))
    driver.drive(twist(0.5))
    response = driver.trigger("reset")
    assert (response.success, response.message) == (True, f"tick 0 at stamp {4 * TICK_NS} ns")
    driver.wait_for_ticks(4)
    graph.settle()
    assert driver.stamps == [TICK_NS * k for k in (1, 2, 3, 4)]
    assert driver.positions[3] == (0.0, 0.0)
    assert driver.obstacles[3].poses == driver.obstacles[0].poses
    assert driver.odom[3].twist == driver.odom[0].twist
    assert len(goals) == 2


def test_a_reset_makes_triggers_unreached(graph: Graph) -> None:
    trigger = {"within_m": 0.9, "point_m": [1.0, 0.0]}
    waits = [{**OBSTACLES[0], "trigger": trigger}]
    driver = Driver(graph, LOCKSTEP | {"scenario": scenario(obstacles=waits, goal_m=[5.0, 0.0])})
    driver.wait_for_ticks(1)

    def centers(count: int) -> list[tuple[float, float]]:
        for _ in range(3):
            driver.drive(twist(0.5))
        graph.until(lambda: len(driver.obstacles) == count)
        return [(m.poses[0].position.x, m.poses[0].position.y) for m in driver.obstacles]

    first = centers(4)
    number = next(k for k, (x, y) in enumerate(driver.positions) if math.hypot(x - 1.0, y) <= 0.9)
    assert [point == (3.0, 9.0) for point in first] == [k <= number for k in range(4)]
    driver.trigger("reset")
    driver.wait_for_ticks(5)
    assert centers(8)[4:] == first


def test_a_command_from_before_a_reset_does_not_move_the_new_run(driver: Driver) -> None:
    driver.trigger("reset")
    driver.wait_for_ticks(2)
    driver.command(twist(9.0), stamp=TICK_NS)  # the command of the tick before the reset
    driver.graph.settle()
    assert len(driver.odom) == 2
    driver.drive(twist(0.1))
    assert driver.positions[2] == (0.1 * TICK_NS * NANO, 0.0)


def test_initialpose_puts_the_robot_elsewhere(driver: Driver) -> None:
    teleport = driver.graph.writer(topics.INITIALPOSE)
    pose = PoseWithCovariance(pose=pose_msg(5.0, -6.0, math.pi / 2))
    teleport.publish(PoseWithCovarianceStamped(pose=pose))
    driver.graph.settle()
    driver.drive(twist(0.5, 0.0))
    pose = robot_pose(driver.odom[1])
    # Forward in the body frame is +y for a robot that looks north.
    assert pose.position == pytest.approx((5.0, -6.0 + 0.5 * TICK_NS * NANO))
    assert pose.yaw == pytest.approx(math.pi / 2)
    assert velocity(driver.odom[1].twist) == pytest.approx((0.5, 0.0, 0.0))


def test_an_initialpose_that_is_not_finite_is_refused(driver: Driver) -> None:
    nowhere = PoseWithCovariance(pose=pose_msg(math.nan, 0.0))
    driver.graph.writer(topics.INITIALPOSE).publish(PoseWithCovarianceStamped(pose=nowhere))
    driver.graph.settle()
    driver.drive(twist())
    assert driver.positions == [(0.0, 0.0)] * 2
    assert driver.world._refused_inputs.count == 1


def ends(driver: Driver) -> list[tuple[str, str]]:
    return [(message.message, message.values[0].value) for message in driver.outcome]


def test_the_run_ends_at_the_goal(driver: Driver) -> None:
    dt = TICK_NS * NANO
    driver.drive(twist(0.5 / dt))
    driver.drive(twist(0.49 / dt))
    driver.command(twist(1.0))
    driver.graph.until(lambda: driver.world.over)
    driver.graph.settle()
    assert len(driver.odom) == 3
    assert ends(driver) == [("running", "0"), ("goal_reached", "3")]
    driver.pause(True)
    assert driver.trigger("step").message == "refused: the run is over; reset first"
    driver.trigger("reset")
    driver.pause(False)
    driver.wait_for_ticks(4)
    assert ends(driver)[2:] == [("running", "0")]


def test_the_run_ends_at_the_time_limit(graph: Graph) -> None:
    limit_s = 2.5 * TICK_NS * NANO
    driver = Driver(graph, {"scenario": scenario(time_limit_s=limit_s), **LOCKSTEP})
    driver.wait_for_ticks(1)
    for _ in range(3):
        driver.drive(twist())
    driver.command(twist())
    graph.until(lambda: driver.world.over)
    graph.settle()
    assert len(driver.odom) == 4
    assert ends(driver) == [("running", "0"), ("time_limit", "4")]


def test_run_on_goes_on(graph: Graph) -> None:
    limit_s = 1.5 * TICK_NS * NANO
    driver = Driver(
        graph, {"scenario": scenario(time_limit_s=limit_s), "run_on": True, **LOCKSTEP}
    )
    driver.wait_for_ticks(1)
    driver.drive(twist(1.0 / (TICK_NS * NANO)))
    for _ in range(5):
        driver.drive(twist())
    assert ends(driver) == [("running", "0")]


def test_real_time_ticks_on_a_wall_timer_with_the_newest_twist(graph: Graph) -> None:
    parameters = {"scenario": scenario(), "speed_factor": 20.0, "tick_ns": 10**9}
    driver = Driver(graph, parameters)
    assert 50_000_000 in [timer.timer_period_ns for timer in driver.world.timers]
    graph.until(lambda: len(driver.odom) == 2)
    started = time.monotonic()
    driver.cmd_vel.publish(twist(9.0))
    driver.cmd_vel.publish(twist(0.01))
    graph.until(lambda: len(driver.odom) == 7)
    assert time.monotonic() - started > 4 * 0.05
    assert driver.stamps == [k * 10**9 for k in range(1, 8)]
    steps = [b[0] - a[0] for a, b in zip(driver.positions[2:], driver.positions[3:])]
    assert steps == pytest.approx([0.01] * len(steps))


def test_real_time_starts_when_the_nodes_of_wait_for_are_there(graph: Graph) -> None:
    driver = Driver(graph, {"speed_factor": 1000.0, "wait_for": "virtual_sensor"})
    graph.settle()
    assert driver.odom == []
    graph.start(VirtualSensor, {})
    graph.until(lambda: len(driver.odom) > 2)


def test_real_time_can_be_paused_and_stepped(graph: Graph) -> None:
    driver = Driver(graph, {"start_paused": True, "speed_factor": 1000.0})
    for tick in range(3):
        assert driver.trigger("step").message == f"tick {tick}"
    driver.wait_for_ticks(3)
    driver.pause(False)
    graph.until(lambda: len(driver.odom) > 5)
    driver.pause(True)
    graph.settle()
    count = len(driver.odom)
    graph.settle()
    assert len(driver.odom) == count


def test_stamped_twists_are_followed_where_enabled(graph: Graph) -> None:
    parameters = {"enable_stamped_cmd_vel": True, "scenario": scenario(), **LOCKSTEP}
    driver = Driver(graph, parameters, TwistStamped)
    driver.wait_for_ticks(1)
    for stamp, vx in ((TICK_NS - 1, 9.0), (TICK_NS, 0.2)):
        message = TwistStamped(twist=twist(vx))
        set_header(message.header, stamp, "base_link")
        driver.cmd_vel.publish(message)
    driver.wait_for_ticks(2)
    assert driver.positions[1] == (0.2 * TICK_NS * NANO, 0.0)


def test_goal_and_outcome_are_latched_for_late_subscribers(driver: Driver) -> None:
    for _ in range(3):
        driver.drive(twist())
    goals = driver.graph.collect(topics.GOAL_POSE)
    outcome = driver.graph.collect(topics.OUTCOME)
    driver.graph.until(lambda: bool(goals and outcome))
    assert (goals[0].pose.position.x, goals[0].pose.position.y) == (1.0, 0.0)
    assert goals[0].header.frame_id == "odom"
    assert outcome[0].message == "running"


def test_views_are_published_at_their_own_low_rate(graph: Graph) -> None:
    period_s = 3 * TICK_NS * NANO
    trail, marks = graph.collect(topics.TRAIL), graph.collect(topics.MARKERS)
    driver = Driver(graph, {"scenario": "case2", "view_period_s": period_s, **LOCKSTEP})
    driver.wait_for_ticks(1)
    for _ in range(6):
        driver.drive(twist(0.1))
    graph.settle()
    assert [len(path.poses) for path in trail] == [1, 2, 3]
    assert len(marks) == 3
    names = [mark.ns for mark in marks[0].markers]
    assert names.count("obstacles") == names.count("velocities") == 5
    for point, path in zip(driver.positions[::3], trail):
        assert (path.poses[-1].pose.position.x, path.poses[-1].pose.position.y) == point


def test_the_whole_scenario_is_a_parameter(graph: Graph) -> None:
    world = graph.start(WorldSim, {"scenario": "walled", "scenario_json": "a lie"})
    text = world.get_parameter("scenario_json").value
    assert load_scenario(text) == load_scenario("walled")
    assert graph.set_parameter("world_sim", "scenario_json", "a lie") == (
        "Trying to set a read-only parameter: scenario_json."
    )


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"scenario": "case9"}, r"^'case9': no such scenario; did you mean 'case[12]'\?"),
        (
            {"speed_factor": 0.0},
            r"^speed_factor=0.0: out of range; give a value in \[0.01, 1000\]",
        ),
        ({"speed_factor": math.nan}, r"^speed_factor=nan: "),
        ({"tick_ns": 1}, r"^tick_ns=1: out of range"),
        ({"tick_ns": 1e9}, r"^parameter tick_ns=1000000000.0: wrong type; give a int"),
        ({"speed_factor": 1}, r"^parameter speed_factor=1: wrong type; .*write 1.0, not 1"),
        ({"lockstep": "yes"}, r"^parameter lockstep='yes': wrong type; give a bool"),
    ],
)
def test_bad_parameters_are_refused_at_start(
    graph: Graph, parameters: dict[str, Any], line: str
) -> None:
    with pytest.raises(ConfigError, match=line):
        graph.start(WorldSim, parameters)
