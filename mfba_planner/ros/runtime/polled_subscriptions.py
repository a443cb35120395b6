# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that are polled now and then, instead of waking an executor per message."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.subscription import Subscription

DUPLICATE_LIMIT = 2000  # messages by which two subscriptions to one topic may be apart


class DuplicateFilter:
    """Tells whether a message is new, where two subscriptions deliver each message."""

    def __init__(self) -> None:
        """Start with no message received."""
        self._received: OrderedDict[tuple[int, int], None] = OrderedDict()

    def is_new(self, info: Mapping[str, Any]) -> bool:
        """Take rclpy's MessageInfo of a message."""
        key = (info["source_timestamp"], info["publication_sequence_number"])
        if key in self._received:
            return False
        self._received[key] = None
        if len(self._received) > DUPLICATE_LIMIT:
            self._received.popitem(last=False)
        return True


class PolledGroup(CallbackGroup):
    """Its subscriptions never enter an executor's wait set: their owner takes from them."""

    def can_execute(self, _: Any) -> bool:
        """Never."""
        return False

    def beginning_execution(self, _: Any) -> bool:
        """Never."""
        return False

    def ending_execution(self, _: Any) -> None:
        """Nothing was executed."""


class SerializedMessage(NamedTuple):
    """One serialized message; when it was sent and received, in ns of the wall clocks."""

    sent_ns: int
    received_ns: int
    data: bytes


Deliver = Callable[[SerializedMessage], None]


class PolledSubscriptions:
    """The polled subscriptions of one node; their messages are delivered sorted by send time.

    While they are polled one by one, newer messages arrive at all of them. What was sent after
    the poll started waits for the next poll, so that a later tick never overtakes an earlier
    one. It waits once at most, as a sender's clock may be ahead of ours.
    """

    def __init__(self) -> None:
        """Start without subscriptions."""
        self.group = PolledGroup()
        self._subscriptions: list[tuple[Subscription, DuplicateFilter | None, Deliver]] = []
        self._waiting: list[tuple[SerializedMessage, Deliver]] = []

    def add(self, subscriptions: list[Subscription], deliver: Deliver) -> None:
        """Take over all raw subscriptions to one topic; their callback group is self.group."""
        duplicates = DuplicateFilter() if len(subscriptions) > 1 else None
        self._subscriptions += [(taken, duplicates, deliver) for taken in subscriptions]

    def poll(self) -> None:
        """Deliver what was received."""
        started_ns = time.time_ns()
        messages, self._waiting = self._waiting, []
        for subscription, duplicates, deliver in self._subscriptions:
            handle = subscription.handle
            with handle:
                while taken := handle.take_message(subscription.msg_type, subscription.raw):
                    data, info = taken
                    if duplicates is None or duplicates.is_new(info):
                        sent_ns = info["source_timestamp"]
                        message = SerializedMessage(sent_ns, info["received_timestamp"], data)
                        on_time = messages if sent_ns <= started_ns else self._waiting
                        on_time.append((message, deliver))
        messages.sort(key=lambda item: item[0].sent_ns)
        for message, deliver in messages:
            deliver(message)
