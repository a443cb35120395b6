# SPDX-License-Identifier: Apache-2.0
"""Sector ranges of walls: between those of rows of circles, and as a lidar would give them."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.segments import Segment, Segments
from mfba_planner.perception.scan_to_sectors import sense_scan
from mfba_planner.perception.sense_segments import sense_circles_and_segments
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import scan_at

PAPER = SensorParams()
RADIUS = 0.3
NUMBERS = st.floats(-2.0, 2.0)
SEGMENTS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)


def sense(
    segments: list[Segment], position: Point = (0.0, 0.0), params: SensorParams = PAPER
) -> tuple[float, ...]:
    return sense_circles_and_segments(position, [], Segments.of(segments), RADIUS, params)


def bits(*segments: Segment) -> str:
    return "".join(map(str, sensory_vector(sense([*segments]))))


def test_a_wall_ahead() -> None:
    """1 m to the right: its edge is 0.7 m away, and 0.8 m away up to 1.1 m aslant."""
    half = math.degrees(math.acos(1.0 / 1.1) + math.asin(0.3 / 1.1))
    assert 30.0 < half < 60.0
    assert bits((1.0, -9.0, 1.0, 9.0)) == "110000000011"
    ranges = sense([(1.0, -9.0, 1.0, 9.0)])
    assert ranges[0] == ranges[11] == pytest.approx(0.7)
    assert ranges[1] == pytest.approx(0.7 / math.cos(math.radians(30.0)), abs=0.02)
    assert bits((1.11, -9.0, 1.11, 9.0)) == "0" * 12, "out of SR"


def test_ends_and_corners() -> None:
    assert bits((0.0, 0.9, 0.0, 9.0)) == "001100000000", "a wall seen end on"
    assert bits((1.0, -9.0, 1.0, 1.0), (1.0, 1.0, -9.0, 1.0)) == "111110000011"


def test_in_contact_the_half_plane_of_the_wall_is_closed() -> None:
    touched = bits((0.2, -9.0, 0.2, 9.0))
    assert (touched[:3], touched[5:7], touched[9:]) == ("111", "00", "111")
    assert sense([(0.2, -9.0, 0.2, 9.0)])[0] == 0.0
    assert bits((0.0, -9.0, 0.0, 9.0)) == "1" * 12, "on the wall"


@given(segment=SEGMENTS, sectors=st.integers(3, 40), reach_m=st.floats(0.2, 2.0))
@example(segment=(1.0, 1.0, 1.0, 1.0), sectors=12, reach_m=2.0)
@example(segment=(-1.0, 0.0, 1.0, 0.0), sectors=12, reach_m=2.0)
def test_a_wall_is_the_circles_round_its_points(
    segment: Segment, sectors: int, reach_m: float
) -> None:
    """Nearer than a row of circles on it, and farther than one of slightly larger circles."""
    params = SensorParams(sectors=sectors, sensing_range_m=reach_m)
    x0, y0, x1, y1 = segment
    share = np.linspace(0.0, 1.0, 1501)
    points = list(zip((x0 + share * (x1 - x0)).tolist(), (y0 + share * (y1 - y0)).tolist()))
    if min(math.hypot(*point) for point in points) <= RADIUS + 0.01:
        return  # in contact only the nearest point counts: tested above
    apart = math.dist(points[0], points[1]) + 1e-6
    upper = sense_circles((0.0, 0.0), [(point, RADIUS) for point in points], params)
    lower = sense_circles((0.0, 0.0), [(point, RADIUS + apart) for point in points], params)
    found = sense([segment], params=params)
    for low, value, high in zip(lower, found, upper):
        assert low - 1e-6 <= value
        assert value <= high + 1e-6 or value == high


@given(segment=SEGMENTS)
def test_sectors_of_a_wall_are_those_of_a_fine_scan_of_it(segment: Segment) -> None:
    """Where no part hides another: the sensor of the paper and a lidar agree."""
    params = SensorParams(sensing_range_m=1.5)
    every = Segments.of([segment])
    lidar = Lidar(beams=1080, range_min_m=0.0, range_max_m=20.0)
    if every.distances(0.0, 0.0)[0] < RADIUS + 0.01:
        return
    scan = scan_at(Pose2D(0.0, 0.0), lidar, [], None, every)
    by_scan = sense_scan(scan, 0.0, RADIUS, params)
    for mine, lidars in zip(sense([segment], params=params), by_scan):
        assert mine <= lidars + 1e-5, "the lidar has only points of it"


def test_the_nearest_of_circles_and_walls() -> None:
    wall, circle = Segments.of([(1.0, -9.0, 1.0, 9.0)]), ((0.7, 0.45), 0.2)
    found = sense_circles_and_segments((0.0, 0.0), [circle], wall, RADIUS, PAPER)
    alone = sense_circles((0.0, 0.0), [circle], PAPER)
    assert found == tuple(map(min, alone, sense([(1.0, -9.0, 1.0, 9.0)])))
    assert found[0] < 0.7 == pytest.approx(found[11])


def test_ranges_are_single_precision_and_free_without_walls() -> None:
    for value in sense([(0.9, -0.2, 0.7, 0.4)]):
        assert value == float(np.float32(value))
    assert sense([]) == (math.inf,) * 12


def test_a_position_that_is_not_finite_is_refused() -> None:
    with pytest.raises(InputError, match="not finite"):
        sense([(1.0, 0.0, 2.0, 0.0)], position=(math.nan, 0.0))
