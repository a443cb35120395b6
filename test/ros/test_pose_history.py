# SPDX-License-Identifier: Apache-2.0
"""In real time pose and scan are brought to one moment, by their stamps."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from planner_talk import fields
from real_time_robot import BEAMS, FREE, TRACKING, RealTimeRobot, scan_of, stamp
from ros_graph import Graph

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.lidar_extrinsics import CENTRED
from mfba_planner.perception.pose_history import EXTRAPOLATED_NS, KEPT_NS, PoseHistory
from mfba_planner.recording.from_messages import laser_scan
from mfba_planner.recording.scan_parts import MountedScan
from mfba_planner.ros.runtime.stale_inputs import NewestInputs

TENTH = 100_000_000
SCAN = MountedScan(laser_scan(scan_of(0)), CENTRED)


@given(st.integers(0, 10 * TENTH), st.floats(-3.0, 3.0))
def test_between_two_poses_the_motion_is_uniform(stamp_ns: int, yaw: float) -> None:
    history = PoseHistory()
    assert history.at(stamp_ns) is None
    for k in range(11):
        history.add(k * TENTH, Pose2D(0.1 * k, -0.2 * k, math.remainder(yaw + k, 2 * math.pi)))
    found, share = history.at(stamp_ns), stamp_ns / TENTH
    assert found is not None
    assert found.position == pytest.approx((0.1 * share, -0.2 * share))
    assert math.remainder(found.yaw - yaw - share, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_beyond_the_last_pose_the_motion_goes_on_for_a_while() -> None:
    history = PoseHistory()
    history.add(0, Pose2D(1.0, 0.0))
    assert history.at(TENTH) == Pose2D(1.0, 0.0), "one pose has no motion"
    history.add(TENTH, Pose2D(1.1, 0.0))
    found = history.at(2 * TENTH)
    assert found is not None
    assert found.x == pytest.approx(1.2)
    assert history.at(TENTH + EXTRAPOLATED_NS) == history.at(100 * TENTH)
    assert history.at(-TENTH) == Pose2D(1.0, 0.0), "the first, before it"


def test_old_poses_are_dropped_and_an_equal_stamp_replaces() -> None:
    history = PoseHistory()
    for k in range(100):
        history.add(k * TENTH, Pose2D(float(k), 0.0))
    history.add(99 * TENTH, Pose2D(-1.0, 0.0))
    assert history.at(99 * TENTH) == Pose2D(-1.0, 0.0)
    assert len(history._poses) == KEPT_NS // TENTH + 1


def test_a_scan_that_is_late_gets_the_pose_of_its_own_stamp() -> None:
    inputs = NewestInputs()
    for k in range(4):
        inputs.add_odom(k * TENTH, Pose2D(0.1 * k, 0.0), 0.0)
    found = inputs.add_sectors(TENTH, (math.inf,) * 12, 0.0, SCAN)
    assert found is not None
    assert (found.stamp_ns, found.pose, found.pose_stamp_ns) == (
        TENTH,
        Pose2D(0.1 * 3, 0.0),
        3 * TENTH,
    )
    assert found.sensed == (TENTH, Pose2D(0.1, 0.0))


def test_odometry_that_is_late_is_brought_to_the_scan() -> None:
    inputs = NewestInputs()
    for k in range(2):
        inputs.add_odom(k * TENTH, Pose2D(0.1 * k, 0.0), 0.0)
    found = inputs.add_sectors(2 * TENTH, (math.inf,) * 12, 0.0, SCAN)
    assert found is not None
    assert not isinstance(found.pose, str)
    assert found.pose.x == pytest.approx(0.2)
    assert (found.sensed, found.pose_stamp_ns) == (None, None)


def test_without_a_scan_the_newest_pose_counts_as_before() -> None:
    inputs = NewestInputs()
    for k in range(4):
        inputs.add_odom(k * TENTH, Pose2D(0.1 * k, 0.0), 0.0)
    found = inputs.add_sectors(TENTH, (math.inf,) * 12, 0.0)
    assert found is not None
    assert (found.pose, found.sensed) == (Pose2D(0.1 * 3, 0.0), None)


def test_the_planner_tracks_a_late_scan_from_where_it_was_taken(graph: Graph) -> None:
    """A post straight ahead, of a robot at 1 m/s whose scan is 0.3 s late, stays where it is."""
    robot = RealTimeRobot(graph, planner=TRACKING)
    start = stamp()
    tracked = []
    for k in range(12):
        robot.send_odom(start + k * TENTH, x=0.1 * k)
        if k < 3:
            continue
        ranges = list(FREE)
        ranges[BEAMS // 2] = 2.0 - 0.1 * (k - 3)
        robot.send_scan(scan_of(start + (k - 3) * TENTH, ranges))
        found = fields(robot.decisions[-1])
        assert found["perception"] == "scan"
        assert found["pose_stamp_ns"] == str(start + k * TENTH)
        x, _, _ = map(float, found["scan_pose"].split(","))
        assert x == pytest.approx(0.1 * (k - 3), abs=1e-6)
        (circle,) = robot.planner.path_planner.inner._perceived  # type: ignore[attr-defined]
        tracked.append(circle)
    for circle in tracked[4:]:
        assert circle.center_m[0] == pytest.approx(2.0, abs=0.35)
        assert math.hypot(*circle.velocity_mps) < 0.1
