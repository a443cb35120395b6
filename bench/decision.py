# SPDX-License-Identifier: Apache-2.0
"""Time of one decision, beside its lower bound, and of case study 1 by the core driver.

Run: python bench/decision.py. The lower bound is what every swarm of this size needs: one
random stream, and the objective at every candidate. All are measured in turn (A B C A B C
...), so that a machine whose speed drifts slows all of them; trust the ratios.
"""

from __future__ import annotations

import argparse
import math
import platform
import statistics
import time
from collections.abc import Callable

import numpy as np

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Mode, Observation
from mfba_planner.core.random_streams import stream
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run
from mfba_planner.swarm.bat_swarm import BatParams

BUDGET_US = 200.0
RUN_BUDGET_MS = 50.0
GOAL = (12.0, 12.0)
FREE = (math.inf,) * 12
FIG_5 = (0.5, 0.5, *FREE[:4], 0.5, 0.5, 0.5, *FREE[:3])


def floor(params: BatParams) -> Callable[[int], object]:
    """One stream, and the objective population * (iterations + 1) times."""
    points = [[0.1 * k, 0.2] for k in range(params.population)]

    def cost(x: list[float]) -> float:
        dx, dy = x[0] - 8.0, x[1] - 9.0
        return math.sqrt(dx * dx + dy * dy)

    def once(stamp: int) -> object:
        stream(1, stamp)
        return [[cost(x) for x in points] for _ in range(params.iterations + 1)]

    return once


def decisions(ranges_m: tuple[float, ...], mode: Mode) -> Callable[[int], object]:
    """Decisions of one planner on ever new stamps, between start and goal."""
    planner = Algorithm1(PlannerParams(), seed=1)

    def once(stamp: int) -> object:
        pose = Pose2D(1.0 + 1e-4 * (stamp % 50_000), 2.0)
        decision = planner.plan(
            Observation(stamp_ns=stamp, now_ns=stamp, pose=pose, ranges_m=ranges_m, goal=GOAL)
        )
        assert decision.mode is mode
        return decision

    return once


def measure(subjects: dict[str, Callable[[int], object]], rounds: int) -> dict[str, list[float]]:
    """Microseconds of every call, all subjects in turn; the first tenth warms up."""
    times: dict[str, list[float]] = {name: [] for name in subjects}
    for k in range(rounds + rounds // 10):
        for name, once in subjects.items():
            start = time.perf_counter_ns()
            once(382_165_605 * (k + 1))
            times[name].append((time.perf_counter_ns() - start) / 1e3)
    return {name: taken[-rounds:] for name, taken in times.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=5000)
    parser.add_argument("--runs", type=int, default=20)
    options = parser.parse_args()
    bat = BatParams()
    evaluations = bat.population * (bat.iterations + 1)
    taken = measure(
        {
            f"floor: stream + {evaluations} evaluations": floor(bat),
            "path generation": decisions(FREE, Mode.PATH_GENERATION),
            "obstacle avoidance": decisions(FIG_5, Mode.OBSTACLE_AVOIDANCE),
        },
        options.rounds,
    )
    print(f"Python {platform.python_version()}, numpy {np.__version__}; {options.rounds} each")
    print(f"{'one decision':36} {'median us':>10} {'p99 us':>8} {'x floor':>8}")
    base = statistics.median(next(iter(taken.values())))
    for name, times in taken.items():
        median = statistics.median(times)
        p99 = statistics.quantiles(times, n=100)[98]
        print(f"{name:36} {median:10.1f} {p99:8.1f} {median / base:8.2f}")
    print(f"(budget: path generation in {BUDGET_US:g} us at the median)")
    case1 = load_scenario("case1")
    spent, ticks = [], 0
    for seed in range(options.runs):
        start = time.perf_counter()
        ticks += len(run(case1, seed=seed).ticks)
        spent.append((time.perf_counter() - start) * 1e3)
    print(
        f"case study 1, core driver: median {statistics.median(spent):.1f} ms, longest "
        f"{max(spent):.1f} ms of {options.runs} runs, {ticks / options.runs:.0f} ticks each "
        f"(budget: {RUN_BUDGET_MS:g} ms)"
    )


if __name__ == "__main__":
    main()
