# SPDX-License-Identifier: Apache-2.0
"""Sensory vector and sector ranges: the paper's example, brute force, limits, scans."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Point, towards
from mfba_planner.core.planner_types import Scan
from mfba_planner.perception.scan_to_sectors import sense_scan
from mfba_planner.perception.sensory_vector import (
    SensorParams,
    longest_range_m,
    sense_circles,
    sensory_vector,
    single_precision,
)

Circle = tuple[Point, float]
PAPER = SensorParams()
ORIGIN = (0.0, 0.0)


def polar(degrees: float, d: float, radius: float) -> Circle:
    return towards(ORIGIN, math.radians(degrees), d), radius


def bits(circles: Sequence[Circle], params: SensorParams = PAPER) -> str:
    return "".join(map(str, sensory_vector(sense_circles(ORIGIN, circles, params))))


# --- circles --------------------------------------------------------------------------------


def test_the_example_of_fig_5() -> None:
    obstacles = [
        polar(30.0, 1.0, 0.4),  # Obs1 touches S1 and S2
        polar(120.0, 3.0, 0.6),  # Obs2 is out of range
        polar(210.0, 1.1, 0.45),  # Obs3 touches S7 and S8
        polar(255.0, 1.0, 0.25),  # Obs4 lies within S9
    ]
    assert bits(obstacles) == "110000111000"


def test_nothing_in_range_is_a_free_ring() -> None:
    assert sense_circles(ORIGIN, [], PAPER) == (math.inf,) * 12
    assert bits([polar(77.0, 2.0, 0.6)]) == "0" * 12


@pytest.mark.parametrize(
    ("free", "bit"),
    [(math.inf, 0), (0.0, 1), (0.3, 1), (1e30, 1), (-math.inf, 1), (math.nan, 1)],
)
def test_only_inf_is_free(free: float, bit: int) -> None:
    assert sensory_vector([free, math.inf]) == (bit, 0)


@pytest.mark.parametrize(
    ("degrees", "half", "expected"),
    [
        (15.0, 14.0, "100000000000"),
        (15.0, 16.0, "110000000001"),  # over +x to both sides
        (0.0, 10.0, "100000000001"),
        (359.0, 0.5, "000000000001"),
        (-20.0, 9.0, "000000000001"),
        (180.0, 5.0, "000001100000"),
        (-179.0, 0.5, "000000100000"),
        (179.0, 0.5, "000001000000"),
        (90.0, 40.0, "011110000000"),
        (45.0, 44.9, "111000000000"),
        (300.0, 31.0, "000000001111"),
    ],
)
def test_spans_by_hand(degrees: float, half: float, expected: str) -> None:
    radius = 0.7 * math.sin(math.radians(half))
    assert bits([polar(degrees, 0.7, radius)]) == expected


@pytest.mark.parametrize(
    ("direction", "sector"),
    [((1.0, 0.0), 1), ((1.0, 1.0), 2), ((0.0, 1.0), 3), ((-1.0, 1.0), 4), ((-1.0, 0.0), 5),
     ((-1.0, -0.0), 5), ((-1.0, -1.0), 6), ((0.0, -1.0), 7), ((1.0, -1.0), 8), ((1.0, -0.0), 1)],
)  # fmt: skip
def test_sectors_are_half_open(direction: Point, sector: int) -> None:
    # radius 0 gives a single direction; the bounds of 8 sectors are exact floats
    ring = sense_circles(ORIGIN, [(direction, 0.0)], SensorParams(sectors=8, sensing_range_m=9.0))
    assert [i for i, r in enumerate(ring, start=1) if r < math.inf] == [sector]


def test_a_tangent_on_a_bound_belongs_to_the_sector_that_starts_with_it() -> None:
    # inside a circle the span is half a turn: from -90 to 90 degrees, both included
    ring = sense_circles(ORIGIN, [((0.5, 0.0), 1.0)], SensorParams(sectors=8))
    assert sensory_vector(ring) == (1, 1, 1, 0, 0, 0, 1, 1)
    assert {r for r in ring if r < math.inf} == {0.0}, (
        "inside the circle: range 0 in every set sector"
    )


def test_at_the_very_centre_of_a_circle() -> None:
    ring = sense_circles((2.0, 3.0), [((2.0, 3.0), 1.0)], SensorParams(sectors=8))
    assert sensory_vector(ring) == (1, 1, 1, 0, 0, 0, 1, 1)


@pytest.mark.parametrize("sectors", [3, 4, 5, 7, 12, 36, 361, 3600])
def test_inside_a_circle_half_of_any_ring_is_set(sectors: int) -> None:
    ring = sense_circles(ORIGIN, [polar(40.3, 0.2, 0.6)], SensorParams(sectors=sectors))
    assert len(ring) == sectors
    assert sectors / 2 <= sum(sensory_vector(ring)) <= sectors / 2 + 2


def test_sensing_range_is_measured_to_the_enlarged_edge_and_includes_it() -> None:
    params = SensorParams(sensing_range_m=0.75)
    for d, visible in ((1.25, True), (math.nextafter(1.25, 2.0), False), (1.3, False)):
        ring = sense_circles(ORIGIN, [((d, 0.0), 0.5)], params)
        assert any(sensory_vector(ring)) is visible


def test_ranges_by_hand() -> None:
    # in the middle of S2, tangents at 45 -+ asin(0.5 / 1)
    ring = sense_circles(ORIGIN, [polar(45.0, 1.0, 0.5)], PAPER)
    aside = math.cos(math.radians(15.0)) - math.sqrt(0.25 - math.sin(math.radians(15.0)) ** 2)
    assert ring[:3] == pytest.approx((aside, 0.5, aside), abs=1e-6)
    assert set(ring[3:]) == {math.inf}


def test_the_nearest_of_several_obstacles_counts_in_any_sequence() -> None:
    near, far, aside = polar(45.0, 1.0, 0.4), polar(45.0, 1.2, 0.6), polar(200.0, 1.0, 0.4)
    ring = sense_circles(ORIGIN, [near, far, aside], PAPER)
    assert ring == sense_circles(ORIGIN, [aside, far, near], PAPER)
    assert ring[1] == pytest.approx(0.6, abs=1e-6)
    each = sense_circles(ORIGIN, [far], PAPER)
    assert ring[0] == each[0] < math.inf, "the smaller one does not reach S1"
    assert ring[6] == pytest.approx(0.6, abs=1e-6)


def test_ranges_are_rounded_to_float32_as_in_a_message() -> None:
    ring = sense_circles(ORIGIN, [polar(45.0, 1.0, 0.3)], PAPER)
    assert ring[1] == float(np.float32(0.7))
    assert ring[1] != 0.7
    assert all(type(r) is float for r in ring)
    assert single_precision([0.1, math.inf]) == (0.10000000149011612, math.inf)
    assert single_precision(single_precision([0.1])) == single_precision([0.1])


@pytest.mark.parametrize(
    ("position", "circle"),
    [
        ((math.nan, 0.0), ((1.0, 0.0), 0.5)),
        ((0.0, math.inf), ((1.0, 0.0), 0.5)),
        ((0.0, 0.0), ((math.nan, 0.0), 0.5)),
        ((0.0, 0.0), ((1.0, -math.inf), 0.5)),
        ((0.0, 0.0), ((1.0, 0.0), math.nan)),
    ],
)
def test_what_is_not_finite_is_refused_and_not_free(position: Point, circle: Circle) -> None:
    with pytest.raises(InputError, match="not finite; send finite numbers"):
        sense_circles(position, [circle], PAPER)


CIRCLE = st.builds(polar, st.floats(-180.0, 180.0), st.floats(0.05, 2.5), st.floats(0.02, 1.5))
CIRCLES = st.lists(CIRCLE, max_size=5)
SECTORS = st.integers(3, 40)
POSITIONS = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))


def shifted(circles: Sequence[Circle], by: Point) -> list[Circle]:
    return [((x + by[0], y + by[1]), radius) for (x, y), radius in circles]


def cast_rays(
    position: Point, circles: Sequence[Circle], reach: float, angles: np.ndarray
) -> np.ndarray:
    """Distance to the first circle in range along each ray, from the quadratic equation."""
    direction = np.stack([np.cos(angles), np.sin(angles)])
    nearest = np.full(angles.shape, np.inf)
    for center, radius in circles:
        offset = np.array(center) - position
        if math.hypot(*offset) - radius > reach:
            continue
        b = direction.T @ offset
        c = offset @ offset - radius**2
        root = np.sqrt(np.maximum(0.0, b * b - c))
        hit = (b * b >= c) & (b + root >= 0.0)
        first = np.where(c <= 0.0, 0.0, b - root)
        nearest = np.where(hit & (b >= 0.0), np.minimum(nearest, first), nearest)
    return nearest


@given(CIRCLES, SECTORS)
def test_a_ring_of_several_circles_is_the_least_of_each(circles: list[Circle], n: int) -> None:
    params = SensorParams(sectors=n)
    each = [sense_circles(ORIGIN, [circle], params) for circle in circles]
    expected = tuple(map(min, zip(*each))) if each else (math.inf,) * n
    assert sense_circles(ORIGIN, circles, params) == expected


@given(POSITIONS, CIRCLE, SECTORS)
def test_ring_against_many_rays(position: Point, around: Circle, n: int) -> None:
    circles = shifted([around], position)
    assume(all(abs(math.dist(position, c) - r - 0.8) > 1e-9 for c, r in circles))
    ring = sense_circles(position, circles, SensorParams(sectors=n))
    rays = 500
    angles = (np.arange(n * rays) + 0.5) * (2.0 * math.pi / (n * rays))
    ray_ranges = cast_rays(position, circles, 0.8, angles)
    for sector, r in enumerate(ring):
        in_sector = ray_ranges[sector * rays : (sector + 1) * rays]
        nearest = in_sector.min()
        assert r <= nearest + 1e-6, "no ray hits anything nearer"
        if nearest < math.inf:
            assert nearest == pytest.approx(r, abs=2e-3) or grazing(in_sector)
            assert nearest <= r + 0.2
        elif r < math.inf:  # the circle is between the sector's bound and its first ray
            assert (
                min(
                    ray_ranges[sector * rays - 1],
                    ray_ranges[(sector + 1) * rays % len(ray_ranges)],
                )
                < math.inf
            )


def grazing(ray_ranges: np.ndarray) -> bool:
    """Whether a ray next to the nearest one misses: the range changes steeply there."""
    index = int(ray_ranges.argmin())
    nearby = ray_ranges[max(0, index - 2) : index + 3]
    return bool(np.isinf(nearby).any() or index in (0, len(ray_ranges) - 1))


@given(CIRCLES, SECTORS, st.integers(1, 40))
def test_turning_the_world_by_sectors_turns_the_ring(
    circles: list[Circle], n: int, turns: int
) -> None:
    width = 2.0 * math.pi / n

    def clear_of_bounds(circle: Circle) -> bool:
        (x, y), radius = circle
        d = math.hypot(x, y)
        half = math.asin(min(1.0, radius / d))
        ends = [(math.atan2(y, x) + side * half) / width for side in (-1, 1)]
        return abs(d - radius - 0.8) > 1e-9 and all(abs(e - round(e)) > 1e-9 for e in ends)

    assume(all(map(clear_of_bounds, circles)))
    c, s = math.cos(turns * width), math.sin(turns * width)
    turned = [((c * x - s * y, s * x + c * y), r) for (x, y), r in circles]
    params = SensorParams(sectors=n)
    ring = sense_circles(ORIGIN, circles, params)
    expected = tuple(ring[(i - turns) % n] for i in range(n))
    assert sense_circles(ORIGIN, turned, params) == pytest.approx(expected, abs=1e-5)


@given(CIRCLES, SECTORS)
@example([polar(0.375, 0.8, 0.8)], 37)  # rounding gave a range of -1e-16
def test_no_range_exceeds_the_tangent_of_a_circle_at_the_edge(
    circles: list[Circle], n: int
) -> None:
    ring = sense_circles(ORIGIN, circles, SensorParams(sectors=n))
    longest = max((longest_range_m(PAPER, radius) for _, radius in circles), default=0.0)
    assert all(0.0 <= r <= longest * (1.0 + 1e-6) for r in ring if r < math.inf)


def test_the_longest_range_by_hand() -> None:
    assert longest_range_m(SensorParams(sensing_range_m=0.2), 0.3) == pytest.approx(0.4)
    # that range occurs where a tangent barely reaches into a sector
    half = math.degrees(math.asin(0.3 / 0.5))
    ring = sense_circles(
        ORIGIN, [polar(half - 1e-7, 0.5, 0.3)], SensorParams(sensing_range_m=0.2001)
    )
    assert ring[11] == pytest.approx(0.4, abs=1e-3)


def test_a_tangent_on_a_bound_has_a_range_in_spite_of_rounding() -> None:
    found = 0
    for n in range(3, 60):
        for k in range(n):
            width = 2.0 * math.pi / n
            half = 0.4 * width
            circle = towards(ORIGIN, k * width + half, 1.5), 1.5 * math.sin(half)
            ring = sense_circles(ORIGIN, [circle], SensorParams(sectors=n, sensing_range_m=2.0))
            assert ring[k] < 1.5
            found += ring[(k - 1) % n] < math.inf
            if ring[(k - 1) % n] < math.inf:
                assert ring[(k - 1) % n] == pytest.approx(1.5 * math.cos(half), abs=1e-5)
    assert found > 0, "some tangent was rounded over the bound"


# --- scans ----------------------------------------------------------------------------------


def scan(ranges: Sequence[float], start_deg: float = 0.0, step_deg: float = 10.0) -> Scan:
    """These beams, and free ones for the rest of a full turn."""
    return partial_scan([*ranges, *[math.inf] * (36 - len(ranges))], start_deg, step_deg)


def partial_scan(ranges: Sequence[float], start_deg: float = 0.0, step_deg: float = 10.0) -> Scan:
    return Scan(
        ranges_m=np.array(ranges),
        angle_min_rad=math.radians(start_deg),
        angle_increment_rad=math.radians(step_deg),
        range_min_m=0.1,
        range_max_m=5.0,
    )


def scan_bits(ranges: Sequence[float], start_deg: float = 0.0, yaw_deg: float = 0.0) -> str:
    ring = sense_scan(scan(ranges, start_deg), math.radians(yaw_deg), 0.3, PAPER)
    return "".join(map(str, sensory_vector(ring)))


def test_one_return_is_a_point_enlarged_by_the_robot() -> None:
    ring = sense_scan(scan([0.9], 45.0), 0.0, 0.3, PAPER)  # half angle asin(1 / 3) = 19.5 degrees
    aside = 0.9 * math.cos(math.radians(15.0))
    aside -= math.sqrt(0.09 - (0.9 * math.sin(math.radians(15.0))) ** 2)
    assert ring[:3] == pytest.approx((aside, 0.6, aside), abs=1e-6)
    assert ring[3:] == (math.inf,) * 9
    assert ring == sense_circles(ORIGIN, [polar(45.0, 0.9, 0.3)], PAPER)


def test_beams_count_from_angle_min_by_the_increment() -> None:
    far = math.inf
    assert scan_bits([far, far, 0.6, far], start_deg=55.0) == "011100000000"
    assert scan_bits([far, far, 0.6, far], start_deg=-95.0) == "000000001110"
    backwards = sense_scan(scan([far, far, 0.6], 95.0, -10.0), 0.0, 0.3, PAPER)
    assert sensory_vector(backwards) == (0, 1, 1, 1) + (0,) * 8


def test_yaw_turns_the_scan_into_the_frame_of_the_sectors() -> None:
    assert scan_bits([0.6], start_deg=15.0, yaw_deg=60.0) == "011100000000"
    assert scan_bits([0.6], start_deg=15.0, yaw_deg=-90.0) == "000000001110"


def test_the_range_of_a_scan_is_measured_to_the_enlarged_point_and_includes_it() -> None:
    params = SensorParams(sensing_range_m=0.75)
    for d, visible in ((1.0, True), (1.0 + 1e-9, False)):
        ring = sense_scan(scan([d]), 0.0, 0.25, params)
        assert any(sensory_vector(ring)) is visible


def test_rep_117() -> None:
    far = math.inf
    assert scan_bits([far], 45.0) == "0" * 12
    assert scan_bits([far, math.nan, 0.05, 6.0], 45.0) == "0" * 12, "no measurements"
    nearest = sense_scan(scan([-math.inf], 45.0), 0.0, 0.02, PAPER)
    assert sensory_vector(nearest) == (0, 1) + (0,) * 10
    assert nearest[1] == pytest.approx(0.08), "an obstacle below range_min, taken at range_min"


def test_the_limits_of_a_scan_are_valid_ranges() -> None:
    wide = SensorParams(sensing_range_m=9.0)
    for r, visible in ((0.1, True), (0.0999, False), (5.0, True), (5.001, False)):
        ring = sense_scan(scan([r, math.inf]), 0.0, 0.01, wide)
        assert any(sensory_vector(ring)) is visible


def test_a_sector_that_no_beam_covers_is_not_free() -> None:
    def bits(ranges: Sequence[float], start_deg: float, step_deg: float, yaw_deg: float) -> str:
        ring = sense_scan(
            partial_scan(ranges, start_deg, step_deg), math.radians(yaw_deg), 0.3, PAPER
        )
        assert {r for r in ring if r < math.inf} <= {0.0}
        return "".join(map(str, sensory_vector(ring)))

    front = [math.inf] * 271  # 270 degrees, the rear is not covered
    assert bits(front, -135.0, 1.0, 0.0) == "000001100000"
    assert bits(front, -135.0, 1.0, 90.0) == "000000001100"
    assert bits(front[::-1], 135.0, -1.0, 0.0) == "000001100000"
    assert bits([math.inf], 45.0, 1.0, 0.0) == "101111111111", "a single beam"
    assert bits([math.inf] * 12, 15.0, 30.0, 0.0) == "0" * 12, "a beam per sector"
    masked = [math.inf] * 360
    masked[30:60] = [math.nan] * 30
    assert bits(masked, 0.5, 1.0, 0.0) == "010000000000", "masked by the robot's body"
    masked[40] = math.inf
    assert bits(masked, 0.5, 1.0, 0.0) == "0" * 12


@pytest.mark.parametrize(
    "ranges", [[], [math.nan], [math.nan, 6.0], [0.05], [0.0, 0.0, 99.0], [-1.0]], ids=str
)
def test_a_scan_without_usable_ranges_is_refused(ranges: list[float]) -> None:
    with pytest.raises(InputError, match=f"^scan of {len(ranges)} beams without one usable range"):
        sense_scan(partial_scan(ranges), 0.0, 0.3, PAPER)


@pytest.mark.parametrize(
    "changes",
    [
        {"angle_min_rad": math.nan},
        {"angle_increment_rad": math.inf},
        {"range_min_m": math.nan},
        {"range_min_m": -0.1},
        {"range_max_m": math.nan},
        {"range_max_m": 0.1},
        {"range_max_m": 0.0},
    ],
)
def test_a_scan_of_impossible_geometry_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="unusable; check the lidar driver"):
        sense_scan(replace(scan([1.0]), **changes), 0.0, 0.3, PAPER)


@pytest.mark.parametrize(
    "increment_rad", [0.0, -0.0, 2.2 * math.pi / 359.0, -2.2 * math.pi / 359.0]
)
def test_beams_in_one_direction_or_beyond_a_full_turn_are_refused(increment_rad: float) -> None:
    wrong = replace(scan([1.0] * 360), angle_increment_rad=increment_rad)
    with pytest.raises(
        InputError, match=r"^scan of 360 beams with angle_increment=.*lidar driver$"
    ):
        sense_scan(wrong, 0.0, 0.3, PAPER)


@pytest.mark.parametrize("beams", [1, 2, 12, 360, 1081])
@pytest.mark.parametrize("sign", [1, -1], ids=["upright", "upside down"])
def test_a_full_turn_with_both_its_ends_is_a_scan(beams: int, sign: int) -> None:
    increment_rad = sign * 2.0 * math.pi / max(beams - 1, 1)
    whole = replace(partial_scan([0.5] * beams), angle_increment_rad=increment_rad)
    assert any(sensory_vector(sense_scan(whole, 0.0, 0.3, PAPER)))


def test_a_pose_without_yaw_is_refused() -> None:
    with pytest.raises(InputError, match=r"yaw=nan: unusable"):
        sense_scan(partial_scan([1.0]), math.nan, 0.3, PAPER)


def test_a_scan_may_have_no_upper_limit_and_start_at_0() -> None:
    unlimited = replace(scan([0.0, math.inf], 45.0), range_min_m=0.0, range_max_m=math.inf)
    assert sum(sensory_vector(sense_scan(unlimited, 0.0, 0.3, PAPER))) >= 6


def lidar(position: Point, circles: Sequence[Circle], beams: int, yaw: float) -> Scan:
    """A scan of the circles' surfaces by a robot with this yaw."""
    angles = -math.pi + np.arange(beams) * (2.0 * math.pi / beams)
    return Scan(
        ranges_m=cast_rays(position, circles, math.inf, angles + yaw).astype(np.float32),
        angle_min_rad=-math.pi,
        angle_increment_rad=2.0 * math.pi / beams,
        range_min_m=0.0,
        range_max_m=30.0,
    )


@given(
    POSITIONS,
    st.lists(
        st.builds(polar, st.floats(-180.0, 180.0), st.floats(0.8, 2.5), st.floats(0.05, 0.4)),
        max_size=3,
    ),
    st.floats(-3.0, 3.0),
)
def test_scan_and_circles_give_the_same_sectors(
    position: Point, around: list[Circle], yaw: float
) -> None:
    robot = 0.3
    assume(all(math.hypot(*c) > r + robot + 0.01 for c, r in around))
    circles = shifted(around, position)
    from_scan = sense_scan(lidar(position, circles, 1440, yaw), yaw, robot, PAPER)
    enlarged = [(c, r + robot) for c, r in circles]
    truth = sense_circles(position, enlarged, PAPER)
    wider = sense_circles(position, [(c, r + 0.01) for c, r in enlarged], PAPER)
    for scanned, true, most in zip(from_scan, truth, wider):
        assert scanned == math.inf or most < math.inf, "the scan adds no obstacle"
        assert scanned >= min(true, most) - 0.01, "and no obstacle is nearer"

    def fully_in_range(
        circle: Circle,
    ) -> bool:  # its visible side, up to the tangents, lies within SR
        (x, y), r = circle
        return math.sqrt(x * x + y * y - r * r) - robot < 0.8 - 0.01

    # a single obstacle is not occluded: the scan must show all of it
    if len(around) == 1 and fully_in_range(around[0]):
        narrower = sense_circles(position, [(c, r - 0.02) for c, r in enlarged], PAPER)
        for scanned, least in zip(from_scan, narrower):
            assert scanned < math.inf or least == math.inf
            assert scanned <= least + 0.1
