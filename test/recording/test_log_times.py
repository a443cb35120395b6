# SPDX-License-Identifier: Apache-2.0
"""First and last valid log time of parts that hold times which a writer left unset."""

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.recording.bag_metadata import NO_TIME_NS
from mfba_planner.recording.log_times import WALL_TIME_NS, LogTimes
from mfba_planner.recording.storage_file import Span, StoredMessage

WALL_NS = 1_700_000_000 * 10**9
UNSET = (0, NO_TIME_NS)


def span_of(times: list[int]) -> Span:
    def load(_: frozenset[int]) -> Iterable[StoredMessage]:
        return [StoredMessage(1, 0, time, time, b"") for time in times]

    return Span(min(times), max(times), load)


def bounds(*parts: list[int]) -> tuple[int | None, int | None]:
    found = LogTimes(span_of(times) for times in parts)
    return found.start_ns, found.end_ns


WALL_TIMES = st.lists(st.integers(WALL_NS, WALL_NS + 10**12), min_size=1, max_size=4)


@given(st.lists(st.tuples(WALL_TIMES, st.lists(st.sampled_from(UNSET))), min_size=1, max_size=4))
def test_unset_times_never_count_beside_wall_times(
    parts: list[tuple[list[int], list[int]]],
) -> None:
    known = [time for times, _ in parts for time in times]
    assert bounds(*(times + unset for times, unset in parts)) == (min(known), max(known))


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ([0, 5, 9], (0, 9)),
        ([0], (0, 0)),
        ([0, NO_TIME_NS], (0, 0)),
        ([5, NO_TIME_NS], (5, 5)),
        ([NO_TIME_NS], (None, None)),
        ([1, NO_TIME_NS - 1], (1, NO_TIME_NS - 1)),
        ([0, WALL_TIME_NS - 1], (0, WALL_TIME_NS - 1)),
        ([0, WALL_TIME_NS], (WALL_TIME_NS, WALL_TIME_NS)),
    ],
)
def test_zero_is_the_start_of_simulated_time_only(
    times: list[int], expected: tuple[int | None, int | None]
) -> None:
    assert bounds(times) == expected


def test_parts_whose_bounds_are_set_are_not_read() -> None:
    def load(_: frozenset[int]) -> Iterable[StoredMessage]:
        raise AssertionError("read")

    found = LogTimes([Span(1, 7, load), Span(3, NO_TIME_NS - 1, load)])
    assert (found.start_ns, found.end_ns) == (1, NO_TIME_NS - 1)


def test_a_bag_without_messages_has_no_times() -> None:
    found = LogTimes([])
    assert (found.start_ns, found.end_ns) == (None, None)
    assert found.is_valid(0)
    assert not found.is_valid(1)
    assert found.valid(4) == 0


@pytest.mark.parametrize(("time", "valid"), [(4, 5), (5, 5), (7, 7), (9, 9), (10, 9)])
def test_the_nearest_valid_time(time: int, valid: int) -> None:
    found = LogTimes([span_of([5, 9])])
    assert found.valid(time) == valid
    assert found.is_valid(time) is (time == valid)
