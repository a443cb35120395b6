# SPDX-License-Identifier: Apache-2.0
"""Obstacles at rest: no contact until the robot can stop; enclosure; returns inside the robot."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point, distance
from mfba_planner.core.planner_types import Circle
from mfba_planner.planning.obstacles_at_rest import ObstaclesAtRest

HERE = (3.0, -2.0)
DURATION_S = 0.15


def circle(
    heading_rad: float, away_m: float, radius_m: float = 0.3, speed_mps: float = 0.0
) -> Circle:
    x, y = HERE[0] + away_m * math.cos(heading_rad), HERE[1] + away_m * math.sin(heading_rad)
    return Circle(center_m=(x, y), radius_m=radius_m, velocity_mps=(speed_mps, 0.0))


def at_rest(*circles: Circle) -> ObstaclesAtRest:
    return ObstaclesAtRest(HERE, circles)


def ring(count: int, away_m: float, radius_m: float = 0.3, speed_mps: float = 0.0) -> list[Circle]:
    step = 2.0 * math.pi / count
    return [circle(k * step, away_m, radius_m, speed_mps) for k in range(count)]


circles = st.builds(
    circle, st.floats(-math.pi, math.pi), st.floats(0.16, 1.2), st.floats(0.05, 0.3)
)
velocities = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


@given(st.lists(circles, min_size=1, max_size=8), velocities)
def test_the_allowed_share_brings_no_contact_and_is_not_too_small(
    found: list[Circle], velocity: Point
) -> None:
    share = at_rest(*found).allowed_share(velocity, DURATION_S)
    assert 0.0 <= share <= 1.0

    def edge(c: Circle, part: float) -> float:
        x, y = (h + part * DURATION_S * v for h, v in zip(HERE, velocity))
        return distance((x, y), c.center_m) - c.radius_m

    def approach(c: Circle, part: float) -> float:
        """The velocity's component towards the centre, times the distance from it."""
        offsets = (m - h - part * DURATION_S * v for m, h, v in zip(c.center_m, HERE, velocity))
        return sum(offset * v for offset, v in zip(offsets, velocity))

    for c in found:
        start = min(edge(c, 0.0), 0.0)  # in contact already: not deeper
        for k in range(1, 9):
            assert edge(c, share * k / 8.0) >= start - 1e-7
    if share < 1.0:  # there it touches a circle, and more would lead nearer
        assert any(edge(c, share) < 1e-6 and approach(c, share) > -1e-9 for c in found)


def test_from_contact_a_robot_may_move_away_or_along_but_not_nearer() -> None:
    touching = at_rest(circle(0.0, 0.29))
    shares = {
        heading: touching.allowed_share(
            (math.cos(math.radians(heading)), math.sin(math.radians(heading))), DURATION_S
        )
        for heading in (0, 60, 89, 90, 120, 180, 270, 300)
    }
    assert shares == {0: 0, 60: 0, 89: 0, 90: 1, 120: 1, 180: 1, 270: 1, 300: 0}


def test_what_moves_is_left_to_its_risk() -> None:
    moving = at_rest(*ring(12, 0.32, speed_mps=0.3))
    assert moving.allowed_share((1.0, 0.0), DURATION_S) == 1.0
    assert moving.enclosure() == ""


@pytest.mark.parametrize("away_m", [0.15, 0.29, 0.3, 0.31, 0.5, 0.55])
@pytest.mark.parametrize("count", [12, 36, 360])
def test_a_ring_without_a_gap_encloses(count: int, away_m: float) -> None:
    assert at_rest(*ring(count, away_m)).enclosure().startswith(f"enclosed by {count} obstacles")


def test_the_reason_names_returns_inside_the_robot_and_the_remedy() -> None:
    near, far = ring(4, 0.2), ring(36, 0.5)
    assert at_rest(*far).enclosure() == "enclosed by 36 obstacles at rest, the nearest 0.20 m off"
    assert at_rest(*near, *far).enclosure() == (
        "enclosed by 40 obstacles at rest, the nearest -0.10 m off, 4 inside the robot's radius; "
        "check robot_radius_m, and range_min or the mask of the robot's own returns"
    )


@pytest.mark.parametrize("missing", range(12))
def test_a_ring_with_a_gap_does_not_enclose(missing: int) -> None:
    """Eleven of twelve at 0.7 m: the gap is 0.7 m wide, and the circles leave 0.1 m of it."""
    open_ring = [c for k, c in enumerate(ring(12, 0.7)) if k != missing]
    assert at_rest(*open_ring).enclosure() == ""
    widened = [*open_ring, circle(missing * math.pi / 6.0, 0.7, 0.07)]
    assert at_rest(*widened).enclosure() != ""


def test_contact_on_one_side_does_not_enclose() -> None:
    """Seven sectors that read 0: half a turn of circles that touch the robot."""
    away = (math.cos(math.radians(285)), math.sin(math.radians(285)))
    side = [circle(math.radians(15 + 30 * k), 0.3) for k in range(7)]
    assert at_rest(*side).enclosure() == ""
    assert at_rest(*side).allowed_share(away, DURATION_S) == 1.0
    assert at_rest(*side, circle(math.radians(285), 0.3)).enclosure() != ""


def test_a_long_wall_and_a_dead_end_do_not_enclose() -> None:
    wall = [
        Circle(center_m=(HERE[0] + 0.5, HERE[1] + y), radius_m=0.3)
        for y in np.arange(-4.0, 4.1, 0.25)
    ]
    dead_end = [circle(math.radians(a), 0.8) for a in range(-150, 151, 10)]
    assert at_rest(*wall).enclosure() == at_rest(*dead_end).enclosure() == ""


@given(st.lists(circles, min_size=3, max_size=14), st.integers(0, 7))
@example([circle(k * 0.9, 0.4) for k in range(7)], 3)
def test_enclosed_means_that_no_path_leads_out(found: list[Circle], turn: int) -> None:
    """Against a flood fill: of the region it surely can reach, or surely cannot."""
    assume(all(distance(HERE, c.center_m) > c.radius_m for c in found))
    enclosed = bool(at_rest(*found).enclosure())
    if enclosed:
        assert not leads_out(found, slack_m=0.02)
    else:
        assert leads_out(found, slack_m=-0.02)
    rotated = found[turn % len(found) :] + found[: turn % len(found)]
    assert bool(at_rest(*rotated).enclosure()) is enclosed


def leads_out(found: list[Circle], slack_m: float) -> bool:
    """Whether a grid path leads out, of cells farther than slack_m from every circle."""
    h, n = 0.02, 81  # +- 1.62 m
    line = h * np.arange(-n, n + 1)
    gx, gy = np.meshgrid(HERE[0] + line, HERE[1] + line, indexing="ij")
    free = np.ones(gx.shape, dtype=bool)
    for c in found:
        free &= np.hypot(gx - c.center_m[0], gy - c.center_m[1]) > c.radius_m + slack_m
    reached = np.zeros_like(free)
    reached[n, n] = True
    while True:
        grown = reached.copy()
        for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
            grown |= np.roll(reached, shift, axis)
        grown = (grown & free) | reached
        if grown[0].any() or grown[-1].any() or grown[:, 0].any() or grown[:, -1].any():
            return True
        if (grown == reached).all():
            return False
        reached = grown


@pytest.mark.parametrize("away_m", [0.0, 0.1, 0.149])
def test_a_return_at_the_middle_of_the_robot_is_no_obstacle(away_m: float) -> None:
    """As from a lidar that reports 0.0 where nothing is: every direction leads away from it."""
    reason = at_rest(circle(1.0, 0.9), circle(0.5, away_m)).misplaced()
    assert reason.startswith(f"an obstacle reaches {0.3 - away_m:.2f} m into the robot; check ")
    assert at_rest(circle(1.0, 0.9), circle(0.5, 0.16)).misplaced() == ""


def test_shares_fall_with_the_distance_left() -> None:
    shares = [
        at_rest(circle(0.0, 0.3 + left_m)).allowed_share((1.0, 0.0), DURATION_S)
        for left_m in (0.0, 0.03, 0.075, 0.15, 0.3)
    ]
    assert shares == pytest.approx([0.0, 0.2, 0.5, 1.0, 1.0], abs=1e-6)
    assert all(a <= b for a, b in pairwise(shares))
