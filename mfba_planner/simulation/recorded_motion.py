# SPDX-License-Identifier: Apache-2.0
"""Obstacles along recorded trajectories, and obstacles that appear and vanish: closed form.

A trajectory is straight and uniform between two knots, and exact at each. Its obstacle is there
from its first to its last knot; with `loop` it begins anew then, with `stays` it stands at the
first one before, at the last one afterwards. appears_s and vanishes_s shorten that for any
obstacle. While it is absent nothing touches or sees it. loop and stays together, standing before
the first lap, is only of an obstacle that waited for a trigger.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from functools import lru_cache
from typing import Protocol

from ..core.errors import ConfigError
from ..core.geometry import Point

Knot = tuple[float, float, float]  # stamp (s), x, y (m)
# Uniform motion while the obstacle is there: start, end (s), centre at both (m).
Piece = tuple[float, float, Point, Point]


class Timed(Protocol):
    """What an obstacle says of when it is there, and of its trajectory."""

    @property
    def trajectory(self) -> tuple[Knot, ...]:
        """The knots; (): it does not follow a trajectory."""

    @property
    def loop(self) -> bool:
        """Whether the trajectory begins anew at its end."""

    @property
    def stays(self) -> bool:
        """Whether it stands at the ends of the trajectory before and after."""

    @property
    def appears_s(self) -> float:
        """From when it is there, s."""

    @property
    def vanishes_s(self) -> float | None:
        """Until when it is there, s."""


class Moving(Timed, Protocol):
    """The rest of an obstacle, for check_motion."""

    @property
    def center_m(self) -> Point:
        """Centre at t = 0, m; with a trajectory its first point."""

    @property
    def speed_mps(self) -> float:
        """Speed at t = 0, m/s."""

    @property
    def turns(self) -> tuple[object, ...]:
        """Changes of speed and heading."""


MOST_KNOTS = 20_000
SHORTEST_LOOP_S = 0.1
ALWAYS = (-math.inf, math.inf)


def presence(obstacle: Timed) -> tuple[float, float]:
    """From when to when the obstacle is there, s; both ends belong to it."""
    begin = obstacle.appears_s if obstacle.appears_s > 0.0 else -math.inf
    end = math.inf if obstacle.vanishes_s is None else obstacle.vanishes_s
    if obstacle.trajectory and not obstacle.stays:
        begin = max(begin, obstacle.trajectory[0][0])
        end = end if obstacle.loop else min(end, obstacle.trajectory[-1][0])
    return begin, end


def is_present(obstacle: Timed, t_s: float) -> bool:
    """Whether the obstacle is there at time t."""
    begin, end = presence(obstacle)
    return begin <= t_s <= end


def lap(trajectory: tuple[Knot, ...], t_s: float) -> int:
    """How often a trajectory that loops has begun anew before time t."""
    first, last = trajectory[0][0], trajectory[-1][0]
    return math.floor((t_s - first) / (last - first))


def lap_time(trajectory: tuple[Knot, ...], t_s: float) -> float:
    """Time t of a trajectory that loops, brought into its first lap."""
    first, last = trajectory[0][0], trajectory[-1][0]
    return min(last, max(first, t_s - lap(trajectory, t_s) * (last - first)))


def _time_within(obstacle: Timed, t_s: float) -> float:
    """Time t, or while an obstacle loops, t brought into the first lap."""
    if not obstacle.loop or (obstacle.stays and t_s < obstacle.trajectory[0][0]):
        return t_s
    return lap_time(obstacle.trajectory, t_s)


@lru_cache(maxsize=4096)
def _stamps(trajectory: tuple[Knot, ...]) -> tuple[float, ...]:
    return tuple(stamp for stamp, _, _ in trajectory)


def between(trajectory: tuple[Knot, ...], t_s: float) -> Point:
    """The point at time t of one lap; before and after it, that of the nearest end."""
    k = bisect_right(_stamps(trajectory), t_s) - 1
    if k < 0:
        return trajectory[0][1:]
    if k >= len(trajectory) - 1:
        return trajectory[-1][1:]
    t0, x, y = trajectory[k]
    vx, vy = slope(trajectory, k)
    return (x + vx * (t_s - t0), y + vy * (t_s - t0))


def slope(trajectory: tuple[Knot, ...], k: int) -> Point:
    """(vx, vy) in m/s between knots k and k + 1."""
    (t0, x0, y0), (t1, x1, y1) = trajectory[k], trajectory[k + 1]
    return ((x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0))


def point_at(obstacle: Timed, t_s: float) -> Point:
    """Centre at time t of an obstacle with a trajectory, present or not."""
    return between(obstacle.trajectory, _time_within(obstacle, t_s))


def velocity_along(obstacle: Timed, t_s: float) -> Point:
    """(vx, vy) at time t in m/s of an obstacle with a trajectory; at a knot, that after it."""
    trajectory, t = obstacle.trajectory, _time_within(obstacle, t_s)
    k = bisect_right(_stamps(trajectory), t) - 1
    return slope(trajectory, k) if 0 <= k < len(trajectory) - 1 else (0.0, 0.0)


def top_speed(trajectory: tuple[Knot, ...]) -> float:
    """The highest speed between two knots, m/s."""
    return max(math.hypot(*slope(trajectory, k)) for k in range(len(trajectory) - 1))


def trajectory_pieces(obstacle: Timed, t0_s: float, t1_s: float) -> Iterator[Piece]:
    """The pieces of an obstacle with a trajectory within [t0, t1], its presence left aside."""
    trajectory = obstacle.trajectory
    first, last = trajectory[0][0], trajectory[-1][0]
    if not obstacle.loop:
        yield from _lap_pieces(trajectory, 0.0, t0_s, t1_s)
        return
    if obstacle.stays and t0_s < first:
        yield from _lap_pieces(trajectory, 0.0, t0_s, min(t1_s, first))
        if t1_s <= first:
            return
    begin = max(t0_s, first)
    for number in range(lap(trajectory, begin), lap(trajectory, t1_s) + 1):
        offset_s = number * (last - first)
        # A lap has its own knots only: it does not stand before or after them.
        low, high = max(begin, first + offset_s), min(t1_s, last + offset_s)
        if low < high or (low == high and t0_s == t1_s):
            yield from _lap_pieces(trajectory, offset_s, low, high)


def _lap_pieces(
    trajectory: tuple[Knot, ...], offset_s: float, t0_s: float, t1_s: float
) -> Iterator[Piece]:
    """Pieces of one lap that is offset_s late; standing before its first and after its last."""
    stamps = _stamps(trajectory)
    first = bisect_right(stamps, t0_s - offset_s)
    times = [t0_s]
    for k in range(first, len(stamps)):
        stamp = stamps[k] + offset_s
        if stamp >= t1_s:
            break
        if stamp > t0_s:
            times.append(stamp)
    times.append(t1_s)
    points = [between(trajectory, t - offset_s) for t in times]
    yield from zip(times, times[1:], points, points[1:])


def check_motion(number: int, obstacle: Moving) -> None:
    """Raise ConfigError for a trajectory or a presence that makes no sense."""
    name = f"obstacle {number}"
    if obstacle.vanishes_s is not None and obstacle.vanishes_s <= obstacle.appears_s:
        raise ConfigError(
            f"{name} vanishes_s={obstacle.vanishes_s:g}: not after appears_s="
            f"{obstacle.appears_s:g}; raise it"
        )
    if not obstacle.trajectory:
        for key in ("loop", "stays"):
            if getattr(obstacle, key):
                raise ConfigError(f"{name} {key}: without a trajectory; give one, or leave it out")
        return
    _check_knots(name, obstacle.trajectory)
    if obstacle.speed_mps or obstacle.turns:
        raise ConfigError(f"{name} trajectory: with speed_mps or turns as well; leave those out")
    if obstacle.loop and obstacle.stays:
        raise ConfigError(f"{name} loop: with stays as well; leave one of them out")
    first, last = obstacle.trajectory[0], obstacle.trajectory[-1]
    # 0.3 - 0.2 is a little less than 0.1.
    if obstacle.loop and last[0] - first[0] < SHORTEST_LOOP_S * (1.0 - 1e-9):
        raise ConfigError(
            f"{name} loop: a lap of {last[0] - first[0]:g} s is shorter than {SHORTEST_LOOP_S:g} "
            "s; give a longer trajectory"
        )
    if obstacle.center_m != first[1:]:
        raise ConfigError(
            f"{name} center_m={list(obstacle.center_m)}: not the first point of its trajectory; "
            "leave center_m out"
        )


def _check_knots(name: str, trajectory: tuple[Knot, ...]) -> None:
    if len(trajectory) < 2:
        raise ConfigError(f"{name} trajectory: a single point; give two or more [t, x, y]")
    if len(trajectory) > MOST_KNOTS:
        raise ConfigError(
            f"{name} trajectory: {len(trajectory)} points; give at most {MOST_KNOTS}"
        )
    for before, after in zip(trajectory, trajectory[1:]):
        if not before[0] < after[0]:
            raise ConfigError(
                f"{name} trajectory: t={after[0]:g} does not come after {before[0]:g}; sort the "
                "points by time, one for each"
            )
