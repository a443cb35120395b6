# SPDX-License-Identifier: Apache-2.0
"""Polled subscriptions over DDS: sequence of delivery, and messages sent during a poll."""

import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from ros_graph import Graph
from std_msgs.msg import String

from mfba_planner.ros.runtime import polled_subscriptions
from mfba_planner.ros.runtime.polled_subscriptions import PolledSubscriptions

Publish = Callable[[str, str], None]


@pytest.fixture
def received() -> list[str]:
    return []


@pytest.fixture
def polled(graph: Graph, received: list[str]) -> PolledSubscriptions:
    """Two topics, late and early; late is polled first."""
    made = PolledSubscriptions()

    def deliver(message: Any) -> None:
        received.append(deserialize_message(message.data, String).data)

    for name in ("late", "early"):
        subscription = graph.probe.create_subscription(
            String, name, lambda _: None, 10, callback_group=made.group, raw=True
        )
        made.add([subscription], deliver)
    return made


@pytest.fixture
def publish(graph: Graph) -> Publish:
    writers = {name: graph.probe.create_publisher(String, name, 10) for name in ("late", "early")}
    return lambda name, text: writers[name].publish(String(data=text))


def poll_until(polled: PolledSubscriptions, received: list[str], count: int) -> None:
    deadline = time.monotonic() + 5.0
    while len(received) < count:
        assert time.monotonic() < deadline, received
        polled.poll()


def test_messages_are_delivered_sorted_by_send_time(
    polled: PolledSubscriptions, received: list[str], publish: Publish
) -> None:
    for number in range(6):
        publish(("early", "late")[number % 2], str(number))
    poll_until(polled, received, 6)
    assert received == list("012345")


def test_what_was_sent_after_a_poll_started_waits_for_the_next(
    polled: PolledSubscriptions,
    received: list[str],
    publish: Publish,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The patched clock starts the poll long before the messages were sent."""
    publish("early", "first")
    poll_until(polled, received, 1)
    publish("early", "second")
    with monkeypatch.context() as patch:
        patch.setattr(polled_subscriptions.time, "time_ns", lambda: 0)
        polled.poll()
        assert received == ["first"]
        polled.poll()
        assert received == ["first", "second"], "it waits once at most"
