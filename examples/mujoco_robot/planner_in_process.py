# SPDX-License-Identifier: Apache-2.0
"""One drive with the planner in this process, on the inputs that its node would get.

A scan arrives SCAN_AGE_NS after its stamp, beside odometry that is newer, and the command on it
moves the wheels REACTION_NS after that stamp. The planner's node joins scan and odometry by their
stamps (NewestInputs); here the same code does. The decisions equal those of the graph that
run.py starts, where it does not follow the clock.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from contact_events import ContactEvent
from crowded_room import SPEED_MPS, Room
from physics_world import SCAN_NS, PhysicsWorld

from mfba_planner.core.geometry import Pose2D, distance, pose_as_in_message
from mfba_planner.core.lidar_extrinsics import CENTRED
from mfba_planner.core.planner_types import NANO, Decision, Mode, Observation, observe
from mfba_planner.perception.scan_to_sectors import aligned, sense_scan
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.differential_drive import track
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PerceptionInput, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.scan_parts import MountedScan
from mfba_planner.ros.runtime.lockstep_inputs import Inputs
from mfba_planner.ros.runtime.stale_inputs import NewestInputs
from mfba_planner.simulation.episode import Episode, Outcome

REACTION_NS = 60_000_000  # from the stamp of a scan until its command moves the wheels
SCAN_AGE_NS = 40_000_000  # of a scan when it arrives, in the stamped timing
FILM_PERIOD_NS = 100_000_000
ROBOT_STREAM = 21  # of the errors of the robot's sensors


def robot_rng(world: int) -> np.random.Generator:
    """The random generator of the robot's sensors in a world."""
    return np.random.default_rng((ROBOT_STREAM, world))


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveResult:
    """What came of one drive; lengths in metres."""

    episode: Episode
    contacts: tuple[ContactEvent, ...]
    off_goal_m: float  # true distance to the goal at the end
    odometry_off_m: float  # of the odometry from the true position, at the end

    @property
    def arrived(self) -> bool:
        """Whether the planner has arrived, as its odometry says."""
        return self.episode.ticks[-1].mode is Mode.ARRIVED

    @property
    def time_s(self) -> float:
        """Duration of the drive."""
        return self.episode.time_s(self.episode.ticks[-1].stamp_ns)


def planner_params(room: Room) -> PlannerParams:
    """The planner of the example: predictive on scans, a decision per scan, recovery enabled."""
    params = PlannerParams(goal_tolerance_m=0.1, speed_mps=SPEED_MPS)
    params = replace(
        preset(replace(params, recovery=replace(params.recovery, enabled=True))),
        step_length_m=SPEED_MPS * SCAN_NS * NANO,
        method=Method.PREDICTIVE,
        perception=PerceptionInput.SCAN,
    )
    assert params.tick_ns == SCAN_NS
    return room.scenario.planner_params(params)


def drive(
    world: PhysicsWorld,
    *,
    seed: int,
    film: bool = False,
    go_on: Callable[[Decision], bool] = lambda _: True,
) -> DriveResult:
    """Drive until the planner has arrived, the time limit, or go_on() says no."""
    params, sensor = planner_params(world.room), SensorParams()
    planner = make_planner(params, sensor, seed)
    film_ns = FILM_PERIOD_NS if film else 0
    inputs = _Inputs(world, film_ns)
    ticks: list[Decision] = []
    truth: list[Pose2D] = []
    limit_ns = round(world.scenario.time_limit_s / NANO)
    while True:
        tick_ns = world.now_ns
        truth.append(world.pose)
        ticks.append(planner.plan(inputs.observe(sensor)))
        finished = ticks[-1].mode is Mode.ARRIVED or tick_ns >= limit_ns
        inputs.advance(tick_ns + REACTION_NS)
        world.command(*track(ticks[-1], params, params.tick_ns))
        inputs.advance(tick_ns + SCAN_NS)
        if finished or not go_on(ticks[-1]):
            break
    arrived = ticks[-1].mode is Mode.ARRIVED
    episode = Episode(
        scenario=world.scenario,
        sensor=sensor,
        planner=params,
        seed=seed,
        driver="core",
        ticks=tuple(ticks),
        outcome=Outcome.GOAL_REACHED if arrived else Outcome.TIME_LIMIT,
        truth=tuple(truth),
    )
    return DriveResult(
        episode=episode,
        contacts=tuple(world.contacts),
        off_goal_m=distance(world.pose.position, world.scenario.goal_m),
        odometry_off_m=distance(world.pose.position, world.odometry.pose.position),
    )


def stamp_at(now_ns: int) -> int:
    """The stamp of a moment: one tick later than the people's time, as 0 is no stamp in ROS."""
    return now_ns + SCAN_NS


class _Inputs:
    """The scan SCAN_AGE_NS after its stamp, with the odometry that has arrived by then."""

    def __init__(self, world: PhysicsWorld, film_ns: int) -> None:
        self._world, self._film_ns = world, film_ns
        self._newest = NewestInputs()
        self._last = Pose2D(*world.scenario.start_m)
        self._add_odometry()

    def observe(self, sensor: SensorParams) -> Observation:
        """The observation on the scan of the present tick; time moves on by the scan's age."""
        world = self._world
        scan, stamp = world.scan(), stamp_at(world.now_ns)
        self.advance(world.now_ns + SCAN_AGE_NS)
        self._add_odometry()
        # virtual_sensor turns the scan by the newest heading.
        ranges = sense_scan(scan, self._last.yaw, world.scenario.robot_radius_m, sensor)
        inputs = self._newest.add_sectors(stamp, ranges, world.time_s, MountedScan(scan, CENTRED))
        assert inputs is not None
        return _with_scan(inputs, world, self._last)

    def advance(self, until_ns: int) -> None:
        """Let the world go on."""
        self._world.advance(until_ns, self._film_ns)

    def _add_odometry(self) -> None:
        self._last = pose_as_in_message(self._world.odometry.pose)
        self._newest.add_odom(stamp_at(self._world.now_ns), self._last, self._world.time_s)


def _with_scan(inputs: Inputs, world: PhysicsWorld, last: Pose2D) -> Observation:
    """As PlannerNode and InputSubscriptions.add_scan make it of their inputs."""
    goal, scan = world.scenario.goal_m, inputs.scan
    obs = observe(
        inputs.stamp_ns, inputs.pose, inputs.ranges_m, goal, last, round(inputs.age_s / NANO)
    )
    assert scan is not None
    pose = inputs.sensed[1] if inputs.sensed else obs.pose
    return replace(
        obs,
        scan=aligned(scan.scan, pose.yaw, scan.extrinsics),
        sensed=inputs.sensed,
        pose_stamp_ns=inputs.pose_stamp_ns,
    )
