# SPDX-License-Identifier: Apache-2.0
"""The sequence of a replay, its deadlines and its QoS: without ROS and without clock."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recorded_bags import FOREIGN, LATCHED, SECOND, SENSOR, START_NS, text

from mfba_planner.core.errors import ConfigError
from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.replay_schedule import (
    Schedule,
    due_messages,
    merged_qos,
    replay_start_ns,
)

S = SECOND
STRING = "std_msgs/msg/String"


def bag_of(path: Path, *messages: tuple[float, str, str]) -> BagReader:
    """(seconds, topic, content) each; a topic named /latched* is latched."""
    with BagWriter(path) as writer:
        for seconds, topic, content in messages:
            writer.add_topic(topic, STRING, LATCHED if "latched" in topic else OfferedQos())
            time_ns = START_NS + round(seconds * S)
            writer.write(topic, text(content), time_ns, time_ns)
    return BagReader(path)


def contents(
    bag: BagReader, topics: set[str], latched: dict[str, int], offset_s: float = 0.0
) -> list[tuple[str, float]]:
    with bag:
        return [
            (due.data[8:-1].decode(), (due.time_ns - START_NS) / S)
            for due in due_messages(bag, topics, latched, offset_s)
        ]


def test_messages_are_sorted_by_log_time(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "b", (0, "/a", "a0"), (2, "/a", "a2"), (1, "/b", "b1"), (3, "/c", "-"))
    assert contents(bag, {"/a", "/b"}, {}) == [("a0", 0), ("b1", 1), ("a2", 2)]


def test_after_an_offset_the_newest_latched_messages_come_first(tmp_path: Path) -> None:
    bag = bag_of(
        tmp_path / "b",
        (0, "/latched_one", "old"),
        (0.5, "/latched_two", "x"),
        (1, "/latched_one", "newest"),
        (2, "/latched_two", "y"),
        (3, "/latched_two", "z"),
        (3.5, "/plain", "gone"),
        (4, "/plain", "first"),
        (5, "/latched_one", "later"),
    )
    topics = {"/latched_one", "/latched_two", "/plain"}
    latched = {"/latched_one": 1, "/latched_two": 2}
    assert contents(bag, topics, latched, 4.0) == [
        ("newest", 4),
        ("y", 4),
        ("z", 4),
        ("first", 4),
        ("later", 5),
    ]


def test_a_latched_message_at_the_offset_comes_once(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "b", (0, "/latched", "old"), (1, "/latched", "new"))
    assert contents(bag, {"/latched"}, {"/latched": 1}, 1.0) == [("old", 1), ("new", 1)]


def test_old_latched_messages_are_found(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "b", (0, "/latched", "old"), (9, "/plain", "now"))
    assert contents(bag, {"/latched", "/plain"}, {"/latched": 1}, 8.0) == [("old", 8), ("now", 9)]


def test_an_offset_beyond_the_end_is_refused() -> None:
    with BagReader(FOREIGN) as bag:
        assert replay_start_ns(bag, bag.duration_ns / S) == bag.end_ns
        with pytest.raises(ConfigError, match=r"start_offset=13.3 s: beyond the end .* 13.2021 s"):
            replay_start_ns(bag, 13.3)


def test_the_qos_of_one_publisher_is_unchanged() -> None:
    assert merged_qos((SENSOR,)) == SENSOR
    assert merged_qos(()).depth == 0


def test_the_qos_of_several_publishers_is_the_strongest() -> None:
    both = merged_qos((SENSOR, LATCHED))
    assert (both.reliability, both.durability) == ("reliable", "transient_local")
    assert (both.depth, both.deadline_ns) == (5, SENSOR.deadline_ns)
    weak = OfferedQos(reliability="best_effort", depth=1)
    assert merged_qos((weak, OfferedQos(reliability="best_effort", depth=7))).reliability == (
        "best_effort"
    )
    assert merged_qos((weak, OfferedQos(depth=0))).depth == 0  # one of unknown depth
    assert merged_qos((weak, OfferedQos(history="keep_all"))).history == "keep_all"


@given(
    rate=st.floats(0.01, 100.0),
    times=st.lists(st.integers(0, 10**12), max_size=20),
    start_ns=st.integers(0, 10**15),
    elapsed_ns=st.integers(0, 10**10),
)
def test_deadlines_do_not_depend_on_the_time_of_the_call(
    rate: float, times: list[int], start_ns: int, elapsed_ns: int
) -> None:
    schedule = Schedule(rate, START_NS)
    schedule.start(start_ns)
    for time_ns in times:
        wait = schedule.wait_ns(START_NS + time_ns, start_ns + elapsed_ns)
        assert wait == round(time_ns / rate) - elapsed_ns


@given(
    rate=st.floats(0.1, 10.0),
    pauses=st.lists(st.tuples(st.integers(0, 10**10), st.integers(0, 10**10)), max_size=5),
)
def test_pauses_shift_the_deadlines_by_their_length(
    rate: float, pauses: list[tuple[int, int]]
) -> None:
    schedule = Schedule(rate, 0)
    now = 5
    schedule.start(now)
    due = round(10**12 / rate) + now
    for running_ns, paused_ns in pauses:
        now += running_ns
        schedule.pause(now)
        before = schedule.time_ns(now)
        assert schedule.wait_ns(10**12, now) is None
        now += paused_ns
        assert schedule.time_ns(now) == before
        schedule.resume(now)
        due += paused_ns
    wait = schedule.wait_ns(10**12, now)
    assert wait is not None
    assert abs(wait - (due - now)) <= 20 / rate + 2  # one rounding per pause


def test_time_is_stopped_until_the_start_and_while_paused() -> None:
    schedule = Schedule(2.0, START_NS, paused=True)
    schedule.start(0)
    assert schedule.time_ns(99) == START_NS
    assert [schedule.is_stepped] == [True]
    schedule.advance_to(START_NS + 10)
    schedule.advance_to(START_NS + 4)  # never back
    assert schedule.time_ns(99) == START_NS + 10
    schedule.resume(1000)
    schedule.resume(2000)  # already running
    assert [schedule.is_stepped] == [False]
    schedule.advance_to(START_NS + 10**9)  # no effect while time runs
    assert schedule.time_ns(1005) == START_NS + 20
    assert schedule.wait_ns(START_NS + 30, 1005) == 5


def test_resume_before_start_runs_from_the_start() -> None:
    schedule = Schedule(1.0, 0, paused=True)
    schedule.resume(10)
    assert schedule.wait_ns(5, 20) is None
    schedule.start(100)
    assert schedule.wait_ns(5, 100) == 5


def test_as_fast_as_possible_all_is_due_and_time_follows_the_messages() -> None:
    schedule = Schedule(None, START_NS)
    assert schedule.wait_ns(START_NS, 0) is None
    schedule.start(0)
    assert schedule.wait_ns(START_NS + 10**15, 0) == 0
    assert schedule.time_ns(10**15) == START_NS
    schedule.advance_to(START_NS + 7)
    assert schedule.time_ns(10**15) == START_NS + 7
    schedule.rewind(START_NS + 7, START_NS, 100)
    assert schedule.time_ns(10**15) == START_NS


def test_the_next_loop_starts_after_the_gap_at_any_time_of_the_call() -> None:
    schedule = Schedule(2.0, START_NS)
    schedule.start(1000)
    for loop in range(1, 4):
        schedule.rewind(START_NS + 600, START_NS, 50)
        assert schedule.wait_ns(START_NS, 0) == 1000 + loop * 350
