# SPDX-License-Identifier: Apache-2.0
"""Errors of the obstacle tracker against ground truth, its time, and its memory.

Run: python bench/tracking.py [--seeds N] [--only TEXT], or --memory TICKS for the memory of a
process that simulates, tracks and decides for so many ticks. Each row is a set of scenes of 3 s: a
robot at 0.8 m/s, a lidar of 10 m, a scan every 0.1 s, ten discs within 1 to 6 m that keep their
velocities and do not overlap. The first 0.5 s of every disc in view count only for the delay.
Position and radius are compared relative to the pose that the tracker was given. The circles'
enlargement for uncertainty is part of `cover`: how far a disc sticks out of its circle, which
is not above 0 while the circle covers it.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Circle, Mode
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.scan_to_sectors import aligned
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_factory import make_loaded_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.lidar_perception import with_lidar
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.simulated_lidar import cast_rays, scan_at
from mfba_planner.simulation.world import World

TICK_S = 0.1
TICK_NS = 100_000_000
TICKS = 30
SETTLED = 5  # scans in view after which errors count
ROBOT_MPS = 0.8
REACH_M = 10.0
MEMORY_WORLD, TIMED_WORLD, LONGEST_TRIP = 70000, 90000, 1000  # ticks


@dataclass(frozen=True)
class Row:
    """One kind of scenes."""

    speed: tuple[float, float] = (0.0, 2.5)
    radius: tuple[float, float] = (0.1, 0.5)
    beams: int = 360
    scan_m: float = 0.0
    odom_m: float = 0.0
    odom_rad: float = 0.0


ROWS: dict[str, Row] = {
    "at rest": Row(speed=(0.0, 0.0)),
    "0.1 to 0.3 m/s": Row(speed=(0.1, 0.3)),
    "0.5 to 1 m/s": Row(speed=(0.5, 1.0)),
    "1 to 1.5 m/s": Row(speed=(1.0, 1.5)),
    "2 to 2.5 m/s": Row(speed=(2.0, 2.5)),
    "radius 0.05 m": Row(radius=(0.05, 0.05)),
    "radius 0.3 m": Row(radius=(0.3, 0.3)),
    "radius 1 m": Row(radius=(1.0, 1.0)),
    "12 beams": Row(beams=12),
    "90 beams": Row(beams=90),
    "180 beams": Row(beams=180),
    "720 beams": Row(beams=720),
    "1080 beams": Row(beams=1080),
    "scan 1 cm": Row(scan_m=0.01),
    "scan 2 cm": Row(scan_m=0.02),
    "scan 3 cm": Row(scan_m=0.03),
    "scan 2 cm, odometry 2 cm, 0.02 rad": Row(scan_m=0.02, odom_m=0.02, odom_rad=0.02),
    "the same, at rest": Row(speed=(0.0, 0.0), scan_m=0.02, odom_m=0.02, odom_rad=0.02),
    "the same, 0.1 to 0.3 m/s": Row(speed=(0.1, 0.3), scan_m=0.02, odom_m=0.02, odom_rad=0.02),
}


@dataclass
class Errors:
    """Errors of all discs in view; lengths in m, speeds in m/s."""

    position: list[float]
    velocity: list[float]
    radius: list[float]
    cover: list[float]
    delay: list[int]  # scans until the velocity is within 0.3 m/s and a fifth
    visible: int = 0
    missed: int = 0  # discs in view without a circle
    false_motion: int = 0  # circles of discs at rest with a velocity
    resting: int = 0


def discs(row: Row, rng: np.random.Generator) -> np.ndarray:
    """Ten discs (10, 5) x, y, vx, vy, r that do not overlap in their first second."""
    found: list[list[float]] = []
    while len(found) < 10:
        distance_m, bearing = rng.uniform(1.0, 6.0), rng.uniform(-math.pi, math.pi)
        heading, speed = rng.uniform(-math.pi, math.pi), rng.uniform(*row.speed)
        r = rng.uniform(*row.radius)
        x, y = distance_m * math.cos(bearing), distance_m * math.sin(bearing)
        if distance_m - r < 0.6:
            continue
        if all(math.dist((x, y), d[:2]) > r + d[4] + 0.3 for d in found) or r > 0.9:
            found.append([x, y, speed * math.cos(heading), speed * math.sin(heading), r])
        if r > 0.9 and len(found) >= 3:
            break
    return np.array(found)


def visible_returns(discs_now: np.ndarray, pose: Pose2D, beams: int) -> np.ndarray:
    """Returns that each disc gives from the pose."""
    ranges = [
        cast_rays(pose.position, [tuple(d[[0, 1, 4]])], beams, REACH_M, pose.yaw)
        for d in discs_now
    ]
    nearest = np.array(ranges).argmin(axis=0)
    met = np.isfinite(np.array(ranges).min(axis=0))
    return np.bincount(nearest[met], minlength=len(discs_now))


def run_scene(row: Row, seed: int, errors: Errors) -> None:
    """Track one scene and collect the errors."""
    rng = np.random.default_rng(seed)
    truth = discs(row, rng)
    heading = rng.uniform(-math.pi, math.pi)
    lidar = Lidar(beams=row.beams, range_max_m=REACH_M, range_min_m=0.05)
    tracker = Tracker()
    scans, known = np.zeros(len(truth), dtype=int), np.zeros(len(truth), dtype=bool)
    for k in range(TICKS):
        t = k * TICK_S
        along = ROBOT_MPS * t
        pose = Pose2D(along * math.cos(heading), along * math.sin(heading), heading)
        now = truth.copy()
        now[:, :2] += t * truth[:, 2:4]
        away = np.hypot(now[:, 0] - pose.x, now[:, 1] - pose.y) - now[:, 4]
        if away.min() < 0.1:
            return
        scan = scan_at(pose, lidar, [tuple(d) for d in now[:, [0, 1, 4]].tolist()], None)
        noise = rng.normal(size=row.beams) * row.scan_m
        scan = replace(scan, ranges_m=scan.ranges_m + noise)
        dx, dy, turn = rng.normal(size=3) * (row.odom_m, row.odom_m, row.odom_rad)
        given = Pose2D(pose.x + dx, pose.y + dy, pose.yaw + turn)
        tracker.update((k + 1) * TICK_NS, given, aligned(scan, given.yaw))
        circles = tracker.circles((k + 1) * TICK_NS, 0.0)
        returns = visible_returns(now, pose, row.beams)
        compare(now, pose, given, circles, returns, scans, known, errors)


def compare(
    now: np.ndarray,
    pose: Pose2D,
    given: Pose2D,
    circles: tuple[Circle, ...],
    returns: np.ndarray,
    scans: np.ndarray,
    known: np.ndarray,
    errors: Errors,
) -> None:
    """Compare the circles with the discs in view."""
    c, s = math.cos(given.yaw - pose.yaw), math.sin(given.yaw - pose.yaw)
    for k, (x, y, vx, vy, r) in enumerate(now.tolist()):
        if returns[k] < 1:
            scans[k] = max(scans[k] - 1, 0)
            continue
        scans[k] += 1
        px, py = x - pose.x, y - pose.y
        at = (given.x + c * px - s * py, given.y + s * px + c * py)
        nearest = min(circles, key=lambda o: math.dist(o.center_m, at), default=None)
        found = nearest is not None and math.dist(nearest.center_m, at) < r + 0.25
        late = scans[k] > SETTLED
        if late:
            errors.visible += 1
            errors.missed += not found
        if not found or nearest is None:
            continue
        off = math.dist(nearest.velocity_mps, (vx, vy))
        speed = math.hypot(vx, vy)
        if not known[k] and speed > 0.0 and off < max(0.3, 0.2 * speed):
            known[k] = True
            errors.delay.append(int(scans[k]))
        if not late:
            continue
        errors.position.append(math.dist(nearest.center_m, at))
        errors.velocity.append(off)
        errors.radius.append(nearest.radius_m - r)
        errors.cover.append(math.dist(nearest.center_m, at) + r - nearest.radius_m)
        if speed == 0.0:
            errors.resting += 1
            errors.false_motion += nearest.velocity_mps != (0.0, 0.0)


def percentile(values: list[float], share: float) -> float:
    """The value below which that share of all lies; NaN for none."""
    return float(np.quantile(values, share)) if values else math.nan


def table(seeds: int, only: str) -> None:
    """Print a line for each row."""
    print(
        "| scenes | seen | missed | position | velocity | radius | cover | delay | false motion |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for name, row in ROWS.items():
        if only not in name:
            continue
        e = Errors([], [], [], [], [])
        for seed in range(seeds):
            run_scene(row, seed, e)
        rest = f"{100.0 * e.false_motion / e.resting:.2f} %" if e.resting else ""
        print(
            f"| {name} | {e.visible} | {100.0 * e.missed / max(e.visible, 1):.2f} % "
            f"| {1e2 * percentile(e.position, 0.5):.1f}, {1e2 * percentile(e.position, 0.95):.1f} "
            f"| {percentile(e.velocity, 0.5):.2f}, {percentile(e.velocity, 0.95):.2f} "
            f"| {1e2 * percentile(e.radius, 0.5):+.1f}, "
            f"{1e2 * percentile([abs(r) for r in e.radius], 0.95):.1f} "
            f"| {1e2 * percentile(e.cover, 0.95):+.1f} "
            f"| {percentile([float(d) for d in e.delay], 0.5):.0f}, "
            f"{percentile([float(d) for d in e.delay], 0.95):.0f} | {rest} |",
            flush=True,
        )


def timing(worlds: int) -> None:
    """Print the time of a scan, of a decision on it, and of the floor, measured in turn.

    The robot drives through worlds of ten obstacles, from its lidar, and follows its decisions.
    """
    times: dict[str, list[float]] = {"floor": [], "tracking": [], "decision": []}
    x, y = np.random.default_rng(0).random((2, 360))
    for index in range(TIMED_WORLD, TIMED_WORLD + worlds):
        scenario = with_lidar(suite("random-10").world(index), "lidar")
        params = scenario.planner_params(preset(PlannerParams(method=Method.PREDICTIVE)))
        planner, sensor = make_loaded_planner(params, 0), SensorParams()
        tracker = Tracker()
        world = World(scenario, params.tick_ns, params.goal_tolerance_m)
        for _ in range(LONGEST_TRIP):
            obs = replace(observe_scan(world, sensor), goal=scenario.goal_m)
            assert obs.scan is not None
            start = time.perf_counter()
            np.hypot(x, y)
            hypot = time.perf_counter()
            tracker.update(obs.stamp_ns, obs.pose, aligned(obs.scan, obs.pose.yaw))
            tracker.circles(obs.stamp_ns, 0.3)
            tracked = time.perf_counter()
            decision = planner.plan(obs)
            decided = time.perf_counter()
            for name, span in zip(times, (hypot - start, tracked - hypot, decided - tracked)):
                times[name].append(span)
            if decision.mode is Mode.ARRIVED:
                break
            world.step(world.command(decision))
    floor = statistics.median(times["floor"])
    print(f"\nworlds {TIMED_WORLD} to {index} of random-10, {len(times['floor'])} decisions")
    print("\n| 360 beams, ten discs | median, us | 99 %, us | median / floor |\n|---|---|---|---|")
    names = ("floor: np.hypot of 360", "tracking: update and circles", "decision with tracking")
    for name, spans in zip(names, times.values()):
        median, late = statistics.median(spans), percentile(spans, 0.99)
        print(f"| {name} | {1e6 * median:.1f} | {1e6 * late:.1f} | {median / floor:.0f} |")


def memory(ticks: int) -> None:
    """Print the resident memory of a trip to and fro through a crowd, ten times."""
    scenario = with_lidar(suite("random-20").world(MEMORY_WORLD), "lidar")
    params = scenario.planner_params(
        preset(PlannerParams(method=Method.PREDICTIVE, speed_mps=ROBOT_MPS))
    )
    planner, sensor = make_loaded_planner(params, 0), SensorParams()
    world = World(scenario, params.tick_ns, params.goal_tolerance_m)
    goals, arrived, since = [scenario.goal_m, scenario.start_m], 0, 0
    print("\n| tick | MB | trips |\n|---|---|---|")
    for tick in range(1, ticks + 1):
        decision = planner.plan(replace(observe_scan(world, sensor), goal=goals[0]))
        if decision.mode is Mode.ARRIVED or tick - since > LONGEST_TRIP:
            arrived, since = arrived + (decision.mode is Mode.ARRIVED), tick
            goals.reverse()
        world.step(world.command(decision))
        if tick % (ticks // 10) == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            megabytes = 1e-6 * pages * os.sysconf("SC_PAGE_SIZE")
            print(f"| {tick} | {megabytes:.2f} | {arrived} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--only", default="", help="rows whose name holds this")
    parser.add_argument("--worlds", type=int, default=20, help="of the timing; 0: none")
    parser.add_argument("--memory", type=int, default=0, metavar="TICKS", help="only memory")
    found = parser.parse_args()
    if found.memory:
        memory(found.memory)
        return
    table(found.seeds, found.only)
    if found.worlds:
        timing(found.worlds)


if __name__ == "__main__":
    main()
