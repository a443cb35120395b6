# SPDX-License-Identifier: Apache-2.0
"""Dropped messages and competing publishers, found by sequence numbers; without ROS."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.ros.runtime.reception import HELD_S, Reception

TWO = ["a", "b"]


def reception(names: list[str], wanted: str = "") -> Reception:
    return Reception("scan", lambda: names, "merge them", wanted)


def faults(numbers: list[int], names: list[str], period_s: float = 0.1) -> list[bool]:
    """Whether there is a fault after each of these sequence numbers."""
    found, topic = [], reception(names)
    for k, number in enumerate(numbers):
        topic.received(number, k, "laser", k * period_s, 1.0)
        found.append(bool(topic.fault(k * period_s)))
    return found


def test_dropped_messages_are_counted() -> None:
    topic = reception(["a"])
    for k, number in enumerate((7, 8, 12, 13, 1, 2, 4)):
        topic.received(number, k, "laser", 0.1 * k, 1.0)
    assert topic.dropped == 3 + 1, "a restart is none"


@pytest.mark.parametrize(
    "numbers",
    [
        [1000, 1, 1001, 2, 1002, 3],
        [5, 5, 6, 6, 7, 7],
        [5, 6, 6, 7, 7, 8],
        [9, 1, 2, 10, 3, 4, 11],
        [1, 2, 3, 1, 4, 2],
    ],
)
def test_two_publishers_that_send_in_turn_are_a_fault(numbers: list[int]) -> None:
    found = faults(numbers, TWO)
    assert found[-1]
    assert not found[1]
    assert not any(faults(numbers, ["a"])), "the graph knows one publisher only"


def test_a_fault_names_the_publishers_and_ends_by_itself() -> None:
    topic = reception(TWO)
    for number in (100, 1, 101):
        topic.received(number, 1, "laser", 0.0, 1.0)
    assert topic.fault(0.0) == "scan has 2 publishers that send in turn (a, b); merge them"
    assert topic.fault(HELD_S - 0.01)
    assert topic.fault(HELD_S) == ""


@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(0, 3))
def test_a_publisher_that_is_restarted_is_no_fault(runs: list[int], lost: int) -> None:
    """Even if the graph still knows the old one; its run ends before the new one begins."""
    numbers = [n for length in runs for n in range(1 + lost, 1 + lost + length)]
    assert not any(faults(numbers, ["a"]))
    falling = sorted(runs, reverse=True)
    numbers = [n + 100 * k for k, length in enumerate(falling[::-1]) for n in range(1, length)]
    assert not any(faults(numbers, TWO)), "rising numbers are those of one publisher"


def test_a_message_that_was_overtaken_is_left_out() -> None:
    """Of two subscriptions to one publisher, one may have dropped what the other one has not."""
    topic = reception(TWO)
    sent = (1, 2, 4, 3, 5, 6)
    used = [topic.received(number, number, "laser", 0.0, 1.0) for number in sent]
    assert used == [True, True, True, False, True, True]
    assert topic.dropped == 1
    assert topic.fault(0.0) == ""


def test_a_publisher_with_a_slow_clock_is_found_too() -> None:
    topic = reception(TWO)
    for number, sent_ns in ((100, 1000), (1, 10), (101, 1001), (2, 11)):
        topic.received(number, sent_ns, "laser", 0.0, 1.0)
    assert topic.fault(0.0)


def test_after_a_long_silence_an_old_sequence_is_forgotten() -> None:
    assert not any(faults([1000, 1, 1001, 2, 1002], TWO, period_s=12.0))


def test_a_change_of_frame_is_a_fault_for_a_while() -> None:
    topic = reception(["a"])
    assert topic.received(1, 1, "front", 0.0, 1.0)
    assert topic.received(2, 1, "rear", 0.1, 1.0)
    text = "scan changes its frame from 'front' to 'rear'; merge them"
    assert topic.fault(0.1) == text
    topic.received(3, 1, "rear", 0.2, 1.0)
    assert topic.fault(0.2) == text
    assert topic.fault(0.1 + HELD_S) == ""


def test_without_sequence_numbers_frames_still_count() -> None:
    topic = reception(TWO)
    assert [topic.received(None, 1, frame, 0.0, 1.0) for frame in ("front", "front")] == [True] * 2
    assert (topic.fault(0.0), topic.dropped) == ("", 0)
    topic.received(None, 1, "rear", 0.0, 1.0)
    assert topic.fault(0.0).startswith("scan changes its frame")


def test_messages_of_another_frame_are_ignored_while_the_wanted_ones_come() -> None:
    topic = reception(TWO, wanted="front")
    assert topic.received(1, 1, "rear", 0.0, 1.0), "no wanted one yet"
    assert topic.received(5, 1, "front", 0.1, 1.0)
    assert not topic.received(2, 1, "rear", 0.2, 1.0)
    assert topic.received(6, 1, "front", 0.3, 1.0)
    assert topic.fault(0.3) == ""
    assert topic.received(9, 1, "rear", 2.0, 1.0), "the wanted ones have ended"
    assert topic.ignored == 1
    alone = reception(["a"], wanted="front")
    assert alone.received(1, 1, "front", 0.0, 1.0)
    assert alone.received(2, 1, "rear", 0.1, 1.0), "one lidar whose frame changes"


def merging(names: list[str]) -> Reception:
    known = {"front", "rear"}.__contains__
    return Reception("scan", lambda: names, "merge them", is_merged=known)


@given(st.integers(0, 50), st.integers(0, 50), st.lists(st.booleans(), min_size=5, max_size=40))
def test_a_publisher_for_each_merged_frame_is_no_fault(
    front: int, rear: int, sequence: list[bool]
) -> None:
    topic, numbers = merging(TWO), {"front": front, "rear": rear}
    for k, is_front in enumerate(sequence):
        frame = "front" if is_front else "rear"
        numbers[frame] += 1
        topic.received(numbers[frame], 1000 + k, frame, 0.01 * k, 1.0)
        assert topic.fault(0.01 * k) == ""


def test_once_they_are_known_by_frame_nothing_is_dropped_or_overtaken() -> None:
    topic = merging(TWO)
    for k in range(1, 5):
        for frame in ("front", "rear"):
            topic.received(k, 10 * k, frame, 0.1 * k, 1.0)
    before = topic.dropped
    for k in range(5, 15):  # the clock of the rear one is late
        assert topic.received(k, 10 * k, "front", 0.1 * k, 1.0)
        assert topic.received(k, 10 * k - 9, "rear", 0.1 * k, 1.0)
    assert topic.dropped == before
    topic.received(17, 180, "front", 1.5, 1.0)
    assert topic.dropped == before + 2


def test_one_publisher_of_both_frames_is_no_fault_and_loses_nothing() -> None:
    topic = merging(["relay"])
    for k in range(1, 20):
        assert topic.received(k, k, ("front", "rear")[k % 2], 0.1 * k, 1.0)
    assert (topic.dropped, topic.fault(2.0)) == (0, "")


def test_two_publishers_in_one_of_the_merged_frames_are_a_fault() -> None:
    topic = merging(["a", "b", "c"])
    now_s = 0.0
    for k in range(1, 6):
        for frame, number in (("front", k), ("rear", k), ("rear", 1000 + k)):
            now_s += 0.01
            topic.received(number, k, frame, now_s, 1.0)
    assert topic.fault(now_s) == ("scan has 3 publishers that send in turn (a, b, c); merge them")


def test_a_frame_that_is_not_merged_is_a_fault_beside_those_that_are() -> None:
    topic = merging(TWO)
    for k, frame in enumerate(("front", "rear", "front", "arm"), start=1):
        assert topic.fault(0.0) == ""
        topic.received(k, k, frame, 0.0, 1.0)
    assert topic.fault(0.0) == "scan changes its frame from 'front' to 'arm'; merge them"
