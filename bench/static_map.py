# SPDX-License-Identifier: Apache-2.0
"""The local map against ground truth, and its time.

Run: python bench/static_map.py [--worlds N] [--only TEXT] [--barn FILE]. Worlds 0 to N - 1 of each
suite, driven by `predictive` from the lidar, at most 40 s each. BARN's worlds are not part of the
package: FILE has columns world, x_m, y_m, radius_m of cylinders; the robot of 0.22 m starts at
(-2.25, 3), its goal is 10 m further.

Per scan, from 1 s after the start: points, the most of them, those on moving discs, and ghosts,
which are more than 0.1 m (0.15 m with noise) from everything that stands and on no moving disc.
missed: returns from standing discs, in view for 0.5 s, without a point within 0.1 m (0.15 m).
sharp: distance of the points from the outline, median and 95th percentile.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import math
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Observation
from mfba_planner.evaluation.suites.named_suites import suite
from mfba_planner.perception.obstacle_tracker import Tracker
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.perception.static_map import StaticMap
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.robot_model import Lidar, Noise, Robot
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World

LONGEST_S = 40.0
IN_VIEW_S = 0.5


@dataclass(frozen=True)
class Row:
    """One kind of worlds and robots."""

    worlds: str
    beams: int = 360
    reach_m: float = 3.5
    scan_m: float = 0.0
    odom_m: float = 0.0
    odom_rad: float = 0.0


NOISE = Row("barn", scan_m=0.02, odom_m=0.02, odom_rad=0.02)
ROWS = {
    "BARN": Row("barn"),
    "BARN, 1 cm, 1 cm, 0.01 rad": Row("barn", scan_m=0.01, odom_m=0.01, odom_rad=0.01),
    "BARN, 2 cm, 2 cm, 0.02 rad": replace(NOISE, worlds="barn"),
    "BARN, 180 beams": Row("barn", beams=180),
    "BARN, 1080 beams, 30 m": Row("barn", beams=1080, reach_m=30.0),
    "random-20": Row("random-20"),
    "random-20, 10 m": Row("random-20", reach_m=10.0),
    "random-20, 2 cm, 2 cm, 0.02 rad": replace(NOISE, worlds="random-20"),
    "dense": Row("dense"),
    "dense, 10 m": Row("dense", reach_m=10.0),
    "dense, 2 cm, 2 cm, 0.02 rad": replace(NOISE, worlds="dense"),
    "pedestrians": Row("pedestrians"),
    "pedestrians, 10 m": Row("pedestrians", reach_m=10.0),
    "pedestrians, 180 beams, 30 m": Row("pedestrians", beams=180, reach_m=30.0),
    "pedestrians, 2 cm, 2 cm, 0.02 rad": replace(NOISE, worlds="pedestrians"),
    "fast-20": Row("fast-20"),
    "dynabarn-like": Row("dynabarn-like"),
}


@dataclass
class Errors:
    """Counts over all scans of a row."""

    scans: int = 0
    points: int = 0
    ghosts: int = 0
    on_movers: int = 0
    returns: int = 0
    missed: int = 0
    most: int = 0
    off_m: list[np.ndarray] = field(default_factory=list)
    error_m: list[float] = field(default_factory=list)
    update_s: list[float] = field(default_factory=list)
    field_s: list[float] = field(default_factory=list)


def to_truth(x: np.ndarray, y: np.ndarray, given: Pose2D, true: Pose2D) -> np.ndarray:
    """Points (k, 2) that are seen from the given pose, as seen from the true one."""
    c, s = math.cos(true.yaw - given.yaw), math.sin(true.yaw - given.yaw)
    dx, dy = x - given.x, y - given.y
    return np.stack((true.x + c * dx - s * dy, true.y + s * dx + c * dy), axis=1)


def surface(at: np.ndarray, discs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance of points (k, 2) from the nearest of discs (m, 3), and which that is."""
    if not discs.shape[0]:
        return np.full(at.shape[0], np.inf), np.zeros(at.shape[0], dtype=np.int64)
    d = np.hypot(at[:, None, 0] - discs[:, 0], at[:, None, 1] - discs[:, 1]) - discs[:, 2]
    nearest = np.abs(d).argmin(axis=1)
    return d[np.arange(at.shape[0]), nearest], nearest


class Judge:
    """Makes the map beside the planner and compares it with the world at every tick."""

    def __init__(self, errors: Errors, noisy: bool) -> None:
        """Start with an empty map."""
        self._errors, self._near_m = errors, 0.15 if noisy else 0.1
        self._tracker, self._map = Tracker(), StaticMap()
        self._in_view_s: dict[int, float] = defaultdict(float)

    def __call__(self, world: World, sensor: SensorParams) -> Observation:
        """Observe, update the map and compare."""
        obs = observe_scan(world, sensor)
        if obs.scan is None:
            return obs
        self._tracker.update(obs.stamp_ns, obs.pose, obs.scan)
        moving, beams = self._tracker.moving(), self._tracker.beams
        assert beams is not None
        e, start = self._errors, time.perf_counter()
        self._map.update(obs.stamp_ns, obs.pose, beams, *moving, self._tracker.pose_error)
        updated = time.perf_counter()
        self._map.distance(np.array([obs.pose.x]), np.array([obs.pose.y]))
        e.update_s.append(updated - start)
        e.field_s.append(time.perf_counter() - updated)
        discs = np.array(
            [(*center, o.radius_m) for center, o in zip(world.centers(), world.scenario.obstacles)]
        )
        moves = np.array([any(world.velocity(k)) for k in range(len(discs))])
        self._compare(world, obs.pose, discs, moves)
        return obs

    def _compare(self, world: World, given: Pose2D, discs: np.ndarray, moves: np.ndarray) -> None:
        e, points = self._errors, self._map.points()
        at = to_truth(points[:, 0], points[:, 1], given, world.pose)
        off, _ = surface(at, discs[~moves])
        on_mover, _ = surface(at, discs[moves])
        ghost = np.abs(off) > self._near_m
        if world.time_s > 1.0:
            e.scans += 1
            e.points += off.size
            e.most = max(e.most, off.size)
            e.ghosts += int((ghost & (on_mover >= 0.05)).sum())
            e.on_movers += int((ghost & (on_mover < 0.05)).sum())
            e.off_m.append(off[~ghost])
        beams = self._tracker.beams
        assert beams is not None
        hit = beams.range_m * beams.spacing_rad <= self._map.params.spacing_m
        hit &= beams.range_m < beams.longest_m - 0.2
        r = beams.range_m[hit]
        x = beams.origin_x[hit] + r * beams.cos[hit]
        y = beams.origin_y[hit] + r * beams.sin[hit]
        _, of = surface(to_truth(x, y, given, world.pose), discs)
        for k in np.unique(of).tolist():
            self._in_view_s[k] += world.tick_ns * 1e-9
        late = np.array(
            [self._in_view_s[k] > IN_VIEW_S and not moves[k] for k in range(len(moves))]
        )
        chosen = late[of]
        e.returns += int(chosen.sum())
        if chosen.any() and points.size:
            dx, dy = x[chosen, None] - points[:, 0], y[chosen, None] - points[:, 1]
            e.missed += int((np.sqrt((dx * dx + dy * dy).min(axis=1)) > self._near_m).sum())
        elif chosen.any():
            e.missed += int(chosen.sum())


def barn_worlds(path: Path) -> Iterator[Scenario]:
    """BARN's worlds from a file of cylinders."""
    worlds: dict[str, list[Obstacle]] = defaultdict(list)
    with gzip.open(path, "rt", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            center = (float(row["x_m"]), float(row["y_m"]))
            obstacle = Obstacle(center_m=center, radius_m=float(row["radius_m"]))
            worlds[row["world"]].append(obstacle)
    for name, obstacles in worlds.items():
        yield Scenario(
            name=f"barn-{name}", start_m=(-2.25, 3.0), goal_m=(-2.25, 13.0), robot_radius_m=0.22,
            obstacles=tuple(obstacles), time_limit_s=LONGEST_S,
        )  # fmt: skip


def run_row(row: Row, worlds: int, barn: Path | None) -> Errors:
    """Drive through the worlds of a row."""
    e = Errors()
    noise = Noise(scan_m=row.scan_m, odom_m=row.odom_m, odom_rad=row.odom_rad)
    lidar = Lidar(beams=row.beams, range_max_m=row.reach_m)
    barn_list = list(barn_worlds(barn)) if row.worlds == "barn" and barn else []
    for k in range(worlds):
        if row.worlds == "barn":
            scenario, speed = barn_list[(k * 37) % len(barn_list)], 1.0
        else:
            scenario, speed = suite(row.worlds).world(k), suite(row.worlds).speed_mps
        robot = Robot(lidar=lidar, noise=noise)
        scenario = replace(
            scenario, robot=robot, time_limit_s=min(scenario.time_limit_s, LONGEST_S)
        )
        params = PlannerParams(method=Method.PREDICTIVE, speed_mps=speed)
        params, sensor = scenario.planner_params(params), SensorParams()
        run(
            scenario, planner=params, sensor=sensor, seed=k,
            path_planner=make_planner(params, sensor, k), observe=Judge(e, row.scan_m > 0.0),
        )  # fmt: skip
    return e


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--worlds", type=int, default=5)
    parser.add_argument("--only", default="", help="rows whose name holds this")
    parser.add_argument("--barn", type=Path, help="cylinders of BARN's worlds, .csv.gz")
    found = parser.parse_args()
    columns = [
        "worlds",
        "points",
        "most",
        "on movers",
        "ghosts",
        "missed",
        "sharp, cm",
        "update, ms",
        "field, ms",
    ]
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for name, row in ROWS.items():
        if found.only not in name or (row.worlds == "barn" and found.barn is None):
            continue
        e = run_row(row, found.worlds, found.barn)
        off = np.abs(np.concatenate(e.off_m)) * 100.0 if e.off_m else np.array([math.nan])
        off = off if off.size else np.array([math.nan])
        update, times = 1e3 * np.array(e.update_s), 1e3 * np.array(e.field_s)
        print(
            f"| {name} | {e.points / e.scans:.1f} | {e.most} "
            f"| {e.on_movers / e.scans:.2f} | {e.ghosts / e.scans:.2f} "
            f"| {100.0 * e.missed / max(e.returns, 1):.2f} % "
            f"| {np.quantile(off, 0.5):.1f}, {np.quantile(off, 0.95):.1f} "
            f"| {np.quantile(update, 0.5):.2f}, {np.quantile(update, 0.99):.2f} "
            f"| {np.quantile(times, 0.5):.2f}, {np.quantile(times, 0.99):.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
