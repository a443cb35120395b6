# SPDX-License-Identifier: Apache-2.0
"""Converts QoS profiles between rclpy's and the recorded form."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from ...recording.bag_qos import OfferedQos

DEPTH = 1000  # for publishers whose recorded history is unknown (rosbag2 records depth 0)
FOREVER_NS = 2**63 - 1


def offered(profile: QoSProfile) -> OfferedQos:
    """A publisher's profile as it is recorded."""
    return OfferedQos(
        history=profile.history.short_key,
        depth=profile.depth,
        reliability=profile.reliability.short_key,
        durability=profile.durability.short_key,
    )


def profile(recorded: OfferedQos) -> QoSProfile:
    """A publisher's profile that offers what was recorded; unknown values give defaults."""
    history = HistoryPolicy.KEEP_ALL if recorded.history == "keep_all" else HistoryPolicy.KEEP_LAST
    best_effort = recorded.reliability == "best_effort"
    latched = recorded.durability == "transient_local"
    return QoSProfile(
        history=history,
        depth=recorded.depth or DEPTH,
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        deadline=_duration(recorded.deadline_ns),
        lifespan=_duration(recorded.lifespan_ns),
        liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_duration(recorded.liveliness_lease_duration_ns),
    )


def _duration(nanoseconds: int) -> Duration:
    """A duration; infinite is 0 for rclpy, which leaves it to the middleware."""
    return Duration(nanoseconds=0 if nanoseconds >= FOREVER_NS else nanoseconds)
