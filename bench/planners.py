# SPDX-License-Identifier: Apache-2.0
"""What one decision of the predictive planner costs, against obstacles in range.

Run: python bench/planners.py. Circles are placed at random, evenly over the sensing region
(which grows with their number beyond ten, so that the crowd is equally dense), none in contact
with the robot; every arrangement has a planner of its own, which has observed it before. The
paper's path generation is measured in turn with them: on a busy machine trust the ratio.
"""

from __future__ import annotations

import argparse
import math
import statistics
from collections.abc import Callable

import numpy as np
from decision import FREE, decisions, measure

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Circle, Mode, Observation
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.planner_registry import make
from mfba_planner.planning.predictive_planner import preset

COUNTS = (1, 3, 10, 30, 100, 300, 1000)
RADIUS_M, SR_M = 0.6, 0.8
ARRANGEMENTS = 200


def arrangement(count: int, rng: np.random.Generator) -> tuple[Circle, ...]:
    """So many circles around (1, 2) that move at 0.1 to 0.3 m/s."""
    outer = (RADIUS_M + SR_M) * math.sqrt(max(1.0, count / 10.0))
    circles = []
    for _ in range(count):
        r = math.sqrt(rng.uniform((RADIUS_M + 0.01) ** 2, outer**2))
        bearing, heading = rng.uniform(-math.pi, math.pi, 2).tolist()
        speed = rng.uniform(0.1, 0.3)
        circles.append(
            Circle(
                center_m=(1.0 + r * math.cos(bearing), 2.0 + r * math.sin(bearing)),
                radius_m=RADIUS_M,
                velocity_mps=(speed * math.cos(heading), speed * math.sin(heading)),
            )
        )
    return tuple(circles)


def predictive(count: int) -> Callable[[int], object]:
    """Decisions of as many planners as there are arrangements, in turn."""
    rng = np.random.default_rng(count)
    crowds = [arrangement(count, rng) for _ in range(ARRANGEMENTS)]
    params = preset(PlannerParams(speed_mps=0.8))
    planners = [make("predictive", params) for _ in crowds]
    calls = iter(range(10**9))

    def once(stamp: int) -> object:
        number = next(calls) % ARRANGEMENTS
        pose = Pose2D(1.0, 2.0)
        return planners[number].plan(
            Observation(
                stamp_ns=stamp,
                now_ns=stamp,
                pose=pose,
                ranges_m=(),
                goal=(9.0, 9.0),
                circles=crowds[number],
            )
        )

    return once


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=400)
    options = parser.parse_args()
    taken = measure(
        {
            "paper, path generation": decisions(FREE, Mode.PATH_GENERATION),
            **{f"predictive, {n} in range": predictive(n) for n in COUNTS},
        },
        options.rounds,
    )
    base = statistics.median(next(iter(taken.values())))
    print(f"{'one decision':28} {'median us':>10} {'p95 us':>10} {'x paper':>8}")
    for name, times in taken.items():
        median = statistics.median(times)
        p95 = statistics.quantiles(times, n=20)[18]
        print(f"{name:28} {median:10.1f} {p95:10.1f} {median / base:8.2f}")


if __name__ == "__main__":
    main()
