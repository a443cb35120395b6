# SPDX-License-Identifier: Apache-2.0
"""Metrics of a run from its Episode: length, time, clearance, collisions, success."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest

import numpy as np

from ..core.geometry import Pose2D, distance
from ..core.planner_types import NANO, Decision, Mode
from ..planning.odometry_jump import is_odometry_jump
from ..simulation.batched_motion import Array, StepClearances
from ..simulation.episode import Episode, Outcome
from ..simulation.robot_contact import RobotContact
from .contacts_and_clearances import DrivenPath, ObstaclePasses, RunMotion

BLOCK = 512  # ticks


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """Figures of one run; lengths in metres, times in simulated seconds."""

    outcome: Outcome
    success: bool
    length_m: float
    time_s: float
    ticks: int
    fitness: float
    min_clearance_m: float
    collisions: int
    mode_switches: int
    avoidance_ticks: int
    blocked_ticks: int
    stopped_ticks: int
    encounters: tuple[int, ...]


def evaluate(episode: Episode) -> Result:
    """Compute the Result of an episode.

    length_m is the sum of eq. 1 over all steps and fitness its reciprocal, as Tables 5 and 7
    use it (no epsilon; inf for a robot that never moved). min_clearance_m is the smallest
    gap between the robot's edge and those of obstacles and walls, continuous in time, negative in
    contact (inf without any); collisions counts contacts, one per obstacle and unbroken run of
    ticks; all walls count as one obstacle.
    encounters lists the obstacles (from 1) whose enlarged edge came within SR at a tick, sorted by
    time. mode_switches counts every change of mode, including that to ARRIVED. success: goal
    reached without collision.
    """
    return assess(episode)[0]


def run_motion(episode: Episode) -> RunMotion:
    """Compute the RunMotion of an episode."""
    return assess(episode)[1]


def assess(episode: Episode) -> tuple[Result, RunMotion]:
    """evaluate() and run_motion() in one pass."""
    accumulator = MetricsAccumulator(episode)
    for tick, pose in zip_longest(episode.ticks, episode.truth):
        accumulator.add(tick, pose)
    return accumulator.result(episode.outcome), accumulator.run_motion()


class MetricsAccumulator:
    """The figures of assess(), added tick by tick; holds at most BLOCK ticks.

    Obstacles are evaluated one block at a time, for speed.
    """

    def __init__(self, run: Episode) -> None:
        """Start before the first tick. Uses scenario and parameters of run, not its ticks."""
        self._run = run
        self._contact = RobotContact(run.scenario)
        self._block: list[Decision] = []
        self._evaluated = 0  # ticks of the block already evaluated: 1 or 0
        self._first: Decision | None = None
        # summed by fsum at the end: sum() rounds differently before and after Python 3.12
        self._steps_m = array("d")
        self._modes: Counter[Mode] = Counter()
        self._switches = 0
        self._passes = ObstaclePasses()
        self._path = DrivenPath()
        self._encounters: dict[int, None] = {}

    def add(self, tick: Decision, pose: Pose2D | None = None) -> None:
        """Add the next tick, with the true pose where it differs from the decision's."""
        if pose is not None:
            tick = replace(tick, pose=pose)
        if self._first is None:
            self._first = tick
        else:
            self._switches += self._block[-1].mode is not tick.mode
        self._modes[tick.mode] += 1
        self._block.append(tick)
        if len(self._block) == BLOCK:
            self._evaluate_block()

    def result(self, outcome: Outcome) -> Result:
        """The Result of the ticks so far; for a single tick, that of a robot at rest."""
        passes = self._all_passes()
        first, last = self._first, self._block[-1] if self._block else None
        length = math.fsum(self._steps_m)
        collisions = passes.hits_moving + passes.hits_standing
        return Result(
            outcome=outcome,
            success=outcome is Outcome.GOAL_REACHED and collisions == 0,
            length_m=length,
            time_s=(last.stamp_ns - first.stamp_ns) * NANO if first and last else 0.0,
            ticks=self._modes.total(),
            fitness=1.0 / length if length > 0.0 else math.inf,
            min_clearance_m=passes.min_gap_m,
            collisions=collisions,
            mode_switches=self._switches,
            avoidance_ticks=self._modes[Mode.OBSTACLE_AVOIDANCE],
            blocked_ticks=self._modes[Mode.BLOCKED],
            stopped_ticks=self._modes[Mode.STOPPED],
            encounters=tuple(number + 1 for number in self._encounters),
        )

    def run_motion(self) -> RunMotion:
        """The RunMotion of the ticks so far."""
        passes = self._all_passes()
        tick_s = self._run.planner.tick_ns * NANO
        length, turning = math.fsum(self._steps_m), self._path.turning_rad
        return RunMotion(
            hits_moving=passes.hits_moving,
            hits_standing=passes.hits_standing,
            first_contact_with=passes.first_contact_with,
            first_contact_s=passes.first_contact_s,
            mean_clearance_m=passes.mean_gap_m,
            min_ttc_s=passes.min_ttc_s,
            turning_rad=turning,
            curvature_radpm=turning / length if length > 0.0 else 0.0,
            heading_changes=self._path.heading_changes,
            jerk_mps3=self._path.jerk(tick_s),
            avoidance_s=self._modes[Mode.OBSTACLE_AVOIDANCE] * tick_s,
        )

    def _all_passes(self) -> ObstaclePasses:
        """The passes so far; for a single tick, those of a robot at rest."""
        self._evaluate_block()
        if self._modes.total() != 1:
            return self._passes
        at_rest = ObstaclePasses()
        times_s, poses = self._times_and_poses([self._block[0]] * 2)
        at_rest.add(self._contact.steps(times_s, poses), times_s, np.zeros(1))
        return at_rest

    def _evaluate_block(self) -> None:
        """Evaluate the ticks added since the last call; keep the last one."""
        ticks = self._block
        if len(ticks) == self._evaluated:
            return
        driven = np.array([not is_odometry_jump(tick.reason) for tick in ticks[1:]], dtype=bool)
        self._extend_path(ticks[self._evaluated :])
        times_s, poses = self._times_and_poses(ticks)
        steps = self._contact.steps(times_s, poses)
        near = steps.distance_m - self._contact.disc.radius_m <= self._run.sensor.sensing_range_m
        self._encounters.update(dict.fromkeys(np.argwhere(near)[:, 1].tolist()))
        dx, dy = np.diff(poses[:2])
        moved_m = np.sqrt(dx * dx + dy * dy)
        starts_s = times_s[:-1]
        if not driven.all():  # a kidnapping adds no length and no contact
            starts_s, moved_m = starts_s[driven], moved_m[driven]
            walls = steps.walls and steps.walls.select(driven)
            steps = StepClearances(
                steps.gap_m[driven], steps.contact_s[driven], steps.distance_m, walls
            )
        self._steps_m.extend(moved_m.tolist())
        self._passes.add(steps, starts_s, moved_m)
        self._block, self._evaluated = [ticks[-1]], 1

    def _extend_path(self, ticks: list[Decision]) -> None:
        """Add ticks to the path; a new path starts where the robot was kidnapped."""
        first = 0
        for number, tick in enumerate(ticks):
            if is_odometry_jump(tick.reason):
                if number > first:
                    self._path.add([tick.pose.position for tick in ticks[first:number]])
                self._path.interrupt()
                first = number
        self._path.add([tick.pose.position for tick in ticks[first:]])

    def _times_and_poses(self, ticks: list[Decision]) -> tuple[Array, Array]:
        """Times (K,) and poses (3, K) of ticks."""
        times_s = [self._run.time_s(tick.stamp_ns) for tick in ticks]
        return np.array(times_s), np.array([tick.pose for tick in ticks]).T


def steps_driven(episode: Episode) -> list[tuple[Decision, Decision]]:
    """Pairs of successive ticks with true poses; a single tick is paired with itself.

    A kidnapped robot counts as at rest until the tick that detects the odometry jump.
    """
    ticks = [
        tick if pose is None else replace(tick, pose=pose)
        for tick, pose in zip_longest(episode.ticks, episode.truth)
    ]
    pairs = pairwise(ticks if len(ticks) > 1 else ticks * 2)
    return [(a, replace(b, pose=a.pose) if is_odometry_jump(b.reason) else b) for a, b in pairs]


def tick_clearances(episode: Episode) -> list[list[float]]:
    """Smallest gap (m) to each obstacle during each step; ticks - 1 rows (one if no step).

    In a scenario with wall segments the last column is the gap to the nearest of them.
    """
    steps, contact = steps_driven(episode), RobotContact(episode.scenario)
    moments = [*(a for a, _ in steps), steps[-1][1]]
    times_s = np.array([episode.time_s(tick.stamp_ns) for tick in moments])
    poses = np.array([tick.pose for tick in moments]).T
    gaps_m = contact.steps(times_s, poses).gaps_with_walls_m
    for k, (_, b) in enumerate(steps):
        if is_odometry_jump(b.reason):  # the next step starts elsewhere
            at_rest = poses[:, [k, k]]
            gaps_m[k] = contact.steps(times_s[k : k + 2], at_rest).gaps_with_walls_m[0]
    return [[float(gap) for gap in row] for row in gaps_m]


def within_range(episode: Episode, tick: Decision) -> tuple[int, ...]:
    """Obstacles (from 1) whose enlarged edge is within SR at a tick."""
    circles = episode.scenario.enlarged(episode.time_s(tick.stamp_ns))
    return tuple(
        number
        for number, (center, radius) in enumerate(circles, start=1)
        if distance(tick.pose.position, center) - radius <= episode.sensor.sensing_range_m
    )
