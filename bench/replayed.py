# SPDX-License-Identifier: Apache-2.0
"""A new planner fed from a replayed bag at any rate: whether it reaches the recorded digest.

Replay and planner are separate processes, in lockstep; every sectors message must give one
decision. Bags of both case studies, algorithms and readings, as fast as possible.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from rclpy.context import Context

from mfba_planner.core.option_specs import flatten, override
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.node_processes import parameters_yaml
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.paper import readings_of_paper as readings
from mfba_planner.recording.from_messages import decision, stamp_ns
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.ros.interface import topics
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest

sys.path.insert(0, str(Path(__file__).parents[1] / "test" / "helpers"))
from launched_programs import Program
from ros_graph import Graph

FAST = ["--as-fast-as-possible", "--wait-timeout", "30", "--inputs-of", "planner"]


def decide_again(config: RunConfig, bag: Path, root: Path, domain: int) -> tuple[int, str]:
    """Number of decisions of a new planner on the replayed bag, and their digest.

    The sectors are taken from the bag: this listener may miss the first that are replayed.
    """
    ranges = {tick.stamp_ns: tick.ranges_m for tick in read_episode(bag).ticks}
    parameters = flatten(config.planner) | {"seed": config.seed, "lockstep": True}
    (root / "planner.yaml").write_text(parameters_yaml(parameters), encoding="utf-8")
    context = Context()
    context.init(domain_id=domain)
    graph = Graph(context)
    decisions = graph.collect(topics.DECISION)
    env = {"ROS_DOMAIN_ID": str(domain)}
    arguments = ["--ros-args", "--params-file", str(root / "planner.yaml")]
    try:
        with Program("planner", *arguments, cwd=root, more_env=env):
            writers = graph.probe.count_publishers
            graph.until(lambda: writers(topics.DECISION.name) > 0)
            with Program("replay", str(bag), *FAST, cwd=root, more_env=env) as replay:
                graph.until(lambda: replay.process.poll() is not None, 120.0)
                graph.until(lambda: len(decisions) >= len(ranges))
                graph.settle()
        ticks = [decision(why, ranges[stamp_ns(why.header.stamp)]) for why in decisions]
        return len(decisions), digest(ticks)
    finally:
        graph.close()
        context.try_shutdown()
        context.destroy()


def main() -> int:
    """Print one line per bag; exit 1 unless all digests are equal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bags", type=int, default=20)
    options = parser.parse_args()
    equal = 0
    for index in range(options.bags):
        case, algorithm = ("case1", "case2")[index % 2], ("mfba", "ba")[index // 2 % 2]
        reading = list(readings.PLANNERS)[index // 4 % len(readings.PLANNERS)]
        planner = override(readings.planner(reading), {"bat.algorithm": algorithm})
        config = replace(RunConfig(scenario=load_scenario(case)), planner=planner, seed=index)
        with tempfile.TemporaryDirectory() as name, private_domain() as domain:
            root = Path(name)
            run_in_process(config, root / "bag", domain_id=domain)
            recorded = read_episode(root / "bag")
            count, found = decide_again(config, root / "bag", root, domain)
        same = count == len(recorded.ticks) and found == digest(recorded.ticks)
        equal += same
        print(
            f"{index}: {case}, {algorithm}, {reading}: {count} of "
            f"{len(recorded.ticks)} decisions, "
            f"{'same digest' if same else f'OTHER digest {found}'}",
            flush=True,
        )
    print(f"{equal} of {options.bags} digests equal to the recorded ones")
    return int(equal < options.bags)


if __name__ == "__main__":
    raise SystemExit(main())
