# SPDX-License-Identifier: Apache-2.0
"""Which contacts nobody could avoid who does not know the future.

    python bench/last_escape.py DIR                # scenario files; predictive, 360 beams of 3.5 m
    python bench/last_escape.py DIR --perception lidar-differential

Of every run with a contact, the first one: the last tick of the run from which a robot that drives
in any direction, at up to the same speed, and knows the motion of everything, could still have
kept clear for the horizon after the contact (reachable cells over time, every rounding in the
robot's favour). From that tick on everything is predicted to keep its velocity. If by that
prediction the way that the robot then took is clear, the contact comes from a change of motion
after the last escape: no planner that does not know the future could have seen it. Else the
contact was to be seen while an escape was left.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from crossings import Robot, add_robot_arguments, cross, robots_of
from scipy.ndimage import distance_transform_edt

from mfba_planner.core.geometry import Point
from mfba_planner.core.planner_types import NANO
from mfba_planner.evaluation.metrics import assess
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.scenario import Scenario

CELL_M, STEP_S = 0.02, 0.25
AFTER_S, BEFORE_S = 1.0, 5.0  # of the contact: kept clear until, and escapes looked for since
RATE_S = 1e-3  # for velocities by differences


def main(args: list[str] | None = None) -> int:
    """Print a line for each run with a contact, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("directory", type=Path)
    add_robot_arguments(parser, [1.0])
    parser.set_defaults(range_m=3.5)
    parser.add_argument(
        "--reaction", type=float, default=0.25, metavar="S", help="reaction time (default: 0.25)"
    )
    found = parser.parse_args(args)
    files = sorted(found.directory.glob("*.yaml"))
    for robot in robots_of(found):
        counts = {"lost": 0, "seen": 0}
        for number, file in enumerate(files):
            for line, is_lost in judged(load_scenario(str(file)), robot, number, found.reaction):
                counts["lost" if is_lost else "seen"] += 1
                print(f"{file.stem}: {line}", flush=True)
        print(
            f"{robot.label}: {len(files)} worlds, {sum(counts.values())} with contact; "
            f"{counts['lost']} by a change of motion too late to react, "
            f"{counts['seen']} to be seen while an escape was left"
        )
    return 0


def judged(
    scenario: Scenario, robot: Robot, seed: int, reaction_s: float
) -> Iterator[tuple[str, bool]]:
    """A line on the first contact, and whether nobody could have avoided it; nothing without."""
    episode = cross(scenario, robot, seed)
    result, motion = assess(episode)
    if not result.collisions:
        return
    contact_s = motion.first_contact_s
    last_s = last_escape_s(episode, robot.speed_mps, contact_s)
    with_ = motion.first_contact_with
    if last_s is None:
        yield f"contact with {with_} at {contact_s:.2f} s, no escape {BEFORE_S:g} s before", True
        return
    room_m = predicted_clearance_m(episode, last_s - reaction_s, contact_s)
    yield (
        (
            f"contact with {with_} at {contact_s:.2f} s, last escape {contact_s - last_s:.2f} s "
            f"before; clearance predicted {reaction_s:g} s earlier: {room_m:.2f} m"
        ),
        room_m > 0.0,
    )


def last_escape_s(episode: Episode, speed_mps: float, contact_s: float) -> float | None:
    """The time of the last tick from which somebody who knows the future keeps clear."""
    ticks = [(episode.time_s(t.stamp_ns), t.pose.position) for t in episode.ticks]
    until_s = contact_s + AFTER_S
    near = [(t, p) for t, p in ticks if contact_s - BEFORE_S <= t <= contact_s]
    low, high = -1, len(near)  # whoever can escape later on can escape now: bisection
    while high - low > 1:
        middle = (low + high) // 2
        if keeps_clear(episode.scenario, near[middle][1], speed_mps, near[middle][0], until_s):
            low = middle
        else:
            high = middle
    return near[low][0] if low >= 0 else None


def keeps_clear(
    scenario: Scenario, position: Point, speed_mps: float, from_s: float, until_s: float
) -> bool:
    """Whether a robot at a position may keep clear; every rounding is in its favour."""
    reach_m = speed_mps * (until_s - from_s) + 4.0 * CELL_M
    n = math.ceil(reach_m / CELL_M)
    axis = CELL_M * np.arange(-n, n + 1)
    xs, ys = position[0] + axis, position[1] + axis
    half = CELL_M / math.sqrt(2.0)
    reached = np.zeros((axis.size, axis.size), dtype=bool)
    reached[n, n] = True
    stride = (speed_mps * STEP_S + 2.0 * half) / CELL_M
    for k in range(1, math.ceil((until_s - from_s) / STEP_S) + 1):
        reached = distance_transform_edt(~reached) <= stride
        for (x, y), r in scenario.enlarged(from_s + k * STEP_S):
            if math.isfinite(x):
                inner = max(r - half, 0.0)
                reached &= (xs[:, None] - x) ** 2 + (ys - y) ** 2 >= inner * inner
        if not reached.any():
            return False
    return True


def predicted_clearance_m(episode: Episode, from_s: float, contact_s: float) -> float:
    """Least clearance along the robot's own way, if all keep their velocities of from_s."""
    now, soon = episode.scenario.enlarged(from_s), episode.scenario.enlarged(from_s + RATE_S)
    until_s = contact_s + episode.planner.tick_ns * NANO
    least = math.inf
    for tick in episode.ticks:
        ahead_s = episode.time_s(tick.stamp_ns) - from_s
        if not 0.0 <= ahead_s <= until_s - from_s + 1e-9:
            continue
        for ((x, y), r), ((u, v), _) in zip(now, soon):
            dx = x + (u - x) / RATE_S * ahead_s - tick.pose.x
            dy = y + (v - y) / RATE_S * ahead_s - tick.pose.y
            if math.isfinite(dx):
                least = min(least, math.hypot(dx, dy) - r)
    return least


if __name__ == "__main__":
    sys.exit(main())
