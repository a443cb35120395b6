# SPDX-License-Identifier: Apache-2.0
"""How well `replay --rate 1` keeps the recorded times between messages, measured by a subscriber.

Run: python bench/replay_timing.py [BAG ...]; without bags it takes the one that rosbag2 recorded
from a robot with a lidar, and a run of case study 1. The subscriber is another process than
replay; an interval's error is |arrival interval - log time interval|, for all messages in a row
and for those of each topic among themselves.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from functools import partial
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import rclpy

from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.ros.runtime.spin_node import make_executor
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario

ROOT = Path(__file__).parents[1]
FOREIGN = ROOT / "test/data/rosbag2_foreign_scan"
REPLAY = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.replay())"

Times = dict[str, list[int]]  # ns, by topic, ascending


def log_times(bag: Path, left_out: str = "tf2_msgs") -> tuple[dict[str, str], Times]:
    """The types and log times of the messages to replay."""
    types: dict[str, str] = {}
    times: Times = {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            if not message.type_name.startswith(left_out):
                types[message.topic] = message.type_name
                times.setdefault(message.topic, []).append(message.log_time_ns)
    return types, times


def arrival_times(bag: Path, types: dict[str, str], expected: int, rate: float) -> Times:
    """When each message arrived in this process."""
    arrived: Times = {topic: [] for topic in types}
    node = rclpy.create_node("listener")
    executor = make_executor()
    executor.add_node(node)

    def note(topic: str, _: bytes) -> None:
        arrived[topic].append(time.monotonic_ns())

    for topic, type_name in types.items():
        package, _, name = type_name.split("/")
        kind: Any = getattr(import_module(f"{package}.msg"), name)
        node.create_subscription(kind, topic, partial(note, topic), 1000, raw=True)
    options = ["--rate", str(rate), "--wait-for-subscribers", "1"]
    command = [sys.executable, "-c", REPLAY, str(bag), *options]
    with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(ROOT)}) as process:
        while process.poll() is None and sum(map(len, arrived.values())) < expected:
            executor.spin_once(timeout_sec=0.1)
        assert process.wait(timeout=10) == 0
    executor.shutdown()
    node.destroy_node()
    return arrived


def errors_ms(logged: list[int], arrived: list[int], rate: float) -> list[float]:
    """One per pair of neighbours."""
    return [
        abs((b1 - a1) - (b0 - a0) / rate) / 1e6
        for (a0, b0), (a1, b1) in zip(pairwise(logged), pairwise(arrived))
    ]


def in_a_row(times: Times) -> list[int]:
    """The times of all topics together."""
    return sorted(t for of_topic in times.values() for t in of_topic)


def report(what: str, errors: list[float]) -> None:
    """One line: median, 99th percentile, maximum."""
    if len(errors) > 1:
        median, worst = statistics.median(errors), max(errors)
        p99 = statistics.quantiles(errors, n=100, method="inclusive")[98]
        print(f"  {what:24} {len(errors):6} {median:8.3f} {p99:8.3f} {worst:8.3f}")


def measure(bag: Path, rate: float) -> None:
    """Replay one bag and print its timing errors."""
    types, logged = log_times(bag)
    expected = sum(map(len, logged.values()))
    arrived = arrival_times(bag, types, expected, rate)
    lost = expected - sum(map(len, arrived.values()))
    print(f"{bag.name}: {expected} messages at rate {rate:g}, {lost} lost")
    print(f"  {'interval error in ms':24} {'count':>6} {'median':>8} {'p99':>8} {'max':>8}")
    report("all in a row", errors_ms(in_a_row(logged), in_a_row(arrived), rate))
    for topic in logged:
        report(topic, errors_ms(logged[topic], arrived[topic], rate))


def main() -> None:
    """Measure each bag."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("bags", nargs="*", type=Path, metavar="BAG")
    parser.add_argument("--rate", type=float, default=1.0)
    given = parser.parse_args()
    with private_domain() as domain_id, tempfile.TemporaryDirectory() as directory:
        bags = given.bags
        if not bags:
            own = Path(directory) / "case1"
            config = RunConfig(scenario=load_scenario("case1"), seed=1)
            run_in_process(config, own, domain_id=domain_id)
            bags = [FOREIGN, own]
        rclpy.init(args=[])
        for bag in bags:
            measure(bag, given.rate)
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
