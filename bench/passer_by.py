# SPDX-License-Identifier: Apache-2.0
"""One passer-by, who does not react, from every side: how often the robot avoids contact.

    python bench/passer_by.py                      # predictive, 360 beams of 3.5 m, 1 m/s
    python bench/passer_by.py --planner orca --perception known --range 3.5

The robot drives 10 m. Run k of a speed: the person walks straight, at an angle of 360 k / runs
degrees to the robot's direction, and would meet a robot that drives straight in the middle of its
trip, give or take 0.3 m to each side; later on if he would start nearer than 1.5 m, and if that
does not help he follows the robot from 1.5 m behind.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np
from crossings import add_robot_arguments, judge_all, report, robots_of

from mfba_planner.core.geometry import distance, towards
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

SPEEDS_MPS = (0.2, 0.5, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5)
TRIP_M, RADIUS_M, ASIDE_M, NEAREST_M = 10.0, 0.3, 0.3, 1.5


def passing(speed_mps: float, robot_mps: float, number: int, runs: int, seed: int) -> Scenario:
    """Run `number` with a passer-by of this speed."""
    aside = np.random.default_rng([seed, number]).uniform(-ASIDE_M, ASIDE_M)
    heading = 2.0 * math.pi * number / runs
    for share in (0.5, 0.6, 0.7, 0.8, 0.9):  # of the trip, where they meet
        meeting_m = share * TRIP_M
        meeting = (meeting_m - aside * math.sin(heading), aside * math.cos(heading))
        start = towards(meeting, heading, -speed_mps * meeting_m / robot_mps)
        if distance(start, (0.0, 0.0)) >= NEAREST_M:
            break
    else:  # as fast as the robot and the same way: right behind it
        start = towards((0.0, 0.0), heading, -NEAREST_M)
    person = Obstacle(center_m=start, radius_m=RADIUS_M, speed_mps=speed_mps, heading_rad=heading)
    return Scenario(
        name=f"passer-by-{number}",
        start_m=(0.0, 0.0),
        goal_m=(TRIP_M, 0.0),
        obstacles=(person,),
        time_limit_s=60.0,
    )


def main(args: list[str] | None = None) -> int:
    """Print a line for each robot and speed of the passer-by."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=60, help="of each speed (default: 60)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--person", action="append", type=float, metavar="M/S",
        help=f"speed of the passer-by; may be repeated (default: {SPEEDS_MPS})",
    )  # fmt: skip
    add_robot_arguments(parser, [1.0])
    parser.set_defaults(range_m=3.5)
    found = parser.parse_args(args)
    for robot in robots_of(found):
        for speed in found.person or SPEEDS_MPS:
            scenarios = [
                passing(speed, robot.speed_mps, k, found.runs, found.seed)
                for k in range(found.runs)
            ]
            endings = judge_all(scenarios, robot, found.workers)
            print(report(f"{robot.label}; passer-by {speed:g} m/s", endings), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
