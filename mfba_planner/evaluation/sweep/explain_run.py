# SPDX-License-Identifier: Apache-2.0
"""Explain a run in words: its first contact and the decisions before it, or its delay."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from ...core.geometry import Point, bearing, distance, wrap_angle
from ...core.planner_types import Decision
from ...perception.sensory_vector import bits_text
from ...simulation.episode import Episode, Outcome
from ...simulation.obstacle_motion import velocity_at
from ...simulation.robot_contact import RobotContact
from ..contacts_and_clearances import WALL, RunMotion
from ..metrics import Result, assess, within_range
from .single_run import CompletedRun

BEFORE = 6  # decisions shown


def _headline(completed: CompletedRun, result: Result, run_motion: RunMotion) -> str:
    """How the run ended, in one line."""
    episode = completed.episode
    if completed.fault:
        return f"the planner failed at {completed.fault_at}"
    if result.collisions:
        number, index = run_motion.first_contact_with, _index(episode, run_motion) or 0
        did = "ran into" if _moves(episode, index) else "stood still and was hit by"
        more = f"; {result.collisions} contacts in all" if result.collisions > 1 else ""
        touched = "a wall" if number == WALL else f"obstacle {number}"
        return f"the robot {did} {touched} at {run_motion.first_contact_s:.2f} s{more}"
    if result.outcome is Outcome.GOAL_REACHED:
        return f"goal reached without collision after {result.length_m:.3f} m"
    remaining_m = distance(episode.ticks[-1].pose.position, episode.scenario.goal_m)
    return f"{remaining_m:.2f} m left to the goal when time was up ({result.time_s:.1f} s)"


def contact_index(episode: Episode) -> int | None:
    """The tick (from 0) that starts the step of the first contact; None without one."""
    return _index(episode, assess(episode)[1])


def _index(episode: Episode, run_motion: RunMotion) -> int | None:
    times = [episode.time_s(tick.stamp_ns) for tick in episode.ticks]
    contact_s = run_motion.first_contact_s
    return times.index(contact_s) if contact_s in times else None


def explain(completed: CompletedRun) -> list[str]:
    """Lines of text that explain a run, the headline first."""
    episode = completed.episode
    result, run_motion = assess(episode)
    lines = [_headline(completed, result, run_motion)]
    if not episode.ticks:
        return lines
    index = _index(episode, run_motion)
    if index is not None:
        number = run_motion.first_contact_with
        contact = (
            _wall_contact(episode, index) if number == WALL else _contact(episode, index, number)
        )
        lines += [*contact, "", *_table(episode, index, number)]
    elif completed.fault:
        last = len(episode.ticks) - 1
        lines += ["", "the last decisions that were followed:", *_table(episode, last, 0)]
    elif episode.outcome is not Outcome.GOAL_REACHED:
        lines += [
            *_time_use(episode, result),
            *_passes(result, run_motion),
            "",
            *_table(episode, len(episode.ticks) - 1, 0),
        ]
    else:
        lines += _passes(result, run_motion)
    return lines


def _contact_step(episode: Episode, index: int, number: int) -> str:
    """The step of the first contact, with an obstacle or the walls."""
    time_s = episode.time_s(episode.ticks[index].stamp_ns)
    ttc = _time_to_contact(episode, index, number)
    gap = _gap(episode, index, number)
    at_tick = (
        "the obstacle was absent at the tick"
        if math.isnan(gap)
        else f"gap at the tick {gap:.3f} m"
    )
    return (
        f"contact: in the step after tick {index} ({time_s:.2f} s)"
        + (f", {ttc:.2f} s into it" if math.isfinite(ttc) and not _swings(episode, index) else "")
        + f"; {at_tick}"
    )


def _wall_contact(episode: Episode, index: int) -> Iterator[str]:
    """The first contact with a wall: time, motion, and the decision."""
    tick = episode.ticks[index]
    yield _contact_step(episode, index, WALL)
    yield f"motion: robot {math.hypot(*tick.velocity):.2f} m/s"
    yield f"decided: {tick.mode.value}, {tick.reason}{_bits(tick)}"


def _contact(episode: Episode, index: int, number: int) -> Iterator[str]:
    """The first contact: time, motion of both, and since when the obstacle was within SR."""
    tick = episode.ticks[index]
    time_s = episode.time_s(tick.stamp_ns)
    position, center = tick.pose.position, _center(episode, number, time_s)
    scenario = episode.scenario
    obstacle = velocity_at(scenario.obstacles[number - 1], time_s, scenario.walls)
    closing = _closing_speed(position, center, tick.velocity, obstacle)
    yield _contact_step(episode, index, number)
    yield (
        f"motion: robot {math.hypot(*tick.velocity):.2f} m/s, obstacle {math.hypot(*obstacle):.2f}"
        f" m/s, closing at {closing:.2f} m/s; "
        f"the obstacle is {_side(position, center, tick.velocity)}"
    )
    reach = episode.sensor.sensing_range_m
    first = index
    while first > 0 and number in within_range(episode, episode.ticks[first - 1]):
        first -= 1
    if number not in within_range(episode, tick):
        yield f"known: the obstacle was not within SR ({reach:g} m) at the decision before contact"
    else:
        ago = time_s - episode.time_s(episode.ticks[first].stamp_ns)
        yield (
            f"known: within SR ({reach:g} m) since tick {first}, {ago:.2f} s before; then the gap "
            f"was {_gap(episode, first, number):.3f} m"
        )
    others = [str(n) for n in within_range(episode, tick) if n != number]
    if others:
        yield f"also within SR: obstacle{'s' * (len(others) > 1)} {', '.join(others)}"
    yield f"decided: {tick.mode.value}, {tick.reason}{_bits(tick)}"


def _table(episode: Episode, index: int, number: int) -> Iterator[str]:
    """The decisions up to tick index; with an obstacle or WALL, gap and time to collision."""
    head = f"{'tick':>5} {'time':>7}  {'mode':<19}"
    yield head + (f" {'gap':>7} {'ttc':>7}" if number else "") + "  why"
    for k in range(max(0, index - BEFORE + 1), index + 1):
        tick = episode.ticks[k]
        line = f"{k:>5} {episode.time_s(tick.stamp_ns):>6.2f}s  {tick.mode.value:<19}"
        if number:
            ttc = _time_to_contact(episode, k, number)
            ttc_text = f"{ttc:>6.2f}s" if math.isfinite(ttc) else f"{'-':>7}"
            gap = _gap(episode, k, number)
            gap_text = f"{'absent':>7}" if math.isnan(gap) else f"{gap:>6.3f}m"
            line += f" {gap_text} {ttc_text}"
        yield f"{line}  {tick.reason}{_bits(tick)}"


def _time_use(episode: Episode, result: Result) -> Iterator[str]:
    """Share of each mode, and how near the robot came to the goal."""
    counts = Counter(tick.mode.value for tick in episode.ticks)
    shares = [f"{mode} {count / result.ticks:.0%}" for mode, count in counts.most_common()]
    yield f"modes: {', '.join(shares)}"
    goal = episode.scenario.goal_m
    nearest = min(distance(tick.pose.position, goal) for tick in episode.ticks)
    yield (
        f"path: {result.length_m:.2f} m travelled, never nearer to the goal than {nearest:.2f} m; "
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
    if number == WALL:
        segments, circles = episode.scenario.segments, episode.scenario.robot_circles(tick.pose)
        return min(float(segments.distances(*own).min()) - radius for own, radius in circles)
    center = _center(episode, number, episode.time_s(tick.stamp_ns))
    return episode.scenario.gap_m(
        tick.pose, center, episode.scenario.obstacles[number - 1].radius_m
    )


def _swings(episode: Episode, index: int) -> bool:
    """Whether the circles of a footprint move on curves in the step after a tick."""
    yaws = {tick.pose.yaw for tick in episode.ticks[index : index + 2]}
    return bool(episode.scenario.robot.footprint_m) and len(yaws) > 1


def _moves(episode: Episode, index: int) -> bool:
    return math.hypot(*episode.ticks[index].velocity) > 0.0


def _time_to_contact(episode: Episode, index: int, number: int) -> float:
    """Time to collision with an obstacle, or WALL, at the velocities of the step after a tick."""
    ticks = episode.ticks[index : index + 2]
    if len(ticks) < 2:
        return math.inf
    times_s = np.array([episode.time_s(tick.stamp_ns) for tick in ticks])
    poses = np.array([tick.pose for tick in ticks]).T
    steps = RobotContact(episode.scenario).steps(times_s, poses)
    if number == WALL and steps.walls is not None:
        return float(steps.walls.contact_s[0])
    return float(steps.contact_s[0, number - 1])


def _closing_speed(position: Point, center: Point, robot: Point, obstacle: Point) -> float:
    """Speed at which the distance shrinks, m/s."""
    away = distance(position, center) or 1.0
    ux, uy = (center[0] - position[0]) / away, (center[1] - position[1]) / away
    return (robot[0] - obstacle[0]) * ux + (robot[1] - obstacle[1]) * uy


def _side(position: Point, center: Point, velocity: Point) -> str:
    """Direction of the obstacle relative to the velocity."""
    if not any(velocity):
        return f"{math.degrees(bearing(position, center)):.0f} degrees from +x"
    turn = math.degrees(wrap_angle(bearing(position, center) - bearing((0.0, 0.0), velocity)))
    if abs(turn) <= 45.0:
        return "ahead"
    if abs(turn) >= 135.0:
        return "behind"
    return "to the left" if turn > 0.0 else "to the right"
