# SPDX-License-Identifier: Apache-2.0
"""The oracle for a robot with a footprint: paths of the disc around it, proofs of one within."""

from dataclasses import replace

import pytest

from mfba_planner.core.segments import Segment
from mfba_planner.evaluation.oracle import (
    Certificate,
    TimedPose,
    footprint_clearance,
    inspect,
    solve,
)
from mfba_planner.evaluation.oracle.footprint_discs import disc_around, disc_within
from mfba_planner.simulation.footprint import Footprint, circumscribed_radius_m, parse_footprint
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.simulation.scenario import Scenario

V = 0.8
LONG = parse_footprint([[0.3, 0.0, 0.2], [0.0, 0.0, 0.2], [-0.3, 0.0, 0.2]])
APART = parse_footprint([[0.3, 0.0, 0.2], [-0.3, 0.0, 0.2]])


def task(*segments: Segment, footprint: Footprint = LONG, post: float | None = None) -> Scenario:
    obstacles = () if post is None else (Obstacle(center_m=(3.0, post), radius_m=0.3),)
    return Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(6.0, 0.0),
        robot_radius_m=circumscribed_radius_m(footprint),
        robot=Robot(footprint_m=footprint),
        segments_m=segments,
        obstacles=obstacles,
        time_limit_s=30.0,
    )


def door(width_m: float) -> tuple[Segment, ...]:
    """A room around start and goal, and a wall with a door of that width between them."""
    corners = [(-2.0, -2.0), (8.0, -2.0), (8.0, 2.0), (-2.0, 2.0), (-2.0, -2.0)]
    room = tuple((*a, *b) for a, b in zip(corners, corners[1:]))
    half = 0.5 * width_m
    return (*room, (3.0, -2.0, 3.0, -half), (3.0, half, 3.0, 2.0))


def test_a_path_is_that_of_the_disc_and_free_for_the_footprint() -> None:
    scenario = task(post=0.1)
    found = solve(scenario, V)
    disc = replace(scenario, robot=Robot())
    assert found == solve(disc, V)
    assert inspect(disc, found.waypoints, V)[1] == ""
    for yaw in (0.0, 0.7, 1.5):
        poses = [TimedPose(*w, yaw) for w in found.waypoints]
        assert footprint_clearance(scenario, poses) >= found.clearance_m - 1e-9


def test_a_door_for_the_footprint_only_is_not_called_closed() -> None:
    found = solve(task(*door(0.8)), V)
    assert found.certificate is Certificate.UNDECIDED
    assert found.reason == (
        "no path found for the disc around the footprint, and no proof that there is none for the "
        "disc of 0.2 m within it"
    )
    closed = solve(replace(task(*door(0.8)), robot=Robot()), V)
    assert closed.certificate is Certificate.INFEASIBLE, "for the disc"


def test_a_door_too_narrow_for_the_disc_within_is_closed() -> None:
    found = solve(task(*door(0.2)), V)
    assert found.certificate is Certificate.INFEASIBLE
    assert found.reason == "walls enclose the start or goal_m"


def test_without_a_disc_within_there_is_no_proof() -> None:
    assert disc_within(task(footprint=APART)) is None
    found = solve(task(*door(0.2), footprint=APART), V)
    assert found.certificate is Certificate.UNDECIDED
    assert found.reason == (
        "no path found for the disc around the footprint, and no circle of it holds base_link, so "
        "there is no proof that there is none"
    )


def test_a_start_where_the_disc_touches_is_undecided() -> None:
    beside = task((-1.0, 0.3, 1.0, 0.3))
    found = solve(beside, V)
    assert found.certificate is Certificate.UNDECIDED
    assert found.reason.startswith("for the disc around the footprint, start_m=[0.0, 0.0]: 0.2 m")
    assert disc_around(task()).robot_radius_m == 0.5


def test_clearance_of_the_check() -> None:
    scenario = task((2.0, 0.3, 4.0, 0.3))
    ahead = [TimedPose(0.0, 0.0, 0.0, 0.0), TimedPose(7.5, 6.0, 0.0, 0.0)]
    assert footprint_clearance(scenario, ahead) == pytest.approx(0.1)
    across = [pose._replace(yaw=1.5707963267948966) for pose in ahead]
    assert footprint_clearance(scenario, across) == pytest.approx(-0.2, abs=1e-5)
    stands = [ahead[0], ahead[0]]
    assert footprint_clearance(task(post=0.0), stands) == float("inf"), "no time has passed"
