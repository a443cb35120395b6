# SPDX-License-Identifier: Apache-2.0
"""The suite of rooms: what each family holds, free ends, ways wide enough; and it is drivable."""

import math

import pytest
from flood_fill import clearance_of, has_path
from suite_run import metrics_of

from mfba_planner.core.geometry import distance
from mfba_planner.evaluation.oracle import Certificate, solve
from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.room_worlds import FAMILIES, FREE_M, NARROWEST_M, SPARE_M
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.scenario import Scenario

ROOMS = suite("rooms")
ROUNDING_M = 3e-4
# goal and wall of world 3
GOLDEN = (1.9726, -6.1009, 2.2658, -1.7337, -0.4433, -3.8923)


def worlds(family: str, count: int) -> list[Scenario]:
    first = list(FAMILIES).index(family)
    return [ROOMS.world(first + len(FAMILIES) * k) for k in range(count)]


def lengths(world: Scenario) -> list[float]:
    return [distance(s[:2], s[2:]) for s in world.segments_m]


def test_families_alternate() -> None:
    names = [ROOMS.world(k).name for k in range(7)]
    assert names == [
        "rooms-0-door", "rooms-1-corridor", "rooms-2-u-trap", "rooms-3-long-wall", "rooms-4-maze",
        "rooms-5-furniture", "rooms-6-door",
    ]  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
def test_start_and_goal_are_clear_and_a_path_is_wider_than_the_robot(family: str) -> None:
    for world in worlds(family, 8):
        for end in (world.start_m, world.goal_m):
            assert clearance_of(world, end) >= FREE_M - ROUNDING_M
        # A flood fill of cells of 2 cm may lose that much.
        assert has_path(world, 0.5 * NARROWEST_M - 0.02)


@pytest.mark.parametrize("family", FAMILIES)
def test_worlds_of_a_family_differ_also_in_their_direction(family: str) -> None:
    found = worlds(family, 40)
    assert len({(w.segments_m, w.obstacles) for w in found}) == 40
    headings = [math.atan2(w.goal_m[1] - w.start_m[1], w.goal_m[0] - w.start_m[0]) for w in found]
    assert min(headings) < -0.5 * math.pi < 0.5 * math.pi < max(headings)


@pytest.mark.parametrize("family", ["door", "corridor", "maze"])
def test_nothing_leads_round_the_outside(family: str) -> None:
    """A disc that fits no door or corridor gets nowhere."""
    too_wide = {"door": 0.62, "corridor": 0.72, "maze": 0.78}[family]
    assert not any(has_path(world, too_wide, 0.05) for world in worlds(family, 8))


def test_doors_are_of_0_7_to_1_2_m() -> None:
    """The widest disc that passes, by trial."""
    widths = []
    for world in worlds("door", 10):
        passing = [w for w in (0.66, 0.8, 0.95, 1.1, 1.22) if has_path(world, 0.5 * w, 0.04)]
        widths.append(max(passing))
    assert 0.66 == min(widths) < 0.9 < max(widths) < 1.22


def test_sizes_of_the_u_and_of_the_wall() -> None:
    shapes = [lengths(world) for world in worlds("u-trap", 60)]
    deep, wide = zip(*((arm, bottom) for arm, bottom, _ in shapes))
    assert all(first == pytest.approx(third, abs=1e-3) for first, _, third in shapes)
    assert 0.8 - 1e-3 <= min(deep) < 1.0 < 2.7 < max(deep) <= 3.0 + 1e-3
    assert 1.6 - 1e-3 <= min(wide) < 1.9 < 3.7 < max(wide) <= 4.0 + 1e-3
    walls = [length for world in worlds("long-wall", 60) for length in lengths(world)]
    assert len(walls) == 60
    assert 2.0 - 1e-3 <= min(walls) < 2.4 < 5.6 < max(walls) <= 6.0 + 1e-3


@pytest.mark.parametrize("family", ["u-trap", "long-wall"])
def test_the_straight_line_is_blocked(family: str) -> None:
    for world in worlds(family, 4):
        found = solve(world, 0.8)
        assert found.certificate is Certificate.FEASIBLE
        assert found.length_m > distance(world.start_m, world.goal_m) + 1e-3


def test_tables_are_four_posts() -> None:
    found = worlds("furniture", 20)
    assert {len(world.obstacles) % 4 for world in found} == {0}
    assert {o.radius_m for world in found for o in world.obstacles} == {0.03}
    assert sum(bool(world.obstacles) for world in found) >= 10
    # The room has four sides, a box four more.
    assert {len(world.segments_m) % 4 for world in found} == {0}
    assert min(len(world.segments_m) for world in found) >= 8
    assert SPARE_M == 0.1


def test_a_published_world_does_not_change() -> None:
    world = ROOMS.world(3)
    found = (*world.goal_m, *world.segments_m[0])
    assert found == pytest.approx(GOLDEN, abs=1e-9)


@pytest.mark.parametrize("k", range(12))
def test_the_default_planner_passes_from_its_lidar(k: int) -> None:
    """Two worlds of each family."""
    found = metrics_of("rooms", k)
    assert (found.outcome, found.collisions) == (Outcome.GOAL_REACHED, 0)
