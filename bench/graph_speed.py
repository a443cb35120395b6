# SPDX-License-Identifier: Apache-2.0
"""How fast the in-process graph turns, as a ratio to a bare three-hop loop in the same run.

Both run on the executor the nodes use, in turn (A B A B ...), so that a machine whose speed
drifts slows both. The bare loop sends the same three messages (Odometry, LaserScan of 12
beams, Twist) around three nodes that do nothing else.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("RCUTILS_LOGGING_MIN_SEVERITY", "WARN")

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.context import Context
from sensor_msgs.msg import LaserScan

from mfba_planner.recording.reader import BagReader
from mfba_planner.ros.in_process import run_in_process
from mfba_planner.ros.runtime import make_executor
from mfba_planner.ros.topics import TICK_QOS
from mfba_planner.run_config import Driver, RunConfig
from mfba_planner.scenarios import load_scenario

DOMAIN = 97


def bare_loop(steps: int) -> float:
    """Steps per second of Odometry -> LaserScan -> Twist around three idle nodes."""
    context = Context()
    context.init(domain_id=DOMAIN)
    nodes = [rclpy.create_node(name, context=context) for name in ("a", "b", "c")]
    a, b, c = nodes
    odom = a.create_publisher(Odometry, "odom", TICK_QOS)
    sectors = b.create_publisher(LaserScan, "sectors", TICK_QOS)
    cmd_vel = c.create_publisher(Twist, "cmd_vel", TICK_QOS)
    count = 0

    def on_twist(_: Twist) -> None:
        nonlocal count
        count += 1
        odom.publish(Odometry())

    scan = LaserScan(ranges=[0.0] * 12, intensities=[0.0] * 12)
    b.create_subscription(Odometry, "odom", lambda _: sectors.publish(scan), TICK_QOS)
    c.create_subscription(LaserScan, "sectors", lambda _: cmd_vel.publish(Twist()), TICK_QOS)
    a.create_subscription(Twist, "cmd_vel", on_twist, TICK_QOS)
    executor = make_executor(context)
    for node in nodes:
        executor.add_node(node)
    started = time.perf_counter()
    odom.publish(Odometry())
    while count < steps:
        executor.spin_once(timeout_sec=1.0)
    took = time.perf_counter() - started
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()
    context.destroy()
    return steps / took


def graph(seed: int, scenario: str, root: Path) -> float:
    """Ticks per second of the whole graph with the recorder on."""
    config = RunConfig(scenario=load_scenario(scenario), driver=Driver.IN_PROCESS, seed=seed)
    bag = root / f"bag{seed}"
    took = run_in_process(config, bag, domain_id=DOMAIN)
    with BagReader(bag) as reader:
        return reader.topics["/cmd_vel"].message_count / took


def main() -> None:
    """Print both rates and the ratio, pair by pair."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--scenario", default="case2")
    parser.add_argument("--steps", type=int, default=1000)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as root:
        for seed in range(options.pairs):
            bare = bare_loop(options.steps)
            rows.append((bare, graph(seed, options.scenario, Path(root))))
    ratios = sorted(ours / bare for bare, ours in rows)
    print(f"bare 3-hop loop  median {statistics.median(b for b, _ in rows):8.0f} steps/s")
    print(f"graph + recorder median {statistics.median(o for _, o in rows):8.0f} ticks/s")
    print(
        f"ratio median {statistics.median(ratios):.3f}, min {ratios[0]:.3f}, max {ratios[-1]:.3f}"
        f" ({options.pairs} pairs, {options.scenario}, seeds 0..{options.pairs - 1})"
    )


if __name__ == "__main__":
    main()
