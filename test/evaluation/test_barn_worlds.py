# SPDX-License-Identifier: Apache-2.0
"""Worlds in the manner of BARN: the automaton's rule, the lane, the way through; drivable."""

import flood_fill
import numpy as np
import pytest
from suite_run import metrics_of

from mfba_planner.evaluation.oracle import Certificate, solve
from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.barn_worlds import (
    FIELD_ROWS,
    FIRST_ROW,
    VARIANTS,
    field_cells,
    has_path,
    lane_cells,
)
from mfba_planner.simulation.episode import Outcome

BARN = suite("barn-like")
# cylinders 100 to 102 of world 0
GOLDEN = [(0.225, 5.325), (4.425, 5.325), (0.075, 5.475)]


class Filled:
    """In the place of a Generator: the cells that are filled at random."""

    def __init__(self, *cells: tuple[int, int]) -> None:
        self.cells = cells

    def random(self, shape: tuple[int, int]) -> np.ndarray:
        values = np.ones(shape)
        for cell in self.cells:
            values[cell] = 0.0
        return values


def smoothed(times: int, *cells: tuple[int, int]) -> set[tuple[int, int]]:
    """Filled cells after so many smoothings, without the two sides."""
    found = field_cells(0.2, times, Filled(*cells))  # type: ignore[arg-type]
    assert found[:, [0, -1]].all()
    return {(int(i), int(j)) for i, j in np.argwhere(found) if j not in (0, 29)}


def test_a_cell_needs_five_filled_neighbours_to_be_filled_and_two_to_stay() -> None:
    ring = [(9, 9), (9, 10), (9, 11), (10, 9), (10, 11), (11, 9), (11, 10), (11, 11)]
    assert (10, 10) in smoothed(1, *ring[:5])
    assert (10, 10) not in smoothed(1, *ring[:4])
    assert smoothed(0, (10, 10), (20, 20)) == {(10, 10), (20, 20)}
    assert smoothed(1, (10, 10), (10, 11)) == set(), "one neighbour is too few"
    assert smoothed(1, (10, 10), (10, 11), (11, 10)) == {(10, 10), (10, 11), (11, 10)}
    assert (10, 1) in smoothed(1, (9, 1), (11, 1)), "the side counts: three and two"


def test_the_lane_is_closed_at_its_sides_and_behind_the_robot() -> None:
    lane = lane_cells(np.zeros((FIELD_ROWS, 30), dtype=bool))
    assert lane.sum() == 2 * 66 + 28
    assert lane[0].all()
    assert lane[:, [0, -1]].all()
    assert not lane[1:, 1:-1].any()


def test_a_path_is_as_wide_as_the_robot_and_0_1_m() -> None:
    """A gap of n cells in a row across: from cylinder to cylinder n x 0.15 m."""

    def passes(cells: int) -> bool:
        field = np.zeros((FIELD_ROWS, 30), dtype=bool)
        field[15] = True
        field[15, 8 : 8 + cells] = False
        return has_path(lane_cells(field))

    assert [passes(n) for n in (0, 3, 4, 8)] == [False, False, True, True]


def test_worlds_are_lanes_of_200_to_500_cylinders() -> None:
    filled = []
    for k in range(24):
        world = BARN.world(k)
        centers = np.array([o.center_m for o in world.obstacles])
        assert {o.radius_m for o in world.obstacles} == {0.075}
        assert (world.robot_radius_m, world.start_m, world.goal_m) == (
            0.22,
            (2.25, 3.0),
            (2.25, 13.0),
        )
        assert 180 <= len(centers) <= 520
        cells = centers / 0.15 - 0.5
        assert np.abs(cells - np.round(cells)).max() < 1e-9
        rows = np.round(cells[:, 1])
        inner = (cells[:, 0] > 0.5) & (cells[:, 0] < 28.5) & (rows > 0)
        assert rows[inner].min() >= FIRST_ROW
        assert rows[inner].max() < FIRST_ROW + FIELD_ROWS
        filled.append(int(inner.sum()))
        assert flood_fill.clearance_of(world, world.start_m) >= 0.32
        assert flood_fill.clearance_of(world, world.goal_m) >= 0.32
    by_fill = np.array(filled).reshape(2, 4, 3).mean(axis=(0, 2))
    assert len(VARIANTS) == 12
    assert (np.diff(by_fill) > 0).all(), "more is filled from one percentage to the next"


@pytest.mark.parametrize("k", [0, 5, 9, 10])
def test_flood_fill_and_oracle_find_a_path(k: int) -> None:
    world = BARN.world(k)
    # The lane is closed behind the robot, and its sides have no gaps.
    assert flood_fill.has_path(world, 0.22 + 0.05 - 0.01)
    found = solve(world, 1.0)
    assert found.certificate is Certificate.FEASIBLE
    assert 10.0 <= found.length_m < 14.0


def test_a_published_world_does_not_change() -> None:
    world = BARN.world(0)
    assert len(world.obstacles) == 223
    assert [o.center_m for o in world.obstacles[100:103]] == GOLDEN


@pytest.mark.parametrize("k", [0, 4])
def test_the_default_planner_passes_from_its_lidar(k: int) -> None:
    found = metrics_of("barn-like", k)
    assert (found.outcome, found.collisions) == (Outcome.GOAL_REACHED, 0)
