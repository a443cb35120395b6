# SPDX-License-Identifier: Apache-2.0
"""A differential base whose lidar does not cover its back turns to where it has not looked."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.robot_base import Base, Drive
from mfba_planner.core.segments import Segment
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.base_planner import Move
from mfba_planner.planning.differential_drive import Speeds, apply_command, heading_law
from mfba_planner.planning.mode_transitions import Event
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.planning.turn_to_observe import turn_to_observe
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario

PARAMS = preset(PlannerParams(method=Method.PREDICTIVE))
LIDAR = Lidar(beams=270, fov_rad=math.radians(270.0))
POCKET = ((-1.5, 0.4, 0.45, 0.4), (0.45, 0.4, 0.45, -0.4), (0.45, -0.4, -1.5, -0.4))
BLOCKED = Move(velocity=(0.0, 0.0), reason="blocked", event=Event.NO_GAP)


def driven(
    drive: Drive,
    reverse: bool,
    radius_m: float,
    goal_x: float,
    segments_m: tuple[Segment, ...] = (),
) -> Episode:
    robot = Robot(drive=drive, reverse=reverse, lidar=LIDAR)
    scenario = Scenario(
        name="behind", start_m=(0.0, 0.0), goal_m=(goal_x, 0.0), robot_radius_m=radius_m,
        time_limit_s=60.0, robot=robot, segments_m=segments_m,
    )  # fmt: skip
    return simulate(scenario, planner=PARAMS, sensor=SensorParams(), seed=0)


@pytest.mark.parametrize("reverse", [False, True])
def test_a_goal_behind_the_robot_is_reached(reverse: bool) -> None:
    episode = driven(Drive.DIFFERENTIAL, reverse, 0.3, -3.0)
    assert "turns to where the lidar has not covered" in episode.ticks[0].reason
    assert evaluate(episode).success


@pytest.mark.no_cover
@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("radius_m", [0.22, 0.3])
def test_a_narrow_pocket_is_left_backwards(reverse: bool, radius_m: float) -> None:
    episode = driven(Drive.DIFFERENTIAL, reverse, radius_m, 3.0, segments_m=POCKET)
    assert evaluate(episode).success
    if not reverse:
        assert any("leaves no way out; turns" in tick.reason for tick in episode.ticks)


def test_a_base_that_cannot_turn_stands() -> None:
    episode = driven(Drive.OMNIDIRECTIONAL, True, 0.3, -3.0)
    assert {tick.velocity for tick in episode.ticks} == {(0.0, 0.0)}


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.booleans(), st.floats(0.1, 1.5))
def test_it_turns_without_driving_to_the_nearest_unobserved_heading(
    yaw: float, wanted: float, reverse: bool, first_rad: float
) -> None:
    base = Base(drive=Drive.DIFFERENTIAL, reverse=reverse, turn_first_rad=first_rad)
    headings = 2.0 * math.pi / 72 * np.arange(1, 73)
    off = np.abs(np.remainder(headings - yaw + math.pi, 2.0 * math.pi) - math.pi)
    unobserved = off > math.radians(135.0)
    move = turn_to_observe(BLOCKED, unobserved, wanted, yaw, Speeds(), base)
    speeds = heading_law(move.velocity, 9.0, yaw, base, 0.1)
    pose, _ = apply_command(Pose2D(0.0, 0.0, yaw), Speeds(), speeds, base, 100_000_000)
    assert math.hypot(*pose.position) < 1e-3
    assert abs(speeds.omega) > 0.1
    side = math.remainder(wanted - yaw, 2.0 * math.pi)
    if 0.1 < abs(side) < math.pi - 0.1:
        assert math.copysign(1.0, speeds.omega) == math.copysign(1.0, side)
    again = turn_to_observe(BLOCKED, unobserved, wanted, yaw, Speeds(0.0, -0.5), base)
    assert heading_law(again.velocity, 9.0, yaw, base, 0.1).omega < 0.0, "it goes on"
