# SPDX-License-Identifier: Apache-2.0
"""Kill the planner with -9 in the middle of a run and start it again: same digest, or said why.

A process per node, in lockstep; at a random tick the planner is killed and a new one started,
which picks up at the tick the world repeats. The bag is then verified without ROS.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from mfba_planner.core.digest import digest
from mfba_planner.core.episode import run
from mfba_planner.core.planner import PlannerParams
from mfba_planner.launcher.crew import Crew
from mfba_planner.launcher.domain import private_domain
from mfba_planner.launcher.monitor import Monitor
from mfba_planner.paper import readings
from mfba_planner.ros import topics
from mfba_planner.run_config import NODES, RunConfig, node_parameters, run_facts
from mfba_planner.scenarios import load_scenario
from mfba_planner.verification.check import verify

TIMEOUT_S = 120.0


def interrupted_run(config: RunConfig, kill_at: int, bag: Path) -> None:
    """Run case and kill; return when the world says that the run is over."""
    told = node_parameters(config, (*NODES, topics.RECORDER))
    told["world_sim"] |= {"answer_timeout_s": 0.5, "answer_retries": 60}
    recorder = {"output": str(bag), "nodes": ",".join(NODES), "sim_time": True}
    recorder["run"] = json.dumps(run_facts(config))
    lines: list[str] = []
    with (
        private_domain() as domain,
        Monitor(domain) as monitor,
        Crew(lambda name, line: lines.append(f"{name}: {line}"), lambda: False) as crew,
    ):
        deadline = time.monotonic() + TIMEOUT_S

        def until(done: object, what: str) -> None:
            while not done():  # type: ignore[operator]
                assert time.monotonic() < deadline, f"{what}\n" + "\n".join(lines[-20:])
                monitor.spin(0.01)

        crew.start({topics.RECORDER: recorder, **told}, {})
        for name, question in monitor.ask_ready([topics.RECORDER, *NODES]).items():
            until(lambda q=question: (a := q.answer()) is not None and a.success, f"{name} ready")
        monitor.listen()
        pause = monitor.ask_pause(False)
        until(lambda: pause.answer() is not None, "pause")
        tick_ns = config.planner.tick_ns

        def tick() -> int:
            monitor.take_in()
            now = monitor.progress()
            return now.stamp_ns // tick_ns - 1 if now else -1

        until(lambda: tick() >= kill_at or monitor.ticks_at_end(), "tick to kill at")
        (planner,) = [child for child in crew.children if child.name == topics.PLANNER]
        planner.process.kill()
        planner.process.wait()
        crew.children.remove(planner)
        crew.start({topics.PLANNER: told[topics.PLANNER] | {"wait_for": ""}}, {})
        until(monitor.ticks_at_end, "end of the run")


def main() -> int:
    """Print one line per run; exit 1 when a run differs without a word."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reading", default="section6", choices=list(readings.PLANNERS))
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    same = refused = silent = 0
    with tempfile.TemporaryDirectory() as root:
        for index in range(options.runs):
            case = ("case1", "case2")[index % 2]
            params: PlannerParams = readings.planner(options.reading)
            config = replace(RunConfig(scenario=load_scenario(case)), planner=params, seed=index)
            core = run(config.scenario, planner=params, seed=index)
            kill_at = int(rng.integers(1, len(core.ticks) - 2))
            bag = Path(root) / str(index)
            interrupted_run(config, kill_at, bag)
            report = verify(bag)
            if report.is_identical and report.digest == digest(core.ticks):
                same += 1
                fate = "same digest"
            elif not report.is_identical:
                refused += 1
                fault = next(iter(report.faults), f"tick {report.divergence}")
                fate = f"refused: {fault}"
            else:
                silent += 1
                fate = "DIFFERENT, and nothing says so"
            print(f"{index}: {case}, killed at tick {kill_at}: {fate}", flush=True)
    print(f"{same} same digest, {refused} refused with a reason, {silent} silently different")
    return int(silent > 0)


if __name__ == "__main__":
    raise SystemExit(main())
