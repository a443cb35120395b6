# SPDX-License-Identifier: Apache-2.0
"""How much faster than the simulated time `mfba verify` checks a bag of case study 2."""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.verification.verify_bag import verify

MFBA = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"


def main() -> None:
    """Print simulated time / wall time of the check itself and of the whole command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=20)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as root, private_domain() as domain:
        bag = Path(root) / "bag"
        run_in_process(RunConfig(scenario=load_scenario("case2")), bag, domain_id=domain)
        report = verify(bag)
        assert report.is_identical
        simulated_s = evaluate(report.setup.episode(report.recorded)).time_s
        command = [sys.executable, "-c", MFBA, "verify", str(bag)]
        nothing = [sys.executable, "-c", "import mfba_planner.cli.verify"]
        took: dict[str, list[float]] = {"check": [], "command": [], "imports alone": []}
        for _ in range(options.repetitions):
            for name, job in (
                ("check", lambda: verify(bag)),
                ("command", lambda: subprocess.run(command, check=True, capture_output=True)),
                ("imports alone", lambda: subprocess.run(nothing, check=True)),
            ):
                started = time.perf_counter()
                job()
                took[name].append(time.perf_counter() - started)
    print(f"{simulated_s:.2f} s simulated, {options.repetitions} repetitions")
    for name, times in took.items():
        low, middle, high = min(times), statistics.median(times), max(times)
        print(
            f"{name:<14} {middle * 1e3:7.1f} ms ({low * 1e3:.1f}..{high * 1e3:.1f}): "
            f"{simulated_s / middle:.0f} times as fast"
        )


if __name__ == "__main__":
    main()
