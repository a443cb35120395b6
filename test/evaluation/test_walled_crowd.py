# SPDX-License-Identifier: Apache-2.0
"""People in a hall: the force of borders is a gradient, nobody touches a wall; it is drivable."""

import math

import numpy as np
import pytest
from flood_fill import clearance_at, clearance_of, has_path
from suite_run import metrics_of

from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.oracle import Certificate, solve
from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.social_forces import CUT_M, SPEED_MPS
from mfba_planner.evaluation.suites.walled_crowd import (
    BORDER_M2PS2,
    BORDER_RANGE_M,
    PILLAR_RADIUS_M,
    Borders,
    Hall,
    HallParams,
    draw_hall,
    people_paths,
)
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.scenario import Scenario

CROWD = suite("crowd")
# in world 0: a wall, where the first person starts, where the fourth is after 12 s
GOLDEN = (0.0, -4.0, 0.0, -2.5145, -25.375516, -1.977921, 0.936385, 1.380777)
PLACE = Hall(segments_m=((0.0, 0.0, 4.0, 0.0),), doors=(), pillars_m=((2.0, 3.0),))


def potential(x: float, y: float) -> float:
    """Of PLACE, by hand."""
    wall = math.hypot(x - min(max(x, 0.0), 4.0), y)
    pillar = math.hypot(x - 2.0, y - 3.0) - PILLAR_RADIUS_M
    return BORDER_M2PS2 * sum(math.exp(-d / BORDER_RANGE_M) for d in (wall, pillar))


@pytest.mark.parametrize("point", [(1.0, 0.4), (-0.3, 0.2), (2.1, 2.3), (4.2, -0.1), (1.4, 3.1)])
def test_borders_repel_by_the_negative_gradient_of_their_potential(
    point: tuple[float, float],
) -> None:
    x, y = point
    h = 1e-6
    gradient = [
        (potential(x + h, y) - potential(x - h, y)) / (2.0 * h),
        (potential(x, y + h) - potential(x, y - h)) / (2.0 * h),
    ]
    found = Borders(PLACE).repulsion(np.array([point, (9.0, 9.0)]))
    assert found[0] == pytest.approx([-g for g in gradient], rel=1e-4, abs=1e-6)
    assert np.abs(found[1]).max() < 1e-6


def test_a_person_in_touch_with_a_border_is_moved_straight_out_of_it() -> None:
    before = np.array([(1.0, 0.1), (1.0, -0.2), (2.0, 2.5), (1.0, 1.0)])
    found = Borders(PLACE).outside(before, 0.25)
    expected = [(1.0, 0.25), (1.0, -0.25), (2.0, 3.0 - PILLAR_RADIUS_M - 0.25), (1.0, 1.0)]
    assert found == pytest.approx(np.array(expected))


def people(world: Scenario) -> list[int]:
    return [i for i, o in enumerate(world.obstacles) if o.top_speed_mps > 0.0]


def test_people_go_through_both_doors_in_both_directions_and_touch_nothing_that_stands() -> None:
    through: set[tuple[bool, bool]] = set()
    for k in range(4):
        world = CROWD.world(k)
        walking = people(world)
        assert len(walking) == 14
        times = np.arange(0.0, 40.0, 0.1)
        at = np.array([world.centers(float(t)) for t in times])[:, walking]
        assert clearance_at(world, at[..., 0], at[..., 1]).min() >= 0.25 - CUT_M - 1e-6
        for path in np.moveaxis(at, 1, 0):
            (crossings,) = np.nonzero(np.diff(np.sign(path[:, 0])))
            assert len(crossings) <= 1, "nobody turns back in the wall across"
            through |= {(bool(path[0, 0] < 0.0), bool(path[i, 1] > 0.0)) for i in crossings}
    assert len(through) == 4


def test_people_are_there_while_the_robot_drives_and_walk_at_1_3_mps() -> None:
    counts, speeds = [], []
    for k in range(4):
        world = CROWD.world(k)
        walking = people(world)
        for t in (1.0, 5.0, 10.0):
            centers = np.array(world.centers(t))[walking]
            counts.append(int((np.abs(centers[:, 0]) < 9.0).sum()))
            moved = np.array(world.centers(t + 0.1))[walking] - centers
            speeds += (np.hypot(*moved.T) / 0.1).tolist()
    assert 3 <= np.mean(counts) <= 12
    assert np.mean(speeds) == pytest.approx(SPEED_MPS, abs=0.15)


def test_the_hall_has_a_path_and_start_and_goal_are_clear() -> None:
    for k in range(5):
        world = CROWD.world(k)
        assert has_path(world, 0.35 - 0.04, 0.04)
        for end in (world.start_m, world.goal_m):
            assert clearance_of(world, end) >= 0.4
            centers = [world.obstacles[i].center_m for i in people(world)]
            assert min(math.dist(end, c) for c in centers) >= 0.55 + 0.5
    empty = HallParams(people=0, pillars=0)
    rng = np.random.default_rng(1)
    assert people_paths(empty, draw_hall(empty, rng), rng).shape[0] == 0


def test_parameters_out_of_range_are_refused() -> None:
    with pytest.raises(ConfigError, match="people=-1: out of range"):
        HallParams(people=-1)
    with pytest.raises(ConfigError, match=r"door_min_m=2\.5: above door_max_m=2; "):
        HallParams(door_min_m=2.5, door_max_m=2.0)


@pytest.mark.parametrize("k", [503, 516])
def test_the_oracle_certifies_worlds_among_people_and_walls(k: int) -> None:
    found = solve(CROWD.world(k), 1.0)
    assert found.certificate is Certificate.FEASIBLE
    assert found.length_m > 12.0


def test_a_published_world_does_not_change() -> None:
    world = CROWD.world(0)
    found = [*world.segments_m[2], *world.obstacles[0].center_m, *world.centers(12.0)[3]]
    assert found == pytest.approx(GOLDEN, abs=1e-6)


@pytest.mark.no_cover
@pytest.mark.parametrize("k", [7, 11])
def test_the_default_planner_passes_from_its_lidar(k: int) -> None:
    found = metrics_of("crowd", k)
    assert (found.outcome, found.collisions) == (Outcome.GOAL_REACHED, 0)
