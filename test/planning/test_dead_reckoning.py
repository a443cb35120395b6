# SPDX-License-Identifier: Apache-2.0
"""DeadReckoning: the pose beside an older scan, by odometry and the commands since."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mfba_planner.core.geometry import Pose2D, distance, rotated
from mfba_planner.core.planner_types import Observation
from mfba_planner.core.robot_base import Drive
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.suites import suite
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.dead_reckoning import DeadReckoning
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, preset
from mfba_planner.simulation.lidar_perception import LidarPerception, with_lidar
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.simulated_lidar import scan_at

TICK_NS = 100_000_000
NO_ERROR = (0.0, 0.0, 0.0)
EXACT, NOISY = (1e-6, 1e-6), (4e-4, 4e-4)


def driven(pose: Pose2D, v: float, omega: float, dt: float) -> Pose2D:
    """The end of an arc, by its closed form."""
    radius = v / omega
    yaw = pose.yaw + omega * dt
    return Pose2D(
        pose.x + radius * (math.sin(yaw) - math.sin(pose.yaw)),
        pose.y - radius * (math.cos(yaw) - math.cos(pose.yaw)),
        yaw,
    )


def commanded(poses: list[Pose2D]) -> DeadReckoning:
    """From each pose to the next within a tick, the first at 0."""
    reckoning = DeadReckoning(TICK_NS)
    for k, (pose, after) in enumerate(zip(poses, poses[1:])):
        reckoning.command(k * TICK_NS, pose, after)
    return reckoning


def arc(count: int) -> list[Pose2D]:
    poses = [Pose2D(3.0, -2.0, 0.7)]
    for _ in range(count):
        poses.append(driven(poses[-1], 0.8, 0.9, 0.1))
    return poses


def test_the_motion_since_a_stamp_is_that_of_the_commands_since() -> None:
    poses = arc(6)
    moved = commanded(poses).moved(2 * TICK_NS, 5 * TICK_NS)
    assert moved is not None
    expected = driven(Pose2D(0.0, 0.0, 0.0), 0.8, 0.9, 0.3)
    assert moved == pytest.approx(expected, abs=1e-12)


def test_of_a_part_of_a_tick_it_is_a_part() -> None:
    reckoning = commanded([Pose2D(0.0, 0.0, 0.0), Pose2D(0.08, 0.0, 0.0)])
    moved = reckoning.moved(TICK_NS // 4, 3 * TICK_NS // 4)
    assert moved is not None
    assert moved == pytest.approx((0.04, 0.0, 0.0), abs=1e-15)


def test_the_last_command_lasts_and_a_later_one_for_the_same_stamp_replaces_it() -> None:
    reckoning = DeadReckoning(TICK_NS)
    here = Pose2D(0.0, 0.0, 0.0)
    reckoning.command(0, here, Pose2D(0.5, 0.0, 0.0))
    reckoning.command(0, here, Pose2D(0.0, 0.08, 0.0))
    moved = reckoning.moved(0, 2 * TICK_NS)
    assert moved is not None
    assert moved == pytest.approx((0.0, 0.16, 0.0), abs=1e-15)


def test_without_a_command_at_the_scan_the_odometry_counts() -> None:
    reckoning = DeadReckoning(TICK_NS)
    present = Pose2D(1.0, 2.0, 0.3)
    sensed = (0, Pose2D(0.9, 2.0, 0.3))
    assert reckoning.pose(sensed, (TICK_NS, present), NO_ERROR, NOISY) == present
    reckoning.command(TICK_NS // 2, present, present)
    assert reckoning.moved(0, TICK_NS) is None
    assert reckoning.pose(sensed, (TICK_NS, present), NO_ERROR, NOISY) == present


def test_an_exact_odometry_is_believed_where_the_base_has_slipped() -> None:
    reckoning = commanded([Pose2D(0.0, 0.0, 0.0), Pose2D(0.08, 0.0, 0.0)])
    slipped = Pose2D(0.06, 0.0, 0.0)
    found = reckoning.pose((0, Pose2D(0.0, 0.0, 0.0)), (TICK_NS, slipped), NO_ERROR, EXACT)
    assert found == pytest.approx(slipped, abs=5e-4)


def test_errors_of_single_poses_count_half_as_much_and_less() -> None:
    generator = np.random.default_rng(3)
    poses = arc(2)
    by_odometry, found = [], []
    for _ in range(500):
        noisy = [Pose2D(*(np.array(pose) + 0.02 * generator.standard_normal(3))) for pose in poses]
        reckoning = DeadReckoning(TICK_NS)
        after = driven(noisy[0], 0.8, 0.9, 0.1)
        reckoning.command(0, noisy[0], after)
        truth = driven(noisy[0], 0.8, 0.9, 0.1)  # relative to the pose of the scan
        pose = reckoning.pose((0, noisy[0]), (TICK_NS, noisy[1]), NO_ERROR, NOISY)
        by_odometry.append(distance(noisy[1].position, truth.position) ** 2)
        found.append(distance(pose.position, truth.position) ** 2)
        assert abs(pose.yaw - truth.yaw) <= abs(noisy[1].yaw - truth.yaw)
    assert np.mean(found) < 0.25 * np.mean(by_odometry)


def test_a_known_error_of_the_scan_s_pose_is_not_counted_as_motion() -> None:
    """The odometry has erred by 5 cm at the scan, and not now: the base has not moved."""
    still = Pose2D(0.0, 0.0, 0.0)
    reckoning = commanded([still, still])
    sensed = (0, Pose2D(0.05, -0.05, 0.02))
    found = reckoning.pose(sensed, (TICK_NS, still), (0.05, -0.05, 0.02), EXACT)
    assert found == pytest.approx(sensed[1], abs=1e-12)


def test_the_planner_decides_beside_the_scan_and_drives_by_the_odometry(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As from that pose, turned by as much as the odometry's heading differs from it."""
    params = preset(PlannerParams(method=Method.PREDICTIVE, drive=Drive.DIFFERENTIAL))
    beside, by_odometry = Pose2D(0.1, 0.02, 0.2), Pose2D(0.06, 0.05, 0.3)
    scan = scan_at(Pose2D(0.0, 0.0), Lidar(beams=360), [(2.0, 0.1, 0.4)], None)
    kept = Observation(
        stamp_ns=TICK_NS, pose=beside, ranges_m=(), goal=(4.0, 0.0), now_ns=TICK_NS, scan=scan,
        sensed=(0, Pose2D(0.0, 0.0)),
    )  # fmt: skip
    expected = Predictive(params, SensorParams(), 0).plan(kept).velocity
    monkeypatch.setattr(DeadReckoning, "pose", lambda *_: beside)
    given = replace(kept, pose=by_odometry)
    decision = Predictive(params, SensorParams(), 0).plan(given)
    assert math.hypot(*decision.velocity) > 0.1
    assert decision.velocity == pytest.approx(rotated(expected, 0.1), abs=1e-12)
    assert decision.pose == by_odometry


@pytest.mark.parametrize("world", [71022, 71056])
def test_what_may_move_is_kept_off_though_points_of_it_are_in_the_map(world: int) -> None:
    """Errors of sensors hide slow motion; the first seconds of runs that ended in a contact."""
    scenario = with_lidar(suite("random-30").world(world, 0.8), "lidar-realistic")
    params = scenario.planner_params(preset(PlannerParams(method=Method.PREDICTIVE)))
    episode = run(
        scenario, planner=params, sensor=SensorParams(), seed=0,
        path_planner=make_planner(params, SensorParams(), 0),
        observe=LidarPerception("lidar-realistic"), go_on=lambda world: world.time_s < 4.0,
    )  # fmt: skip
    result = evaluate(episode)
    assert result.collisions == 0
    assert result.min_clearance_m > 0.02


@pytest.mark.parametrize(("error", "poses"), [((1e-12, 0.0, 0.0), 1.0), (NO_ERROR, 2.0)])
def test_an_unknown_error_of_the_scan_s_pose_counts_as_a_second_pose(
    error: tuple[float, float, float], poses: float
) -> None:
    still = Pose2D(0.0, 0.0, 0.0)
    found = commanded([still, still]).pose(
        (0, still), (TICK_NS, Pose2D(0.02, 0.0, 0.02)), error, NOISY
    )
    odometry, command = poses * NOISY[0], 0.005**2  # variances
    expected = 0.02 * command / (odometry + command)
    assert (found.x, found.yaw) == pytest.approx((expected, expected), abs=1e-9)
