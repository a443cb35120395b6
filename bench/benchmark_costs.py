# SPDX-License-Identifier: Apache-2.0
"""Cost of runs and of one decision: our planners, pyrvo's ORCA, a dynamic window; by obstacles.

The dynamic window is this package's `dwa`, all velocities at once in numpy, and again as in
tutorials (stepwise_dwa.py); PythonRobotics itself is not a package that could be measured.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from benchmark_runs import FINE, Entry
from planners import arrangement
from stepwise_dwa import StepwiseDwa

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Observation, PathPlanner
from mfba_planner.evaluation.sweep.run_sweep import sweep
from mfba_planner.evaluation.sweep.sweep_spec import SweepSpec
from mfba_planner.evaluation.sweep.worker import Lost, run_in_worker
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_registry import make

COUNTS = (1, 3, 10, 30, 100, 300, 1000)
STEPWISE = "dwa, step by step"
NAMES = ("predictive", "orca", "dwa", STEPWISE)
ARRANGEMENTS = 20  # fewer for fewer than three rounds of each
PATIENCE_S = 3600.0
RATE_SUITE, RATE_ROUNDS = "random-10", 3


@dataclass(frozen=True, slots=True)
class Costs:
    """Microseconds of one decision, median, per planner and number of circles in range.

    median_us: planners in turn, since a robot's computer runs other code between two decisions.
    repeated_us: `predictive` with ten circles in range, again and again, as timing loops do.
    """

    counts: Sequence[int]
    median_us: Mapping[str, Sequence[float]]
    rounds: int
    repeated_us: float

    def at(self, name: str, count: int) -> float:
        """One of them."""
        return self.median_us[name][list(self.counts).index(count)]

    def slope(self, name: str) -> float:
        """Exponent of the growth with the number, from 10 on, by least squares on logarithms."""
        far = [k for k, count in enumerate(self.counts) if count >= 10]
        x = np.log([self.counts[k] for k in far])
        return float(np.polyfit(x, np.log([self.median_us[name][k] for k in far]), 1)[0])


def measure_rates(
    entries: Sequence[Entry], worlds: int, workers: int, executor: Executor | None
) -> Mapping[str, list[float]]:
    """Episodes per minute of whole sweeps that nothing is kept of, by label; all in turn."""
    found: dict[str, list[float]] = {entry.label: [] for entry in entries}
    for _ in range(RATE_ROUNDS):
        for entry in entries:
            spec = SweepSpec(
                suite=RATE_SUITE, planners=(entry.planner,), worlds=worlds, oracle=False,
                setting=entry.setting,
            )  # fmt: skip
            begun = time.perf_counter()
            sweep(spec, workers=workers, executor=executor)
            found[entry.label].append(60.0 * worlds / (time.perf_counter() - begun))
    return found


def measure_costs(rounds: int) -> Costs:
    """Measure in a process like those that runs are made in: with one thread."""
    (found,) = run_in_worker(_measure, [rounds], None, PATIENCE_S)
    if isinstance(found, Lost):
        raise SystemExit(f"the measurement of cost {found.why}")
    return found


def _measure(rounds: int, _: None) -> Costs:
    """CPU times, all in turn: a machine whose speed drifts slows all alike."""
    median_us: dict[str, list[float]] = {name: [] for name in NAMES}
    different = min(ARRANGEMENTS, max(1, rounds // 3))
    fewest = 3 * different  # in the first third every planner meets its arrangement
    for count in COUNTS:
        subjects = {name: _deciding(name, count, different) for name in NAMES}
        taken: dict[str, list[int]] = {name: [] for name in NAMES}
        for k in range(max(fewest, min(rounds, 20 * rounds // count))):
            for name, once in subjects.items():
                taken[name].append(_taken(once, k))
        for name in NAMES:
            median_us[name].append(statistics.median(taken[name][different:]) / 1e3)
    again, repeated_ns = _deciding(NAMES[0], 10, different), []
    for k in range(max(fewest, 20 * rounds)):
        repeated_ns.append(_taken(again, k))
    return Costs(COUNTS, median_us, rounds, statistics.median(repeated_ns[different:]) / 1e3)


def _taken(once: Callable[[int], object], k: int) -> int:
    """Nanoseconds of CPU time that the k-th decision takes."""
    start_ns = time.process_time_ns()
    once(100_000_000 * (k + 1))
    return time.process_time_ns() - start_ns


def _deciding(name: str, count: int, different: int) -> Callable[[int], object]:
    """Decisions of as many planners as there are arrangements, the same ones for every name."""
    rng = np.random.default_rng(count)
    crowds = [arrangement(count, rng) for _ in range(different)]
    planners = [_planner(name) for _ in crowds]
    calls = iter(range(10**9))

    def once(stamp: int) -> object:
        number = next(calls) % different
        return planners[number].plan(
            Observation(
                stamp_ns=stamp, now_ns=stamp, pose=Pose2D(1.0, 2.0), ranges_m=(), goal=(9.0, 9.0),
                circles=crowds[number],
            )
        )  # fmt: skip

    return once


def _planner(name: str) -> PathPlanner:
    if name == STEPWISE:
        return StepwiseDwa(FINE, SensorParams(), 0)
    return make(name, FINE)
