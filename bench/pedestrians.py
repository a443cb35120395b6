# SPDX-License-Identifier: Apache-2.0
"""Crossings among recorded pedestrians, who do not react to the robot.

    python bench/pedestrians.py recording.csv.gz other.csv --crossings 100
    python bench/pedestrians.py recording.csv --perception lidar --fov 270 --speed 0.8 --speed 1.2
    python bench/pedestrians.py recording.csv --planner orca --perception known

A recording is a table (CSV, also .gz) with the columns t_s, person, x_m, y_m, for example of the
ETH and UCY data sets, which this project does not contain. People are discs that walk straight
between two samples, and straight on before the first and after the last of them.

Crossing k is drawn from the seed and k: a side of the area, start and goal on it and on the
opposite one, and a moment at which a robot that drives straight would come within 1 m of a
person's centre or nearer. Contacts of people with a robot that stands, or from behind, are
counted apart. The run is that of `mfba sim` for a robot with that lidar.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import math
import sys
from pathlib import Path

import numpy as np
from crossings import add_robot_arguments, judge_all, obstacle_along, report, robots_of

from mfba_planner.core.errors import ConfigError, InputError, MfbaError
from mfba_planner.core.geometry import Point
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

COLUMNS = ("t_s", "person", "x_m", "y_m")
ROBOT_RADIUS_M, PERSON_RADIUS_M = 0.3, 0.3
LIMIT_S = 60.0
NEAR_M = 1.0  # that a straight trip comes to a person's centre, or nearer
FREE_M = 0.4  # around the start at first, beyond both radii, and around the goal while arriving
LEAST_PEOPLE = 3  # who are in the area meanwhile
TRIES = 5000
STANDS_MPS = 0.1

Track = tuple[np.ndarray, np.ndarray]  # times (n,) and positions (n, 2) of one person


def read_recording(path: Path) -> list[Track]:
    """The people of a recording. Raises InputError, in one line, for what is no such table."""
    open_text = gzip.open if path.suffix == ".gz" else open
    rows: dict[str, list[tuple[float, float, float]]] = {}
    try:
        with open_text(path, "rt", encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            if missing := [name for name in COLUMNS if name not in (reader.fieldnames or ())]:
                raise InputError(f"{path}: no column {missing[0]}; give {', '.join(COLUMNS)}")
            for number, row in enumerate(reader, start=2):
                try:
                    t, x, y = (float(row[name]) for name in ("t_s", "x_m", "y_m"))
                except (TypeError, ValueError):
                    raise InputError(f"{path}, line {number}: not three numbers") from None
                if not all(map(math.isfinite, (t, x, y))):
                    raise InputError(f"{path}, line {number}: not finite")
                rows.setdefault(row["person"], []).append((t, x, y))
    except (OSError, UnicodeDecodeError, EOFError) as error:
        raise InputError(f"{path}: cannot be read ({error}); give a CSV, also .gz") from None
    tracks = []
    for person, samples in rows.items():
        table = np.array(sorted(samples))
        if (np.diff(table[:, 0]) <= 0.0).any():
            raise InputError(f"{path}: person {person} is at two places at once")
        if len(table) > 1:
            tracks.append((table[:, 0], table[:, 1:]))
    if not tracks:
        raise InputError(f"{path}: no person with two samples")
    return tracks


def position(track: Track, t_s: np.ndarray) -> np.ndarray:
    """Positions (k, 2) at times (k,): interpolated, and straight on beyond both ends."""
    times, points = track
    k = np.clip(np.searchsorted(times, t_s, side="right") - 1, 0, len(times) - 2)
    share = (t_s - times[k]) / (times[k + 1] - times[k])
    found: np.ndarray = points[k] + share[:, None] * (points[k + 1] - points[k])
    return found


def crossing(
    name: str, tracks: list[Track], speed_mps: float, number: int, seed: int, radius_m: float
) -> Scenario:
    """Crossing `number` of a recording; ConfigError where none is found."""
    rng = np.random.default_rng([seed, number])
    everywhere = np.concatenate([points for _, points in tracks])
    low, high = np.percentile(everywhere, [2.0, 98.0], axis=0)
    first_s = min(times[0] for times, _ in tracks)
    last_s = max(times[-1] for times, _ in tracks)
    for _ in range(TRIES):
        axis, flip = int(rng.integers(2)), rng.random() < 0.5
        a, b = np.empty(2), np.empty(2)
        a[axis], b[axis] = (high[axis], low[axis]) if flip else (low[axis], high[axis])
        a[1 - axis], b[1 - axis] = rng.uniform(low[1 - axis], high[1 - axis], 2)
        trip_s = math.dist(a, b) / speed_mps
        if last_s - first_s <= trip_s:
            raise ConfigError(f"{name}: shorter than a trip of {trip_s:.0f} s; give a longer one")
        t0 = rng.uniform(first_s, last_s - trip_s)
        # Who is recorded during the trip; those who come later are left out.
        present = [t for t in tracks if t[0][0] <= t0 + 1.5 * trip_s and t[0][-1] >= t0]
        t = np.arange(0.0, trip_s, 0.1)
        robot = a + (t / trip_s)[:, None] * (b - a)
        centers = np.array([position(track, t0 + t) for track in present]).reshape(-1, t.size, 2)
        inside = ((centers >= low) & (centers <= high)).all(axis=2).any(axis=1)
        if inside.sum() < LEAST_PEOPLE:
            continue
        away = np.linalg.norm(centers - robot, axis=2)
        free_m = radius_m + ROBOT_RADIUS_M + FREE_M
        at_goal = np.linalg.norm(centers[:, -20:] - b, axis=2)
        if away.min() > NEAR_M or away[:, 0].min() < free_m or at_goal.min() < free_m:
            continue
        return Scenario(
            name=f"{name}-{number}",
            start_m=_point(a),
            goal_m=_point(b),
            robot_radius_m=ROBOT_RADIUS_M,
            obstacles=tuple(
                obstacle_along((times - t0).tolist(), [_point(p) for p in points], radius_m)
                if times[0] <= t0
                else _later(times - t0, points, radius_m)
                for times, points in present
            ),
            time_limit_s=LIMIT_S,
        )
    raise ConfigError(f"{name}: no crossing found in {TRIES} tries; give a denser recording")


def _later(times: np.ndarray, points: np.ndarray, radius_m: float) -> Obstacle:
    """Somebody whose first sample comes after t = 0 has come straight from where that leads."""
    v = (points[1] - points[0]) / (times[1] - times[0])
    before = points[0] - times[0] * v
    stamps, places = [0.0, *times.tolist()], [before, *points]
    return obstacle_along(stamps, [_point(p) for p in places], radius_m)


def _point(row: np.ndarray) -> Point:
    return (float(row[0]), float(row[1]))


def main(args: list[str] | None = None) -> int:
    """Print a line for each recording and robot, and for all recordings together."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("recordings", type=Path, nargs="+", metavar="CSV")
    parser.add_argument("--crossings", type=int, default=100, help="of each (default: 100)")
    parser.add_argument("--first", type=int, default=0, help="number of the first crossing")
    parser.add_argument("--seed", type=int, default=0, help="of all crossings (default: 0)")
    parser.add_argument("--radius", type=float, default=PERSON_RADIUS_M, help="of a person, m")
    add_robot_arguments(parser, [1.0])
    found = parser.parse_args(args)
    try:
        recordings = [(path.name.partition(".")[0], read_recording(path))
                      for path in found.recordings]  # fmt: skip
        for robot in robots_of(found):
            total = None
            for name, tracks in recordings:
                scenarios = [
                    crossing(name, tracks, robot.speed_mps, k, found.seed, found.radius)
                    for k in range(found.first, found.first + found.crossings)
                ]
                endings = judge_all(scenarios, robot, found.workers, found.first)
                print(report(f"{name}: {robot.label}", endings), flush=True)
                total = endings if total is None else total + endings
            if total is not None and len(recordings) > 1:
                print(report(f"all: {robot.label}", total), flush=True)
    except MfbaError as error:
        print(f"pedestrians.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
