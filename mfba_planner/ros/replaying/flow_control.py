# SPDX-License-Identifier: Apache-2.0
"""Flow control towards ROS nodes: publish no faster than the slowest reader reads.

A DDS acknowledgement only says that a message is in a reader's history, where newer ones push
it out. But an executor serves what is ready in rounds, one message of each subscription before
any service request. So a node that has n messages of a topic waiting has read them all when it
has answered n calls that came after them.
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

WINDOW = 5  # messages of a topic on their way: half of what a reader holds by default
HOLD_S = 0.1  # longest delay for the sake of a latched message, where timing counts
_SILENT_S = 2.0  # a node whose service is not found so long after it subscribed has none
_NAMELESS = "_UNKNOWN_"  # what rmw gives for a subscriber whose node it does not know (yet)
_NOW = Duration(nanoseconds=0)


def windowed(profile: QoSProfile) -> QoSProfile:
    """The same QoS for every subscriber, with a history that is full after WINDOW messages.

    Fast DDS asks for acknowledgements with the message that fills the history (answer in 5 ms),
    and otherwise every 3 s. Latched topics keep their depth: it is what late subscribers get.
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
    """A node that subscribes to some of our topics; without client it cannot be asked."""

    name: str
    topics: frozenset[str]
    client: Client | None = None


@dataclass(slots=True)
class FlowControl:
    """Counts what was published and not read yet; topics go by their keys in `publishers`.

    Not lossless it only sees to it that what is latched is read before anything that follows,
    and gives that up for good where it takes longer than HOLD_S.
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
    _answers: list[tuple[_Reader, Any]] | None = None
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

    def allows(self, topic: str, *, alone: bool = False) -> bool:
        """Whether the next message may be published before `settle` is true.

        alone: only when all that was published is read.
        """
        if self._settling_since_s is not None or self._latched_sent:
            return self._given_up
        if not self.lossless:
            return True
        if alone and self._unread:
            return False
        return self._unread[topic] < WINDOW and self._unacknowledged[topic] < self._depth(topic)

    def knows_readers(self, now_s: float) -> bool:
        """Whether all who subscribe now can be asked, or will never be able to answer."""
        return not self._find_readers(now_s)

    def settle(self, now_s: float) -> bool:
        """True once everything was read; call it again and again, and spin in between.

        Raises GraphError naming the topic or node that did not answer for timeout_s.
        """
        if self._settling_since_s is None:
            self._settling_since_s = now_s
        missing = self._missing_acknowledgement()
        if not (missing and self._latched_sent):  # only what has arrived can be read in order
            missing = self._missing_answer(now_s) or missing
        if not missing:
            self._unread.clear()
            self._answers, self._settling_since_s, self._latched_sent = None, None, False
            return True
        waited_s = now_s - self._settling_since_s
        if not self.lossless and waited_s > HOLD_S:
            self._given_up = True
        elif waited_s > self.timeout_s:
            raise GraphError(
                f"{missing} for {self.timeout_s:g} s; end what hangs or raise --wait-timeout"
            )
        return self._given_up

    def _depth(self, topic: str) -> int:
        return max(1, int(self.publishers[topic].qos_profile.depth))

    def _missing_acknowledgement(self) -> str:
        """Of a topic whose history is full; of others it would only come after seconds."""
        for topic, count in self._unacknowledged.items():
            if count >= self._depth(topic):
                if not all_acknowledged(self.publishers[topic]):
                    return f"{topic}: not acknowledged"
                self._unacknowledged[topic] = 0
        return ""

    def _missing_answer(self, now_s: float) -> str:
        if self._answers is None:
            unknown = self._find_readers(now_s)
            if unknown:
                return unknown
            self._answers = [
                (reader, reader.client.call_async(GetParameters.Request()))
                for reader in self._readers.values()
                if reader.client
                for _ in range(max(self._unread[topic] for topic in reader.topics))
            ]
        self._answers = [(reader, answer) for reader, answer in self._answers if not answer.done()]
        if now_s - (self._settling_since_s or now_s) > _SILENT_S:
            self._answers = [
                (reader, answer)
                for reader, answer in self._answers
                if reader.client and reader.client.service_is_ready()  # it has not gone
            ]
        return f"{self._answers[0][0].name}: no answer" if self._answers else ""

    def _find_readers(self, now_s: float) -> str:
        """Learn who subscribes, when that may have changed; say who is not known yet."""
        matched = tuple(p.get_subscription_count() for p in self.publishers.values())
        if matched != self._matched:
            self._matched, self._matched_s, self._nameless = matched, now_s, True
        patient = now_s - self._matched_s < _SILENT_S
        if self._nameless:
            self._nameless = self._update() and patient
            if self._nameless:
                return "a subscriber's node: not found"
        for name, reader in self._readers.items():
            if reader.client is None or reader.client.service_is_ready():
                continue
            if patient:
                return f"{name}: not found"
            self._readers[name] = replace(reader, client=None)
            self.node.get_logger().warning(
                f"{name} has no parameter service to ask whether it has read everything; "
                "it may lose messages if it is slow"
            )
        return ""

    def _update(self) -> bool:
        """Read the graph; whether a subscriber's node is not known (yet)."""
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
