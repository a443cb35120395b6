# SPDX-License-Identifier: Apache-2.0
"""Looks from time to time for nodes whose types or QoS do not fit a node's topics."""

from __future__ import annotations

from rclpy.node import Node

from ..interface.connections import UNKNOWN, Mismatch, mismatches

PERIOD_S = 0.5
# Per check, which a tick may have to wait for:
QUERIES = 3  # of a topic's endpoints, 0.1 to 0.5 ms each
WATCHED = 40  # topics whose endpoints are counted, 10 us each; a fleet has more, in turn
OF_EVERY_NODE = {"/rosout", "/parameter_events"}


class ConnectionCheck:
    """The mismatches of a node's topics, each logged once.

    The middleware says nothing where types differ, and with one of several QoS profiles it warns
    of what is no fault. A topic's endpoints are read again when their number has changed, and in
    turn: an endpoint cannot change, only go and come back.
    """

    def __init__(self, node: Node) -> None:
        """Call check() every PERIOD_S."""
        self._node, self._own = node, node.get_fully_qualified_name()
        self._counts: dict[str, tuple[int, int]] = {}  # endpoints when last read
        self._found: dict[str, list[Mismatch]] = {}
        self._logged: set[Mismatch] = set()
        self._unnamed: set[str] = set()  # topics with an endpoint whose node was not known
        self._turn = 0

    @property
    def mismatches(self) -> list[Mismatch]:
        """Those of the last check, by topic."""
        return [fault for _, found in sorted(self._found.items()) for fault in found]

    def check(self) -> None:
        """Read the endpoints of up to QUERIES of WATCHED topics; log what is new."""
        names = topics_of(self._node)
        for gone in self._counts.keys() - names:
            del self._found[gone], self._counts[gone]
        watched = [names[(self._turn + k) % len(names)] for k in range(min(len(names), WATCHED))]
        changed = [name for name in watched if self._counts.get(name) != self._count(name)]
        for name in changed[:QUERIES] or watched[:1]:
            self._read(name)
        if len(changed) <= QUERIES:
            self._turn += 1 if len(watched) == len(names) else len(watched)

    def _count(self, topic: str) -> tuple[int, int]:
        return self._node.count_publishers(topic), self._node.count_subscribers(topic)

    def _read(self, topic: str) -> None:
        count = self._count(topic)
        publishers = self._node.get_publishers_info_by_topic(topic)
        subscriptions = self._node.get_subscriptions_info_by_topic(topic)
        if all(endpoint.node_name != UNKNOWN for endpoint in (*publishers, *subscriptions)):
            self._unnamed.discard(topic)
        elif topic not in self._unnamed:
            self._unnamed.add(topic)
            return  # the name follows: read again at the next check
        self._counts[topic] = count
        self._found[topic] = mismatches(topic, publishers, subscriptions, self._own)
        for fault in self._found[topic]:
            if fault not in self._logged:
                self._logged.add(fault)
                if fault.of_type:  # rclpy wants one severity per line of code
                    self._node.get_logger().error(fault.text)
                else:
                    self._node.get_logger().warning(fault.text)


def topics_of(node: Node) -> list[str]:
    """The full names of the topics that a node publishes or subscribes to, without rclpy's own."""
    published = {publisher.topic_name for publisher in node.publishers}
    subscribed = {subscription.topic_name for subscription in node.subscriptions}
    return sorted((published | subscribed) - OF_EVERY_NODE)


def type_mismatch(node: Node, topics: list[str]) -> str:
    """The first mismatch of types on these topics; empty: none."""
    own = node.get_fully_qualified_name()
    types = dict(node.get_topic_names_and_types())
    for topic in topics:
        if len(types.get(topic, ())) > 1:  # rare, and cheaper to ask for than the endpoints
            publishers = node.get_publishers_info_by_topic(topic)
            subscriptions = node.get_subscriptions_info_by_topic(topic)
            for fault in mismatches(topic, publishers, subscriptions, own):
                if fault.of_type:
                    return fault.text
    return ""
