# SPDX-License-Identifier: Apache-2.0
"""Convert core values to messages and back without loss; invalid messages are refused."""

import math
import struct
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseArray,
    PoseStamped,
    Quaternion,
    Twist,
    TwistStamped,
    Vector3,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Pose2D, rotated, wrap_angle
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.perception.scan_beams import BeamReader
from mfba_planner.perception.scan_coverage import usable_beams
from mfba_planner.perception.sensory_vector import SensorParams, sensory_vector
from mfba_planner.recording import from_messages
from mfba_planner.ros.interface import to_messages

finite = st.floats(allow_nan=False, allow_infinity=False)
moderate = st.floats(-1e6, 1e6)
plane_points = st.tuples(finite, finite)
coordinates = st.floats(-from_messages.FARTHEST_M, from_messages.FARTHEST_M)
angles = st.floats(-math.pi, math.pi)
stamps = st.integers(0, (2**31 - 1) * from_messages.SECOND_NS)
# A string in a message ends at the first NUL.
reasons = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=30)
ranges = st.lists(
    st.one_of(st.just(math.inf), st.floats(0.0, 2.0**100, width=32)), min_size=3, max_size=20
).map(tuple)
NOT_FINITE = (math.nan, math.inf, -math.inf)
NORTH = math.pi / 2


@st.composite
def decisions(draw: st.DrawFn) -> Decision:
    sector_ranges = draw(ranges)
    bits = sensory_vector(sector_ranges)
    return Decision(
        stamp_ns=draw(stamps),
        mode=draw(st.sampled_from(Mode)),
        reason=draw(reasons),
        pose=Pose2D(draw(finite), draw(finite), draw(angles)),
        goal=draw(st.none() | plane_points),
        ranges_m=sector_ranges,
        vs=bits,
        vg=tuple(1 - bit for bit in bits),
        gap=draw(st.integers(0, len(bits))),
        waypoint=draw(plane_points),
        velocity=draw(plane_points),
        candidates=draw(st.lists(plane_points, max_size=8).map(tuple)),
    )


def sent(message: Any) -> Any:
    """The message after serialization and deserialization."""
    return deserialize_message(serialize_message(message), type(message))


def bits(*numbers: float) -> bytes:
    """The bytes of numbers, to compare every bit, including the sign of zero."""
    return struct.pack(f"{len(numbers)}d", *numbers)


@given(stamps)
def test_stamps_round_trip(stamp_ns: int) -> None:
    assert from_messages.stamp_ns(sent(to_messages.time_msg(stamp_ns))) == stamp_ns
    assert from_messages.stamp_ns(sent(to_messages.clock_msg(stamp_ns)).clock) == stamp_ns


@given(coordinates, coordinates, angles, plane_points, stamps)
def test_odometry_round_trip(
    x: float, y: float, yaw: float, velocity: tuple[float, float], stamp_ns: int
) -> None:
    message = sent(
        to_messages.odometry_msg(Pose2D(x, y, yaw), velocity, stamp_ns, "odom", "base_link")
    )
    pose = from_messages.robot_pose(message)
    assert bits(*pose.position) == bits(x, y)
    assert abs(wrap_angle(pose.yaw - yaw)) < 1e-12
    assert from_messages.stamp_ns(message.header.stamp) == stamp_ns
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")


@given(plane_points)
def test_odometry_at_zero_yaw_is_exact(velocity: tuple[float, float]) -> None:
    message = sent(to_messages.odometry_msg(Pose2D(0.0, 0.0), velocity, 1, "odom", "base_link"))
    assert from_messages.robot_pose(message).yaw == 0.0
    linear = message.twist.twist.linear
    assert bits(linear.x, linear.y) == bits(*velocity)


def test_odometry_gives_the_velocity_in_the_body_frame() -> None:
    """REP-105: a robot that faces north and moves east moves to its right, which is -y."""
    message = to_messages.odometry_msg(Pose2D(0.0, 0.0, NORTH), (1.0, 0.0), 1, "odom", "base_link")
    linear = message.twist.twist.linear
    assert (linear.x, linear.y) == pytest.approx((0.0, -1.0))


@given(st.lists(plane_points, max_size=12), stamps)
def test_obstacles_round_trip_in_sequence(
    centers: list[tuple[float, float]], stamp_ns: int
) -> None:
    message = sent(to_messages.obstacles_msg(centers, stamp_ns, "odom"))
    assert from_messages.obstacle_centers(message) == centers
    assert from_messages.stamp_ns(message.header.stamp) == stamp_ns


@given(st.tuples(coordinates, coordinates), stamps)
def test_goal_round_trip(goal: tuple[float, float], stamp_ns: int) -> None:
    message = sent(to_messages.pose_stamped_msg(goal, stamp_ns, "odom"))
    assert bits(*from_messages.goal_point(message)) == bits(*goal)


@given(ranges, st.floats(0.01, 1000.0))
def test_sectors_round_trip(sector_ranges: tuple[float, ...], sensing_range_m: float) -> None:
    params = SensorParams(sectors=len(sector_ranges), sensing_range_m=sensing_range_m)
    message = sent(to_messages.sectors_msg(sector_ranges, params, 0.3, 1, "odom"))
    assert from_messages.sector_ranges(message) == sector_ranges
    assert tuple(message.intensities) == sensory_vector(sector_ranges)
    # As LaserScan requires: every finite range within the limits, and a full circle.
    finite_ranges = [r for r in message.ranges if math.isfinite(r)]
    assert all(message.range_min <= r <= message.range_max for r in finite_ranges)
    assert message.angle_increment * len(sector_ranges) == pytest.approx(2.0 * math.pi)
    last = message.angle_min + (len(sector_ranges) - 1) * message.angle_increment
    assert message.angle_max == pytest.approx(last, abs=1e-5)


def test_the_first_beam_is_in_the_middle_of_sector_1() -> None:
    message = to_messages.sectors_msg((math.inf,) * 12, SensorParams(), 0.3, 1, "odom")
    assert math.degrees(message.angle_min) == pytest.approx(15.0)
    assert math.degrees(message.angle_increment) == pytest.approx(30.0)


@given(st.lists(st.integers(0, 1), min_size=3).map(tuple))
def test_the_sensory_vector_has_a_labelled_layout(vs: tuple[int, ...]) -> None:
    message = sent(to_messages.sensory_vector_msg(vs))
    assert tuple(message.data) == vs
    (dimension,) = message.layout.dim
    assert (dimension.label, dimension.size, dimension.stride) == ("sector", len(vs), len(vs))


@settings(max_examples=50)
@given(decisions())
def test_decision_round_trip(decision: Decision) -> None:
    message = sent(to_messages.decision_msg(decision, "mfba", 3, "/planner"))
    assert from_messages.decision(message, decision.ranges_m) == decision


def test_the_level_of_a_decision_depends_on_its_mode() -> None:
    def level(mode: Mode) -> bytes:
        message = to_messages.decision_msg(a_decision(mode=mode), "ba", 7, "/robot1/planner")
        status = message.status[0]
        found = {item.key: item.value for item in status.values}
        assert (found["algorithm"], found["refused_inputs"]) == ("ba", "7")
        assert status.name == "/robot1/planner"
        return bytes(status.level)

    levels = {mode: level(mode) for mode in Mode}
    assert levels.pop(Mode.STOPPED) == b"\x02"
    assert levels.pop(Mode.BLOCKED) == b"\x01"
    assert set(levels.values()) == {b"\x00"}


def a_decision(**changes: Any) -> Decision:
    values: dict[str, Any] = {
        "stamp_ns": 1,
        "mode": Mode.PATH_GENERATION,
        "reason": "no obstacle within SR",
        "pose": Pose2D(1.0, 2.0),
        "goal": (9.0, 9.0),
        "ranges_m": (math.inf,) * 12,
        "vs": (0,) * 12,
        "vg": (0,) * 12,
        "gap": 0,
        "waypoint": (1.2, 2.2),
        "velocity": (0.5, 0.6),
    }
    return Decision(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, [(1.0, 2.0), (1.2, 2.2), (9.0, 9.0)]),
        ({"waypoint": (1.0, 2.0)}, [(1.0, 2.0), (9.0, 9.0)]),
        ({"goal": (1.2, 2.2)}, [(1.0, 2.0), (1.2, 2.2)]),
        ({"goal": None, "waypoint": (1.0, 2.0)}, [(1.0, 2.0)]),
    ],
)
def test_the_plan_is_pose_waypoint_and_goal(
    changes: dict[str, Any], expected: list[tuple[float, float]]
) -> None:
    plan = sent(to_messages.plan_msg(a_decision(**changes), "odom"))
    assert [(p.pose.position.x, p.pose.position.y) for p in plan.poses] == expected
    assert all(p.header == plan.header for p in plan.poses)


@given(st.tuples(moderate, moderate), angles)
def test_the_twist_is_the_decision_in_the_body_frame(
    velocity: tuple[float, float], yaw: float
) -> None:
    decision = a_decision(velocity=velocity, pose=Pose2D(0.0, 0.0, yaw))
    for message in (
        to_messages.twist_msg(decision),
        to_messages.twist_stamped_msg(decision, "base_link"),
    ):
        vx, vy, wz = from_messages.velocity(sent(message))
        assert wz == 0.0
        back = rotated((vx, vy), yaw)
        # subnormal floats lose digits
        assert math.dist(back, velocity) <= 1e-12 * math.hypot(*velocity) + 1e-300
        if yaw == 0.0:
            assert bits(vx, vy) == bits(*velocity)


def test_the_stamped_twist_names_frame_and_stamp() -> None:
    header = to_messages.twist_stamped_msg(a_decision(stamp_ns=5), "base_link").header
    assert (from_messages.stamp_ns(header.stamp), header.frame_id) == (5, "base_link")


@given(st.lists(finite, min_size=4, max_size=4))
def test_any_quaternion_gives_a_yaw_or_is_refused(q: list[float]) -> None:
    pose = Pose(orientation=Quaternion(**dict(zip("xyzw", q))))
    sound = 1e-6 < sum(value * value for value in q) < 1e6
    with nullcontext() if sound else pytest.raises(InputError, match="send a unit quaternion"):
        assert math.isfinite(from_messages.pose2d(pose, "odom").yaw)


@given(angles, st.floats(0.01, 100.0))
def test_a_quaternion_need_not_be_of_unit_length(yaw: float, scale: float) -> None:
    half = 0.5 * yaw
    q = Quaternion(x=0.0, y=0.0, z=scale * math.sin(half), w=scale * math.cos(half))
    pose = from_messages.pose2d(Pose(orientation=q), "odom")
    assert abs(wrap_angle(pose.yaw - yaw)) < 1e-9


def test_a_default_message_is_a_valid_pose() -> None:
    """The default quaternion of ROS 2 has w = 1; one of zeros is refused."""
    assert from_messages.robot_pose(Odometry()) == Pose2D(0.0, 0.0, 0.0)
    with pytest.raises(InputError, match="odom orientation has norm 0; send a unit quaternion"):
        from_messages.robot_pose(odometry_with(qw=0.0))


def odometry_with(**numbers: float) -> Odometry:
    message = Odometry()
    for name, value in numbers.items():
        target = (
            message.pose.pose.orientation if name.startswith("q") else message.pose.pose.position
        )
        setattr(target, name[-1], value)
    return message


def pose_at(**numbers: float) -> Pose:
    return Pose(position=Point(**{"x": 0.0, "y": 0.0, **numbers}))


@pytest.mark.parametrize("bad", NOT_FINITE)
@pytest.mark.parametrize(
    ("read", "make"),
    [
        (from_messages.robot_pose, lambda v: odometry_with(x=v)),
        (from_messages.robot_pose, lambda v: odometry_with(y=v)),
        (from_messages.robot_pose, lambda v: odometry_with(qx=v)),
        (from_messages.robot_pose, lambda v: odometry_with(qy=v)),
        (from_messages.robot_pose, lambda v: odometry_with(qz=v)),
        (from_messages.robot_pose, lambda v: odometry_with(qw=v)),
        (from_messages.goal_point, lambda v: PoseStamped(pose=pose_at(x=v))),
        (from_messages.goal_point, lambda v: PoseStamped(pose=pose_at(y=v))),
        (from_messages.obstacle_centers, lambda v: PoseArray(poses=[pose_at(), pose_at(x=v)])),
        (from_messages.obstacle_centers, lambda v: PoseArray(poses=[pose_at(y=v)])),
        (from_messages.velocity, lambda v: Twist(linear=Vector3(x=v))),
        (from_messages.velocity, lambda v: Twist(linear=Vector3(y=v))),
        (from_messages.velocity, lambda v: Twist(angular=Vector3(z=v))),
        (from_messages.velocity, lambda v: TwistStamped(twist=Twist(linear=Vector3(x=v)))),
    ],
)
def test_non_finite_values_are_refused_and_named(
    read: Callable[[Any], Any], make: Callable[[float], Any], bad: float
) -> None:
    with pytest.raises(InputError, match=rf"holds {bad}; send finite numbers$"):
        read(sent(make(bad)))


@pytest.mark.parametrize("far", [1.1e7, -3e38, 1e308])
def test_a_position_that_no_map_has_is_refused(far: float) -> None:
    """Cells of a map are counted in integers: 3e38 m raised an OverflowError in the planner."""
    for read, message in (
        (from_messages.robot_pose, odometry_with(x=far)),
        (from_messages.robot_pose, odometry_with(y=far)),
        (from_messages.goal_point, PoseStamped(pose=pose_at(y=far))),
    ):
        with pytest.raises(InputError, match=r" is farther than 1e\+07 m from the origin; check "):
            read(sent(message))


@pytest.mark.parametrize("bad", [math.nan, -math.inf, -0.1])
@pytest.mark.parametrize("sector", [1, 7, 12])
def test_sectors_of_a_blind_sensor_are_refused(bad: float, sector: int) -> None:
    sector_ranges = [math.inf] * 12
    sector_ranges[sector - 1] = bad
    with pytest.raises(InputError, match=rf"^sector {sector} holds .*the sensor was blind$"):
        from_messages.sector_ranges(sent(LaserScan(ranges=sector_ranges)))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_sectors_are_refused(count: int) -> None:
    with pytest.raises(InputError, match=rf"^sectors hold {count} ranges; .* at least 3$"):
        from_messages.sector_ranges(LaserScan(ranges=[1.0] * count))


@pytest.mark.parametrize("key", ["mode", "vs", "gap", "pose", "waypoint", "candidates"])
@pytest.mark.parametrize("value", [None, "garbage"])
def test_a_malformed_decision_is_refused(key: str, value: str | None) -> None:
    message = to_messages.decision_msg(a_decision(), "mfba", 0, "/planner")
    status = message.status[0]
    kept = [item for item in status.values if item.key != key or value is not None]
    for item in kept:
        if item.key == key:
            item.value = value
    status.values = kept
    text = r"^planner/decision: missing or malformed .*|not a list of"
    with pytest.raises(InputError, match=text):
        from_messages.decision(message, (math.inf,) * 12)


def test_an_empty_diagnostic_is_no_decision() -> None:
    message = to_messages.decision_msg(a_decision(), "mfba", 0, "/planner")
    message.status = []
    with pytest.raises(InputError, match="missing or malformed"):
        from_messages.decision(message, ())


@given(st.lists(plane_points))
def test_points_as_text_round_trip(some: list[tuple[float, float]]) -> None:
    assert from_messages.parse_points(from_messages.points_text(some)) == tuple(some)


@pytest.mark.parametrize("text", ["1", "1,2,3", "a,b", "1,2 3"])
def test_text_without_points_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="not a list of points"):
        from_messages.parse_points(text)


@given(st.tuples(moderate, moderate), angles)
def test_rotation_and_its_inverse(vector: tuple[float, float], angle: float) -> None:
    turned = rotated(vector, angle)
    assert math.hypot(*turned) == pytest.approx(math.hypot(*vector))
    assert rotated(turned, -angle) == pytest.approx(vector, abs=1e-6)


def a_scan(count: int = 360, **changes: Any) -> LaserScan:
    """A scan of the whole circle, its last limit one increment before the first."""
    width = 2.0 * math.pi / max(count, 1)
    values = {
        "angle_min": -math.pi,
        "angle_max": math.pi - width,
        "angle_increment": width,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": [1.0 + 0.01 * k for k in range(count)],
    }
    return LaserScan(**{**values, **changes})


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"angle_max": math.pi},  # one increment too far, as some drivers send it
        {"angle_min": 0.0, "angle_max": 0.0},  # not set
        {"range_min": 0.0},
        {"range_max": math.inf},
    ],
)
def test_a_scan_of_a_usual_driver_is_accepted(changes: dict[str, Any]) -> None:
    message = a_scan(**changes)
    scan = from_messages.laser_scan(message)
    assert (scan.angle_min_rad, scan.angle_increment_rad) == (
        message.angle_min,
        message.angle_increment,
    )
    assert scan.ranges_m.tolist() == list(message.ranges)


def test_a_range_finder_of_one_beam_is_accepted() -> None:
    for limits in ((0.3, 0.3, 0.0), (0.3, 0.3, 0.1), (0.0, 0.0, 0.0), (0.0, 0.1, 0.1)):
        values = dict(zip(("angle_min", "angle_max", "angle_increment"), limits))
        assert from_messages.laser_scan(a_scan(1, **values)).ranges_m.tolist() == [1.0]


@pytest.mark.parametrize("range_max", [math.inf, 3e38, 1e8])
def test_a_return_from_farther_than_any_place_tells_nothing(range_max: float) -> None:
    """Cells of a map are counted in integers, which such a distance overflowed."""
    message = a_scan(4, range_max=range_max)
    message.ranges = [3e38, 2e7, 9e6, math.inf]
    scan = from_messages.laser_scan(message)
    assert usable_beams(scan).tolist() == [False, False, True, True]


@pytest.mark.parametrize("count", [1, 4, 50])
def test_a_small_scan_may_be_one_beam_off_and_not_two(count: int) -> None:
    """Ranges of one beam, of which the angles make three, told the robot what is ahead."""
    for off, accepted in ((-1, True), (1, True), (-2, False), (2, False)):
        message = a_scan(
            count, angle_min=-0.5, angle_increment=0.1, angle_max=-0.5 + 0.1 * (count - 1 + off)
        )
        if accepted:
            assert from_messages.laser_scan(message).ranges_m.size == count
        else:
            with pytest.raises(InputError, match=rf"^scan holds {count} ranges, but "):
                from_messages.laser_scan(message)


@pytest.mark.parametrize("count", [1, 2, 90])
def test_beams_in_clockwise_sequence_keep_their_directions(count: int) -> None:
    increment = -math.pi / 180.0
    message = a_scan(
        count, angle_min=0.5, angle_increment=increment, angle_max=0.5 + increment * (count - 1)
    )
    scan = from_messages.laser_scan(message)
    assert scan.angle_increment_rad > 0.0
    directions = scan.angle_min_rad + scan.angle_increment_rad * np.arange(count)
    given_directions = message.angle_min + message.angle_increment * np.arange(count)
    assert directions[::-1] == pytest.approx(given_directions, abs=1e-6)
    assert scan.ranges_m[::-1].tolist() == list(message.ranges)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"ranges": []}, r"^scan holds 0 ranges; check the lidar driver$"),
        ({"angle_increment": 0.0}, r"^scan of 360 beams has angle_increment=0: all in one dir"),
        (
            {"angle_increment": math.inf},
            r"^scan angle_min, angle_max or angle_increment holds inf; send finite numbers$",
        ),
        ({"angle_max": 0.0}, r"^scan holds 360 ranges, but angle_min=-3.14159, angle_max=0 and "),
        ({"ranges": [1.0] * 300}, r"angle_increment=0.0174533 make 360; check the lidar driver$"),
        ({"ranges": [1.0]}, r"^scan holds 1 ranges, but .* make 360; check the lidar driver$"),
        ({"range_min": 11.0}, r"^scan has range_min=11, range_max=10: not 0 <= range_min < rang"),
        ({"range_min": -0.1}, r"^scan has range_min=-0.1, range_max=10: "),
        ({"range_max": math.nan}, r"^scan has range_min=0.1, range_max=nan: "),
        ({"range_max": 0.0}, r"^scan has range_min=0.1, range_max=0: "),
    ],
)
def test_a_scan_that_contradicts_itself_is_refused_in_one_line(
    changes: dict[str, Any], line: str
) -> None:
    with pytest.raises(InputError, match=line):
        from_messages.laser_scan(a_scan(**changes))


def test_a_clockwise_beam_keeps_its_time() -> None:
    """Of 8 beams clockwise from ahead the third, on the right, is measured third."""
    message = a_scan(
        8, angle_min=0.0, angle_increment=-0.25 * math.pi, angle_max=-1.75 * math.pi,
        time_increment=0.01,
    )  # fmt: skip
    message.ranges = [5.0, 5.0, 1.0, 5.0, 5.0, 5.0, 5.0, 5.0]
    beams = BeamReader().read(Pose2D(0.0, 0.0), (0.0, 0.0, 0.0), from_messages.laser_scan(message))
    nearest = int(beams.range_m.argmin())
    assert (beams.cos[nearest], beams.sin[nearest]) == pytest.approx((0.0, -1.0), abs=1e-6)
    assert beams.time_s[nearest] == pytest.approx(0.02)


def test_a_scan_s_time_between_beams_is_kept() -> None:
    message = a_scan(time_increment=1e-4)
    assert from_messages.laser_scan(message).time_increment_s == pytest.approx(1e-4)


@pytest.mark.parametrize("increment", [-1e-4, math.nan, math.inf, 1.0])
def test_a_time_increment_that_is_none_is_refused(increment: float) -> None:
    message = a_scan(time_increment=increment)
    with pytest.raises(InputError, match=r"time_increment=.*check the lidar driver"):
        from_messages.laser_scan(message)
