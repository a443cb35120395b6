# SPDX-License-Identifier: Apache-2.0
"""Lockstep under stress: every recorded run must have the digest of the core driver's.

Runs of both case studies and of random worlds, with random readings, methods, sensors and
seeds. Most go through the in-process driver; the others as a process per node, started in
random sequence with random delays. Some run while every core is kept busy by other processes.
The digest is taken from the bag, and `mfba verify` must agree.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from manual_run import ALL, ManualRun

from mfba_planner.core.option_specs import override
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.paper import readings_of_paper
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.scenarios.run_config import Driver, RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls
from mfba_planner.simulation.run_episode import simulate
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.verification.verify_bag import verify


def random_world(rng: np.random.Generator) -> Scenario:
    """Three to ten obstacles between walls, none of them over the start."""
    obstacles = tuple(
        Obstacle(
            center_m=(float(x), float(y)),
            radius_m=float(rng.uniform(0.2, 0.4)),
            speed_mps=float(rng.uniform(0.0, 0.4)),
            heading_rad=float(rng.uniform(-np.pi, np.pi)),
        )
        for x, y in rng.uniform(1.2, 10.8, (int(rng.integers(3, 11)), 2))
    )
    return Scenario(
        name="random",
        start_m=(0.0, 0.0),
        goal_m=(11.5, 11.5),
        obstacles=obstacles,
        walls=Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0)),
        time_limit_s=40.0,
    )


def random_config(rng: np.random.Generator, driver: Driver) -> RunConfig:
    """One run out of all that could be."""
    which = int(rng.integers(4))
    scenario = load_scenario(f"case{which + 1}") if which < 2 else random_world(rng)
    names = list(readings_of_paper.PLANNERS)
    planner = readings_of_paper.planner(names[int(rng.integers(len(names)))])
    algorithm = ("mfba", "ba")[int(rng.integers(2))]
    method = ("paper", "paper", "paper", "predictive")[int(rng.integers(4))]
    sensor = SensorParams(sectors=(12, 24, 36)[int(rng.integers(3))])
    return replace(
        RunConfig(scenario=scenario),
        planner=override(planner, {"bat.algorithm": algorithm, "method": method}),
        sensor=sensor,
        seed=int(rng.integers(2**31)),
        driver=driver,
    )


def by_driver(config: RunConfig, bag: Path, rng: np.random.Generator) -> None:
    """Drive the run and record it."""
    if config.driver is Driver.IN_PROCESS:
        with private_domain() as domain:
            run_in_process(config, bag, domain_id=domain)
        return
    sequence = [ALL[k] for k in rng.permutation(len(ALL))]
    with ManualRun(config, bag) as graph:
        graph.start(sequence, rng.uniform(0.0, 0.5, len(sequence)).tolist())
        graph.end()


def one(seed: int, driver: Driver) -> tuple[str, int]:
    """Run once: what is wrong, "" for nothing, and the number of decisions."""
    rng = np.random.default_rng(seed)
    config = random_config(rng, driver)
    expected = digest(
        simulate(
            config.scenario, planner=config.planner, sensor=config.sensor, seed=config.seed
        ).ticks
    )
    with tempfile.TemporaryDirectory() as root:
        bag = Path(root) / "bag"
        try:
            by_driver(config, bag, rng)
        except Exception as error:
            return f"did not finish: {error}", 0
        report = verify(bag)
    if report.digest != expected:
        return f"digest {report.digest}, the core's is {expected}", 0
    return "" if report.is_identical else f"verify: {report.faults}", len(report.recorded)


@contextmanager
def busy_cores() -> Iterator[None]:
    """Two processes per core that do nothing but compute."""
    burners = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"])
        for _ in range(2 * (os.cpu_count() or 1))
    ]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def main() -> int:
    """Print how many runs of each kind had the core's digest; exit 1 unless all had."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--multi-process", type=int, default=60, help="of these, as processes")
    parser.add_argument("--loaded", type=int, default=100, help="of these, with all cores busy")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    kinds = [
        Driver.MULTI_PROCESS if k < options.multi_process else Driver.IN_PROCESS
        for k in range(options.runs)
    ]
    random.Random(options.seed).shuffle(kinds)
    jobs = list(enumerate(kinds, start=options.seed * 1_000_000))
    made: Counter[str] = Counter()
    equal: Counter[str] = Counter()
    decisions = 0
    started = time.monotonic()

    def through(jobs: list[tuple[int, Driver]], where: str) -> None:
        nonlocal decisions
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(options.workers, context) as pool:
            results = pool.map(one, *zip(*jobs)) if jobs else iter(())
            for (seed, driver), (wrong, count) in zip(jobs, results):
                made[f"{driver.value}, {where}"] += 1
                equal[f"{driver.value}, {where}"] += not wrong
                decisions += count
                if wrong:
                    print(f"run {seed} ({driver.value}, {where}): {wrong}", flush=True)

    with busy_cores():
        through(jobs[: options.loaded], "all cores busy")
    through(jobs[options.loaded :], "nothing else")
    for kind, count in sorted(made.items()):
        print(f"{kind:<32} {equal[kind]:>5} of {count:>5} equal")
    took_s = time.monotonic() - started
    print(
        f"{equal.total()} of {made.total()} runs, {decisions} decisions: digest equal to the "
        f"core driver's ({took_s:.0f} s)"
    )
    return int(equal.total() < made.total())


if __name__ == "__main__":
    raise SystemExit(main())
