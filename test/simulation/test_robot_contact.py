# SPDX-License-Identifier: Apache-2.0
"""A footprint of circles: parsing, geometry, and contact that is continuous while it turns."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from trip_samples import trip

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.core.robot_base import Drive
from mfba_planner.core.segments import Segment
from mfba_planner.evaluation.contacts_and_clearances import WALL
from mfba_planner.evaluation.metrics import assess, tick_clearances
from mfba_planner.evaluation.oracle import TimedPose, footprint_clearance
from mfba_planner.simulation.batched_motion import StepClearances
from mfba_planner.simulation.footprint import (
    FootprintCircle,
    circles_at,
    circumscribed_radius_m,
    inscribed_radius_m,
    parse_footprint,
)
from mfba_planner.simulation.lidar_perception import with_lidar
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn
from mfba_planner.simulation.robot_contact import CURVE_M, RobotContact
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.simulation.scenario import FleetRobot, Kidnapping, Scenario

LONG = ((0.25, 0.0, 0.2), (-0.25, 0.0, 0.2))  # 0.9 m long, 0.4 m wide
NUMBERS = st.floats(-2.0, 2.0)
CIRCLES = st.lists(
    st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(0.05, 0.5)),
    min_size=1, max_size=4,
)  # fmt: skip
POSES = st.lists(st.tuples(NUMBERS, NUMBERS, st.floats(-3.1, 3.1)), min_size=2, max_size=5)


def world(
    footprint: object = LONG,
    obstacles: tuple[Obstacle, ...] = (),
    segments_m: tuple[Segment, ...] = (),
    drive: Drive = Drive.DIFFERENTIAL,
    start_m: Point = (50.0, 50.0),
    **more: object,
) -> Scenario:
    robot = Robot(drive=drive, footprint_m=footprint)  # type: ignore[arg-type]
    radius_m = circumscribed_radius_m(robot.footprint_m) or 0.3
    values = {"robot_radius_m": radius_m, "goal_m": (60.0, 50.0), **more}
    return Scenario(
        name="x", start_m=start_m, robot=robot, obstacles=obstacles, segments_m=segments_m,
        **values,  # type: ignore[arg-type]
    )  # fmt: skip


def steps(scenario: Scenario, *poses: tuple[float, float, float]) -> StepClearances:
    """Steps of one second each."""
    return RobotContact(scenario).steps(np.arange(float(len(poses))), np.array(poses).T)


# --- the circles --------------------------------------------------------------------------------


def test_radii_around_and_within() -> None:
    footprint = parse_footprint([[0.3, 0.4, 0.2], [0.1, 0, 0.3]])
    assert footprint[1] == FootprintCircle(0.1, 0.0, 0.3)
    assert circumscribed_radius_m(footprint) == pytest.approx(0.7)
    assert inscribed_radius_m(footprint) == pytest.approx(0.2, abs=1e-6)
    assert inscribed_radius_m(footprint[:1]) == 0.0, "base_link lies outside"
    assert (circumscribed_radius_m(()), inscribed_radius_m(())) == (0.0, 0.0)


def test_the_radius_within_is_that_of_the_circles_together() -> None:
    row = parse_footprint([(0.3, 0.0, 0.2), (0.0, 0.0, 0.2), (-0.3, 0.0, 0.2)])
    assert inscribed_radius_m(row) == pytest.approx(0.2, abs=1e-6)
    pair = parse_footprint([(0.3, 0.0, 0.5), (-0.3, 0.0, 0.5)])
    assert inscribed_radius_m(pair) == pytest.approx(0.4, abs=1e-6), "their corners"
    held = parse_footprint([(0.0, 0.0, 0.1), (0.0, 0.1, 0.5)])
    assert inscribed_radius_m(held) == pytest.approx(0.4, abs=1e-6)
    touching = parse_footprint([(0.1, 0.0, 0.1), (-0.1, 0.0, 0.1)])
    assert inscribed_radius_m(touching) == 0.0


@given(footprint=CIRCLES, share=st.floats(0.0, 1.0), heading_rad=st.floats(-3.2, 3.2))
@example(footprint=[(0.0, 2e-162, 0.5)], share=0.0, heading_rad=0.0)
@example(footprint=[(0.0, 2e-11, 0.5), (0.0, -2e-11, 0.4)], share=1.0, heading_rad=1.5)
def test_the_disc_within_is_covered(
    footprint: list[tuple[float, float, float]], share: float, heading_rad: float
) -> None:
    circles = parse_footprint(footprint)
    within_m = inscribed_radius_m(circles)
    assert within_m >= max(c.radius - c.offset_m for c in circles) - 1e-6
    far = share * within_m
    point = (far * math.cos(heading_rad), far * math.sin(heading_rad))
    assert not within_m or any(distance(point, (c.x, c.y)) <= c.radius for c in circles)


def test_circles_turn_with_the_robot() -> None:
    (center, radius), _ = circles_at(parse_footprint(LONG), Pose2D(1.0, 2.0, math.pi / 2))
    assert center == pytest.approx((1.0, 2.25))
    assert radius == 0.2


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (5, "footprint_m=5: not a list; give circles [[x, y, radius], ...], m"),
        ([5], "footprint_m circle 1=5: not three numbers; give [x, y, radius] in base_link, m"),
        ([[0, 0]], "footprint_m circle 1=[0, 0]: not three numbers; give [x, y, radius] in "
         "base_link, m"),
        ([[0, 0, 1], [0, 0, 1, 2]], "footprint_m circle 2=[0, 0, 1, 2]: not three numbers; give "
         "[x, y, radius] in base_link, m"),
        ([[0, 0, "wide"]], "footprint_m circle 1=[0, 0, 'wide']: not three numbers; give "
         "[x, y, radius] in base_link, m"),
        ([[0, 0, True]], "footprint_m circle 1=[0, 0, True]: not three numbers; give "
         "[x, y, radius] in base_link, m"),
        ([[math.nan, 0, 1]], "footprint_m circle 1=[nan, 0, 1]: not finite, or beyond 100 m; "
         "give [x, y, radius] in base_link, m"),
        ([[0, -1e9, 1]], "footprint_m circle 1=[0, -1000000000.0, 1]: not finite, or beyond "
         "100 m; give [x, y, radius] in base_link, m"),
        ([[0, 0, 0]], "footprint_m circle 1=[0, 0, 0]: radius 0; give a radius above 0 m"),
        ([[0, 0, -0.5]], "footprint_m circle 1=[0, 0, -0.5]: radius -0.5; give a radius above "
         "0 m"),
        ([[0, 0, 1]] * 17, "footprint_m: 17 circles, more than 16; give fewer, larger ones"),
    ],
)  # fmt: skip
def test_what_is_no_footprint_is_refused(given: object, reason: str) -> None:
    with pytest.raises(ConfigError) as refused:
        Robot(footprint_m=given)  # type: ignore[arg-type]
    assert str(refused.value) == reason


def test_no_circles_are_the_disc() -> None:
    assert Robot(footprint_m=[]) == Robot()  # type: ignore[arg-type]
    disc = world(())
    assert disc.robot_circles(Pose2D(1.0, 2.0, 3.0)) == [((1.0, 2.0), 0.3)]


# --- tasks --------------------------------------------------------------------------------------


def refusal(**values: object) -> str:
    with pytest.raises(ConfigError) as refused:
        world(**values)  # type: ignore[arg-type]
    return str(refused.value)


def test_a_radius_that_does_not_hold_the_circles_is_refused() -> None:
    assert refusal(robot_radius_m=0.4) == (
        "robot_radius_m=0.4: robot.footprint_m reaches 0.45 m from base_link; give at least that, "
        "or leave robot_radius_m out"
    )
    assert world(robot_radius_m=0.6).robot_radius_m == 0.6


def test_a_start_in_contact_is_that_of_the_circles() -> None:
    beside = Obstacle(center_m=(50.0, 50.4), radius_m=0.1)  # 0.3 m from its side, in the disc
    assert world(obstacles=(beside,)).obstacles
    ahead = Obstacle(center_m=(50.5, 50.0), radius_m=0.1)
    assert "starts 0.05 m inside obstacle 1" in refusal(obstacles=(ahead,))
    assert world(segments_m=((49.0, 50.3, 51.0, 50.3),)).segments_m
    assert refusal(segments_m=((50.4, 49.0, 50.4, 51.0),)) == (
        "start_m=[50.0, 50.0]: 0.05 m inside a wall segment (robot.footprint_m added); "
        "move it away from the wall"
    )


def test_at_the_goal_a_robot_that_turns_may_have_any_heading() -> None:
    ahead = ((60.4, 49.0, 60.4, 51.0),)  # across its way, at its front
    assert world(segments_m=ahead).segments_m
    assert "goal_m=" in refusal(segments_m=ahead, drive=Drive.OMNIDIRECTIONAL)
    through = ((60.0, 49.0, 60.0, 51.0),)
    assert world(segments_m=through).segments_m, "no circle holds base_link"
    middle = [*LONG, (0.0, 0.0, 0.2)]
    assert "0.2 m inside a wall segment" in refusal(segments_m=through, footprint=middle)


def test_a_kidnapping_into_an_obstacle() -> None:
    to = (Kidnapping(at_s=1.0, to_m=(55.0, 50.0)),)
    ahead = (Obstacle(center_m=(55.5, 50.0), radius_m=0.1),)
    assert world(obstacles=ahead, kidnappings=to).kidnappings
    assert "0.05 m inside obstacle 1" in refusal(
        obstacles=ahead, kidnappings=to, drive=Drive.OMNIDIRECTIONAL
    )


def test_fleets_are_of_discs() -> None:
    members = (
        FleetRobot(name="a", start_m=(50.0, 50.0), goal_m=(60.0, 50.0)),
        FleetRobot(name="b", start_m=(50.0, 55.0), goal_m=(60.0, 55.0)),
    )
    assert refusal(robots=members) == (
        "robots: a fleet with robot.footprint_m not supported; leave one of them out"
    )


def test_a_perception_of_a_sweep_keeps_the_shape() -> None:
    swept = with_lidar(world(), "lidar-realistic")
    assert swept.robot.footprint_m == LONG
    assert swept.robot.lidar.beams


# --- contact ------------------------------------------------------------------------------------


def test_without_circles_all_figures_are_those_of_the_disc() -> None:
    disc = world((), (Obstacle(center_m=(1.0, 0.2), radius_m=0.3),), ((2.0, -1.0, 2.0, 1.0),))
    poses = np.array([(0.0, 0.0, 1.0), (0.5, 0.1, 2.0), (1.0, 0.0, 3.0)]).T
    times_s = np.arange(3.0)
    found, expected = (
        RobotContact(disc).steps(times_s, poses),
        RobotContact(disc).disc.steps(times_s, poses[:2]),
    )
    assert found.gaps_with_walls_m.tolist() == expected.gaps_with_walls_m.tolist()
    assert found.contact_s.tolist() == expected.contact_s.tolist()
    assert found.distance_m.tolist() == expected.distance_m.tolist()


def test_one_circle_in_the_middle_is_a_disc() -> None:
    obstacles = (Obstacle(center_m=(1.0, 0.6), radius_m=0.1, speed_mps=0.3),)
    segments_m = ((2.0, -1.0, 2.5, 1.0),)
    middle, disc = (world(f, obstacles, segments_m) for f in ([(0.0, 0.0, 0.3)], ()))
    poses = ((0.0, 0.0, 1.0), (0.5, 0.1, 2.0), (1.0, 0.0, 3.0))
    found, expected = steps(middle, *poses), steps(disc, *poses)
    assert found.gaps_with_walls_m == pytest.approx(expected.gaps_with_walls_m, abs=1e-12)
    assert found.contact_s == pytest.approx(expected.contact_s)
    assert found.walls is not None
    assert expected.walls is not None
    assert found.walls.contact_s == pytest.approx(expected.walls.contact_s)
    assert found.distance_m.tolist() == expected.distance_m.tolist()


def test_past_an_obstacle_that_the_disc_would_touch() -> None:
    post = Obstacle(center_m=(1.0, 0.45), radius_m=0.2)
    path = ((0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert steps(world(obstacles=(post,)), *path).gap_m[0, 0] == pytest.approx(0.05)
    across = tuple((x, y, math.pi / 2) for x, y, _ in path)
    assert steps(world(obstacles=(post,)), *across).gap_m[0, 0] == pytest.approx(-0.2)


def test_a_circle_off_the_middle_touches_first() -> None:
    offset = world([(0.5, 0.0, 0.2)], (Obstacle(center_m=(3.0, 0.0), radius_m=0.3),))
    found = steps(offset, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert found.gap_m[0, 0] == pytest.approx(1.0)
    assert found.contact_s[0, 0] == pytest.approx(2.0)
    assert found.distance_m[:, 0].tolist() == [3.0, 2.0], "of base_link"


def test_a_turn_in_place_between_two_ticks_is_a_contact() -> None:
    """The tip passes a thin wall in the middle of the turn; at both ticks it is clear."""
    tip = [(0.6, 0.0, 0.05)]
    poses = ((0.0, 0.0, -0.5), (0.0, 0.0, 0.5))
    touched = world(tip, segments_m=((0.62, 0.0, 0.7, 0.0),))
    assert steps(touched, *poses).walls.gap_m[0] == pytest.approx(-0.03, abs=2 * CURVE_M)  # type: ignore[union-attr]
    ends = steps(touched, poses[0], poses[0], poses[1], poses[1]).walls
    assert ends is not None
    assert min(ends.gap_m[0], ends.gap_m[2]) > 0.2
    clear = world(tip, segments_m=((0.66, 0.0, 0.7, 0.0),))
    assert steps(clear, *poses).walls.gap_m[0] == pytest.approx(0.01, abs=2 * CURVE_M)  # type: ignore[union-attr]


def test_the_yaw_takes_the_shorter_turn() -> None:
    behind = world([(0.6, 0.0, 0.1)], (Obstacle(center_m=(-0.8, 0.0), radius_m=0.1),))
    found = steps(behind, (0.0, 0.0, 3.0), (0.0, 0.0, -3.0))
    assert found.gap_m[0, 0] == pytest.approx(0.0, abs=2 * CURVE_M)


@settings(max_examples=60)
@given(
    footprint=CIRCLES,
    poses=POSES,
    centers=st.lists(st.tuples(NUMBERS, NUMBERS), max_size=2),
    segments_m=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), max_size=2),
)
def test_the_independent_check_agrees(
    footprint: list[tuple[float, float, float]],
    poses: list[tuple[float, float, float]],
    centers: list[Point],
    segments_m: list[Segment],
) -> None:
    assume(all(math.dist(s[:2], s[2:]) > 1e-6 for s in segments_m))
    assume(all(abs(math.remainder(b[2] - a[2], math.tau)) < 3.1 for a, b in zip(poses, poses[1:])))
    turn = Turn(at_s=0.7, speed_mps=0.8, heading_rad=2.0)
    obstacles = tuple(
        Obstacle(center_m=c, radius_m=0.2, speed_mps=0.5, heading_rad=0.3, turns=(turn,))
        for c in centers
    )
    scenario = world(footprint, obstacles, tuple(segments_m))
    simulated = steps(scenario, *poses).gaps_with_walls_m.min(initial=math.inf)
    checked = footprint_clearance(
        scenario, [TimedPose(float(k), *pose) for k, pose in enumerate(poses)]
    )
    if math.isinf(checked):
        assert simulated == checked
        return
    assert simulated <= checked + 1e-9, "never larger than the true gap"
    assert simulated >= checked - 1e-5 - 2.0 * CURVE_M - 1e-9


@given(
    footprint=CIRCLES,
    pose=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    center=st.tuples(NUMBERS, NUMBERS),
)
def test_at_rest_the_gap_is_that_of_the_nearest_circle(
    footprint: list[tuple[float, float, float]], pose: tuple[float, float, float], center: Point
) -> None:
    scenario = world(footprint, (Obstacle(center_m=center, radius_m=0.2),))
    found = steps(scenario, pose, pose)
    expected = scenario.gap_m(Pose2D(*pose), center, 0.2)
    assert found.gap_m[0, 0] == pytest.approx(expected, abs=1e-12)
    nearest = min(distance(c, center) - r for c, r in scenario.robot_circles(Pose2D(*pose)))
    assert expected == pytest.approx(nearest - 0.2)


def test_many_steps_are_each_step() -> None:
    """More than are taken together, with a pose that was refused among them."""
    scenario = world(obstacles=(Obstacle(center_m=(1.0, 0.5), radius_m=0.1, speed_mps=0.01),))
    poses = [(0.02 * k, 0.1 * math.sin(k), 0.3 * k) for k in range(150)]
    poses[70] = (math.nan, 0.0, math.nan)
    poses[80] = (1.0, 0.0, math.inf)
    whole = steps(scenario, *poses)
    assert whole.gap_m.shape == (149, 1)
    assert whole.distance_m.shape == (150, 1)
    contact = RobotContact(scenario)
    for k in (0, 63, 64, 80, 100, 148):
        two = np.array(poses[k : k + 2]).T
        one = contact.steps(np.array([k, k + 1.0]), two)
        assert whole.gap_m[k].tolist() == one.gap_m[0].tolist()
        assert whole.contact_s[k].tolist() == one.contact_s[0].tolist()
    assert whole.gap_m[[70, 80], 0].tolist() == [math.inf, math.inf]
    assert math.isnan(scenario.gap_m(Pose2D(1.0, 0.0, math.inf), (0.0, 0.0), 0.1))


# --- metrics ------------------------------------------------------------------------------------


def test_metrics_judge_the_circles() -> None:
    """The same path along a wall: with the disc a contact, with the circles none, turned one."""
    scenario = world(segments_m=((0.0, 0.3, 4.0, 0.3),))
    episode = trip([(0.5 * k, 0.0) for k in range(8)])
    disc = replace(scenario, robot=Robot(), robot_radius_m=0.45)
    circles, around = (replace(episode, scenario=s) for s in (scenario, disc))
    assert assess(circles)[0].collisions == 0
    assert assess(circles)[0].min_clearance_m == pytest.approx(0.1)
    assert assess(around)[0].collisions == 1
    turned = replace(
        circles,
        ticks=tuple(replace(t, pose=t.pose._replace(yaw=1.2)) for t in episode.ticks),
    )
    result, motion = assess(turned)
    assert (result.collisions, motion.first_contact_with) == (1, WALL)
    assert min(map(min, tick_clearances(turned))) == pytest.approx(result.min_clearance_m)
    alone = replace(turned, ticks=turned.ticks[:1])
    assert assess(alone)[0].min_clearance_m == pytest.approx(result.min_clearance_m)
