# SPDX-License-Identifier: Apache-2.0
"""Endpoints on one topic that cannot connect, as their types or QoS differ: cause and remedy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.topic_endpoint_info import TopicEndpointInfo

from .diagnostic_status import Level, Status

UNKNOWN = "_NODE_NAME_UNKNOWN_"  # rmw: the endpoint is discovered before its node's name
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Mismatch(NamedTuple):
    """A topic on which one of our nodes and another one cannot exchange messages."""

    topic: str
    node: str  # the other one, with its namespace
    of_type: bool  # False: of QoS
    text: str


class Pair(NamedTuple):
    """A publisher and a subscription of one topic."""

    publisher: TopicEndpointInfo
    subscription: TopicEndpointInfo

    @property
    def types_differ(self) -> bool:
        """Whether the message types differ."""
        return bool(self.publisher.topic_type != self.subscription.topic_type)

    @property
    def connects(self) -> bool:
        """Whether messages pass: equal types and compatible QoS, as far as that is known."""
        if self.types_differ:
            return False
        offered, requested = self.publisher.qos_profile, self.subscription.qos_profile
        return qos_check_compatible(offered, requested)[0] != QoSCompatibility.ERROR


def full_name(endpoint: TopicEndpointInfo) -> str:
    """The name of an endpoint's node with its namespace."""
    if endpoint.node_name == UNKNOWN:
        return "a node without name"
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def mismatches(
    topic: str,
    publishers: Sequence[TopicEndpointInfo],
    subscriptions: Sequence[TopicEndpointInfo],
    own: str,
) -> list[Mismatch]:
    """What keeps the node `own` (full name) from another node on this topic, one per node.

    A node that publishes or subscribes in several ways connects if one of them does.
    """
    found = []
    for we_publish in (True, False):
        mine, others = (publishers, subscriptions) if we_publish else (subscriptions, publishers)
        ours = [endpoint for endpoint in mine if full_name(endpoint) == own]
        for node, theirs in _by_node(others, own):
            pairs = [Pair(a, b) if we_publish else Pair(b, a) for a, b in product(ours, theirs)]
            if pairs and not any(pair.connects for pair in pairs):
                # Of several, the pair that needs least change.
                pair = min(pairs, key=lambda p: p.types_differ)
                found.append(_mismatch(topic, node, own, pair, we_publish=we_publish))
    return found


def _by_node(
    endpoints: Iterable[TopicEndpointInfo], own: str
) -> Iterable[tuple[str, list[TopicEndpointInfo]]]:
    nodes: dict[str, list[TopicEndpointInfo]] = {}
    for endpoint in endpoints:
        if full_name(endpoint) != own:
            nodes.setdefault(full_name(endpoint), []).append(endpoint)
    return sorted(nodes.items())


def _mismatch(topic: str, node: str, own: str, pair: Pair, *, we_publish: bool) -> Mismatch:
    if pair.types_differ:
        ours, theirs = pair.publisher.topic_type, pair.subscription.topic_type
        if not we_publish:
            ours, theirs = theirs, ours
        verbs = ("subscribes to", "publishes") if we_publish else ("publishes", "subscribes to")
        text = f"{node} {verbs[0]} {theirs}, {own} {verbs[1]} {ours}: nothing arrives"
        return Mismatch(topic, node, True, f"{topic}: {text}; {_type_remedy(own, ours, theirs)}")
    offered, requested = pair.publisher.qos_profile, pair.subscription.qos_profile
    text, remedy = _qos_text(offered, requested)
    if not we_publish:
        remedy = _offer_instead(offered, requested)
    verb = "subscribes" if we_publish else "publishes"
    cause = f"{node} {verb} with QoS that does not fit {own} ({text}): nothing arrives"
    return Mismatch(topic, node, False, f"{topic}: {cause}; let {node} {remedy}")


def _type_remedy(own: str, ours: str, theirs: str) -> str:
    if {ours, theirs} == {TWIST, STAMPED}:
        value = str(theirs == STAMPED).lower()
        return f"start {own} with -p enable_stamped_cmd_vel:={value} (launch: stamped:={value})"
    return f"let both use {ours}, or remap one of them (-r TOPIC:=OTHER)"


def _qos_text(offered: QoSProfile, requested: QoSProfile) -> tuple[str, str]:
    """The policies that do not fit, and what the subscription should request instead."""
    faults = _qos_faults(offered, requested)
    texts = [text for text, _, _ in faults] or [qos_check_compatible(offered, requested)[1]]
    return ", ".join(texts), "request " + _all(ask for _, ask, _ in faults)


def _offer_instead(offered: QoSProfile, requested: QoSProfile) -> str:
    return "offer " + _all(offer for _, _, offer in _qos_faults(offered, requested))


def _all(words: Iterable[str]) -> str:
    return " and ".join(words) or "the QoS of the other side"


def _qos_faults(offered: QoSProfile, requested: QoSProfile) -> list[tuple[str, str, str]]:
    """Each policy that does not fit: what it is, what to request and what to offer instead."""
    faults = []
    if (offered.reliability, requested.reliability) == (
        ReliabilityPolicy.BEST_EFFORT,
        ReliabilityPolicy.RELIABLE,
    ):
        faults.append(("best_effort for reliable", "best_effort", "reliable"))
    if (offered.durability, requested.durability) == (
        DurabilityPolicy.VOLATILE,
        DurabilityPolicy.TRANSIENT_LOCAL,
    ):
        faults.append(("volatile for transient_local", "volatile", "transient_local"))
    if offered.deadline > requested.deadline:
        seconds = requested.deadline.nanoseconds * 1e-9
        faults.append((f"no deadline of {seconds:g} s", "no deadline", "that deadline"))
    if (offered.liveliness, requested.liveliness) == (
        LivelinessPolicy.AUTOMATIC,
        LivelinessPolicy.MANUAL_BY_TOPIC,
    ):
        faults.append(("automatic liveliness for manual", "automatic liveliness", "manual"))
    if offered.liveliness_lease_duration > requested.liveliness_lease_duration:
        seconds = requested.liveliness_lease_duration.nanoseconds * 1e-9
        faults.append((f"no lease of {seconds:g} s", "no lease duration", "that lease duration"))
    return faults


def connections_status(found: Sequence[Mismatch]) -> Status:
    """The status "connections" of /diagnostics: ERROR for types, WARN for QoS."""
    values = {"mismatches": str(len(found))}
    values |= {f"{fault.topic} {fault.node}": fault.text for fault in found}
    if not found:
        return Status("connections", Level.OK, "types and QoS of all topics fit", values)
    ordered = sorted(found, key=lambda fault: not fault.of_type)
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    level = Level.ERROR if ordered[0].of_type else Level.WARN
    return Status("connections", level, ordered[0].text + more, values)
