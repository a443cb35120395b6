# SPDX-License-Identifier: Apache-2.0
"""Worlds in the manner of DynaBARN: counts, radius, speeds, and curves inside the square."""

import math
import statistics

import numpy as np
import pytest

from mfba_planner.core.geometry import distance
from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.dynabarn_worlds import DIFFICULTIES, dynabarn_obstacles
from mfba_planner.simulation.obstacle_motion import Obstacle, center_at, velocity_at

UNTIL_S = 60.0


def discs(name: str, worlds: int = 12) -> list[Obstacle]:
    return [
        disc
        for seed in range(worlds)
        for disc in dynabarn_obstacles(name, np.random.Generator(np.random.PCG64(seed)))
    ]


@pytest.mark.parametrize(
    ("name", "mean_mps", "most", "counts"),
    [
        ("easy", 0.74, 0.97, (5, 14)),
        ("medium", 1.23, 1.46, (15, 19)),
        ("hard", 1.72, 1.95, (20, 24)),
    ],
)
def test_speed_and_number_grow_with_the_difficulty(
    name: str, mean_mps: float, most: float, counts: tuple[int, int]
) -> None:
    """Means and ranges of DynaBARN's published trajectories, by difficulty."""
    found = discs(name)
    assert {disc.radius_m for disc in found} == {0.5}
    assert 12 * counts[0] <= len(found) <= 12 * counts[1]
    speeds = [
        math.hypot(*velocity_at(disc, t)) for disc in found for t in np.arange(0.0, UNTIL_S, 0.5)
    ]
    assert statistics.mean(speeds) == pytest.approx(mean_mps, abs=0.04)
    assert max(speeds) <= most
    assert min(speeds) >= 2.0 * mean_mps - most - 0.01


@pytest.mark.parametrize("name", DIFFICULTIES)
def test_discs_stay_in_the_square_and_reach_its_edges(name: str) -> None:
    for disc in discs(name, 3):
        path = np.array([center_at(disc, t) for t in np.arange(0.0, UNTIL_S, 0.1)]) - 6.0
        assert np.abs(path).max() <= 10.0 + 1e-6
        assert np.abs(path).max() > 9.8
        steps = np.hypot(*np.diff(path, axis=0).T)
        assert steps.max() <= 0.1 * disc.top_speed_mps + 1e-9, "no disc jumps"


def test_curves_bend_more_where_it_is_harder() -> None:
    def turned(name: str) -> float:
        found = discs(name, 4)
        total = 0.0
        for disc in found:
            headings = [disc.heading_rad, *(turn.heading_rad for turn in disc.turns)]
            turns = [abs(math.remainder(b - a, math.tau)) for a, b in zip(headings, headings[1:])]
            total += sum(turns) / len(turns)
        return total / len(found)

    easy, medium, hard = (turned(name) for name in DIFFICULTIES)
    assert easy < medium < hard


def test_the_suite_takes_the_difficulties_in_turn() -> None:
    names = [suite("dynabarn-like").world(k).name for k in range(4)]
    assert names == [
        "dynabarn-like-0-easy", "dynabarn-like-1-medium", "dynabarn-like-2-hard",
        "dynabarn-like-3-easy",
    ]  # fmt: skip
    world = suite("dynabarn-like").world(2)
    for disc in world.obstacles:
        for end in (world.start_m, world.goal_m):
            assert distance(disc.center_m, end) >= 0.5 + 0.3 + 0.5
