# SPDX-License-Identifier: Apache-2.0
"""QoS profiles to the recorded form and back."""

import pytest
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from ros_graph import Graph
from std_msgs.msg import String

from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.qos_conversion import DEPTH, offered, profile


def facts(qos: QoSProfile) -> tuple[object, ...]:
    return (qos.history, qos.depth, qos.reliability, qos.durability, qos.deadline, qos.lifespan)


@pytest.mark.parametrize("topic", topics.GRAPH, ids=lambda topic: topic.name)
def test_our_profiles_survive_the_round_trip(topic: topics.Topic) -> None:
    assert facts(profile(offered(topic.qos))) == facts(topic.qos)


def test_all_that_rosbag2_can_record_can_be_offered() -> None:
    recorded = OfferedQos(
        history="keep_all",
        depth=7,
        reliability="best_effort",
        durability="transient_local",
        deadline_ns=5,
        lifespan_ns=6,
        liveliness_lease_duration_ns=2**63 - 1,
    )
    qos = profile(recorded)
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_ALL, 7)
    assert qos.reliability is ReliabilityPolicy.BEST_EFFORT
    assert qos.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert (qos.deadline, qos.lifespan) == (Duration(nanoseconds=5), Duration(nanoseconds=6))
    assert qos.liveliness_lease_duration == Duration(nanoseconds=0), "infinite is rclpy's 0"


def test_a_history_rosbag2_does_not_know_loses_nothing(graph: Graph) -> None:
    """It records history unknown and depth 0 for every Fast DDS publisher."""
    qos = profile(OfferedQos(history="unknown", depth=0))
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_LAST, DEPTH)
    graph.probe.create_publisher(String, "chatter", qos)
    (info,) = graph.probe.get_publishers_info_by_topic("/chatter")
    assert info.qos_profile.reliability is ReliabilityPolicy.RELIABLE
