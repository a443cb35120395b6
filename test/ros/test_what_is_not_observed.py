# SPDX-License-Identifier: Apache-2.0
"""On the real graph: the robot does not drive into directions that no beam has covered."""

import math
from typing import Any

import pytest
from planner_talk import LOCKSTEP, PlannerHarness, fields, mode, odom, sectors
from rclpy.parameter import Parameter
from real_time_robot import BEAMS, DRIVES, FREE, STOPS, TRACKING, RealTimeRobot, scan_of, stamp
from ros_graph import Graph

from mfba_planner.core.planner_types import Mode
from mfba_planner.recording.from_messages import decision

PAPER = {"method": "paper"}
FRONT = tuple(math.nan if abs(k - BEAMS // 2) < 12 else math.inf for k in range(BEAMS))


def velocity(robot: RealTimeRobot) -> tuple[float, float]:
    return decision(robot.decisions[-1], ()).velocity


@pytest.mark.parametrize("planner", [PAPER, TRACKING], ids=["paper", "predictive"])
@pytest.mark.parametrize(
    ("convention", "reading", "expected"),
    [
        ("inf", math.inf, DRIVES),
        ("inf", 0.0, STOPS),
        ("inf", math.nan, STOPS),
        ("zero", 0.0, DRIVES),
        ("nan", math.nan, DRIVES),
        ("range_max", 10.0, DRIVES),
        ("zero", math.nan, STOPS),
    ],
)
def test_what_a_driver_reports_for_nothing(
    graph: Graph, planner: dict[str, str], convention: str, reading: float, expected: str
) -> None:
    robot = RealTimeRobot(graph, planner=planner, scan_no_return=convention)
    ranges = (reading,) * BEAMS
    robot.drive(ranges=ranges)
    assert robot.drive(ranges=ranges) == expected
    if expected == STOPS:
        assert "scan_no_return" in robot.inputs("virtual_sensor").message


@pytest.mark.parametrize("planner", [PAPER, TRACKING], ids=["paper", "predictive"])
def test_a_goal_in_a_direction_that_no_beam_covers(graph: Graph, planner: dict[str, str]) -> None:
    robot = RealTimeRobot(graph, planner=planner)
    for _ in range(3):
        driven = robot.drive(ranges=FRONT)
        vx, vy = velocity(robot)
        if planner is PAPER:
            assert driven == Mode.OBSTACLE_AVOIDANCE.value
            assert abs(math.atan2(vy, vx)) > math.radians(50.0)
        else:
            assert (driven, vx, vy) == (Mode.BLOCKED.value, 0.0, 0.0)
            assert robot.reason == "no direction that the lidar has covered leads on"
    for _ in range(3):
        robot.drive()
    vx, vy = velocity(robot)
    # A goal step of the paper's swarm turns with the stamp, by 37 degrees in 1 of 20000 draws.
    largest = math.radians(45.0) if planner is PAPER else 1e-9
    assert math.hypot(vx, vy) > 0.5
    assert abs(math.atan2(vy, vx)) < largest, "it is covered now"


def test_a_direction_stays_observed_for_a_moment(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=TRACKING)
    start, speeds = stamp(), []
    for k in range(16):
        ranges: Any = FREE if k < 2 else FRONT
        robot.send_odom(start + k * 100_000_000)
        robot.send_scan(scan_of(start + k * 100_000_000, ranges))
        speeds.append(math.hypot(*velocity(robot)))
    assert min(speeds[:12]) > 0.5
    assert speeds[12:] == [0.0] * 4


def test_a_planner_set_to_predictive_while_it_runs_reads_the_scan(graph: Graph) -> None:
    robot = RealTimeRobot(graph, planner=PAPER)
    perceptions = []
    for name, value in (("method", "paper"), ("method", "predictive"), ("perception", "sectors")):
        (result,) = robot.planner.set_parameters([Parameter(name, value=value)])
        assert result.successful, result.reason
        graph.settle()
        for _ in range(3):
            robot.drive()
        perceptions.append(fields(robot.decisions[-1])["perception"])
    assert perceptions == ["sectors", "scan", "sectors"]


def test_without_a_lidar_the_sectors_are_all_there_is(graph: Graph) -> None:
    harness = PlannerHarness(graph, {**LOCKSTEP, **TRACKING})
    decision_message = harness.decide(odom(1), sectors(1))
    assert fields(decision_message)["perception"] == "sectors"
    assert mode(decision_message) is Mode.PATH_GENERATION
