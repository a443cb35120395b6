# SPDX-License-Identifier: Apache-2.0
"""The robot of examples/mujoco_robot, stepped by MuJoCo: motors, odometry, lidar, contacts."""

from dataclasses import replace

import numpy as np
import pytest
from crowded_room import BODY_RADIUS_M, LIDAR, RANGE_SD_M, Room, Standing, draw_room
from physics_world import SCAN_NS, Lifted, PhysicsWorld
from planner_in_process import DriveResult, drive, robot_rng
from robot_model_xml import RobotBody
from wheel_odometry import OdometryErrors

from mfba_planner.core.geometry import Point, Pose2D, distance
from mfba_planner.planning.odometry_jump import is_odometry_jump
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.recorded_motion import Knot
from mfba_planner.simulation.scenario import Kidnapping
from mfba_planner.simulation.simulated_lidar import scan_at

NO_ERRORS = OdometryErrors(
    wheel_radius_share=0.0,
    wheel_apart_share=0.0,
    gyro_bias_radps=0.0,
    gyro_noise_radps=0.0,
    encoder_ticks=2**20,
)
START = (6.0, 2.0)
TIRELESS_S = 30.0


def empty_room(*people: tuple[Knot, ...], pillars: tuple[Obstacle, ...] = ()) -> Room:
    """The room without walls inside, the robot at START, and people along trajectories."""
    walkers = [
        Obstacle(center_m=knots[0][1:], radius_m=BODY_RADIUS_M, trajectory=knots, stays=True)
        for knots in people
    ]
    scenario = draw_room(0, people=0).scenario
    scenario = replace(
        scenario,
        start_m=START,
        goal_m=(6.0, 10.0),
        obstacles=(*walkers, *pillars),
        segments_m=scenario.segments_m[:4],
    )
    return Room(scenario, (), len(walkers))


def at(x: float, y: float) -> tuple[Knot, ...]:
    """One who stands."""
    return ((0.0, x, y), (TIRELESS_S, x, y + 1e-4))


def driven(
    room: Room, v: float, omega: float, until_s: float, robot: int = 5, **more: object
) -> tuple[PhysicsWorld, list[tuple[float, float]], list[tuple[float, float]]]:
    """The world after a constant command, and wheel speeds and torques on the way."""
    world = PhysicsWorld(room, np.random.default_rng(robot), **more)  # type: ignore[arg-type]
    speeds, torques = [], []
    for tick in range(round(until_s / 0.02)):
        world.command(v, omega)
        world.advance((tick + 1) * 20_000_000)
        speeds.append(world.wheel_radps)
        torques.append(world.torques_nm)
    return world, speeds, torques


def test_motors_keep_their_limits_and_reach_their_highest_speed() -> None:
    body = RobotBody(max_accel_mps2=100.0)
    world, speeds, torques = driven(empty_room(), 5.0, 0.0, 2.0, body=body)
    assert np.abs(torques).max() == pytest.approx(body.max_torque_nm)
    assert np.abs(speeds).max() <= body.max_wheel_radps
    v, turn = world.velocity
    assert v == pytest.approx(body.max_wheel_radps * body.wheel_radius_m, rel=0.03)
    assert abs(turn) < 0.01
    most = 2.0 * body.max_torque_nm / body.wheel_radius_m / body.mass_kg  # of all its weight
    ahead = np.array(speeds).mean(axis=1) * body.wheel_radius_m
    assert np.diff(ahead).max() / 0.02 <= most


def test_the_driver_board_ramps_a_command() -> None:
    world, speeds, _ = driven(empty_room(), 0.8, 0.0, 0.2)
    assert np.mean(speeds[-1]) * world.body.wheel_radius_m <= 0.2 * world.body.max_accel_mps2
    later, _, _ = driven(empty_room(), 0.8, 0.0, 1.5)
    assert later.velocity[0] == pytest.approx(0.8, abs=0.02)


def test_a_command_ends_without_another_one() -> None:
    world, _, _ = driven(empty_room(), 0.5, 0.0, 1.0)
    world.advance(world.now_ns + 1_500_000_000)
    assert abs(world.velocity[0]) < 0.01


def test_wheels_slip_where_the_floor_does_not_hold_them() -> None:
    icy, speeds, _ = driven(empty_room(), 0.8, 0.0, 0.5, body=RobotBody(wheel_friction=0.05))
    assert np.mean(speeds[-1]) * icy.body.wheel_radius_m > 1.5 * icy.velocity[0] > 0.0
    # The encoders count what the wheels turn, not how far the robot gets.
    assert icy.odometry.pose.x - START[0] > 1.5 * (icy.pose.x - START[0])


def test_odometry_drifts_by_its_errors() -> None:
    def drift_m(errors: OdometryErrors, for_s: float, robots: int) -> float:
        worlds = [
            driven(empty_room(), 0.6, 0.25, for_s, errors=errors, robot=robot)[0]
            for robot in range(robots)
        ]
        off = [distance(w.pose.position, w.odometry.pose.position) for w in worlds]
        return float(np.sqrt(np.mean(np.square(off))))

    exact = drift_m(NO_ERRORS, 12.0, 1)
    assert exact < 0.03  # slip alone, on 7 m
    drifted = drift_m(OdometryErrors(), 12.0, 6)
    assert 1.5 * exact < drifted < 0.3
    assert drift_m(OdometryErrors(), 3.0, 6) < drifted


def test_the_lidar_measures_what_geometry_says() -> None:
    room = draw_room(3)
    world = PhysicsWorld(room, robot_rng(3))
    compared = 0
    for pose in ((1.5, 1.5, 0.3), (6.0, 9.0, -2.0), (10.0, 3.0, 1.0), (3.0, 6.2, 3.0)):
        standing = Standing(room.boxes, room.scenario.obstacles[room.people :])
        if standing.clearance_m(pose[:2]) < 0.4:
            continue
        world.advance(world.now_ns + 2 * SCAN_NS)
        world.put(Pose2D(*pose))
        circles = [
            (*center, obstacle.radius_m)
            for center, obstacle in zip(
                room.scenario.centers(world.time_s), room.scenario.obstacles
            )
        ]
        expected = scan_at(
            world.pose, replace(LIDAR, range_max_m=50.0), circles, None, room.scenario.segments
        ).ranges_m
        off = np.abs(world.true_ranges_m() - expected)
        # A beam along an edge may hit on one side and miss on the other.
        assert np.sort(off)[:-4].max() < 0.002
        compared += 1
        noisy, near = world.scan().ranges_m, expected < LIDAR.range_max_m - 0.1
        sd = np.std(np.sort(noisy[near] - expected[near])[4:-4])
        assert 0.7 * RANGE_SD_M < sd < 1.3 * RANGE_SD_M
        assert np.isinf(noisy[expected > LIDAR.range_max_m + 0.1]).all()
    assert compared >= 3


def test_a_person_walking_into_the_standing_robot_is_counted_once() -> None:
    walk = ((0.0, 6.0, 5.0), (4.0, 6.0, 2.2), (8.0, 6.0, 5.0))
    world = PhysicsWorld(empty_room(walk), np.random.default_rng(0))
    world.advance(8_000_000_000)
    (event,) = world.contacts
    assert (event.touched, event.side, event.is_person) == ("person0", "standing", True)
    gap = 5.0 - 2.0 - 2.0 * BODY_RADIUS_M
    assert event.time_s == pytest.approx(gap / (2.8 / 4.0), abs=0.05)
    assert world.pose.y < START[1] - 0.05  # it was pushed


def test_contacts_from_behind_and_in_front_are_distinguished() -> None:
    behind, _, _ = driven(empty_room(((0.0, 3.0, 2.0), (6.0, 9.0, 2.0))), 0.3, 0.0, 5.0)
    assert [(e.touched, e.side) for e in behind.contacts] == [("person0", "behind")]
    ahead, _, _ = driven(empty_room(at(7.5, 2.0)), 0.5, 0.0, 3.0)
    assert [(e.touched, e.side) for e in ahead.contacts] == [("person0", "driving")]
    assert ahead.contacts[0].speed_mps == pytest.approx(0.5, abs=0.03)


def test_a_pillar_is_driven_into_once_and_a_second_time_after_backing_off() -> None:
    pillar = Obstacle(center_m=(7.0, 2.0), radius_m=0.3)
    world, _, _ = driven(empty_room(pillars=(pillar,)), 0.5, 0.0, 2.5)
    assert [(e.touched, e.side) for e in world.contacts] == [("pillar0", "driving")]
    assert world.pose.x < 7.0 - 0.3 - BODY_RADIUS_M + 0.02
    for v, steps in ((-0.5, 60), (0.5, 100)):
        for _ in range(steps):
            world.command(v, 0.0)
            world.advance(world.now_ns + 20_000_000)
    assert len(world.contacts) == 2


def test_a_person_pushing_the_robot_against_a_wall_does_not_crush_it() -> None:
    walk = ((0.0, 6.0, 4.0), (4.0, 6.0, 0.3), (8.0, 6.0, 4.0))
    world = PhysicsWorld(empty_room(walk), np.random.default_rng(0))
    fastest = 0.0
    for _ in range(400):
        world.advance(world.now_ns + 20_000_000)
        fastest = max(fastest, float(np.linalg.norm(world.data.qvel[:2])))
    assert fastest < 3.0
    assert all(0.1 < c < 11.9 for c in world.pose.position)
    assert sum(event.is_person for event in world.contacts) == 1


def with_kidnapping(lifted: Lifted, to_m: Point) -> DriveResult:
    room = draw_room(1, people=0)
    scenario = replace(room.scenario, kidnappings=(Kidnapping(at_s=2.0, to_m=to_m),))
    return drive(
        PhysicsWorld(room._replace(scenario=scenario), robot_rng(1), lifted=lifted), seed=1
    )


def test_a_lifted_robot_arrives_where_its_odometry_notices() -> None:
    noticed = with_kidnapping(Lifted.JUMPS, (9.0, 8.5))
    assert noticed.arrived
    assert sum(is_odometry_jump(tick.reason) for tick in noticed.episode.ticks) == 1
    assert noticed.off_goal_m < 0.5
    assert not noticed.contacts


def test_a_lifted_robot_that_does_not_notice_ends_where_it_believes_the_goal() -> None:
    unnoticed = with_kidnapping(Lifted.UNNOTICED, (2.0, 1.5))
    assert not any(is_odometry_jump(tick.reason) for tick in unnoticed.episode.ticks)
    assert not unnoticed.contacts
    assert unnoticed.odometry_off_m > 0.8
    assert unnoticed.arrived  # by its odometry
    assert unnoticed.off_goal_m > 0.8


def test_the_same_world_and_seed_give_the_same_drive() -> None:
    def few(_: object, count: list[int] = []) -> bool:  # noqa: B006
        count.append(0)
        return len(count) % 15 != 0

    first, second = (
        drive(PhysicsWorld(draw_room(2), robot_rng(2)), seed=2, go_on=few) for _ in range(2)
    )
    assert len(first.episode.ticks) == 15
    assert first.episode == second.episode
    other = drive(PhysicsWorld(draw_room(2), robot_rng(3)), seed=2, go_on=few)
    assert other.episode.ticks != first.episode.ticks
