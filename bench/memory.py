# SPDX-License-Identifier: Apache-2.0
"""Resident memory of every node over a long multi-process lockstep run, the recorder included.

Run: python bench/memory.py. The robot creeps through the walled room in steps so short that
the trip takes --ticks; it avoids, waits and turns as usual. Memory is read from
/proc/PID/status after the first 2000 ticks and then twenty times. Exit code 1 where a node holds
more than 110 MB or has grown by more than 5 MB.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")

from mfba_planner.core.geometry import distance
from mfba_planner.core.planner_types import NANO
from mfba_planner.launcher.forked_process import ForkServer
from mfba_planner.launcher.graph_monitor import GraphMonitor, ServiceCall
from mfba_planner.launcher.node_processes import NodeProcesses
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.ros.interface.topics import RECORDER
from mfba_planner.scenarios.run_config import NODES, RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario

ROOM_MB = 110.0
GROWTH_MB = 5.0
WARM_UP = 2000
READINGS = 20


def resident_mb(pid: int) -> float:
    """Resident set size of a process in MB (10^6 bytes)."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise ProcessLookupError(f"process {pid} has ended")


def long_run(ticks: int) -> RunConfig:
    """The walled room at steps so short that the straight line takes that many ticks."""
    scenario = load_scenario("walled")
    step_m = distance(scenario.start_m, scenario.goal_m) / ticks
    planner = PlannerParams(step_length_m=max(step_m, 0.001), speed_mps=0.8)
    return RunConfig(scenario=scenario, planner=planner)


def measure(ticks: int) -> dict[str, list[float]]:
    """Per node, MB from the end of the warm-up to the last tick."""
    config = long_run(ticks)
    peers = (*NODES, RECORDER)
    with (
        tempfile.TemporaryDirectory() as root,
        private_domain() as domain,
        GraphMonitor(domain) as monitor,
        ForkServer() as server,
        NodeProcesses(server, lambda name, line: None, lambda: False) as processes,
    ):
        parameters = node_parameters(config, peers)
        parameters["world_sim"] |= {
            "run_on": True,
            "view_period_s": ticks * config.planner.tick_ns * NANO / 1000,
        }
        parameters["planner"] |= {"view_period_s": parameters["world_sim"]["view_period_s"]}
        parameters[RECORDER] = {
            "output": f"{root}/bag",
            "nodes": ",".join(NODES),
            "sim_time": True,
        }
        processes.start({RECORDER: parameters.pop(RECORDER), **parameters}, {})
        for question in monitor.call_ready(peers).values():
            agreed(processes, monitor, question)
        monitor.subscribe()
        agreed(processes, monitor, monitor.call_pause(False))
        history: dict[str, list[float]] = {c.name: [] for c in processes.children}
        due, begun = float(WARM_UP), time.monotonic()
        while due <= ticks:
            time.sleep(0.05)
            processes.check()
            monitor.poll()
            now = monitor.progress()
            tick = now.stamp_ns // config.planner.tick_ns if now else 0
            if tick >= due:
                due += (ticks - WARM_UP) / READINGS
                for child in processes.children:
                    history[child.name].append(resident_mb(child.pid))
                now_mb = ", ".join(f"{node} {mb[-1]:.1f}" for node, mb in history.items())
                print(f"tick {tick}: {now_mb} MB", flush=True)
        print(f"{tick} ticks in {time.monotonic() - begun:.0f} s")
        size = sum(path.stat().st_size for path in Path(f"{root}/bag").iterdir())
        print(f"bag of {size / 1e6:.0f} MB")
    return history


def agreed(processes: NodeProcesses, monitor: GraphMonitor, question: ServiceCall) -> None:
    """Spin until the service call has succeeded."""
    while (response := question.response()) is None or not response.success:
        processes.check()
        monitor.spin(0.02)


def main() -> int:
    """Print start, end, largest and growth per node."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=100_000)
    options = parser.parse_args()
    history = measure(options.ticks)
    print("node            start MB    end MB  largest MB   growth MB")
    bad = False
    for node, values in history.items():
        growth = values[-1] - values[0]
        bad |= max(values) > ROOM_MB or growth > GROWTH_MB
        print(
            f"{node:15} {values[0]:8.1f}  {values[-1]:8.1f}  {max(values):10.1f}  {growth:10.1f}"
        )
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
