# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that are emptied now and then, instead of waking an executor per message."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.subscription import Subscription

ONCE_LIMIT = 2000  # messages by which two subscriptions to one topic may be apart


class DuplicateFilter:
    """Tells whether a message is new, where two subscriptions bring each of them."""

    def __init__(self) -> None:
        """Start with nothing seen."""
        self._seen: OrderedDict[tuple[int, int], None] = OrderedDict()

    def is_new(self, info: Mapping[str, Any]) -> bool:
        """Take rclpy's MessageInfo of a message."""
        key = (info["source_timestamp"], info["publication_sequence_number"])
        if key in self._seen:
            return False
        self._seen[key] = None
        if len(self._seen) > ONCE_LIMIT:
            self._seen.popitem(last=False)
        return True


class NeverWaitedFor(CallbackGroup):
    """Its subscriptions never enter an executor's wait set: their owner takes from them."""

    def can_execute(self, _: Any) -> bool:
        """Never."""
        return False

    def beginning_execution(self, _: Any) -> bool:
        """Never."""
        return False

    def ending_execution(self, _: Any) -> None:
        """Nothing was begun."""


class SerializedMessage(NamedTuple):
    """One serialized message; when it was sent and when it came, in ns of the wall clocks."""

    sent_ns: int
    received_ns: int
    data: bytes


Deliver = Callable[[SerializedMessage], None]


class PolledSubscriptions:
    """The boxes of one node; what they hold is handed on in the order in which it was sent.

    While boxes are looked into one by one, newer letters fall into all of them: what was sent
    after the round began waits for the next one, so that a later tick never overtakes an
    earlier one. It waits once at most, as a sender's clock may be ahead of ours.
    """

    def __init__(self) -> None:
        """Start without a box."""
        self.group = NeverWaitedFor()
        self._subscriptions: list[tuple[Subscription, DuplicateFilter | None, Deliver]] = []
        self._waiting: list[tuple[SerializedMessage, Deliver]] = []

    def add(self, subscriptions: list[Subscription], deliver: Deliver) -> None:
        """Take over all raw subscriptions to one topic; they must be of self.group."""
        once = DuplicateFilter() if len(subscriptions) > 1 else None
        self._subscriptions += [(box, once, deliver) for box in subscriptions]

    def empty(self) -> None:
        """Deliver what has come."""
        began_ns = time.time_ns()
        messages, self._waiting = self._waiting, []
        for box, once, deliver in self._subscriptions:
            with box.handle:
                while (taken := box.handle.take_message(box.msg_type, box.raw)) is not None:
                    data, info = taken
                    if once is None or once.is_new(info):
                        sent_ns = info["source_timestamp"]
                        message = SerializedMessage(sent_ns, info["received_timestamp"], data)
                        on_time = messages if sent_ns <= began_ns else self._waiting
                        on_time.append((message, deliver))
        messages.sort(key=lambda item: item[0].sent_ns)
        for message, deliver in messages:
            deliver(message)
