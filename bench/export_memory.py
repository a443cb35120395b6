# SPDX-License-Identifier: Apache-2.0
"""How much memory `mfba export` and `mfba info` take on a large bag, and how long.

The bag is a real run's decisions and sectors over and over under rising stamps, with scans
between them that fill the file; nothing of it compresses away.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import LaserScan

from mfba_planner.core.option_specs import flatten
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.configuration_attachment import attach_configuration
from mfba_planner.ros.interface.to_messages import decision_msg, sectors_msg, set_stamp
from mfba_planner.scenarios.run_config import RunConfig, node_parameters
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run

MFBA = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"


def write_bag(path: Path, size_bytes: int) -> int:
    """Write a bag of that size; return how many ticks it has."""
    rng = np.random.default_rng(0)
    config = RunConfig(scenario=load_scenario("case2"))
    ticks = run(config.scenario).ticks
    tick_ns = PlannerParams().tick_ns
    beams = rng.random((16, 2500), dtype=np.float32)
    with BagWriter(path) as writer:
        for name, kind in (
            ("/planner/decision", "diagnostic_msgs/msg/DiagnosticArray"),
            ("/sectors", "sensor_msgs/msg/LaserScan"),
            ("/scan", "sensor_msgs/msg/LaserScan"),
        ):
            writer.add_topic(name, kind)
        nodes = node_parameters(config, ())
        nodes["world_sim"]["scenario_json"] = nodes["world_sim"]["scenario"]
        nodes["planner"] |= flatten(config.planner)
        attach_configuration(writer, {"nodes": nodes, "run": {}})
        written = count = 0
        while written < size_bytes:
            decision = ticks[count % len(ticks)]
            count += 1
            stamp = count * tick_ns
            sectors = sectors_msg(decision.ranges_m, SensorParams(), 0.3, stamp, "odom")
            why = decision_msg(decision, "mfba", 0, "/planner")
            set_stamp(why.header.stamp, stamp)
            scan = LaserScan(ranges=beams[count % 16] * rng.random(dtype=np.float32))
            set_stamp(scan.header.stamp, stamp)
            for topic, message in (
                ("/scan", scan),
                ("/sectors", sectors),
                ("/planner/decision", why),
            ):
                data = serialize_message(message)
                writer.write(topic, data, stamp, stamp)
                written += len(data)
    return count


def main() -> None:
    """Print the largest resident set of each command on the bag."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--megabytes", type=int, default=1250)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as root:
        bag = Path(root) / "bag"
        ticks = write_bag(bag, options.megabytes * 1_000_000)
        size = sum(path.stat().st_size for path in bag.iterdir())
        print(f"bag of {size / 1e9:.2f} GB, {ticks} ticks", flush=True)
        for words in (["export", str(bag), f"{root}/run.csv"],
                      ["export", str(bag), f"{root}/run.parquet"],
                      ["info", str(bag)]):  # fmt: skip
            started = time.monotonic()
            with tempfile.TemporaryFile("w+") as output:
                child = subprocess.Popen([sys.executable, "-c", MFBA, *words], stdout=output)
                _, status, used = os.wait4(child.pid, 0)
                output.seek(0)
                text = output.read()
            took = time.monotonic() - started
            assert f"{ticks} rows" in text or "\ndigest " in text, text
            name = f"{words[0]} {Path(words[-1]).suffix}"
            print(
                f"{name:<16} exit {status}, {used.ru_maxrss / 1024:.0f} MB resident at most, "
                f"{took:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
