# SPDX-License-Identifier: Apache-2.0
"""The first and last log time of a bag, without those that its writer left unset."""

from collections.abc import Sequence

import pytest

from mfba_planner.recording.bag_metadata import NO_TIME_NS
from mfba_planner.recording.log_times import WALL_TIME_NS, LogTimes
from mfba_planner.recording.storage_file import Span, StoredMessage

WALL = WALL_TIME_NS + 5


def span(times: Sequence[int]) -> Span:
    """A part of a bag with messages at these times."""
    stored = [StoredMessage(1, 0, time_ns, time_ns, b"") for time_ns in times]
    return Span(min(times), max(times), lambda _: stored)


def unread(start_ns: int, end_ns: int) -> Span:
    """A part whose bounds tell all, so that it must not be read."""

    def load(_: frozenset[int]) -> list[StoredMessage]:
        raise AssertionError("read")

    return Span(start_ns, end_ns, load)


@pytest.mark.parametrize(
    ("parts", "bounds"),
    [
        ([], (None, None)),
        ([unread(3, 9)], (3, 9)),
        ([unread(5, 9), unread(3, 4)], (3, 9)),
        ([span([NO_TIME_NS, 7, 8])], (7, 8)),
        ([span([4, 6, NO_TIME_NS]), unread(2, 3)], (2, 6)),
        ([span([NO_TIME_NS])], (None, None)),
        ([unread(1, NO_TIME_NS - 1)], (1, NO_TIME_NS - 1)),
        # 0 is the begin of a simulation, and unset among wall times.
        ([span([0, 5])], (0, 5)),
        ([span([0])], (0, 0)),
        ([span([0, NO_TIME_NS])], (0, 0)),
        ([span([0, WALL])], (WALL, WALL)),
        ([span([0, WALL_TIME_NS - 1])], (0, WALL_TIME_NS - 1)),
        ([span([0, WALL_TIME_NS])], (WALL_TIME_NS, WALL_TIME_NS)),
        ([span([0]), unread(WALL, WALL + 2)], (WALL, WALL + 2)),
    ],
)
def test_the_bounds_are_of_the_times_that_are_set(
    parts: list[Span], bounds: tuple[int | None, int | None]
) -> None:
    times = LogTimes(parts)
    assert (times.start_ns, times.end_ns) == bounds


def test_an_unset_time_counts_as_the_nearest_that_is_set() -> None:
    times = LogTimes([span([NO_TIME_NS, WALL, WALL + 3, 0])])
    assert [times.valid(t) for t in (0, WALL + 1, NO_TIME_NS)] == [WALL, WALL + 1, WALL + 3]
    valid = [t for t in range(WALL - 2, WALL + 6) if times.is_valid(t)]
    assert valid == [WALL, WALL + 1, WALL + 2, WALL + 3]


def test_without_messages_only_zero_is_valid() -> None:
    times = LogTimes([])
    assert [times.is_valid(t) for t in (0, 1)] == [True, False]
    assert times.valid(7) == 0
