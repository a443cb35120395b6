# SPDX-License-Identifier: Apache-2.0
"""Directions that a lidar has covered, and the conventions for free space."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.no_return import NoReturn, rep_117
from mfba_planner.perception.scan_coverage import ScanCoverage, usable_beams

SECOND = 1_000_000_000
NAN, INF = math.nan, math.inf


def scan(ranges: list[float], first_rad: float, step_rad: float) -> Scan:
    return Scan(
        ranges_m=np.array(ranges),
        angle_min_rad=first_rad,
        angle_increment_rad=step_rad,
        range_min_m=0.1,
        range_max_m=5.0,
    )


def uncovered_degrees(coverage: ScanCoverage, now_ns: int) -> list[int]:
    """Directions of 72 headings in degrees, 5 for the first."""
    missing = coverage.uncovered(now_ns)
    return [] if missing is None else [5 * (k + 1) for k in np.flatnonzero(missing).tolist()]


def test_beams_that_tell_what_is_there() -> None:
    ranges = [INF, -INF, 0.1, 5.0, NAN, 0.09, 5.01, 0.0]
    assert usable_beams(scan(ranges, 0.0, 0.1)).tolist() == [True] * 4 + [False] * 4


@given(st.integers(12, 1080), st.floats(-3.0, 3.0), st.sampled_from([1, -1]))
def test_a_full_turn_covers_every_heading(beams: int, first_rad: float, sign: int) -> None:
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan([INF] * beams, first_rad, sign * 2.0 * math.pi / beams))
    assert coverage.uncovered(0) is None


@given(st.floats(0.3, 6.0), st.floats(-3.0, 3.0), st.integers(8, 400))
def test_exactly_the_headings_between_the_first_and_the_last_beam_are_covered(
    span_rad: float, first_rad: float, beams: int
) -> None:
    step = span_rad / (beams - 1)
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan([INF] * beams, first_rad, step))
    missing = coverage.uncovered(0)
    width = 2.0 * math.pi / 72
    for k in range(72):
        after = math.remainder((k + 1) * width - first_rad - 0.5 * span_rad, 2.0 * math.pi)
        off = abs(after) - 0.5 * (span_rad + step) - 0.5 * width  # of its edge from the covered
        if step > math.radians(31.0):
            continue
        if abs(off) > 1e-4:
            assert (missing is not None and bool(missing[k])) == (off > 0.0), k


def test_what_was_covered_stays_covered_for_some_time() -> None:
    coverage = ScanCoverage(72, 1.0)
    assert len(uncovered_degrees(coverage, 0)) == 72, "nothing is covered without a scan"
    front = scan([INF] * 181, -0.5 * math.pi, math.pi / 180.0)
    coverage.update(5 * SECOND, scan([INF] * 360, 0.0, math.pi / 180.0))
    coverage.update(5 * SECOND + 10, front)
    assert uncovered_degrees(coverage, 6 * SECOND) == []
    rear = list(range(95, 270, 5))
    assert uncovered_degrees(coverage, 6 * SECOND + 1) == rear
    assert len(uncovered_degrees(coverage, 6 * SECOND + 11)) == 72


def test_masked_beams_cover_nothing_and_single_lost_ones_do_not_matter() -> None:
    ranges = [INF] * 360
    ranges[::5] = [NAN] * 72
    ranges[90:120] = [NAN] * 30
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan(ranges, 0.0, math.pi / 180.0))
    assert uncovered_degrees(coverage, 0) == [95, 100, 105, 110, 115]


def test_a_single_beam_covers_its_own_direction() -> None:
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan([3.0], math.radians(30.0), math.radians(1.0)))
    assert [d for d in range(5, 365, 5) if d not in uncovered_degrees(coverage, 0)] == [30]


@pytest.mark.parametrize(
    ("convention", "expected"),
    [
        ("inf", [INF, -INF, NAN, NAN, 1.0, 5.0, 6.0]),
        ("zero", [INF, -INF, NAN, INF, 1.0, 5.0, 6.0]),
        ("range_max", [INF, -INF, NAN, NAN, 1.0, INF, INF]),
        ("nan", [INF, -INF, INF, NAN, 1.0, 5.0, 6.0]),
    ],
)
def test_how_a_driver_reports_free_space(convention: str, expected: list[float]) -> None:
    given_m = np.array([INF, -INF, NAN, 0.0, 1.0, 5.0, 6.0])
    found = rep_117(given_m, 5.0, NoReturn(convention))
    np.testing.assert_array_equal(found, expected)
    assert given_m[3] == 0.0, "the input is not changed"


def unsafe_degrees(coverage: ScanCoverage) -> list[int]:
    closed = coverage.unsafe(0)
    return [] if closed is None else [5 * (k + 1) for k in np.flatnonzero(closed).tolist()]


def test_the_robot_is_wider_than_its_heading() -> None:
    """Of a lidar that sees 270 degrees, the body would sweep the rest from 75 degrees on."""
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan([INF] * 271, -0.75 * math.pi, math.pi / 180.0))
    assert uncovered_degrees(coverage, 0) == list(range(140, 225, 5))
    assert unsafe_degrees(coverage) == list(range(80, 285, 5))


def test_narrow_masks_close_no_heading() -> None:
    ranges = [INF] * 360
    for post in (45, 135, 225, 315):
        ranges[post - 4 : post + 5] = [NAN] * 9
    coverage = ScanCoverage(72, 1.0)
    coverage.update(0, scan(ranges, 0.0, math.pi / 180.0))
    assert uncovered_degrees(coverage, 0) == [45, 135, 225, 315]
    assert unsafe_degrees(coverage) == []
    assert ScanCoverage(72, 1.0).unsafe(0) is not None, "without a scan nothing is safe"
