# SPDX-License-Identifier: Apache-2.0
"""Obstacles that wait for a trigger: each is an ordinary obstacle before it, and after it.

A waiting obstacle stands at its centre, or is absent. Once triggered it is the obstacle of its
trigger's `motion`, that much later: closed form as every other, so contact, lidar and pictures
know nothing of triggers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from ..core.errors import ConfigError
from ..core.geometry import Point, distance
from .obstacle_motion import Obstacle, Trigger, Turn
from .recorded_motion import ALWAYS, presence

SHORTEST_PIECE_S = 1e-6  # between two knots: sums of times are rounded to 1e-10 s


def with_trigger(
    motion: Obstacle,
    within_m: float,
    point_m: Point | None = None,
    *,
    absent_before: bool = False,
) -> Obstacle:
    """The obstacle that waits until a robot is within_m of point_m; None: of its own centre."""
    return waiting(
        Trigger(
            within_m=within_m,
            point_m=motion.center_m if point_m is None else point_m,
            motion=motion,
            absent_before=absent_before,
        )
    )


def waiting(trigger: Trigger) -> Obstacle:
    """The obstacle before its trigger, and for ever without it."""
    motion, (x, y) = trigger.motion, trigger.motion.center_m
    return Obstacle(
        center_m=motion.center_m,
        radius_m=motion.radius_m,
        # A trajectory, as walls do not stop those.
        trajectory=((0.0, x, y), (1.0, x, y)) if motion.trajectory else (),
        stays=bool(motion.trajectory),
        appears_s=math.inf if trigger.absent_before else 0.0,
        trigger=replace(trigger, at_s=None),
    )


def triggered(trigger: Trigger, at_s: float) -> Obstacle:
    """The obstacle of a run in which it was triggered at this time."""
    motion, stands = trigger.motion, not trigger.absent_before
    plain = replace(
        motion,
        appears_s=0.0 if stands else at_s + motion.appears_s,
        vanishes_s=None if motion.vanishes_s is None else at_s + motion.vanishes_s,
        trigger=replace(trigger, at_s=at_s),
    )
    if motion.trajectory:
        knots = tuple((at_s + t, x, y) for t, x, y in motion.trajectory)
        plain = replace(plain, trajectory=knots)
        if not stands or motion.stays:
            return plain
        end_s = None if motion.loop else knots[-1][0]
        ends_s = [end for end in (plain.vanishes_s, end_s) if end is not None]
        return replace(plain, stays=True, vanishes_s=min(ends_s, default=None))
    turns = [replace(turn, at_s=at_s + turn.at_s) for turn in motion.turns]
    if at_s == 0.0:
        return plain
    begin = Turn(at_s=at_s, speed_mps=motion.speed_mps, heading_rad=motion.heading_rad)
    return replace(plain, speed_mps=0.0, heading_rad=0.0, turns=(begin, *turns))


def is_waiting(obstacle: Obstacle) -> bool:
    """Whether the obstacle has a trigger that no robot has reached."""
    return obstacle.trigger is not None and obstacle.trigger.at_s is None


def start_triggered(
    obstacles: tuple[Obstacle, ...], time_s: float, positions: Sequence[Point]
) -> tuple[Obstacle, ...]:
    """The obstacles, of which those start now whose trigger a robot (position, m) reaches."""
    return tuple(
        triggered(o.trigger, time_s) if o.trigger and _is_reached(o.trigger, positions) else o
        for o in obstacles
    )


def _is_reached(trigger: Trigger, positions: Sequence[Point]) -> bool:
    return trigger.at_s is None and any(
        distance(position, trigger.point_m) <= trigger.within_m for position in positions
    )


def at_start(obstacle: Obstacle, start_m: Point) -> Obstacle:
    """The obstacle at t = 0 of a run, with the robot at start_m."""
    if obstacle.trigger is None:
        return obstacle
    return start_triggered((waiting(obstacle.trigger),), 0.0, [start_m])[0]


def may_be_absent(obstacle: Obstacle) -> bool:
    """Whether the obstacle is absent at some time of some run."""
    trigger = obstacle.trigger
    if trigger is None:
        return presence(obstacle) != ALWAYS
    return trigger.absent_before or presence(trigger.motion) != ALWAYS


def check_trigger(number: int, trigger: Trigger) -> None:
    """Raise ConfigError for a trigger that makes no sense."""
    name, motion = f"obstacle {number}", trigger.motion
    if not trigger.absent_before:
        if motion.appears_s:
            raise ConfigError(
                f"{name} appears_s={motion.appears_s:g}: with a trigger it stands there before; "
                "leave appears_s out, or give absent_before: true"
            )
        if not (motion.top_speed_mps or may_be_absent(motion)):
            raise ConfigError(
                f"{name} trigger: nothing to start; give the obstacle a motion, or "
                "absent_before: true"
            )
    for (before, _, _), (after, _, _) in pairwise(motion.trajectory):
        if after - before < SHORTEST_PIECE_S:
            raise ConfigError(
                f"{name} trajectory: t={before:g} and t={after:g} are less than "
                f"{SHORTEST_PIECE_S:g} s apart; with a trigger, leave one of them out"
            )
