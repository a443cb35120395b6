# SPDX-License-Identifier: Apache-2.0
"""Wall segments: distances against a fine sampling of both, and exact cases."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mfba_planner.core.geometry import closest_approach
from mfba_planner.core.segments import Segment, Segments

NUMBERS = st.floats(-5.0, 5.0)
POINTS = st.tuples(NUMBERS, NUMBERS)
SEGMENTS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
SAMPLES = 801


def swept(segment: Segment, start: tuple[float, float], end: tuple[float, float]) -> float:
    (x, y), (x1, y1) = start, end
    found = Segments.of([segment]).swept_distances(
        np.array(x), np.array(y), np.array(x1 - x), np.array(y1 - y)
    )
    return float(found[0])


@given(segment=SEGMENTS, point=POINTS)
def test_distance_of_a_point(segment: Segment, point: tuple[float, float]) -> None:
    """A point at rest against one that runs along the segment: another formula."""
    x0, y0, x1, y1 = segment
    found = Segments.of([segment]).distances(*point)[0]
    assert found == pytest.approx(closest_approach(point, point, (x0, y0), (x1, y1)), abs=1e-9)


@given(segment=SEGMENTS, start=POINTS, end=POINTS)
@example(segment=(0.0, 0.0, 2.0, 0.0), start=(1.0, 0.0), end=(1.0, 0.0))
@example(segment=(0.0, 0.0, 2.0, 0.0), start=(1.0, 1.0), end=(1.0, 0.0))
@example(segment=(0.0, 0.0, 2.0, 0.0), start=(-1.0, 0.0), end=(5.0, 0.0))
@example(segment=(1.0, 1.0, 1.0, 1.0), start=(0.0, 0.0), end=(2.0, 2.0))
def test_swept_distance_is_the_least_of_all_moments(
    segment: Segment, start: tuple[float, float], end: tuple[float, float]
) -> None:
    """By the distances of many points of the path: never less, and no more than a half step."""
    share = np.linspace(0.0, 1.0, SAMPLES)
    x = start[0] + share * (end[0] - start[0])
    y = start[1] + share * (end[1] - start[1])
    sampled = Segments.of([segment]).distances(x[:, None], y[:, None]).min()
    found = swept(segment, start, end)
    assert found <= sampled + 1e-9
    assert sampled - found <= 0.5 * math.dist(start, end) / (SAMPLES - 1) + 1e-9


def test_a_path_that_crosses_a_wall_touches_it_however_long_the_step() -> None:
    assert swept((0.0, -1.0, 0.0, 1.0), (-1000.0, 0.0), (1000.0, 0.5)) == 0.0
    assert swept((0.0, -1.0, 0.0, 1.0), (-1000.0, 1.5), (1000.0, 1.5)) == 0.5


@given(
    segments=st.lists(SEGMENTS, min_size=1, max_size=8), point=POINTS, reach_m=st.floats(0.0, 3.0)
)
def test_near_leaves_out_nothing_within_reach(
    segments: list[Segment], point: tuple[float, float], reach_m: float
) -> None:
    every = Segments.of(segments)
    near, within = every.near(point, reach_m), every.distances(*point) <= reach_m
    kept = set(zip(*(column.tolist() for column in near)))
    assert {row for row, keep in zip(zip(*every), within) if keep} <= kept


def test_near_leaves_out_what_is_far() -> None:
    every = Segments.of([(0.0, 0.0, 1.0, 0.0), (90.0, 0.0, 91.0, 0.0)])
    assert every.near((0.5, 0.5), 1.0).x.tolist() == [0.0]
    assert every.near((math.nan, 0.5), 1.0).x.tolist() == [0.0, 90.0]
