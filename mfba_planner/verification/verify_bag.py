# SPDX-License-Identifier: Apache-2.0
"""Decide again on what a bag recorded, and hold every recorded answer against it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.geometry import Point, Pose2D
from ..core.types import Decision, Mode, Observation, observe
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sensory_vector import sense_circles, sensory_vector
from ..planning.planner_factory import make_planner
from ..recording.bag_reader import BagReader
from ..recording.file_integrity import check_data
from ..recording.from_messages import (
    body_velocity,
    decision_value,
    laser_scan,
    obstacle_centers,
    or_refused,
    robot_pose,
    sector_ranges,
    velocity,
)
from ..recording.from_messages import decision as read_decision
from ..recording.robot_topics import NO_NAMESPACE, chosen
from ..recording.run_setup import Setup, read_setup, read_setups
from ..simulation.decision_digest import digest
from .compare_decisions import Divergence, first_divergence
from .tick_records import (
    DECISION,
    OBSTACLES,
    ODOM,
    SCAN,
    SECTORS,
    STEP,
    TWIST,
    VECTOR,
    Tick,
    TickRecords,
    collect,
    gather,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What a check of a bag has found; identical when nothing speaks against it.

    divergence is the first recorded decision that is not what the planner decides.
    """

    setup: Setup
    recorded: tuple[Decision, ...]
    decided: tuple[Decision, ...]
    divergence: Divergence | None
    faults: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def is_identical(self) -> bool:
        """Whether all decisions are equal and nothing else in the bag contradicts them."""
        return not self.faults and self.divergence is None

    @property
    def digest(self) -> str:
        """Decision digest of what was recorded."""
        return digest(self.recorded)


def verify(path: str | Path) -> Report:
    """Check a bag of one robot. Raises BagError for one that cannot be checked at all."""
    with BagReader(path) as reader:
        read_setup(reader)
    return verify_each(path)[NO_NAMESPACE]


def verify_each(path: str | Path, robots: Sequence[str] = ()) -> dict[str, Report]:
    """Check a bag of ours: every robot's decisions, or those of the robots named.

    Raises BagError for a bag that cannot be checked at all, and for a robot that is not there.
    """
    with BagReader(path) as reader:
        for file in reader.file_paths:
            check_data(file)
        setups = read_setups(reader).by_robot
        names = chosen(reader.path, list(setups), robots)
        messages = collect(reader, names)
    found = {}
    for name in names:
        setup = setups[name]
        tick_ns = setup.planner.tick_ns if setup.lockstep else None
        tick_records = gather(messages.pop(name), tick_ns, setup.odom_frame, inputs=_inputs(setup))
        found[name] = _check(setup, tick_records)
    return found


def _check(setup: Setup, tick_records: TickRecords) -> Report:
    faults, notes = [*tick_records.faults], [*tick_records.notes]
    read_odom = partial(robot_pose, frame=setup.odom_frame)
    read_sectors = partial(sector_ranges, frame=setup.odom_frame)
    planner = make_planner(setup.planner, setup.sensor, setup.seed)
    goals = deque(tick_records.goals)
    goal: Point | None = None
    pose = Pose2D(0.0, 0.0)
    recorded, decided = [], []
    unchecked, goal_id = 0, ""
    for tick in tick_records.ticks:
        if DECISION not in tick.said or tick.stamp_ns in tick_records.left_out:
            continue  # named by evidence where it must not be
        if SECTORS not in tick.said:
            if not setup.lockstep:  # there evidence names it
                faults.append(f"stamp {tick.stamp_ns} ns: no {SECTORS}")
            continue
        ranges = or_refused(read_sectors, tick.said[SECTORS])
        try:
            was = read_decision(tick.said[DECISION], () if isinstance(ranges, str) else ranges)
        except InputError as error:
            faults.append(f"stamp {tick.stamp_ns} ns: {error}")
            continue
        before, goal_id = goal_id, decision_value(tick.said[DECISION], "goal_id")
        if goal_id != before:
            planner.reset()  # ordered anew, be it to the same goal, or cancelled
            goal = goal if was.goal else None
        if was.goal != goal:
            while goals and goal != was.goal:
                goal = goals.popleft()
            if goal != was.goal:
                what = (
                    "without the goal that was known (a planner that was restarted?)"
                    if was.goal is None
                    else "for a goal that no /goal_pose gave"
                )
                faults.append(f"stamp {tick.stamp_ns} ns: decided {what}")
                goal = was.goal
        seen: Any = was.pose
        if setup.lockstep:
            seen = or_refused(read_odom, tick.said[ODOM]) if ODOM in tick.said else pose
        elif was.mode is Mode.STOPPED:
            unchecked += 1  # what was refused or how old it was is not recorded
            continue
        observation = observe(tick.stamp_ns, seen, ranges, goal, pose)
        pose = observation.pose
        recorded.append(was)
        decided.append(planner.plan(_with_scan(setup, tick, observation)))
        faults += _contradictions(setup, tick, was)
    if unchecked:
        notes.append(f"{unchecked} stops of a run in real time cannot be decided again")
    return Report(
        setup=setup,
        recorded=tuple(recorded),
        decided=tuple(decided),
        divergence=first_divergence(recorded, decided),
        faults=tuple(faults),
        notes=tuple(notes),
    )


def _inputs(setup: Setup) -> list[str]:
    """What a decision is decided again on, of its own stamp."""
    return [
        SECTORS,
        *([ODOM] if setup.lockstep else []),  # otherwise the decision says where it was
        *([SCAN] if setup.planner.tracks_scan else []),
    ]


def _with_scan(setup: Setup, tick: Tick, obs: Observation) -> Observation:
    """What a planner that tracks scans was shown besides."""
    if not setup.planner.tracks_scan or obs.refused or SCAN not in tick.said:
        return obs
    yaw = obs.pose.yaw + setup.scenario.robot.lidar.yaw_rad
    return replace(obs, scan=aligned(laser_scan(tick.said[SCAN]), yaw))


def _contradictions(setup: Setup, tick: Tick, was: Decision) -> list[str]:
    """What other topics say about the same tick, where it is not what the decision says."""
    found = []
    for topic, is_so in (
        (SECTORS, _intensities_agree),
        (VECTOR, _vector_agrees),
        (STEP, _step_agrees),
        (TWIST, partial(_twist_agrees, setup)),
    ):
        if topic in tick.said and not is_so(tick.said[topic], was):
            found.append(f"stamp {tick.stamp_ns} ns: {topic} is not what the decision says")
    source = SCAN if setup.scenario.robot.lidar.beams else OBSTACLES
    if {source, ODOM} <= tick.said.keys() and not _is_sensed(setup, tick, was):
        found.append(f"stamp {tick.stamp_ns} ns: {SECTORS} is not what the sensor measures")
    return found


def _intensities_agree(sectors: Any, was: Decision) -> bool:
    return not was.ranges_m or tuple(sectors.intensities) == sensory_vector(was.ranges_m)


def _vector_agrees(vector: Any, was: Decision) -> bool:
    return tuple(vector.data) == sensory_vector(was.ranges_m)


def _step_agrees(step: Any, was: Decision) -> bool:
    return (step.pose.position.x, step.pose.position.y) == was.waypoint


def _twist_agrees(setup: Setup, twist: Any, was: Decision) -> bool:
    told = body_velocity(was, setup.scenario.robot, setup.planner.tick_ns)
    return bool(or_refused(velocity, twist) == told)


def _is_sensed(setup: Setup, tick: Tick, was: Decision) -> bool:
    """Whether the obstacles, or the scan, of this tick give these sectors."""
    scenario, lidar = setup.scenario, setup.scenario.robot.lidar
    try:
        pose = robot_pose(tick.said[ODOM])
        if lidar.beams:
            scan, yaw = laser_scan(tick.said[SCAN], setup.scan_frame), pose.yaw + lidar.yaw_rad
            return sense_scan(scan, yaw, scenario.robot_radius_m, setup.sensor) == was.ranges_m
        centers = obstacle_centers(tick.said[OBSTACLES])
    except InputError:
        return not was.ranges_m  # blind, as it must be
    position = pose.position
    radii = [o.radius_m + scenario.robot_radius_m for o in scenario.obstacles]
    if len(radii) != len(centers):
        return False
    ranges = sense_circles(position, list(zip(centers, radii)), setup.sensor)
    return ranges == was.ranges_m or (not was.ranges_m and any(map(math.isnan, ranges)))
