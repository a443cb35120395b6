# SPDX-License-Identifier: Apache-2.0
"""Flow control of replay: publish no faster than the slowest reader reads.

A DDS acknowledgement only means that a message is in a reader's history, where newer ones
replace it. But an executor serves what is ready in rounds, one message of each subscription
before any service request. So a node with n waiting messages of a topic has read them all when
it has responded to n calls that were sent after them.
"""

from __future__ import annotations

from collections import Counter
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile

from ...core.errors import GraphError

WINDOW = 5  # unread messages of a topic: half of what a reader holds by default
HOLD_S = 0.1  # longest delay for a latched message, where the recorded times are kept
_SILENT_S = 2.0  # a node whose service is not found by then has none
_NAMELESS = "_UNKNOWN_"  # what rmw gives for a subscriber whose node it does not know (yet)
_NOW = Duration(nanoseconds=0)


def windowed(profile: QoSProfile) -> QoSProfile:
    """The same QoS for every subscriber, with a history that is full after WINDOW messages.

    Fast DDS asks for acknowledgements with the message that fills the history (response in 5 ms),
    and otherwise every 3 s. Latched topics keep their depth, for late subscribers.
    """
    if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
        return profile
    changed = copy(profile)
    changed.history = HistoryPolicy.KEEP_LAST
    changed.depth = min(profile.depth or WINDOW, WINDOW)
    return changed


def all_acknowledged(publisher: Publisher) -> bool:
    """Whether every reliable reader has received all that was published."""
    return bool(publisher.wait_for_all_acked(_NOW))


@dataclass(frozen=True, slots=True)
class _Reader:
    """A node that subscribes to played topics; without client it has no parameter service."""

    name: str
    topics: frozenset[str]
    client: Client | None = None


@dataclass(slots=True)
class FlowControl:
    """Counts unread messages; topics are named by their keys in `publishers`.

    If not lossless, it only delays messages until a latched one before them is read, and stops
    doing so once that takes longer than HOLD_S.
    """

    node: Node
    publishers: dict[str, Publisher]
    timeout_s: float
    lossless: bool = True
    _given_up: bool = False
    _unread: Counter[str] = field(default_factory=Counter)
    _unacknowledged: Counter[str] = field(default_factory=Counter)
    _readers: dict[str, _Reader] = field(default_factory=dict)
    _matched: tuple[int, ...] = ()
    _matched_s: float = 0.0
    _nameless: bool = False
    _responses: list[tuple[_Reader, Any]] | None = None
    _settling_since_s: float | None = None
    _latched_sent: bool = False

    def sent(self, topic: str) -> None:
        """Count a message."""
        durability = self.publishers[topic].qos_profile.durability
        latched = durability == DurabilityPolicy.TRANSIENT_LOCAL
        if latched or self.lossless:
            self._latched_sent |= latched
            self._unread[topic] += 1
            self._unacknowledged[topic] += 1

    def allows(self, topic: str, *, after_all: bool = False) -> bool:
        """Whether the next message may be published before `settle` is true.

        after_all: only when all that was published is read.
        """
        if self._settling_since_s is not None or self._latched_sent:
            return self._given_up
        if not self.lossless:
            return True
        if after_all and self._unread:
            return False
        return self._unread[topic] < WINDOW and self._unacknowledged[topic] < self._depth(topic)

    def knows_readers(self, now_s: float) -> bool:
        """Whether the parameter service of every subscriber is found or known to be missing."""
        return not self._find_readers(now_s)

    def settle(self, now_s: float) -> bool:
        """True once everything was read; call it repeatedly, and spin in between.

        Raises GraphError naming the topic or node that did not respond for timeout_s.
        """
        if self._settling_since_s is None:
            self._settling_since_s = now_s
        missing = self._missing_acknowledgement()
        if not (missing and self._latched_sent):  # a message must have arrived to be read
            missing = self._missing_response(now_s) or missing
        if not missing:
            self._unread.clear()
            self._responses, self._settling_since_s, self._latched_sent = None, None, False
            return True
        waited_s = now_s - self._settling_since_s
        if not self.lossless and waited_s > HOLD_S:
            self._given_up = True
        elif waited_s > self.timeout_s:
            raise GraphError(
                f"{missing} for {self.timeout_s:g} s; stop what hangs or raise --wait-timeout"
            )
        return self._given_up

    def _depth(self, topic: str) -> int:
        return max(1, int(self.publishers[topic].qos_profile.depth))

    def _missing_acknowledgement(self) -> str:
        """A topic with full history and no acknowledgement; others get theirs seconds later."""
        for topic, count in self._unacknowledged.items():
            if count >= self._depth(topic):
                if not all_acknowledged(self.publishers[topic]):
                    return f"{topic}: not acknowledged"
                self._unacknowledged[topic] = 0
        return ""

    def _missing_response(self, now_s: float) -> str:
        if self._responses is None:
            unknown = self._find_readers(now_s)
            if unknown:
                return unknown
            self._responses = [
                (reader, reader.client.call_async(GetParameters.Request()))
                for reader in self._readers.values()
                if reader.client
                for _ in range(max(self._unread[topic] for topic in reader.topics))
            ]
        self._responses = [
            (reader, response) for reader, response in self._responses if not response.done()
        ]
        if now_s - (self._settling_since_s or now_s) > _SILENT_S:
            self._responses = [
                (reader, response)
                for reader, response in self._responses
                if reader.client and reader.client.service_is_ready()  # the node still exists
            ]
        return f"{self._responses[0][0].name}: no response" if self._responses else ""

    def _find_readers(self, now_s: float) -> str:
        """Update the subscribed nodes if they may have changed; return which is not found yet."""
        matched = tuple(p.get_subscription_count() for p in self.publishers.values())
        if matched != self._matched:
            self._matched, self._matched_s, self._nameless = matched, now_s, True
        within_grace = now_s - self._matched_s < _SILENT_S
        if self._nameless:
            self._nameless = self._update() and within_grace
            if self._nameless:
                return "a subscriber's node: not found"
        for name, reader in self._readers.items():
            if reader.client is None or reader.client.service_is_ready():
                continue
            if within_grace:
                return f"{name}: not found"
            self._readers[name] = replace(reader, client=None)
            self.node.get_logger().warning(
                f"{name} has no parameter service to check whether it has read everything; "
                "it may lose messages if it is slow"
            )
        return ""

    def _update(self) -> bool:
        """Read the ROS graph; return whether a subscriber's node is unknown (yet)."""
        found: dict[str, set[str]] = {}
        for topic, publisher in self.publishers.items():
            for endpoint in self.node.get_subscriptions_info_by_topic(publisher.topic_name):
                name = f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
                found.setdefault(name, set()).add(topic)
        nameless = [name for name in found if _NAMELESS in name]
        for name in nameless:
            del found[name]
        for name in self._readers.keys() - found.keys():
            client = self._readers.pop(name).client
            if client is not None:
                self.node.destroy_client(client)
        for name, topics in found.items():
            reader = self._readers.get(name)
            if reader is None:
                client = self.node.create_client(GetParameters, f"{name}/get_parameters")
                reader = _Reader(name, frozenset(), client)
            self._readers[name] = replace(reader, topics=frozenset(topics))
        return bool(nameless)
