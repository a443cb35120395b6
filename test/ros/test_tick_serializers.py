# SPDX-License-Identifier: Apache-2.0
"""Messages that are serialized from a template equal those of to_messages, to the last bit."""

import math
from typing import Any

import pytest
from geometry_msgs.msg import PoseArray, PoseStamped, Twist
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry, Path
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import UInt8MultiArray

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.core.robot_base import Drive
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.from_messages import SECOND_NS
from mfba_planner.ros.interface import to_messages
from mfba_planner.ros.interface.message_template import MessageTemplate
from mfba_planner.ros.interface.tick_serializers import (
    ClockSerializer,
    CommandSerializer,
    GoalStepSerializer,
    ObstaclesSerializer,
    OdometrySerializer,
    PlanSerializer,
    SectorsSerializer,
    SensoryVectorSerializer,
)

STAMPS = st.integers(0, (2**31 - 1) * SECOND_NS)
NUMBERS = st.floats(-1e7, 1e7)
POINTS = st.tuples(NUMBERS, NUMBERS)
POSES = st.builds(Pose2D, NUMBERS, NUMBERS, st.floats(-math.pi, math.pi) | st.just(0.0))
RANGES = st.lists(
    st.floats(0.0, 1e6, width=32) | st.just(math.inf) | st.just(math.nan), min_size=3, max_size=40
)
# Frames of every length modulo 8: what follows a string is aligned.
FRAMES = st.text("abc/_", max_size=9)


def equal(data: bytes, message: Any) -> bool:
    """Whether the bytes are this message; of floats every bit counts, and NaN is NaN."""
    sent = deserialize_message(serialize_message(message), type(message))
    return repr(deserialize_message(data, type(message))) == repr(sent)


def decision(pose: Pose2D, goal: Any, waypoint: Any, velocity: Any, stamp_ns: int) -> Decision:
    return Decision(
        stamp_ns=stamp_ns,
        mode=Mode.PATH_GENERATION,
        pose=pose,
        goal=goal,
        ranges_m=(math.inf,) * 12,
        vs=(0,) * 12,
        vg=(1,) * 12,
        gap=0,
        waypoint=waypoint,
        velocity=velocity,
        candidates=(),
        reason="",
    )


@given(st.lists(STAMPS, min_size=1, max_size=3))
def test_clock(stamps: list[int]) -> None:
    serialize = ClockSerializer()
    for stamp in stamps:
        assert equal(serialize(stamp), to_messages.clock_msg(stamp))


@given(FRAMES, FRAMES, st.lists(st.tuples(POSES, POINTS, STAMPS, NUMBERS), max_size=3))
def test_odometry(frame: str, base: str, readings: list[Any]) -> None:
    serialize = OdometrySerializer(frame, base)
    for pose, velocity, stamp, turn in readings:
        expected = to_messages.odometry_msg(pose, velocity, stamp, frame, base, turn)
        assert equal(serialize(pose, velocity, stamp, turn), expected)


@given(FRAMES, st.lists(st.tuples(st.lists(POINTS, max_size=6), STAMPS), max_size=4))
def test_obstacles_that_come_and_go(frame: str, ticks: list[Any]) -> None:
    serialize = ObstaclesSerializer(frame)
    for centers, stamp in ticks:
        expected = to_messages.obstacles_msg(centers, stamp, frame)
        assert equal(serialize(centers, stamp), expected)


@given(FRAMES, st.lists(st.tuples(RANGES, STAMPS), max_size=3), st.floats(0.01, 1e3))
def test_sectors(frame: str, ticks: list[Any], sensing_range_m: float) -> None:
    serialize = SectorsSerializer(frame)
    for ranges, stamp in ticks:
        params = SensorParams(sectors=len(ranges), sensing_range_m=sensing_range_m)
        expected = to_messages.sectors_msg(tuple(ranges), params, 0.3, stamp, frame)
        assert equal(serialize(tuple(ranges), params, 0.3, stamp), expected)


def test_another_sensing_range_while_the_node_runs() -> None:
    serialize = SectorsSerializer("odom")
    for sensing_range_m in (1.0, 5.0):
        params = SensorParams(sensing_range_m=sensing_range_m)
        expected = to_messages.sectors_msg((math.inf,) * 12, params, 0.3, 7, "odom")
        assert equal(serialize((math.inf,) * 12, params, 0.3, 7), expected)


@given(st.lists(st.lists(st.integers(0, 1), min_size=3, max_size=300).map(tuple), max_size=3))
def test_the_sensory_vector(vectors: list[tuple[int, ...]]) -> None:
    serialize = SensoryVectorSerializer()
    for vs in vectors:
        assert equal(serialize(vs), to_messages.sensory_vector_msg(vs))


@given(
    FRAMES,
    st.lists(st.builds(decision, POSES, st.none() | POINTS, POINTS, POINTS, STAMPS), max_size=4),
    st.sampled_from([PlannerParams(), PlannerParams(drive=Drive.DIFFERENTIAL)]),
)
def test_decisions(frame: str, decisions: list[Decision], params: PlannerParams) -> None:
    goal_step, command, plan = (
        GoalStepSerializer(frame),
        CommandSerializer(),
        PlanSerializer(frame),
    )
    for d in decisions:
        step = to_messages.pose_stamped_msg(d.waypoint, d.stamp_ns, frame)
        assert equal(goal_step(d.waypoint, d.stamp_ns), step)
        tick_ns = params.tick_ns
        twist = to_messages.twist_msg(d, params, tick_ns)
        assert equal(command(d, params, tick_ns), twist)
        assert equal(plan(d), to_messages.plan_msg(d, frame))


@pytest.mark.parametrize(
    "message", [Clock(), LaserScan(), Odometry(), Path(), PoseArray(), PoseStamped(), Twist()]
)
def test_a_template_leaves_the_message_as_it_is(message: Any) -> None:
    before = repr(message)
    field = {Clock: "clock.sec", Twist: "linear.x"}.get(type(message), "header.stamp.sec")
    template = MessageTemplate(message, [field])
    assert repr(message) == before
    assert equal(template.fill([0]), message)


def test_fields_in_any_sequence() -> None:
    template = MessageTemplate(PoseStamped(), ["pose.position.y", "header.stamp.sec"])
    message = deserialize_message(template.fill([2.5, 7]), PoseStamped)
    assert (message.pose.position.y, message.header.stamp.sec) == (2.5, 7)
    assert (message.pose.position.x, message.pose.orientation.w) == (0.0, 1.0)


def test_a_vector_of_no_sectors_has_no_template() -> None:
    with pytest.raises(AssertionError, match="not found once"):
        MessageTemplate(UInt8MultiArray(), ["data"])
