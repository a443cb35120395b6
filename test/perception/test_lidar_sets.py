# SPDX-License-Identifier: Apache-2.0
"""Which scans of several lidars are perceived together, and when."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.perception.lidar_sets import LidarSets

MS, LIMIT_S = 1_000_000, 0.5
Arrival = tuple[str, int]  # frame, stamp in ms


def perceived(arrivals: list[Arrival], limit_s: float = LIMIT_S) -> list[tuple[Arrival, ...]]:
    """The sets that are perceived by, as (frame, stamp in ms) of each scan."""
    sets: LidarSets[None] = LidarSets()
    return [
        tuple((scan.frame, scan.stamp_ns // MS) for scan in sets.newest(limit_s))
        for frame, stamp in arrivals
        if sets.add(frame, stamp * MS, None, limit_s)
    ]


def turns(front_ms: int, rear_ms: int, count: int = 6, period_ms: int = 100) -> list[Arrival]:
    """Two lidars with a period, each from its first stamp on."""
    found = [("front", front_ms + k * period_ms) for k in range(count)]
    return sorted(
        [*found, *(("rear", rear_ms + k * period_ms) for k in range(count))], key=lambda a: a[1]
    )


def test_of_one_lidar_each_scan_counts_whatever_its_stamp() -> None:
    assert perceived([("", 3), ("", 3), ("", 2), ("", 4)]) == [
        (("", 3),), (("", 3),), (("", 2),), (("", 4),)
    ]  # fmt: skip


@given(st.lists(st.booleans(), min_size=5, max_size=5))
def test_scans_of_the_same_moment_belong_together_in_any_sequence(front_first: list[bool]) -> None:
    arrivals: list[Arrival] = []
    for k, is_first in enumerate(front_first, start=1):
        pair = [("front", 100 * k), ("rear", 100 * k)]
        arrivals += pair if is_first else pair[::-1]
    found = perceived(arrivals)
    assert len(found[0]) == 1, "nothing is known of the other lidar yet"
    assert found[1:] == [(("front", 100 * k), ("rear", 100 * k)) for k in range(2, 6)]


def test_lidars_that_measure_at_nearly_the_same_time_are_perceived_as_pairs() -> None:
    pairs = perceived(turns(0, 20))[1:]
    assert pairs[1:] == [(("front", 100 * k), ("rear", 100 * k + 20)) for k in range(1, 6)]


def test_lidars_that_take_turns_are_perceived_by_each_scan() -> None:
    found = perceived(turns(0, 50))
    stamps = [max(stamp for _, stamp in scans) for scans in found]
    assert stamps == [50 * k for k in range(12)]


def test_a_slow_lidar_does_not_slow_the_other_one_by_more_than_one_scan() -> None:
    fast = [("front", 25 * k) for k in range(41)]
    slow = [("rear", 100 * k + 5) for k in range(10)]
    found = perceived(sorted([*fast, *slow], key=lambda a: a[1]))
    stamps = [max(stamp for _, stamp in scans) for scans in found]
    assert all(0 < b - a <= 50 for a, b in zip(stamps, stamps[1:]))
    assert len(stamps) > 25


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 40)), max_size=60))
def test_stamps_of_what_is_perceived_rise(arrivals: list[Arrival]) -> None:
    sets: LidarSets[None] = LidarSets()
    last_ns = -1
    for frame, stamp in arrivals:
        if sets.add(frame, stamp * 20 * MS, None, LIMIT_S) and sets.are_several:
            assert sets.newest_ns > last_ns
            last_ns = sets.newest_ns


def test_a_lidar_that_falls_silent_is_left_out_and_named() -> None:
    sets: LidarSets[None] = LidarSets()
    for frame, stamp in turns(0, 10, count=3):
        sets.add(frame, stamp * MS, None, LIMIT_S)
    assert sets.silence(LIMIT_S) == ""
    each_time = [sets.add("front", stamp * MS, None, LIMIT_S) for stamp in range(300, 1300, 100)]
    assert each_time[2:] == [True] * 8, "it is not waited for, once it has missed two scans"
    assert [scan.frame for scan in sets.newest(LIMIT_S)] == ["front"]
    assert sets.silence(LIMIT_S) == (
        "no scan in frame 'rear' for more than 0.5 s: what only that lidar covers is not known"
    )
    assert sets.are_several
    sets.add("rear", 1210 * MS, None, LIMIT_S)
    assert sets.silence(LIMIT_S) == ""


def test_the_scans_at_a_stamp_are_the_newest_until_then() -> None:
    sets: LidarSets[int] = LidarSets()
    for k, (frame, stamp) in enumerate(turns(0, 40, count=4)):
        sets.add(frame, stamp * MS, k, LIMIT_S)
    found = sets.at(240 * MS, LIMIT_S)
    assert [(scan.frame, scan.stamp_ns // MS, scan.value) for scan in found] == [
        ("front", 200, 4), ("rear", 240, 5)
    ]  # fmt: skip
    assert [scan.stamp_ns // MS for scan in sets.at(239 * MS, LIMIT_S)] == [200, 140]
    assert [scan.frame for scan in sets.at(240 * MS, 0.01)] == ["rear"]


@pytest.mark.parametrize("first", ["", "front"])
def test_a_lidar_without_a_frame_is_that_of_the_first_that_has_one(first: str) -> None:
    assert len(perceived([("", 1), (first, 2), ("front", 3)])[-1]) == 1
