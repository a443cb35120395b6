# SPDX-License-Identifier: Apache-2.0
"""Beams in odom, segments and their edges, and space that was seen free."""

import math

import numpy as np
import pytest

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.free_space import FreeSpace
from mfba_planner.perception.scan_beams import BeamReader, Beams
from mfba_planner.perception.scan_segments import Segments, segments, taken_from_a_gap
from mfba_planner.simulation.simulated_lidar import cast_rays

BEAMS = 360
STEP = 2.0 * math.pi / BEAMS
AT_REST = (0.0, 0.0, 0.0)
ORIGIN = Pose2D(0.0, 0.0)
Disc = tuple[float, float, float]


def scan_of(discs: list[Disc], *, longest_m: float = 10.0, time_increment_s: float = 0.0) -> Scan:
    return Scan(
        ranges_m=cast_rays((0.0, 0.0), discs, BEAMS, longest_m),
        angle_min_rad=0.5 * STEP,
        angle_increment_rad=STEP,
        range_min_m=0.0,
        range_max_m=longest_m,
        time_increment_s=time_increment_s,
    )


def cut(scan: Scan, hump_m: float = 0.05) -> tuple[Beams, Segments]:
    beams = BeamReader().read(ORIGIN, AT_REST, scan)
    taken = taken_from_a_gap(beams)
    r = beams.range_m[taken]
    xy = r * (beams.cos[taken], beams.sin[taken])
    label, known = np.full(taken.size, -1), np.zeros(0, dtype=bool)
    return beams, segments(beams, taken, xy, label, known, 0.15, hump_m)


def test_a_scan_of_negative_increment_gives_the_same_beams() -> None:
    forward = scan_of([(2.0, 1.0, 0.3)])
    backward = Scan(
        ranges_m=forward.ranges_m[::-1],
        angle_min_rad=forward.angle_min_rad + STEP * (BEAMS - 1),
        angle_increment_rad=-STEP,
        range_min_m=0.0,
        range_max_m=10.0,
    )
    one, other = (BeamReader().read(ORIGIN, AT_REST, scan) for scan in (forward, backward))
    assert np.allclose(one.cos, other.cos)
    assert np.array_equal(one.range_m, other.range_m)
    assert np.array_equal(one.number, other.number)


def test_beams_without_knowledge_are_left_out() -> None:
    scan = scan_of([(2.0, 1.0, 0.3)])
    scan.ranges_m[[3, 4, 5]] = (np.nan, 50.0, -np.inf)
    beams = BeamReader().read(ORIGIN, AT_REST, scan)
    assert beams.number[:4].tolist() == [0, 1, 2, 5]
    assert beams.range_m[3] == 0.0  # nearer than the shortest range, taken there


def test_beams_of_a_scan_that_takes_time_start_where_the_robot_was() -> None:
    scan = scan_of([(2.0, 1.0, 0.3)], time_increment_s=1e-4)
    beams = BeamReader().read(Pose2D(1.0, 2.0), (0.5, -1.0, 0.8), scan)
    t = 1e-4 * beams.number
    assert np.allclose(beams.origin_x, 1.0 + 0.5 * t)
    assert np.allclose(beams.origin_y, 2.0 - t)
    angle = (beams.number + 0.5) * STEP + 0.8 * t
    assert np.allclose(beams.cos, np.cos(angle), atol=1e-6)


@pytest.mark.parametrize("bearing", [0.0, 0.5, math.pi, -0.01])
def test_a_disc_is_one_segment_with_two_sure_edges(bearing: float) -> None:
    disc = (2.0 * math.cos(bearing), 2.0 * math.sin(bearing), 0.3)
    _, found = cut(scan_of([disc]))
    assert found.count == 1
    assert found.right_gap_rad[0] == pytest.approx(STEP)
    assert found.left_gap_rad[0] == pytest.approx(STEP)


def test_two_people_abreast_that_touch_are_two_segments() -> None:
    _, found = cut(scan_of([(3.0, 0.25, 0.25), (3.0, -0.25, 0.25)]))
    assert found.count == 2
    sides = [np.sign(found.xy[1, found.segment == k]) for k in (0, 1)]
    assert abs(sides[0].sum()) >= sides[0].size - 2  # but for the return between them
    assert abs(sides[1].sum()) >= sides[1].size - 2


def test_a_straight_wall_is_one_segment() -> None:
    angles = (np.arange(BEAMS) + 0.5) * STEP
    scan = scan_of([])
    ahead = np.cos(angles) > 0.7
    scan.ranges_m[ahead] = 1.5 / np.cos(angles[ahead])
    _, found = cut(scan)
    assert found.count == 1


def test_an_edge_beside_something_nearer_is_not_sure() -> None:
    _, found = cut(scan_of([(3.0, 0.0, 0.5), (1.5, 0.0, 0.1)]))
    parts = [k for k in range(found.count) if found.last[k] - found.first[k] > 3]
    (right,) = (k for k in parts if found.xy[1, found.last[k]] < -0.1)
    (left,) = (k for k in parts if found.xy[1, found.first[k]] > 0.1)
    assert (found.right_gap_rad[right] > 0.0, found.left_gap_rad[right]) == (True, 0.0)
    assert (found.right_gap_rad[left], found.left_gap_rad[left] > 0.0) == (0.0, True)


def test_an_edge_at_the_longest_range_is_not_sure() -> None:
    _, found = cut(scan_of([(3.0, 0.0, 0.5)], longest_m=2.6))
    assert found.count == 1
    assert found.right_gap_rad[0] == found.left_gap_rad[0] == 0.0


def test_a_point_in_free_space_has_appeared_and_a_surface_has_not() -> None:
    free = FreeSpace()
    beams = BeamReader().read(ORIGIN, AT_REST, scan_of([(3.0, 0.0, 0.5)]))
    free.add(beams, (0.0, 0.0, 0.0), 0.0)
    free.pass_time(0.3)
    x, y = np.array([1.5, 2.5, 4.0]), np.zeros(3)
    assert free.appeared(x, y, 0.0).tolist() == [True, False, False]
    assert free.appeared(x, y, 1.0).tolist() == [False, False, False]
    far = np.array([9.0]), np.array([0.0])  # here the beams are too far apart to judge
    assert free.appeared(*far, 0.0).tolist() == [False]


def test_the_newest_scan_that_is_old_enough_is_compared() -> None:
    """First a free room, then a surface at 2 m: beyond it only the first tells free space."""
    lag_s = 0.6
    free = FreeSpace((lag_s,))
    room, surface = (
        BeamReader().read(ORIGIN, AT_REST, scan_of(discs)) for discs in ([], [(2.5, 0.0, 0.5)])
    )
    beyond = np.array([4.0]), np.zeros(1)
    assert free.appeared(*beyond, 0.0).tolist() == [False]  # without any scan
    free.add(room, AT_REST, 0.0)
    assert free.appeared(*beyond, 0.0).tolist() == [True]  # too young, but there is no other
    free.pass_time(0.3)
    free.add(surface, AT_REST, 0.0)
    assert free.appeared(*beyond, 0.0).tolist() == [True]  # both too young: the oldest
    free.pass_time(0.4)
    assert free.appeared(*beyond, 0.0).tolist() == [True]  # of 0.7 s and 0.4 s
    free.pass_time(0.2)
    assert free.appeared(*beyond, 0.0).tolist() == [False]  # of 0.9 s and 0.6 s
    free.clear()
    assert free.appeared(*beyond, 0.0).tolist() == [False]


def test_no_scan_is_kept_so_soon_after_another() -> None:
    free = FreeSpace((0.01,))
    room, surface = (
        BeamReader().read(ORIGIN, AT_REST, scan_of(discs)) for discs in ([], [(2.5, 0.0, 0.5)])
    )
    beyond = np.array([4.0]), np.zeros(1)
    free.add(room, AT_REST, 0.0)
    free.pass_time(0.05)
    free.add(surface, AT_REST, 0.0)
    assert free.appeared(*beyond, 0.0).tolist() == [True]
    free.pass_time(0.05)
    free.add(surface, AT_REST, 0.0)
    free.pass_time(0.1)
    assert free.appeared(*beyond, 0.0).tolist() == [False]
