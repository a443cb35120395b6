# SPDX-License-Identifier: Apache-2.0
"""The three drivers take the same decisions: both case studies, MFBA and BA, seed by seed.

Every run goes through `mfba run`; the ROS drivers' Episodes are read back from their bags and
compared with the core's, tick by tick, every field of every Decision.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

from mfba_planner.core.option_specs import override
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import run

MFBA = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"


def recorded(scenario: str, algorithm: str, seed: int, driver: str, out: Path) -> Episode | None:
    """Run through a ROS driver and read the bag; None, and why, for a run that failed."""
    arguments = ["run", scenario, "--algorithm", algorithm, "--seed", str(seed)]
    command = [sys.executable, "-c", MFBA, *arguments, "--driver", driver, "--out", str(out)]
    done = subprocess.run([*command, "--no-picture"], check=False, capture_output=True, text=True)
    if done.returncode:
        print(f"{' '.join(arguments)}: {done.stderr.strip().splitlines()[-1:]}", flush=True)
        return None
    return read_episode(out / "bag")


def main() -> int:
    """Print one line per driver; exit 1 when a decision differs or a run fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--drivers", nargs="+", default=["in-process", "multi-process"])
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as root:
        for driver in options.drivers:
            runs = equal = good = decisions = 0
            for scenario, algorithm, seed in product(
                ("case1", "case2"), ("mfba", "ba"), range(options.seeds)
            ):
                params = override(PlannerParams(), {"bat.algorithm": algorithm})
                core = run(load_scenario(scenario), planner=params, seed=seed)
                out = Path(root) / f"{driver}-{scenario}-{algorithm}-{seed}"
                ours = recorded(scenario, algorithm, seed, driver, out)
                runs += 1
                if ours is None:
                    continue
                equal += ours.ticks == core.ticks
                good += evaluate(ours).success
                decisions += len(ours.ticks)
            failed += runs - min(equal, good)
            print(
                f"{driver}: {runs} runs, {decisions} decisions, {equal} runs equal to the core's "
                f"tick by tick, {good} at the goal without collision",
                flush=True,
            )
    return int(failed > 0)


if __name__ == "__main__":
    raise SystemExit(main())
