# SPDX-License-Identifier: Apache-2.0
"""Crossings among people: run one, and say how it ended. Used by pedestrians.py, passer_by.py."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from enum import Enum
from multiprocessing import get_context

from mfba_planner.core.geometry import Point, bearing, distance, wrap_angle
from mfba_planner.core.planner_types import NANO
from mfba_planner.evaluation.metrics import assess, steps_driven
from mfba_planner.evaluation.statistics import share_interval
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.planner_registry import PLANNERS, find_factory, preset_of
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.lidar_perception import LIDAR_ROBOTS, LidarPerception
from mfba_planner.simulation.obstacle_motion import Obstacle, Turn
from mfba_planner.simulation.planner_observations import Observe, Perception
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

STANDING_MPS = 0.05  # below it the robot stands
BEHIND_RAD = math.radians(135.0)  # from its direction; as in `mfba show`


class Ending(Enum):
    """How a crossing ended; of contacts the first decides."""

    CLEAR = "at the goal without contact"
    BY_ROBOT = "robot into a person"
    STANDING = "person into the standing robot"
    BEHIND = "person into the robot from behind"
    LATE = "no contact, not at the goal"


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """Who crosses: planner, perception, speed, and the lidar's reach and angle of view."""

    planner: str = "predictive"
    perception: str = "lidar"  # or known: told the truth within range_m
    speed_mps: float = 1.0
    beams: int = 360
    range_m: float = 10.0
    fov_rad: float = 2.0 * math.pi

    @property
    def label(self) -> str:
        """One line of words."""
        observed = (
            f"{self.beams} beams of {self.range_m:g} m, {math.degrees(self.fov_rad):.0f} deg"
        )
        if self.perception == "known":
            observed = f"within {self.range_m:g} m"
        return f"{self.planner}, {self.perception}, {observed}, {self.speed_mps:g} m/s"


def cross(scenario: Scenario, robot: Robot, seed: int) -> Episode:
    """Run a crossing."""
    factory = find_factory(robot.planner)
    sensor, observe = SensorParams(), Perception("known")
    found: Observe = observe
    if robot.perception == "known":
        sensor = replace(sensor, sensing_range_m=robot.range_m)
    else:
        base = LIDAR_ROBOTS[robot.perception].robot
        lidar = replace(
            base.lidar, beams=robot.beams, range_max_m=robot.range_m, fov_rad=robot.fov_rad
        )
        fastest = max(base.max_speed_mps, robot.speed_mps)
        scenario = replace(scenario, robot=replace(base, lidar=lidar, max_speed_mps=fastest))
        found = LidarPerception(robot.perception)
    params = scenario.planner_params(preset_of(factory, PlannerParams(speed_mps=robot.speed_mps)))
    planner = factory(params, sensor, seed)
    return run(
        scenario, planner=params, sensor=sensor, seed=seed, path_planner=planner, observe=found
    )


def ending(episode: Episode) -> Ending:
    """How it ended, by the robot's true motion, continuous in time."""
    result, motion = assess(episode)
    if not result.collisions:
        return Ending.CLEAR if result.outcome is Outcome.GOAL_REACHED else Ending.LATE
    time_s = motion.first_contact_s
    start, end = next(
        (before.pose.position, after.pose.position)
        for before, after in steps_driven(episode)
        if episode.time_s(before.stamp_ns) == time_s
    )
    if distance(start, end) <= STANDING_MPS * episode.planner.tick_ns * NANO:
        return Ending.STANDING
    person = episode.scenario.centers(time_s)[motion.first_contact_with - 1]
    turn = abs(wrap_angle(bearing(start, person) - bearing(start, end)))
    return Ending.BEHIND if turn >= BEHIND_RAD else Ending.BY_ROBOT


def judge(task: tuple[Scenario, Robot, int]) -> Ending:
    """Run a crossing and say how it ended; for executors."""
    return ending(cross(*task))


def judge_all(
    scenarios: Sequence[Scenario], robot: Robot, workers: int, first_seed: int = 0
) -> Counter[Ending]:
    """The endings of all; crossing k has the seed first_seed + k."""
    tasks = [(scenario, robot, first_seed + k) for k, scenario in enumerate(scenarios)]
    if workers == 1:
        return Counter(map(judge, tasks))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        return Counter(pool.map(judge, tasks, chunksize=4))


def report(label: str, endings: Counter[Ending]) -> str:
    """One line: successes with Wilson's interval (95 %), and the others by kind."""
    total, clear = endings.total(), endings[Ending.CLEAR]
    low, high = share_interval(clear, total)
    others = "; ".join(
        f"{endings[kind]} {kind.value}" for kind in Ending if kind is not Ending.CLEAR
    )
    return (
        f"{label}: {clear} of {total} ({100.0 * low:.1f} to {100.0 * high:.1f} %) "
        f"{Ending.CLEAR.value}; {others}"
    )


def obstacle_along(times_s: Sequence[float], points: Sequence[Point], radius_m: float) -> Obstacle:
    """An obstacle that is at each point at its time, straight in between and before and after.

    Times ascend and the first is at most 0; then it is where the line says at t = 0.
    """
    pieces = []
    for (t, p), (u, q) in zip(zip(times_s, points), zip(times_s[1:], points[1:])):
        heading = bearing(p, q) if p != q else 0.0
        pieces.append(Turn(at_s=t, speed_mps=distance(p, q) / (u - t), heading_rad=heading))
    first = max(k for k, piece in enumerate(pieces) if piece.at_s <= 0.0 or k == 0)
    now, (x, y) = pieces[first], points[first]
    ahead = now.speed_mps * -now.at_s
    return Obstacle(
        center_m=(x + ahead * math.cos(now.heading_rad), y + ahead * math.sin(now.heading_rad)),
        radius_m=radius_m,
        speed_mps=now.speed_mps,
        heading_rad=now.heading_rad,
        turns=tuple(piece for piece in pieces[first + 1 :] if piece.at_s > 0.0),
    )


def add_robot_arguments(parser: argparse.ArgumentParser, speeds_mps: Iterable[float]) -> None:
    """Arguments of robots_of(); every combination is a robot."""
    usual = Robot()
    parser.add_argument(
        "--planner", action="append", choices=PLANNERS, metavar="NAME", help="may be repeated"
    )
    parser.add_argument(
        "--perception", action="append", choices=(*LIDAR_ROBOTS, "known"), metavar="NAME",
        help=f"{', '.join(LIDAR_ROBOTS)} or known (told the truth); may be repeated "
        "(default: lidar and lidar-differential)",
    )  # fmt: skip
    parser.add_argument(
        "--speed", action="append", type=float, metavar="M/S", help="of the robot; may be repeated"
    )
    parser.add_argument(
        "--fov", action="append", type=float, metavar="DEG", help="angle of view; may be repeated"
    )
    parser.add_argument("--beams", type=int, default=usual.beams, help="of the lidar")
    parser.add_argument("--range", type=float, default=usual.range_m, metavar="M", dest="range_m")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.set_defaults(usual_speeds=list(speeds_mps))


def robots_of(found: argparse.Namespace) -> list[Robot]:
    """The robots that the arguments name."""
    return [
        Robot(
            planner=planner, perception=perception, speed_mps=speed, beams=found.beams,
            range_m=found.range_m, fov_rad=math.radians(fov),
        )
        for planner in found.planner or ["predictive"]
        for perception in found.perception or ["lidar", "lidar-differential"]
        for fov in (found.fov or [360.0] if perception != "known" else [360.0])
        for speed in found.speed or found.usual_speeds
    ]  # fmt: skip
