# SPDX-License-Identifier: Apache-2.0
"""Circles that move as closed-form functions of time, and the walls they bounce from."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter

from ..core.errors import ConfigError
from ..core.geometry import Point
from .recorded_motion import (
    ALWAYS,
    Knot,
    Piece,
    point_at,
    presence,
    top_speed,
    trajectory_pieces,
    velocity_along,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """From at_s (s) on, an obstacle moves at another speed (m/s) and heading (rad)."""

    at_s: float
    speed_mps: float
    heading_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """An obstacle waits until a robot is within a distance (m) of a point (m): `motion` from then.

    at_s (s) is when that was in one run; None: not yet, or never (triggered_motion.py).
    """

    within_m: float
    point_m: Point
    motion: Obstacle
    absent_before: bool = False
    at_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A row of Table 4 or 6: centre at t = 0 (m), radius (m), speed (m/s), heading (rad).

    turns change speed and heading, sorted by time; the paper has none. With a trajectory of knots
    (t, x, y) the obstacle follows that instead, and walls do not stop it (recorded_motion.py).
    With a trigger the other fields are its motion in one run, derived from trigger.motion.
    """

    center_m: Point
    radius_m: float
    speed_mps: float = 0.0
    heading_rad: float = 0.0
    turns: tuple[Turn, ...] = ()
    trajectory: tuple[Knot, ...] = ()
    loop: bool = False
    stays: bool = False
    appears_s: float = 0.0
    vanishes_s: float | None = None
    trigger: Trigger | None = None

    def __hash__(self) -> int:
        """Hash without the turns, for speed: stretches_of caches by obstacle."""
        return hash((self.center_m, self.radius_m, self.speed_mps, self.heading_rad))

    @property
    def top_speed_mps(self) -> float:
        """The highest speed of the whole motion in m/s."""
        if self.trajectory:
            return top_speed(self.trajectory)
        return max([self.speed_mps, *(turn.speed_mps for turn in self.turns)])

    @property
    def velocity(self) -> Point:
        """(vx, vy) in m/s until the first wall or turn."""
        return (
            self.speed_mps * math.cos(self.heading_rad),
            self.speed_mps * math.sin(self.heading_rad),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Walls:
    """A rectangle that obstacles bounce from, in metres; the robot is free to cross it."""

    lower_m: Point
    upper_m: Point

    def __post_init__(self) -> None:
        """Raise ConfigError unless there is room between them."""
        if not all(a < b for a, b in zip(self.lower_m, self.upper_m)):
            raise ConfigError(
                f"walls {list(self.lower_m)} to {list(self.upper_m)}: "
                "give lower_m below upper_m on both axes"
            )


@lru_cache(maxsize=4096)
def stretches_of(obstacle: Obstacle, walls: Walls | None) -> tuple[tuple[float, Obstacle], ...]:
    """The motion cut at its turns: start time (s), and an obstacle that starts then and there."""
    at_s, now = 0.0, replace(obstacle, turns=())
    stretches = [(at_s, now)]
    for turn in obstacle.turns:
        now = replace(
            now,
            center_m=center_at(now, turn.at_s - at_s, walls),
            speed_mps=turn.speed_mps,
            heading_rad=turn.heading_rad,
        )
        at_s = turn.at_s
        stretches.append((at_s, now))
    return tuple(stretches)


def _stretch(obstacle: Obstacle, t_s: float, walls: Walls | None) -> tuple[float, Obstacle]:
    """The stretch at time t; at the time of a turn, the later one."""
    number = bisect_right(obstacle.turns, t_s, key=attrgetter("at_s"))
    return stretches_of(obstacle, walls)[number]


def center_at(obstacle: Obstacle, t_s: float, walls: Walls | None = None) -> Point:
    """Centre at time t in metres, closed form: straight, or reflected by the walls.

    Of one that is absent it is where it would be.
    """
    if obstacle.trajectory:
        return point_at(obstacle, t_s)
    if obstacle.turns:
        since_s, obstacle = _stretch(obstacle, t_s, walls)
        t_s -= since_s
    x, y = (
        position + velocity * t_s
        for position, velocity in zip(obstacle.center_m, obstacle.velocity)
    )
    if walls is None:
        return (x, y)
    r = obstacle.radius_m
    return (
        _fold(x, walls.lower_m[0] + r, walls.upper_m[0] - r),
        _fold(y, walls.lower_m[1] + r, walls.upper_m[1] - r),
    )


def _fold(value: float, low: float, high: float) -> float:
    """Reflect an unbounded coordinate into [low, high] (a triangle wave)."""
    if low <= value <= high:
        return value
    length = high - low
    if length <= 0.0:
        return low
    offset = math.fmod(value - low, 2.0 * length)
    if offset < 0.0:
        offset += 2.0 * length
    return min(high, low + (offset if offset <= length else 2.0 * length - offset))


def velocity_at(obstacle: Obstacle, t_s: float, walls: Walls | None = None) -> Point:
    """(vx, vy) at time t in m/s; at a wall or a turn, the velocity after it."""
    if obstacle.trajectory:
        return velocity_along(obstacle, t_s)
    if obstacle.turns:
        since_s, obstacle = _stretch(obstacle, t_s, walls)
        t_s -= since_s
    if walls is None:
        return obstacle.velocity
    (x, y), (vx, vy), r = obstacle.center_m, obstacle.velocity, obstacle.radius_m
    (x0, y0), (x1, y1) = walls.lower_m, walls.upper_m
    return (
        _folded_speed(x, vx, t_s, x0 + r, x1 - r),
        _folded_speed(y, vy, t_s, y0 + r, y1 - r),
    )


def _folded_speed(position: float, speed: float, t_s: float, low: float, high: float) -> float:
    """The slope of _fold; every reflection changes its sign."""
    if not high > low:
        return 0.0
    reached = (position + speed * t_s - low) / (high - low)
    reflections = math.floor(reached) if speed >= 0.0 else math.ceil(reached) - 1
    return -speed if reflections % 2 else speed


def bounce_times(obstacle: Obstacle, t0_s: float, t1_s: float, walls: Walls | None) -> list[float]:
    """Times strictly within (t0, t1) at which the obstacle meets a wall or turns, ascending.

    Also those of its knots, and at which it appears or vanishes.
    """
    if obstacle.trajectory or presence(obstacle) != ALWAYS:
        found = {t for piece in pieces(obstacle, t0_s, t1_s, walls) for t in piece[:2]}
        return sorted(t for t in found if t0_s < t < t1_s)
    return _bounces(obstacle, t0_s, t1_s, walls)


def pieces(obstacle: Obstacle, t0_s: float, t1_s: float, walls: Walls | None) -> list[Piece]:
    """The obstacle's motion within [t0, t1] in pieces of uniform motion, while it is there."""
    begin, end = presence(obstacle)
    a, b = max(t0_s, begin), min(t1_s, end)
    if a > b:
        return []
    if obstacle.trajectory:
        return list(trajectory_pieces(obstacle, a, b))
    times = [a, *_bounces(obstacle, a, b, walls), b]
    points = [center_at(obstacle, t, walls) for t in times]
    return list(zip(times, times[1:], points, points[1:]))


def _bounces(obstacle: Obstacle, t0_s: float, t1_s: float, walls: Walls | None) -> list[float]:
    if obstacle.turns:
        return _kinks(obstacle, t0_s, t1_s, walls)
    if walls is None:
        return []
    times = set()
    for axis in (0, 1):
        position, velocity = obstacle.center_m[axis], obstacle.velocity[axis]
        low = walls.lower_m[axis] + obstacle.radius_m
        length = walls.upper_m[axis] - obstacle.radius_m - low
        if velocity == 0.0 or length <= 0.0:
            continue
        u0, u1 = sorted((position + velocity * t - low) / length for t in (t0_s, t1_s))
        for crossing in range(math.ceil(u0), math.floor(u1) + 1):
            t = (low + crossing * length - position) / velocity
            if t0_s < t < t1_s:
                times.add(t)
    return sorted(times)


def _kinks(obstacle: Obstacle, t0_s: float, t1_s: float, walls: Walls | None) -> list[float]:
    stretches = stretches_of(obstacle, walls)
    turn_times = [turn.at_s for turn in obstacle.turns]
    first, last = bisect_right(turn_times, t0_s), bisect_left(turn_times, t1_s)
    times = set(turn_times[first:last])
    # before t = 0 the first stretch is extended backwards
    for number in range(first, last + 1):
        since_s, plain = stretches[number]
        a = max(t0_s, since_s) if number else t0_s
        b = min(t1_s, turn_times[number]) if number < len(turn_times) else t1_s
        if a < b:
            bounces = _bounces(plain, a - since_s, b - since_s, walls)
            times.update(t for t in (since_s + t for t in bounces) if t0_s < t < t1_s)
    return sorted(times)
