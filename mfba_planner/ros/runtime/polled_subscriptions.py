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


class Once:
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


class Unwaited(CallbackGroup):
    """Its subscriptions never enter an executor's wait set: their owner takes from them."""

    def can_execute(self, _: Any) -> bool:
        """Never."""
        return False

    def beginning_execution(self, _: Any) -> bool:
        """Never."""
        return False

    def ending_execution(self, _: Any) -> None:
        """Nothing was begun."""


class Letter(NamedTuple):
    """One serialized message; when it was sent and when it came, in ns of the wall clocks."""

    sent_ns: int
    received_ns: int
    data: bytes


Deliver = Callable[[Letter], None]


class Letterboxes:
    """The boxes of one node; what they hold is handed on in the order in which it was sent.

    While boxes are looked into one by one, newer letters fall into all of them: what was sent
    after the round began waits for the next one, so that a later tick never overtakes an
    earlier one. It waits once at most, as a sender's clock may be ahead of ours.
    """

    def __init__(self) -> None:
        """Start without a box."""
        self.group = Unwaited()
        self._boxes: list[tuple[Subscription, Once | None, Deliver]] = []
        self._waiting: list[tuple[Letter, Deliver]] = []

    def add(self, boxes: list[Subscription], deliver: Deliver) -> None:
        """Take over all raw subscriptions to one topic; they must be of self.group."""
        once = Once() if len(boxes) > 1 else None
        self._boxes += [(box, once, deliver) for box in boxes]

    def empty(self) -> None:
        """Deliver what has come."""
        began_ns = time.time_ns()
        letters, self._waiting = self._waiting, []
        for box, once, deliver in self._boxes:
            with box.handle:
                while (taken := box.handle.take_message(box.msg_type, box.raw)) is not None:
                    data, info = taken
                    if once is None or once.is_new(info):
                        sent_ns = info["source_timestamp"]
                        letter = Letter(sent_ns, info["received_timestamp"], data)
                        on_time = letters if sent_ns <= began_ns else self._waiting
                        on_time.append((letter, deliver))
        letters.sort(key=lambda item: item[0].sent_ns)
        for letter, deliver in letters:
            deliver(letter)
