# SPDX-License-Identifier: Apache-2.0
"""Verify a bag: decide again on the recorded inputs and compare with the recording."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

from ..core.errors import BagError, InputError
from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO, Decision, Mode, Observation, observe
from ..optimizers.registry import names_module
from ..perception.scan_to_sectors import aligned, sense_scan
from ..perception.sense_segments import sense_circles_and_segments
from ..perception.sensory_vector import sensory_vector
from ..planning.planner_factory import make_planner
from ..planning.planner_params import Method
from ..recording.bag_reader import BagReader
from ..recording.configuration_attachment import parameter_changes
from ..recording.fleet_topics import NO_NAMESPACE, select_robots
from ..recording.from_messages import (
    body_velocity,
    decision_field,
    laser_scan,
    obstacle_centers,
    robot_pose,
    scan_timing,
    sector_ranges,
    value_or_refusal,
    velocity,
)
from ..recording.from_messages import decision as read_decision
from ..recording.run_parameters import Nodes, read_setup, read_setups
from ..recording.run_setup import Setup
from ..recording.scan_parts import FRAME_FIELD, ScanPart, merge_again, parts_in
from ..simulation.decision_digest import canonical, digest
from ..simulation.recorded_motion import is_present
from ..simulation.scenario_map import with_known_map
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
    join_ticks,
    read_tick_messages,
)

Progress = Callable[[int, int], None]
_BEFORE = "what the planner perceived before the recording began is not in the bag"
_TRANSFORMED = (
    "a goal of another frame is taken as it was decided on: it depends on the tf that the planner "
    "had received"
)
_NOT_PERCEIVED = (
    f"{{count}} can be checked: {_BEFORE}; start the recorder before the planner, or send a new "
    "goal while it records"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """Result of the verification of one robot's recording.

    `divergence` is the first recorded decision that differs from the planner's.
    """

    setup: Setup
    recorded: tuple[Decision, ...]
    decided: tuple[Decision, ...]
    divergence: Divergence | None
    faults: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def is_identical(self) -> bool:
        """Whether all decisions are equal and the bag has no faults."""
        return not self.faults and self.divergence is None

    @property
    def digest(self) -> str:
        """Digest of the recorded decisions."""
        return digest(self.recorded)


def verify(path: str | Path, *, allow_modules: bool = False) -> Report:
    """Verify a bag of one robot. Raises BagError as verify_each()."""
    with BagReader(path) as reader:
        read_setup(reader)
    return verify_each(path, allow_modules=allow_modules)[NO_NAMESPACE]


def verify_each(
    path: str | Path,
    robots: Sequence[str] = (),
    *,
    allow_modules: bool = False,
    given: Nodes | None = None,
    progress: Progress = lambda done, total: None,
) -> dict[str, Report]:
    """Verify a bag of mfba: the decisions of every robot, or of the robots named.

    `given` are the parameters of the nodes, by node, instead of those in the bag. progress is
    called with the ticks that are done and all ticks, of each robot in turn.
    Raises BagError for a bag that cannot be checked, for an unknown robot, and for an optimiser
    MODULE:NAME unless allow_modules: a bag must not choose what is imported.
    """
    with BagReader(path) as reader:
        reader.check_data()
        setups = read_setups(reader, given).by_robot
        names = select_robots(reader.path, list(setups), robots)
        for name in names:
            optimizer = setups[name].planner.optimizer
            if names_module(optimizer) and not allow_modules:
                raise BagError(
                    f"{reader.path}: its optimizer {optimizer} is a module that would be "
                    "imported; if you trust the bag, give --allow-modules"
                )
        messages = read_tick_messages(reader, names)
        changes = parameter_changes(reader)
    found = {}
    for name in names:
        setup = setups[name]
        tick_ns = setup.planner.tick_ns if setup.lockstep else None
        tick_records = join_ticks(
            messages.pop(name),
            tick_ns,
            setup.odom_frame,
            inputs=_inputs(setup),
            is_simulated=setup.is_simulated,
        )
        notes = [
            f"{node}: {', '.join(changed)} changed during the recording; decided again with the "
            "values at its begin"
            for node, changed in changes.items()
            if node.rpartition("/")[0] == name
        ]
        found[name] = _check(setup, tick_records, notes, progress)
    return found


def _check(
    setup: Setup, tick_records: TickRecords, notes: list[str], progress: Progress
) -> Report:
    faults, notes = [*tick_records.faults], [*notes, *tick_records.notes]
    read_odom = partial(robot_pose, frame=setup.odom_frame)
    read_sectors = partial(sector_ranges, frame=setup.odom_frame)
    planner = make_planner(setup.planner, setup.sensor, setup.seed)
    if tick_records.known_map is not None and setup.planner.known_map:
        planner.set_known_map(tick_records.known_map)
    elif setup.is_simulated:  # a bag of the core driver: the scenario's walls
        with_known_map(planner, setup.planner, setup.scenario)
    goals = deque(tick_records.goals)
    goal: Point | None = None
    pose = Pose2D(0.0, 0.0)
    recorded: list[Decision] = []
    decided: list[Decision] = []
    scans, unchecked, goal_id = _Scans(tick_records), 0, ""
    for count, tick in enumerate(tick_records.ticks):
        progress(count, len(tick_records.ticks))
        if DECISION not in tick.messages or tick.stamp_ns in tick_records.omitted_stamps:
            continue  # join_ticks has reported it if needed
        if SECTORS not in tick.messages:
            if not setup.lockstep:  # in lockstep join_ticks has reported it
                faults.append(f"stamp {tick.stamp_ns} ns: no {SECTORS}")
            continue
        ranges = value_or_refusal(read_sectors, tick.messages[SECTORS])
        try:
            decision = read_decision(
                tick.messages[DECISION], () if isinstance(ranges, str) else ranges
            )
        except InputError as error:
            faults.append(f"stamp {tick.stamp_ns} ns: {error}")
            continue
        last_goal_id, goal_id = goal_id, decision_field(tick.messages[DECISION], "goal_id")
        if goal_id != last_goal_id:
            planner.reset()  # a new goal, even to the same point, or a cancel
            goal = goal if decision.goal else None
        if decision.goal != goal:
            is_transformed = None in goals and decision.goal not in (None, *goals)
            wanted = None if is_transformed else decision.goal
            while goals and (goal != wanted or is_transformed):
                goal = goals.popleft()
                if goal is None and is_transformed:
                    goal = decision.goal
                    notes.append(_TRANSFORMED)
                    break
            if goal != decision.goal and not decided and decision.goal:
                notes.append("its first goal is older than the recording")
            elif goal != decision.goal:
                reason = (
                    "without the known goal (was the planner restarted?)"
                    if decision.goal is None
                    else "for a goal that was not in any /goal_pose"
                )
                faults.append(f"stamp {tick.stamp_ns} ns: decided {reason}")
            goal = decision.goal
        pose_input: Any = decision.pose
        if setup.lockstep:
            pose_input = (
                value_or_refusal(read_odom, tick.messages[ODOM]) if ODOM in tick.messages else pose
            )
        elif decision.mode is Mode.STOPPED:
            unchecked += 1  # the refused or stale input is not recorded
            continue
        observation = observe(tick.stamp_ns, pose_input, ranges, goal, pose)
        pose = observation.pose
        recorded.append(decision)
        try:
            observation = _with_scan(setup, tick, scans, decision, observation)
        except InputError as error:
            faults.append(f"stamp {tick.stamp_ns} ns: {error}")
        decided.append(planner.plan(observation))
        faults += _contradictions(setup, tick, decision, is_one_lidar=scans.are_of_one_lidar)
    if unchecked:
        notes.append(f"{unchecked} stops of a run in real time cannot be decided again")
    if tick_records.began_late and setup.planner.method is not Method.PAPER:
        first = _first_without_memory(recorded, decided)
        if first == len(recorded) > 0:
            faults.append(_NOT_PERCEIVED.format(count=f"none of its {first} decisions"))
            recorded, decided = [], []
        elif first:
            notes.append(f"left out the first {first} decisions: {_BEFORE}")
            recorded, decided = recorded[first:], decided[first:]
    return Report(
        setup=setup,
        recorded=tuple(recorded),
        decided=tuple(decided),
        divergence=first_divergence(recorded, decided),
        faults=tuple(faults),
        notes=tuple(notes),
    )


def _first_without_memory(recorded: Sequence[Decision], decided: Sequence[Decision]) -> int:
    """The index from which on all decisions are equal, their number if the last one is not."""
    pairs = reversed(list(zip(recorded, decided)))
    equal = takewhile(lambda pair: canonical(0, pair[0]) == canonical(0, pair[1]), pairs)
    return len(recorded) - sum(1 for _ in equal)


def _inputs(setup: Setup) -> list[str]:
    """The topics whose messages of the same stamp are the input of a decision."""
    return [
        SECTORS,
        *([ODOM] if setup.lockstep else []),  # in real time the pose of the decision is used
        *([SCAN] if setup.planner.reads_scan and setup.scenario.robot.lidar.beams else []),
    ]


class _Scans:
    """The scans of a recording, by frame and stamp."""

    def __init__(self, tick_records: TickRecords) -> None:
        self._messages = tick_records.scans()
        self._begin_ns = min((stamp for _, stamp in self._messages), default=0)
        self.are_of_one_lidar = len({frame for frame, _ in self._messages}) < 2

    def include(self, parts: Sequence[ScanPart]) -> bool:
        """Whether the recording had begun when these parts of a merged scan were measured."""
        return all(part.stamp_ns >= self._begin_ns for part in parts)

    def of(self, part: ScanPart) -> Any:
        """The message of a part of a merged scan; InputError without it."""
        message = self._messages.get((part.frame, part.stamp_ns))
        if message is None:
            raise InputError(f"{SCAN} of {part.frame!r} at {part.stamp_ns} ns was not recorded")
        return message


def _with_scan(
    setup: Setup, tick: Tick, scans: _Scans, recorded: Decision, obs: Observation
) -> Observation:
    """The observation with the scan, where the recorded decision was made on one."""
    if recorded.perception != "scan" or obs.refused or SCAN not in tick.messages:
        return obs
    pose_stamp_ns, scan_pose = scan_timing(tick.messages[DECISION])
    read = partial(laser_scan, no_return=setup.scan_no_return)
    parts, yaw = parts_in(tick.messages[DECISION]), (scan_pose or obs.pose).yaw
    if not scans.include(parts):
        return obs
    if parts:
        merged = merge_again(parts, list(map(scans.of, parts)), read, setup.planner.robot_radius_m)
        scan = aligned(merged, yaw)
    else:
        extrinsics = setup.scenario.robot.lidar.extrinsics
        frame = decision_field(tick.messages[DECISION], FRAME_FIELD)
        scan = aligned(read(tick.scans.get(frame, tick.messages[SCAN])), yaw, extrinsics)
    return replace(
        obs,
        scan=scan,
        sensed=(obs.stamp_ns, scan_pose) if scan_pose else None,
        pose_stamp_ns=pose_stamp_ns,
    )


def _contradictions(
    setup: Setup, tick: Tick, decision: Decision, *, is_one_lidar: bool
) -> list[str]:
    """Faults: the topics of a tick that do not match its decision."""
    found = []
    for topic, agrees in (
        (SECTORS, _intensities_agree),
        (VECTOR, _vector_agrees),
        (STEP, _goal_step_agrees),
        (TWIST, partial(_twist_agrees, setup)),
    ):
        if topic in tick.messages and not agrees(tick.messages[topic], decision):
            found.append(f"stamp {tick.stamp_ns} ns: {topic} does not match the decision")
    if not is_one_lidar or (not setup.is_simulated and not setup.lockstep):
        return found  # the sensor may have used other odometry, or other scans
    source = SCAN if setup.scenario.robot.lidar.beams else OBSTACLES
    if {source, ODOM} <= tick.messages.keys() and not _sectors_match_sensor(setup, tick, decision):
        found.append(f"stamp {tick.stamp_ns} ns: {SECTORS} does not match the sensor")
    return found


def _intensities_agree(sectors: Any, decision: Decision) -> bool:
    return not decision.ranges_m or tuple(sectors.intensities) == sensory_vector(decision.ranges_m)


def _vector_agrees(vector: Any, decision: Decision) -> bool:
    return tuple(vector.data) == sensory_vector(decision.ranges_m)


def _goal_step_agrees(goal_step: Any, decision: Decision) -> bool:
    return (goal_step.pose.position.x, goal_step.pose.position.y) == decision.waypoint


def _twist_agrees(setup: Setup, twist: Any, decision: Decision) -> bool:
    command = body_velocity(decision, setup.scenario.robot, setup.planner.tick_ns)
    return bool(value_or_refusal(velocity, twist) == command)


def _sectors_match_sensor(setup: Setup, tick: Tick, decision: Decision) -> bool:
    """Whether the obstacles, or the scan, of this tick give the ranges of the decision."""
    scenario, lidar = setup.scenario, setup.scenario.robot.lidar
    try:
        pose = robot_pose(tick.messages[ODOM])
        if lidar.beams:
            scan = laser_scan(tick.messages[SCAN], setup.scan_frame, setup.scan_no_return)
            ranges = sense_scan(
                scan, pose.yaw, scenario.robot_radius_m, setup.sensor, lidar.extrinsics
            )
            return ranges == decision.ranges_m
        centers = obstacle_centers(tick.messages[OBSTACLES])
    except InputError:
        return not decision.ranges_m  # a blind sensor has no ranges
    position = pose.position
    time_s = (decision.stamp_ns - setup.planner.tick_ns) * NANO
    radii = [
        o.radius_m + scenario.robot_radius_m for o in scenario.obstacles if is_present(o, time_s)
    ]
    if len(radii) != len(centers):
        return False
    ranges = sense_circles_and_segments(
        position,
        list(zip(centers, radii)),
        scenario.segments,
        scenario.robot_radius_m,
        setup.sensor,
    )
    return ranges == decision.ranges_m or (not decision.ranges_m and any(map(math.isnan, ranges)))
