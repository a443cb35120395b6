# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a scan: normals, segments and their widths against walls that are known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.scan_beams import BeamReader
from mfba_planner.perception.scan_surfaces import Surfaces, surfaces

BEAMS = 360
STEP = 2.0 * math.pi / BEAMS


def surfaces_of(ranges: np.ndarray) -> Surfaces | None:
    scan = Scan(
        ranges_m=ranges, angle_min_rad=0.0, angle_increment_rad=STEP,
        range_min_m=0.0, range_max_m=10.0,
    )  # fmt: skip
    return surfaces(BeamReader().read(Pose2D(0.0, 0.0), (0.0, 0.0, 0.0), scan))


def wall(bearing: float, away_m: float, half: float) -> np.ndarray:
    """Ranges of a straight wall around a bearing; nothing elsewhere."""
    off = np.remainder(np.arange(BEAMS) * STEP - bearing + math.pi, 2.0 * math.pi) - math.pi
    observed = np.abs(off) < half
    return np.where(observed, away_m / np.where(observed, np.cos(off), 1.0), np.inf)


@settings(max_examples=40, deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(0.5, 4.0), st.floats(0.2, 0.9))
def test_a_straight_wall_is_one_segment_with_one_normal(
    bearing: float, away_m: float, half: float
) -> None:
    """In all directions, and across the first beam; the normal points at the lidar."""
    found = surfaces_of(wall(bearing, away_m, half))
    assert found is not None
    assert found.segment.tolist() == [0] * found.x.size
    assert (found.first.tolist(), found.last.tolist()) == ([0], [found.x.size - 1])
    assert np.allclose(found.nx, -math.cos(bearing), atol=1e-6)
    assert np.allclose(found.ny, -math.sin(bearing), atol=1e-6)
    box = math.hypot(np.ptp(found.x), np.ptp(found.y))
    ends = math.hypot(found.x[-1] - found.x[0], found.y[-1] - found.y[0])
    assert found.width_m == pytest.approx([box])
    assert box == pytest.approx(ends)


@pytest.mark.parametrize(("missing", "parts"), [(0, 1), (1, 1), (2, 2)])
def test_a_segment_goes_on_over_one_missing_beam(missing: int, parts: int) -> None:
    ranges = wall(0.5 * math.pi, 1.0, 0.2)
    ranges[90 : 90 + missing] = np.nan
    found = surfaces_of(ranges)
    assert found is not None
    assert found.first.size == found.last.size == parts
    assert found.segment[0] == 0
    assert found.segment[-1] == parts - 1


@pytest.mark.parametrize(("behind_m", "parts"), [(0.1, 1), (0.2, 2)])
def test_a_step_in_range_cuts(behind_m: float, parts: int) -> None:
    ranges = np.full(BEAMS, np.inf)
    ranges[10:20], ranges[20:30] = 1.0, 1.0 + behind_m
    found = surfaces_of(ranges)
    assert found is not None
    assert found.first.tolist() == [0, 10][:parts]
    assert found.last.tolist() == [9, 19][2 - parts :]


def test_a_return_alone_faces_the_lidar() -> None:
    ranges = np.full(BEAMS, np.inf)
    ranges[120] = 2.0
    found = surfaces_of(ranges)
    assert found is not None
    assert (found.nx[0], found.ny[0]) == pytest.approx(
        (-math.cos(120 * STEP), -math.sin(120 * STEP))
    )
    assert found.width_m.tolist() == [0.0]


def test_a_scan_without_returns_has_no_surfaces() -> None:
    assert surfaces_of(np.full(BEAMS, np.inf)) is None
