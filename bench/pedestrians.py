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
import gzip
import sys
from pathlib import Path

import numpy as np
from crossings import add_robot_arguments, judge_all, obstacle_along, report, robots_of

from mfba_planner.core.errors import ConfigError, InputError, MfbaError
from mfba_planner.core.geometry import Point
from mfba_planner.scenarios.importers.crossings import (
    LIMIT_S,
    ROBOT_RADIUS_M,
    Track,
    draw_crossing,
    straight_on,
)
from mfba_planner.scenarios.importers.people_recording import csv_tracks
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

PERSON_RADIUS_M = 0.3


def read_recording(path: Path) -> list[Track]:
    """The people of a recording. Raises InputError, in one line, for what is no such table."""
    open_text = gzip.open if path.suffix == ".gz" else open
    try:
        with open_text(path, "rt", encoding="utf-8", newline="") as file:
            return csv_tracks(file.read())
    except ConfigError as error:
        raise InputError(f"{path}, {error}") from None
    except (OSError, UnicodeDecodeError, EOFError) as error:
        raise InputError(f"{path}: cannot be read ({error}); give a CSV, also .gz") from None


def crossing(
    name: str, tracks: list[Track], speed_mps: float, number: int, seed: int, radius_m: float
) -> Scenario:
    """Crossing `number` of a recording; ConfigError where none is found."""
    found = draw_crossing(name, tracks, speed_mps, number, seed, radius_m, positions=straight_on)
    return Scenario(
        name=f"{name}-{number}",
        start_m=found.start_m,
        goal_m=found.goal_m,
        robot_radius_m=ROBOT_RADIUS_M,
        obstacles=tuple(
            obstacle_along((times - found.t0_s).tolist(), [_point(p) for p in points], radius_m)
            if times[0] <= found.t0_s
            else _later(times - found.t0_s, points, radius_m)
            for times, points in found.tracks
        ),
        time_limit_s=LIMIT_S,
    )


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
