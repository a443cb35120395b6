# SPDX-License-Identifier: Apache-2.0
"""Sectors that change while the robot rests tell that obstacles move."""

import math
from dataclasses import replace

import pytest

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Observation, Ranges
from mfba_planner.planning.sector_changes import SectorChanges

S = 10**9
RING: Ranges = (0.4,) * 12
HERE, THERE = (1.0, 2.0), (1.05, 2.0)


def observation(at_s: float, where: Point, ranges: Ranges) -> Observation:
    stamp_ns = round(at_s * S)
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=Pose2D(*where), ranges_m=ranges, goal=(9.0, 9.0)
    )


def moving(*ticks: tuple[float, Point, Ranges]) -> list[bool]:
    changes = SectorChanges()
    return [not changes.at_rest(observation(*tick)) for tick in ticks]


@pytest.mark.parametrize("noise_m", [0.0, 0.02, 0.045])
def test_what_stands_does_not_change(noise_m: float) -> None:
    noisy = (0.4 + noise_m, *RING[1:])
    assert moving((1, HERE, RING), (2, HERE, noisy), (3, HERE, RING)) == [False] * 3


def test_a_change_at_rest_counts_for_two_seconds() -> None:
    nearer = (0.3, *RING[1:])
    ticks = [(1.0, HERE, RING), (1.1, HERE, nearer), (3.0, HERE, nearer), (3.1, HERE, nearer)]
    assert moving(*ticks) == [False, True, True, False]


def test_a_slow_obstacle_is_noticed_too() -> None:
    ticks = [(1 + 0.1 * k, HERE, (0.4 - 0.012 * k, *RING[1:])) for k in range(6)]
    assert moving(*ticks) == [False] * 5 + [True]


def test_a_change_while_the_robot_moves_says_nothing() -> None:
    nearer = (0.3, *RING[1:])
    assert moving((1, HERE, RING), (2, THERE, nearer), (3, HERE, RING)) == [False] * 3


def test_a_sector_at_the_edge_of_the_sensing_range_says_nothing() -> None:
    assert moving((1, HERE, RING), (2, HERE, (math.inf, *RING[1:]))) == [False] * 2


def test_a_ring_that_appears_is_at_rest_until_it_changes() -> None:
    """As when a door is opened and closed again in front of a robot that stands."""
    changes = SectorChanges()
    assert changes.at_rest(observation(1.0, HERE, RING))
    changes.not_enclosed()
    assert changes.at_rest(observation(1.2, HERE, (0.2,) * 12))


def test_without_room_to_evade_it_stays_enclosed() -> None:
    assert moving((1.0, HERE, RING), (1.1, HERE, (0.0, *RING[1:]))) == [False, False]


def test_where_circles_are_known_sectors_do_not_count() -> None:
    changes = SectorChanges()
    for tick, ranges in enumerate((RING, (0.2,) * 12)):
        known = replace(observation(tick, HERE, ranges), circles=())
        assert changes.at_rest(known)
