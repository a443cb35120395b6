# SPDX-License-Identifier: Apache-2.0
"""Stamps read from serialized messages equal those of the messages."""

import struct

import pytest
from geometry_msgs.msg import Twist
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Path
from rclpy.serialization import serialize_message

from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.serialized_message import has_header, header_stamp_ns


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
def test_the_stamp_is_the_one_that_was_written(sec: int, nanosec: int) -> None:
    message = Path()
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    message.header.frame_id = "odom"
    assert header_stamp_ns(serialize_message(message)) == stamp_ns(message.header.stamp)


def test_either_byte_order() -> None:
    assert header_stamp_ns(b"\x00\x00\x00\x00" + struct.pack(">iI", 3, 4)) == 3_000_000_004


@pytest.mark.parametrize("topic", topics.GRAPH, ids=lambda topic: topic.name)
def test_messages_with_a_header_are_known(topic: topics.Topic) -> None:
    assert has_header(topic.type) == hasattr(topic.type(), "header")


def test_a_twist_has_none() -> None:
    assert not has_header(Twist)
