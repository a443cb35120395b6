# SPDX-License-Identifier: Apache-2.0
"""Kill the planner with -9 during a run and start it again: same digest, or a reported reason.

A process per node, in lockstep; at a random tick the planner is killed and a new one started,
which picks up at the tick the world repeats. The bag is then verified without ROS.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from manual_run import ManualRun

from mfba_planner.paper import readings_of_paper
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.run_episode import run
from mfba_planner.verification.verify_bag import verify


def interrupted_run(config: RunConfig, kill_at: int, bag: Path) -> None:
    """Run case and kill; return when world_sim reports the end of the run."""
    with ManualRun(config, bag, answer_timeout_s=0.5, answer_retries=60) as run:
        run.start()
        over = run.monitor.ticks_at_end
        run.until(lambda: run.tick() >= kill_at or over(), "tick to kill at")
        run.replace_planner()
        run.end()


def main() -> int:
    """Print one line per run; exit 1 when a run differs without a word."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reading", default="section6", choices=list(readings_of_paper.PLANNERS))
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    same = refused = silent = 0
    with tempfile.TemporaryDirectory() as root:
        for index in range(options.runs):
            case = ("case1", "case2")[index % 2]
            params: PlannerParams = readings_of_paper.planner(options.reading)
            config = replace(RunConfig(scenario=load_scenario(case)), planner=params, seed=index)
            core = run(config.scenario, planner=params, seed=index)
            kill_at = int(rng.integers(1, len(core.ticks) - 2))
            bag = Path(root) / str(index)
            interrupted_run(config, kill_at, bag)
            report = verify(bag)
            if report.is_identical and report.digest == digest(core.ticks):
                same += 1
                outcome = "same digest"
            elif not report.is_identical:
                refused += 1
                first = report.divergence and f"tick {report.divergence.tick} differs"
                fault = next(iter(report.faults), first)
                outcome = f"refused: {fault}"
            else:
                silent += 1
                outcome = "DIFFERENT, and not reported"
            print(f"{index}: {case}, killed at tick {kill_at}: {outcome}", flush=True)
    print(f"{same} same digest, {refused} refused with a reason, {silent} silently different")
    return int(silent > 0)


if __name__ == "__main__":
    raise SystemExit(main())
