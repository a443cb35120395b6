# SPDX-License-Identifier: Apache-2.0
"""Letterboxes over real subscriptions: order, and what falls in while they are emptied."""

import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from ros_graph import Graph
from std_msgs.msg import String

from mfba_planner.ros.runtime import polled_subscriptions
from mfba_planner.ros.runtime.polled_subscriptions import PolledSubscriptions

Post = Callable[[str, str], None]


@pytest.fixture
def heard() -> list[str]:
    return []


@pytest.fixture
def boxes(graph: Graph, heard: list[str]) -> PolledSubscriptions:
    """Two topics, late and early; the box of late is looked into first."""
    made = PolledSubscriptions()

    def deliver(message: Any) -> None:
        heard.append(deserialize_message(message.data, String).data)

    for name in ("late", "early"):
        box = graph.probe.create_subscription(
            String, name, lambda _: None, 10, callback_group=made.group, raw=True
        )
        made.add([box], deliver)
    return made


@pytest.fixture
def post(graph: Graph) -> Post:
    writers = {name: graph.probe.create_publisher(String, name, 10) for name in ("late", "early")}
    return lambda name, text: writers[name].publish(String(data=text))


def until_heard(boxes: PolledSubscriptions, heard: list[str], count: int) -> None:
    deadline = time.monotonic() + 5.0
    while len(heard) < count:
        assert time.monotonic() < deadline, heard
        boxes.empty()


def test_letters_are_handed_on_as_they_were_sent(
    boxes: PolledSubscriptions, heard: list[str], post: Post
) -> None:
    for number in range(6):
        post(("early", "late")[number % 2], str(number))
    until_heard(boxes, heard, 6)
    assert heard == list("012345")


def test_what_was_sent_after_a_round_began_waits_for_the_next(
    boxes: PolledSubscriptions, heard: list[str], post: Post, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock says when a round begins: long before the letters were sent, here."""
    post("early", "first")
    until_heard(boxes, heard, 1)
    post("early", "second")
    with monkeypatch.context() as patch:
        patch.setattr(polled_subscriptions.time, "time_ns", lambda: 0)
        boxes.empty()
        assert heard == ["first"]
        boxes.empty()
        assert heard == ["first", "second"], "it waits once at most"
