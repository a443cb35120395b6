# SPDX-License-Identifier: Apache-2.0
"""Robot and walls: gaps of steps, time to contact, and what metrics and the lidar make of them."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from trip_samples import post, trip

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.segments import Segment, Segments
from mfba_planner.evaluation.contacts_and_clearances import WALL
from mfba_planner.evaluation.metrics import assess, tick_clearances
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.simulated_lidar import cast_segments, rays, scan_at
from mfba_planner.simulation.wall_contact import WallClearances, wall_clearances

NUMBERS = st.floats(-3.0, 3.0)
SEGMENTS = st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=6)
PATHS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=40)


def clearances(
    segments: list[Segment], points: list[Point], tick_s: float = 1.0
) -> WallClearances:
    durations_s = np.full(len(points) - 1, tick_s)
    return wall_clearances(Segments.of(segments), 0.3, durations_s, np.array(points).T)


@given(segments=SEGMENTS, points=PATHS)
def test_many_steps_among_many_walls_are_each_step_with_each_wall(
    segments: list[Segment], points: list[Point]
) -> None:
    found = clearances(segments, points)
    each = [
        [clearances([segment], [a, b]) for segment in segments] for a, b in zip(points, points[1:])
    ]
    gaps_m = [min(one.gap_m[0] for one in row) for row in each]
    contacts_s = [min(one.contact_s[0] for one in row) for row in each]
    assert found.gap_m.tolist() == gaps_m
    assert found.contact_s.tolist() == contacts_s


@given(segments=SEGMENTS, points=PATHS)
def test_a_selection_for_each_step_changes_nothing(
    segments: list[Segment], points: list[Point]
) -> None:
    """Of many segments only those in the path of a step are looked at."""
    far = [(50.0 + k, 50.0, 50.0 + k, 51.0) for k in range(300)]
    expected, found = clearances(segments, points), clearances([*segments, *far], points)
    assert found.gap_m.tolist() == expected.gap_m.tolist()
    reached = expected.contact_s <= 5.0  # before the far ones
    assert found.contact_s[reached].tolist() == expected.contact_s[reached].tolist()
    assert (found.contact_s <= expected.contact_s).all()


@given(segment=st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), a=PATHS)
def test_time_to_contact_is_when_the_distance_first_is_the_radius(
    segment: Segment, a: list[Point]
) -> None:
    """Beside the gaps of the way up to it and a little beyond."""
    (x, y), (x1, y1) = a[:2]
    u = (x1 - x, y1 - y)
    contact_s = float(clearances([segment], [(x, y), (x1, y1)]).contact_s[0])
    until = contact_s if math.isfinite(contact_s) else 1e3
    before = clearances([segment], [(x, y), (x + until * u[0], y + until * u[1])]).gap_m[0]
    if contact_s > 0.0:
        assert before >= -1e-6 * max(1.0, until)
    if 0.0 < contact_s < 100.0 and math.hypot(*u) > 1e-3:
        assert before == pytest.approx(0.0, abs=1e-6)
    if contact_s == 0.0:
        assert before <= 0.0


def test_time_to_contact_of_known_cases() -> None:
    wall = [(5.0, -1.0, 5.0, 1.0)]
    assert clearances(wall, [(0.0, 0.0), (2.0, 0.0)]).contact_s[0] == pytest.approx(4.7 / 2.0)
    assert clearances(wall, [(0.0, 0.0), (2.0, 0.0)], 0.5).contact_s[0] == pytest.approx(4.7 / 4)
    assert clearances(wall, [(0.0, 1.2), (1.0, 1.2)]).contact_s[0] == pytest.approx(
        5.0 - math.sqrt(0.09 - 0.04)
    ), "at its end"
    assert clearances(wall, [(0.0, 1.31), (1.0, 1.31)]).contact_s[0] == math.inf, "past it"
    assert clearances(wall, [(0.0, 0.0), (-1.0, 0.0)]).contact_s[0] == math.inf, "away from it"
    assert clearances(wall, [(4.8, 0.0), (4.9, 0.0)]).contact_s[0] == 0.0, "in contact"
    assert clearances(wall, [(0.0, 0.0), (0.0, 0.0)]).contact_s[0] == math.inf, "at rest"


def test_a_refused_position_has_no_gap() -> None:
    found = clearances([(0.0, 0.0, 1.0, 0.0)], [(0.0, 2.0), (math.nan, 0.0), (0.0, 2.0)])
    assert found.gap_m.tolist() == [math.inf, math.inf]
    assert found.contact_s.tolist() == [math.inf, math.inf]


def among(segments: tuple[Segment, ...], points: list[Point], **more: Any) -> Episode:
    task = Scenario(name="x", start_m=(9.0, 9.0), goal_m=(0.0, 9.0), segments_m=segments, **more)
    return trip(points, scenario=task)


def test_a_robot_that_drives_through_a_wall_touches_it_once() -> None:
    episode = among(((2.5, -1.0, 2.5, 1.0),), [(float(x), 0.0) for x in range(6)])
    result, motion = assess(episode)
    assert (result.collisions, result.success) == (1, False)
    assert (motion.hits_moving, motion.hits_standing) == (1, 0)
    assert (motion.first_contact_with, motion.first_contact_s) == (WALL, 2.0)
    assert result.min_clearance_m == pytest.approx(-0.3)
    assert tick_clearances(episode)[0] == [pytest.approx(1.2)]
    assert result.encounters == (), "obstacles only"


def test_obstacles_keep_their_numbers_beside_walls() -> None:
    wall, points = ((9.0, -1.0, 9.0, 1.0),), [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    episode = among(wall, points, obstacles=(post((0.0, 5.0)), post((2.0, 0.0))))
    result, motion = assess(episode)
    assert (motion.first_contact_with, motion.first_contact_s) == (2, 1.0)
    assert result.collisions == 1
    assert [len(row) for row in tick_clearances(episode)] == [3, 3]


def test_all_walls_count_as_one() -> None:
    """Along a corner: from one wall to the other without leaving both is one contact."""
    corner = ((0.0, 1.0, 3.0, 1.0), (3.0, 1.0, 3.0, 4.0))
    points = [(1.0, 0.0), (1.0, 0.8), (2.8, 0.8), (2.8, 2.0), (2.0, 2.0)]
    points += [(1.5, 2.0), (2.8, 2.0)]
    assert assess(among(corner, points))[0].collisions == 2, "left once in between"


def test_a_single_tick_is_a_robot_at_rest() -> None:
    result, motion = assess(among(((0.1, -1.0, 0.1, 1.0),), [(0.0, 0.0)]))
    assert (result.collisions, motion.first_contact_with) == (1, WALL)


def test_the_lidar_detects_segments_without_an_option() -> None:
    lidar = Lidar(beams=360, range_min_m=0.0)
    wall = Segments.of([(2.0, -9.0, 2.0, 9.0)])
    found = scan_at(Pose2D(0.0, 0.0), lidar, [], None, wall).ranges_m
    expected = 2.0 / np.maximum(rays(360)[0], 1e-9)
    np.testing.assert_allclose(found[found < 3.5], expected[found < 3.5], rtol=1e-6)
    assert (found < 3.5).sum() == (expected < 3.5).sum() > 100
    hidden = scan_at(Pose2D(0.0, 0.0), lidar, [(1.0, 0.0, 0.2)], None, wall).ranges_m
    assert hidden.min() == pytest.approx(0.8, abs=1e-3), "the nearer of the two"


@given(position=st.tuples(NUMBERS, NUMBERS), turned_rad=st.floats(-3.0, 3.0))
def test_no_beam_passes_between_segments_that_share_an_end(
    position: Point, turned_rad: float
) -> None:
    corners = [(4.0 * math.cos(k), 4.0 * math.sin(k)) for k in np.linspace(0.0, 6.0, 40)]
    corners.append(corners[0])
    room = Segments.of([(*a, *b) for a, b in zip(corners, corners[1:])])
    assert np.isfinite(cast_segments(position, room, 720, turned_rad)).all() or (
        math.hypot(*position) > 3.9
    )


@given(segments=SEGMENTS, position=st.tuples(NUMBERS, NUMBERS))
def test_beams_end_on_a_segment_and_not_behind_one(
    segments: list[Segment], position: Point
) -> None:
    every = Segments.of(segments)
    length = np.hypot(every.dx, every.dy)
    assume(length.min() > 1e-3 and every.distances(*position).min() > 1e-3)
    ranges, (c, s) = cast_segments(position, every, 36), rays(36)
    across = np.abs(c[:, None] * every.dy - s[:, None] * every.dx) / length
    for k in np.flatnonzero(np.isfinite(ranges)).tolist():
        x, y = position[0] + ranges[k] * c[k], position[1] + ranges[k] * s[k]
        assert every.distances(x, y).min() < 1e-6
    short = np.where(np.isfinite(ranges), ranges, 20.0) - 1e-6
    for k in np.flatnonzero((short > 0.0) & (across.min(axis=1) > 1e-3)).tolist():
        gap = every.swept_distances(
            np.array(position[0]), np.array(position[1]), short[k] * c[k], short[k] * s[k]
        )
        assert gap.min() > 0.0
