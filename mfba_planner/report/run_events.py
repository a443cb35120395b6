# SPDX-License-Identifier: Apache-2.0
"""Events of a run for pictures: stretches of one mode, encounters, closest passes, tracks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from mfba_planner.core.geometry import Point, Pose2D, distance, wrap_angle
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.evaluation.metrics import steps_driven, tick_clearances
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls, center_at, pieces
from mfba_planner.simulation.recorded_motion import is_present

_JUMP_M = 1e-6  # between two pieces of a track: nearer is rounding
_INTERVALS = 64  # per tick; in 0.3 m of robot path the error is below 3 mm


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """Consecutive ticks in one mode; points_m ends where the next stretch starts."""

    mode: Mode
    ticks: tuple[Decision, ...]
    points_m: tuple[Point, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pass:
    """Closest pass: when robot and obstacle (number from 1) were closest; gap_m edge to edge."""

    number: int
    time_s: float
    robot: Pose2D
    center_m: Point
    gap_m: float


def is_finite(point: Point) -> bool:
    """Whether both coordinates are finite; those of a refused input may not be."""
    return math.isfinite(point[0]) and math.isfinite(point[1])


def span_s(episode: Episode) -> tuple[float, float]:
    """Times of the first and the last tick."""
    first, last = episode.ticks[0], episode.ticks[-1]
    return episode.time_s(first.stamp_ns), episode.time_s(last.stamp_ns)


def stretches(episode: Episode) -> list[Stretch]:
    """The run split where its mode changes, sorted by time."""
    found, start = [], 0
    for mode, group in groupby(episode.ticks, key=lambda tick: tick.mode):
        ticks = tuple(group)
        end = start + len(ticks)
        points = tuple(tick.pose.position for tick in episode.ticks[start : end + 1])
        found.append(Stretch(mode=mode, ticks=ticks, points_m=points))
        start = end
    return found


def encounter_ticks(episode: Episode) -> list[Decision]:
    """The first tick of each stretch of obstacle avoidance (Fig. 7 b)."""
    return [s.ticks[0] for s in stretches(episode) if s.mode is Mode.OBSTACLE_AVOIDANCE]


def closest_passes(episode: Episode) -> list[Pass]:
    """The closest pass of each obstacle that was ever there, by number; without the walls."""
    columns = zip(*tick_clearances(episode))
    passes = [
        _closest_within(episode, index, min(range(len(gaps)), key=gaps.__getitem__))
        for index, (_, gaps) in enumerate(zip(episode.scenario.obstacles, columns))
    ]
    scenario = episode.scenario
    return [p for p in passes if is_present(scenario.obstacles[p.number - 1], p.time_s)]


def _closest_within(episode: Episode, index: int, step: int) -> Pass:
    """Search between two ticks: uniform motion of robot and obstacle, except for bounces."""
    a, b = steps_driven(episode)[step]
    (ax, ay, yaw), (bx, by, later_yaw) = a.pose, b.pose
    turn = wrap_angle(later_yaw - yaw) if math.isfinite(later_yaw - yaw) else math.nan
    ta, tb = episode.time_s(a.stamp_ns), episode.time_s(b.stamp_ns)
    moments = (
        _pass(
            episode,
            index,
            ta + s * (tb - ta),
            Pose2D(ax + s * (bx - ax), ay + s * (by - ay), yaw + s * turn),
        )
        for s in np.linspace(0.0, 1.0, _INTERVALS + 1).tolist()
    )
    return min(moments, key=lambda moment: moment.gap_m)


def _pass(episode: Episode, index: int, time_s: float, robot: Pose2D) -> Pass:
    obstacle = episode.scenario.obstacles[index]
    center = center_at(obstacle, time_s, episode.scenario.walls)
    gap = episode.scenario.gap_m(robot, center, obstacle.radius_m)
    if not is_present(obstacle, time_s):
        gap = math.inf
    return Pass(number=index + 1, time_s=time_s, robot=robot, center_m=center, gap_m=gap)


def track(obstacle: Obstacle, walls: Walls | None, t0_s: float, t1_s: float) -> list[Point]:
    """Corner points of an obstacle's track from t0 to t1: both ends, every bounce and knot.

    Only while it is there; a point of NaN, where a line breaks, lies before each jump.
    """
    found: list[Point] = []
    for _, _, here, there in pieces(obstacle, t0_s, t1_s, walls):
        if not found:
            found.append(here)
        elif distance(found[-1], here) > _JUMP_M:
            found += [(math.nan, math.nan), here]
        found.append(there)
    return found
