# SPDX-License-Identifier: Apache-2.0
"""Differential drive: heading law, simulated base, and runs to the goal."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D, distance, pose_as_in_message
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.planning.differential_drive import (
    Speeds,
    apply_command,
    arc,
    brake,
    command,
    track,
)
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario, parse_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World

TICK_NS = 100_000_000
ORIGIN = Pose2D(0.0, 0.0)
BASE = Base(drive=Drive.DIFFERENTIAL)
angles = st.floats(-math.pi, math.pi)


def decision(
    velocity: tuple[float, float], pose: Pose2D = ORIGIN, goal: Point = (9.0, 9.0)
) -> Decision:
    return Decision(
        stamp_ns=1,
        mode=Mode.PATH_GENERATION,
        reason="",
        pose=pose,
        goal=goal,
        ranges_m=(),
        vs=(),
        vg=(),
        gap=0,
        waypoint=(0.0, 0.0),
        velocity=velocity,
    )


def test_the_command_of_an_omnidirectional_base_is_the_velocity() -> None:
    assert command(decision((0.3, -0.4)), Base(), TICK_NS) == (0.3, -0.4)


def test_drives_ahead_but_turns_first_towards_a_side() -> None:
    assert track(decision((0.5, 0.0)), BASE, TICK_NS) == (0.5, 0.0)
    left = track(decision((0.0, 0.5)), BASE, TICK_NS)
    assert left.v == 0.0
    assert left.omega > 0.0
    right = track(decision((0.4, -0.1)), BASE, TICK_NS)
    assert 0.0 < right.v < 0.5
    assert right.omega < 0.0
    assert track(decision((0.0, 0.0)), BASE, TICK_NS) == (0.0, 0.0)


def test_half_the_speed_at_half_of_turn_first_rad() -> None:
    u = 0.5  # m/s, slow enough for every limit
    wanted = (u * math.cos(0.4), u * math.sin(0.4))
    commanded = track(decision(wanted), replace(BASE, turn_first_rad=0.8), TICK_NS)
    assert commanded.v == pytest.approx(0.5 * u)
    a, t = BASE.max_turn_accel_radps2, 0.1
    assert commanded.omega == pytest.approx(a * (math.sqrt(t * t + 2.0 * 0.4 / a) - t))


def test_reverses_only_where_allowed() -> None:
    back = track(decision((-0.5, 0.05)), BASE, TICK_NS)
    assert back.v < 0.0
    assert back.omega < 0.0
    round_about = track(decision((-0.5, 0.05)), replace(BASE, reverse=False), TICK_NS)
    assert round_about.v == 0.0
    assert round_about.omega > 0.0


@given(left=st.floats(0.0, 100.0), a=st.floats(0.01, 100.0), held=st.floats(0.001, 2.0))
def test_the_speed_of_brake_stops_in_time(left: float, a: float, held: float) -> None:
    v = brake(left, a, held)
    assert v * held + v * v / (2.0 * a) == pytest.approx(left, rel=1e-6, abs=1e-9)


@given(yaw=angles, v=st.floats(-2.0, 2.0), omega=st.floats(-3.0, 3.0), chunks=st.integers(2, 50))
def test_an_arc_equals_its_pieces(yaw: float, v: float, omega: float, chunks: int) -> None:
    whole = arc(Pose2D(1.0, 2.0, yaw), v, omega, 0.4)
    pose = Pose2D(1.0, 2.0, yaw)
    for _ in range(chunks):
        pose = arc(pose, v, omega, 0.4 / chunks)
    assert (pose.x, pose.y) == pytest.approx((whole.x, whole.y), abs=1e-9)
    assert math.cos(pose.yaw - whole.yaw) == pytest.approx(1.0)


def test_a_quarter_of_a_circle() -> None:
    pose = arc(Pose2D(0.0, 0.0), 0.5 * math.pi, 0.5 * math.pi, 1.0)
    assert pose == pytest.approx((1.0, 1.0, 0.5 * math.pi))


@given(
    commanded=st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)),
    v=st.floats(-1.0, 1.0),
    omega=st.floats(-2.84, 2.84),
)
def test_limits_hold_for_any_command(
    commanded: tuple[float, float], v: float, omega: float
) -> None:
    pose, now = apply_command(Pose2D(0.0, 0.0), Speeds(v, omega), commanded, BASE, TICK_NS)
    assert abs(now.v) <= BASE.max_speed_mps
    assert abs(now.omega) <= BASE.max_turn_radps
    assert abs(now.v - v) <= BASE.max_accel_mps2 * 0.1 + 1e-9
    assert abs(now.omega - omega) <= BASE.max_turn_accel_radps2 * 0.1 + 1e-9
    assert distance((0.0, 0.0), pose.position) <= 0.1 * BASE.max_speed_mps + 1e-9


@pytest.mark.parametrize("goal", [(3.0, 0.0), (-3.0, 0.1), (0.0, -2.0), (-0.5, 0.5)])
@pytest.mark.parametrize("reverse", [True, False])
def test_the_robot_arrives_and_stops(goal: tuple[float, float], reverse: bool) -> None:
    robot = Robot(drive=Drive.DIFFERENTIAL, reverse=reverse)
    scenario = Scenario(name="x", start_m=(0.0, 0.0), goal_m=goal, robot=robot)
    params = PlannerParams(speed_mps=0.8, step_length_m=0.08)
    episode = run(scenario, planner=params, seed=1)
    assert episode.outcome is Outcome.GOAL_REACHED
    straight = distance((0.0, 0.0), goal)
    assert len(episode.ticks) * 0.1 < straight / 0.8 + 4.0
    for a, b in zip(episode.ticks, episode.ticks[1:]):
        assert distance(a.pose.position, b.pose.position) <= 0.08 + 1e-9


def test_a_robot_placed_elsewhere_is_at_rest() -> None:
    scenario = replace(load_scenario("empty"), robot=Robot(drive=Drive.DIFFERENTIAL))
    world = World(scenario, TICK_NS, 0.02)
    world.step((1.0, 0.5))
    assert world.speeds.v > 0.0
    world.put(Pose2D(5.0, 5.0, 1.0))
    world.step((0.0, 0.0))
    assert world.pose == (5.0, 5.0, 1.0)


def test_a_pose_survives_a_message() -> None:
    pose = Pose2D(1.0, 2.0, 0.0)
    assert pose_as_in_message(pose) is pose
    assert pose_as_in_message(Pose2D(1.0, 2.0, 3.0)) == pytest.approx((1.0, 2.0, 3.0))


def test_the_robot_of_a_scenario_survives_a_round_trip() -> None:
    text = (
        "{name: x, start_m: [0.0, 0.0], goal_m: [1.0, 1.0], "
        "robot: {drive: differential, max_turn_radps: 1, lidar: {beams: 720}, "
        "noise: {odom_m: 0.01}}}"
    )
    scenario = parse_scenario(text, "it")
    assert scenario.robot == Robot(
        drive=Drive.DIFFERENTIAL,
        max_turn_radps=1.0,
        lidar=Lidar(beams=720),
        noise=Noise(odom_m=0.01),
    )
    assert scenario.robot.base == Base(drive=Drive.DIFFERENTIAL, max_turn_radps=1.0)
    assert parse_scenario(scenario_to_json(scenario), "again") == scenario
    assert "robot" not in scenario_to_json(replace(scenario, robot=Robot())).replace(
        "robot_radius_m", ""
    )


@pytest.mark.parametrize(
    ("robot", "reason"),
    [
        ("{drive: legs}", r"robot.drive='legs': unknown; choose one of omnidirectional, diff"),
        ("{max_speed_mps: 0.0}", r"robot.max_speed_mps=0.0: out of range; give a value in \["),
        ("{lidar: {beams: 5}}", r"robot.beams=5: fewer than 12; give 0 \(no lidar\) or more"),
        ("{lidar: {beams: 2000}}", r"robot.beams=2000: out of range; give a value in \[0, 1080"),
        ("{lidar: {range_min_m: 4.0}}", r"robot.range_min_m=4: not below range_max_m=3.5"),
        ("{noise: {odom_m: .nan}}", r"robot.odom_m=nan: not finite"),
        ("{noise: {odom: 1}}", r"robot.noise.odom: unknown option; did you mean"),
        ("{lidar: 360}", r"robot.lidar: unknown option; did you mean"),
        ("[1]", r"robot=\[1\]: refused"),
    ],
)
def test_invalid_robots_are_refused(robot: str, reason: str) -> None:
    text = f"{{name: x, start_m: [0.0, 0.0], goal_m: [1.0, 1.0], robot: {robot}}}"
    with pytest.raises(ConfigError, match=f"^it: {reason}"):
        parse_scenario(text, "it")
