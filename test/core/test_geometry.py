# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mfba_planner.core.geometry import (
    Point,
    Pose2D,
    bearing,
    closest_approach,
    distance,
    ray_circle_distance,
    tangent_half_angle,
    towards,
    wrap_angle,
)

ANGLES = st.floats(-50.0, 50.0)
COORDINATES = st.floats(-20.0, 20.0)
POINTS = st.tuples(COORDINATES, COORDINATES)


def test_the_yaw_of_a_pose_defaults_to_0() -> None:
    assert Pose2D(1.0, 2.0) == (1.0, 2.0, 0.0)
    assert Pose2D(1.0, 2.0, 3.0).position == (1.0, 2.0)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3.0 * math.pi, math.pi),
        (-0.5 * math.pi, -0.5 * math.pi),
        (1.5 * math.pi, -0.5 * math.pi),
        (2.0 * math.pi, 0.0),
        (-7.0, -7.0 + 2.0 * math.pi),
    ],
)
def test_wrap_angle(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-12)


@given(ANGLES)
def test_wrapped_angle_is_the_same_direction_in_one_turn(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-12)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-12)


def test_distance_of_eq_1() -> None:
    assert distance((1.0, 2.0), (4.0, 6.0)) == 5.0
    assert distance((4.0, 6.0), (1.0, 2.0)) == 5.0
    assert distance((-2.0, 7.0), (-2.0, 7.0)) == 0.0


@pytest.mark.parametrize(
    ("target", "degrees"),
    [((3.0, 2.0), 0.0), ((2.0, 3.0), 45.0), ((1.0, 5.0), 90.0), ((1.0, 0.0), -90.0)],
)
def test_bearing_is_counter_clockwise_from_x(target: Point, degrees: float) -> None:
    assert math.degrees(bearing((1.0, 2.0), target)) == pytest.approx(degrees)


def test_bearing_of_the_same_point_is_0() -> None:
    assert bearing((1.0, 2.0), (1.0, 2.0)) == 0.0


@given(POINTS, ANGLES, st.floats(0.01, 100.0))
def test_towards_is_the_inverse_of_distance_and_bearing(
    a: Point, heading: float, length: float
) -> None:
    b = towards(a, heading, length)
    assert distance(a, b) == pytest.approx(length, rel=1e-9)
    assert wrap_angle(bearing(a, b) - heading) == pytest.approx(0.0, abs=1e-9)


def test_towards_by_hand() -> None:
    assert towards((1.0, 2.0), math.radians(30.0), 2.0) == pytest.approx((1.0 + 3.0**0.5, 3.0))


@pytest.mark.parametrize(
    ("d", "radius", "degrees"),
    [(2.0, 1.0, 30.0), (math.sqrt(2.0), 1.0, 45.0), (5.0, 0.0, 0.0), (1.0, 1.0, 90.0)],
)
def test_tangents_of_a_circle(d: float, radius: float, degrees: float) -> None:
    assert math.degrees(tangent_half_angle(d, radius)) == pytest.approx(degrees)


def test_inside_a_circle_the_tangent_half_angle_is_90_degrees() -> None:
    assert tangent_half_angle(0.5, 1.0) == math.pi / 2.0
    assert tangent_half_angle(0.0, 0.0) == math.pi / 2.0


def test_ray_to_a_circle_by_hand() -> None:
    assert ray_circle_distance(3.0, 1.0, 0.0) == 2.0
    almost_tangent = 0.99999 * math.radians(30.0)
    assert ray_circle_distance(2.0, 1.0, almost_tangent) == pytest.approx(3.0**0.5, abs=0.01)
    # 45 degrees off a circle of radius 5 at distance 5 sqrt(2) - 1: a chord's near end
    d = 5.0 * math.sqrt(2.0) - 1.0
    along, across = d / math.sqrt(2.0), d / math.sqrt(2.0)
    expected = along - math.sqrt(25.0 - across * across)
    assert ray_circle_distance(d, 5.0, math.radians(-45.0)) == pytest.approx(expected)


def test_a_ray_that_misses_has_distance_inf() -> None:
    assert ray_circle_distance(2.0, 1.0, math.radians(30.1)) == math.inf
    assert ray_circle_distance(2.0, 1.0, math.radians(90.0)) == math.inf
    assert ray_circle_distance(2.0, 1.0, math.radians(180.0)) == math.inf, "the circle is behind"
    assert ray_circle_distance(0.6, 0.5, math.radians(180.0)) == math.inf


def test_a_tangent_touches() -> None:
    radius = 2.0 * math.sin(0.5)  # the same float as the lateral distance of the ray
    assert ray_circle_distance(2.0, radius, 0.5) == 2.0 * math.cos(0.5)


def test_on_or_inside_a_circle_every_ray_hits_at_once() -> None:
    assert ray_circle_distance(1.0, 1.0, 3.0) == 0.0
    assert ray_circle_distance(0.3, 1.0, 3.0) == 0.0


@given(st.floats(0.1, 20.0), st.floats(0.01, 1.0), st.floats(-1.0, 1.0))
def test_a_ray_hits_the_near_side_of_the_circle(
    d: float, share: float, offset_share: float
) -> None:
    radius = 0.99 * share * d
    offset = 0.999 * offset_share * tangent_half_angle(d, radius)
    r = ray_circle_distance(d, radius, offset)
    hit = towards((0.0, 0.0), offset, r)
    assert distance(hit, (d, 0.0)) == pytest.approx(radius, rel=1e-6, abs=1e-6)
    assert d - radius - 1e-9 <= r <= math.sqrt(d * d - radius * radius) + 1e-9


@pytest.mark.parametrize(
    ("a0", "a1", "b0", "b1", "smallest"),
    [
        ((0, 0), (2, 0), (2, 0), (0, 0), 0.0),  # head on
        ((0, 0), (4, 0), (2, 1), (2, 1), 1.0),  # past a post
        ((0, 0), (4, 0), (2, -3), (2, -3), 3.0),
        ((0, 0), (1, 0), (4, 4), (4, 4), 5.0),  # still approaching at the end
        ((1, 0), (0, 0), (4, 4), (4, 4), 5.0),  # leaving from the start
        ((0, 0), (3, 1), (0, 2), (3, 3), 2.0),  # side by side
        ((0, 0), (0, 0), (3, 4), (3, 4), 5.0),  # both at rest
        ((0, 0), (2, 0), (0, 1), (0, 1), 1.0),  # closest at the very start
        ((-2, 0), (2, 0), (0, -2), (0, 2), 0.0),  # crossing at the same moment
        ((-2, 0), (2, 0), (0, -1), (0, 3), math.sqrt(0.5)),  # crossing one after the other
    ],
)
def test_closest_approach(a0: Point, a1: Point, b0: Point, b1: Point, smallest: float) -> None:
    assert closest_approach(a0, a1, b0, b1) == pytest.approx(smallest)
    assert closest_approach(b0, b1, a0, a1) == pytest.approx(smallest)


@given(POINTS, POINTS, POINTS, POINTS)
def test_closest_approach_is_below_every_sample_and_reached_by_one(
    a0: Point, a1: Point, b0: Point, b1: Point
) -> None:
    def at(p: Point, q: Point, s: float) -> Point:
        return (p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]))

    samples = [distance(at(a0, a1, k / 400), at(b0, b1, k / 400)) for k in range(401)]
    smallest = closest_approach(a0, a1, b0, b1)
    assume(max(samples) < 1e3)
    assert smallest <= min(samples) + 1e-9
    path_length = distance(a0, a1) + distance(b0, b1)
    assert smallest >= min(samples) - path_length / 400 - 1e-9
