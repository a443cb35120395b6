# SPDX-License-Identifier: Apache-2.0
"""Log times in simulated time: what is lost and sent again keeps the time it was sent at."""

import time
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import serialize_message

from mfba_planner.ros.endpoints import simulated_log_times
from mfba_planner.ros.endpoints.simulated_log_times import SimulatedLogTimes, Timed
from mfba_planner.ros.interface.to_messages import clock_msg
from mfba_planner.ros.runtime.polled_subscriptions import SerializedMessage

TICK_NS = 10**8
WALL_NS = 1_700_000_000 * 10**9
PERIOD_NS = 10**6  # of a tick, by the wall clock
# Topic: when it is sent within a tick, and whether it has the tick's stamp. /plan is published
# after the next tick has begun.
TOPICS = {
    "/clock": (0, False),
    "/odom": (10, True),
    "/goal_step": (400, True),
    "/cmd_vel": (500, False),
    "/markers": (600, False),
    "/plan": (PERIOD_NS + 100, True),
}


def sent(topic: str, tick: int) -> SerializedMessage:
    sent_ns = WALL_NS + tick * PERIOD_NS + TOPICS[topic][0]
    data = serialize_message(clock_msg(tick * TICK_NS)) if topic == "/clock" else b"x%d" % tick
    return SerializedMessage(sent_ns, sent_ns, data)


def received(log_times: SimulatedLogTimes, topic: str, tick: int) -> list[Timed]:
    message = sent(topic, tick)
    if topic == "/clock":
        return list(log_times.add_clock(topic, message))
    return list(log_times.add(topic, message, tick * TICK_NS if TOPICS[topic][1] else 0))


def delivered(sequence: Iterable[tuple[str, int]]) -> list[Timed]:
    log_times = SimulatedLogTimes()
    found = [timed for topic, tick in sequence for timed in received(log_times, topic, tick)]
    return [*found, *log_times.take_held()]


@given(
    st.integers(1, 12),
    st.dictionaries(
        st.sampled_from(list(TOPICS)), st.tuples(st.integers(1, 12), st.integers(1, 9))
    ),
)
def test_late_messages_have_the_log_time_of_their_tick(
    ticks: int, late: dict[str, tuple[int, int]]
) -> None:
    """From one tick on, all messages of a topic come late, up to the resent one's arrival."""

    def arrival_ns(topic: str, tick: int) -> int:
        sent_ns = sent(topic, tick).sent_ns
        first, by = late.get(topic, (ticks + 1, 0))
        end_ns = sent(topic, first).sent_ns + by * PERIOD_NS
        return max(sent_ns, end_ns) if tick >= first else sent_ns

    made = [(topic, tick) for tick in range(1, ticks + 1) for topic in TOPICS]
    made.sort(key=lambda item: (arrival_ns(*item), item[1], sent(*item).sent_ns))
    found = delivered(made)
    assert len(found) == len(made)
    for topic in TOPICS:
        own = [timed for timed in found if timed.name == topic]
        data = [timed.data for timed in own]
        assert data == [sent(topic, tick).data for tick in range(1, ticks + 1)]
        if "/clock" not in late or topic in ("/clock", "/odom", "/goal_step", "/plan"):
            expected = [tick * TICK_NS for tick in range(1, ticks + 1)]
            assert [timed.log_time_ns for timed in own] == expected, topic


def test_what_follows_a_held_message_stays_behind_it() -> None:
    log_times = SimulatedLogTimes()
    assert len(received(log_times, "/clock", 1)) == 1
    assert received(log_times, "/odom", 2) == []
    assert received(log_times, "/cmd_vel", 2) == []
    found = received(log_times, "/clock", 2)
    assert [(timed.name, timed.log_time_ns) for timed in found] == [
        ("/odom", 2 * TICK_NS), ("/cmd_vel", 2 * TICK_NS), ("/clock", 2 * TICK_NS)]  # fmt: skip


def test_without_any_clock_the_log_time_is_the_wall_time() -> None:
    before_ns = time.time_ns()
    (found,) = delivered([("/cmd_vel", 1)])
    assert before_ns <= found.log_time_ns <= time.time_ns()


def test_stamps_that_no_clock_reaches_are_not_held_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(simulated_log_times, "HELD_LIMIT", 3)
    log_times = SimulatedLogTimes()
    received(log_times, "/clock", 1)
    for tick in range(2, 5):
        assert received(log_times, "/odom", tick) == []
    found = received(log_times, "/odom", 5)
    assert [timed.log_time_ns for timed in found] == [TICK_NS] * 4
    assert list(log_times.take_held()) == []


def test_after_the_wall_clock_was_set_back_the_new_clock_counts() -> None:
    log_times = SimulatedLogTimes()
    for tick in (50, 51):
        received(log_times, "/clock", tick)
    early = sent("/clock", 1)._replace(data=sent("/clock", 52).data)
    list(log_times.add_clock("/clock", early))
    (found,) = log_times.add("/markers", sent("/markers", 1))
    assert found.log_time_ns == 52 * TICK_NS


def test_the_history_of_the_clock_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulated_log_times, "KEPT", 4)
    log_times = SimulatedLogTimes()
    for tick in range(1, 24):
        received(log_times, "/clock", tick)
        assert len(log_times._sent_ns) == len(log_times._clock_ns) < 8
    (found,) = log_times.add("/markers", sent("/markers", 21))
    assert found.log_time_ns == 21 * TICK_NS
