# SPDX-License-Identifier: Apache-2.0
"""Why a run ended as it did, in words: the first contact and what led to it, or the delay."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from ...core.geometry import Point, bearing, distance, wrap_angle
from ...core.types import Decision
from ...perception.sensory_vector import bits_text
from ...simulation.batched_motion import Motion
from ...simulation.episode import Episode, Outcome
from ...simulation.obstacle_motion import velocity_at
from ..contacts_and_clearances import RunMotion
from ..metrics import Result, assess, within_range
from .single_run import PlayedRun

BEFORE = 6  # decisions that are shown


def _headline(played: PlayedRun, result: Result, run_motion: RunMotion) -> str:
    """How it ended, in one line."""
    episode = played.episode
    if played.fault:
        return f"the planner failed at {played.fault_at}"
    if result.collisions:
        number, index = run_motion.first_contact_with, _index(episode, run_motion) or 0
        did = "ran into" if _moves(episode, index) else "stood still and was hit by"
        more = f"; {result.collisions} contacts in all" if result.collisions > 1 else ""
        return f"the robot {did} obstacle {number} at {run_motion.first_contact_s:.2f} s{more}"
    if result.outcome is Outcome.GOAL_REACHED:
        return f"goal reached without collision after {result.length_m:.3f} m"
    left = distance(episode.ticks[-1].pose.position, episode.scenario.goal_m)
    return f"{left:.2f} m left to the goal when time was up ({result.time_s:.1f} s)"


def contact_index(episode: Episode) -> int | None:
    """The tick (from 0) at which the step begins that leads to the first contact."""
    return _index(episode, assess(episode)[1])


def _index(episode: Episode, run_motion: RunMotion) -> int | None:
    times = [episode.time_s(tick.stamp_ns) for tick in episode.ticks]
    contact_s = run_motion.first_contact_s
    return times.index(contact_s) if contact_s in times else None


def explain(played: PlayedRun) -> list[str]:
    """Lines that tell what happened and why, the headline first."""
    episode = played.episode
    result, run_motion = assess(episode)
    lines = [_headline(played, result, run_motion)]
    if not episode.ticks:
        return lines
    index = _index(episode, run_motion)
    if index is not None:
        number = run_motion.first_contact_with
        lines += [*_contact(episode, index, number), "", *_table(episode, index, number)]
    elif played.fault:
        last = len(episode.ticks) - 1
        lines += ["", "the last decisions that were followed:", *_table(episode, last, 0)]
    elif episode.outcome is not Outcome.GOAL_REACHED:
        lines += [
            *_held_up(episode, result),
            *_passes(result, run_motion),
            "",
            *_table(episode, len(episode.ticks) - 1, 0),
        ]
    else:
        lines += _passes(result, run_motion)
    return lines


def _contact(episode: Episode, index: int, number: int) -> Iterator[str]:
    """The moment of the first contact, who moved how, and since when it could be seen."""
    tick = episode.ticks[index]
    time_s = episode.time_s(tick.stamp_ns)
    step = _step(episode, index, number)
    here, there = tick.pose.position, _center(episode, number, time_s)
    scenario = episode.scenario
    obstacle = velocity_at(scenario.obstacles[number - 1], time_s, scenario.walls)
    closing = _closing(here, there, tick.velocity, obstacle)
    yield (
        f"contact: in the step after tick {index} ({time_s:.2f} s)"
        + (f", {step:.2f} s into it" if math.isfinite(step) else "")
        + f"; gap at the tick {_gap(episode, index, number):.3f} m"
    )
    yield (
        f"motion: robot {math.hypot(*tick.velocity):.2f} m/s, obstacle {math.hypot(*obstacle):.2f}"
        f" m/s, closing at {closing:.2f} m/s; the obstacle is {_side(here, there, tick.velocity)}"
    )
    reach = episode.sensor.sensing_range_m
    seen = index
    while seen > 0 and number in within_range(episode, episode.ticks[seen - 1]):
        seen -= 1
    if number not in within_range(episode, tick):
        yield f"known: the obstacle was not within SR ({reach:g} m) at the decision before contact"
    else:
        ago = time_s - episode.time_s(episode.ticks[seen].stamp_ns)
        yield (
            f"known: within SR ({reach:g} m) since tick {seen}, {ago:.2f} s before; then the gap "
            f"was {_gap(episode, seen, number):.3f} m"
        )
    others = [str(n) for n in within_range(episode, tick) if n != number]
    if others:
        yield f"also within SR: obstacle{'s' * (len(others) > 1)} {', '.join(others)}"
    yield f"decided: {tick.mode.value}, {tick.reason}{_bits(tick)}"


def _table(episode: Episode, index: int, number: int) -> Iterator[str]:
    """The decisions up to tick index; with an obstacle, its gap and the time to collision."""
    head = f"{'tick':>5} {'time':>7}  {'mode':<19}"
    yield head + (f" {'gap':>7} {'ttc':>7}" if number else "") + "  why"
    for k in range(max(0, index - BEFORE + 1), index + 1):
        tick = episode.ticks[k]
        line = f"{k:>5} {episode.time_s(tick.stamp_ns):>6.2f}s  {tick.mode.value:<19}"
        if number:
            ttc = _step(episode, k, number)
            told = f"{ttc:>6.2f}s" if math.isfinite(ttc) else f"{'-':>7}"
            line += f" {_gap(episode, k, number):>6.3f}m {told}"
        yield f"{line}  {tick.reason}{_bits(tick)}"


def _held_up(episode: Episode, result: Result) -> Iterator[str]:
    """What it did with its time."""
    counts = Counter(tick.mode.value for tick in episode.ticks)
    shares = [f"{mode} {count / result.ticks:.0%}" for mode, count in counts.most_common()]
    yield f"modes: {', '.join(shares)}"
    goal = episode.scenario.goal_m
    nearest = min(distance(tick.pose.position, goal) for tick in episode.ticks)
    yield (
        f"way: {result.length_m:.2f} m travelled, never nearer to the goal than {nearest:.2f} m; "
        f"{len(result.encounters)} obstacles met"
    )


def _passes(result: Result, run_motion: RunMotion) -> Iterator[str]:
    if math.isfinite(result.min_clearance_m):
        ttc = f"{run_motion.min_ttc_s:.2f} s" if math.isfinite(run_motion.min_ttc_s) else "never"
        yield (
            f"near: smallest gap {result.min_clearance_m:.3f} m, on average "
            f"{run_motion.mean_clearance_m:.3f} m; smallest time to collision {ttc}"
        )


def _bits(tick: Decision) -> str:
    return f" (Vs {bits_text(tick.vs)}, Vg {bits_text(tick.vg)})" if tick.vs else ""


def _center(episode: Episode, number: int, time_s: float) -> Point:
    return episode.scenario.centers(time_s)[number - 1]


def _gap(episode: Episode, index: int, number: int) -> float:
    tick = episode.ticks[index]
    center, radius = episode.scenario.enlarged(episode.time_s(tick.stamp_ns))[number - 1]
    return distance(tick.pose.position, center) - radius


def _moves(episode: Episode, index: int) -> bool:
    return math.hypot(*episode.ticks[index].velocity) > 0.0


def _step(episode: Episode, index: int, number: int) -> float:
    """Time to collision with one obstacle, going on as in the step after a tick."""
    ticks = episode.ticks[index : index + 2]
    if len(ticks) < 2:
        return math.inf
    times_s = np.array([episode.time_s(tick.stamp_ns) for tick in ticks])
    positions = np.array([tick.pose.position for tick in ticks]).T
    steps = Motion(episode.scenario).steps(times_s, positions)
    return float(steps.contact_s[0, number - 1])


def _closing(here: Point, there: Point, robot: Point, obstacle: Point) -> float:
    """Speed at which the distance shrinks, m/s."""
    away = distance(here, there) or 1.0
    ux, uy = (there[0] - here[0]) / away, (there[1] - here[1]) / away
    return (robot[0] - obstacle[0]) * ux + (robot[1] - obstacle[1]) * uy


def _side(here: Point, there: Point, velocity: Point) -> str:
    """Where it is as seen along the way."""
    if not any(velocity):
        return f"{math.degrees(bearing(here, there)):.0f} degrees from +x"
    turn = math.degrees(wrap_angle(bearing(here, there) - bearing((0.0, 0.0), velocity)))
    if abs(turn) <= 45.0:
        return "ahead"
    if abs(turn) >= 135.0:
        return "behind"
    return "to the left" if turn > 0.0 else "to the right"
