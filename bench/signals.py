# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM to every node at random moments: exit code 0, empty stderr, closed bag.

Run: python bench/signals.py 30. The nodes do their work while it happens: a publisher sends
odometry, obstacles, sectors and goals at 100 Hz to them. A moment is drawn from the first of our
code on, which is when the process catches SIGTERM (SigCgt in /proc/PID/status: the interpreter
itself never does), up to --longest seconds later; so many fall into imports and start-up.
Before that the process is the bare Python interpreter, whose signal handling is not ours.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")

from mfba_planner.core.errors import MfbaError
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.recording.bag_reader import BagReader

ROOT = Path(__file__).resolve().parents[1]
FOREIGN_BAG = ROOT / "test" / "data" / "rosbag2_foreign_scan"
PROGRAM = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.{}())"
SIGNALS = (signal.SIGINT, signal.SIGTERM)
END_WITHIN_S = 15.0


class Death(NamedTuple):
    """How a node took one signal."""

    node: str
    signum: signal.Signals
    moment_s: float
    took_s: float
    fault: str


def arguments(node: str, directory: Path) -> list[str]:
    """What makes a node busy."""
    if node == "replay":
        return [str(FOREIGN_BAG), "--loop"]
    parameters = {
        "planner": [],
        "virtual_sensor": [],
        "world_sim": ["speed_factor:=50.0", "run_on:=true"],
        "recorder": [f"output:={directory}"],
    }
    return ["--ros-args", *(word for value in parameters[node] for word in ("-p", value))]


def kill_one(node: str, signum: signal.Signals, moment_s: float, domain: int, root: Path) -> Death:
    """Start a node, end it by a signal after moment_s of our code, and judge."""
    bag = root / f"{node}_{signum.name}_{moment_s:.6f}"
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(node), *arguments(node, bag)],
        env={
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "PYTHONPATH": str(ROOT),
            "PYTHONFAULTHANDLER": "1",  # SIGABRT prints the stacks of all threads
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        while not catches_sigterm(process.pid):
            time.sleep(0.001)
        time.sleep(moment_s)
        sent = time.monotonic()
        process.send_signal(signum)
        _, stderr = process.communicate(timeout=END_WITHIN_S)
        took_s = time.monotonic() - sent
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)
        _, stderr = process.communicate()
        return Death(node, signum, moment_s, END_WITHIN_S, f"did not end; {stderr.strip()}")
    fault = f"exit code {process.returncode}" if process.returncode else ""
    fault = fault or (f"stderr: {stderr.strip()}" if stderr else "") or bag_fault(bag)
    return Death(node, signum, moment_s, took_s, fault)


def catches_sigterm(pid: int) -> bool:
    """Whether a process has a handler for SIGTERM; ProcessLookupError when it has ended."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("SigCgt:"):
            return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    raise ProcessLookupError(f"process {pid} ended by itself")


def bag_fault(bag: Path) -> str:
    """What is wrong with a bag that was begun."""
    if not bag.exists():
        return ""
    try:
        with BagReader(bag) as reader:
            return "" if reader.complete else "bag not closed"
    except MfbaError as error:
        return str(error)


@contextmanager
def traffic(domain: int) -> Iterator[None]:
    """Odometry, obstacles, sectors and a goal for all nodes, at 100 Hz."""
    import rclpy
    from rclpy.context import Context

    from mfba_planner.core.geometry import Pose2D
    from mfba_planner.perception.sensory_vector import SensorParams
    from mfba_planner.ros.interface import to_messages, topics

    context = Context()
    context.init(domain_id=domain)
    node = rclpy.create_node("traffic", context=context)
    kinds = (topics.ODOM, topics.OBSTACLES, topics.SECTORS, topics.GOAL_POSE)
    writers = [node.create_publisher(topic.type, topic.name, topic.qos) for topic in kinds]
    over = threading.Event()

    def publish() -> None:
        while not over.wait(0.01):
            now = time.monotonic_ns()
            pose = Pose2D(0.0, 0.0)
            odom, obstacles, sectors, goal = writers
            odom.publish(to_messages.odometry_msg(pose, (0.0, 0.0), now, "odom", "base_link"))
            obstacles.publish(to_messages.obstacles_msg([(1.0, 1.0)], now, "odom"))
            sectors.publish(to_messages.sectors_msg((9.0,) * 12, SensorParams(), 0.3, now, "odom"))
            if now // 10_000_000 % 100 == 0:
                goal.publish(to_messages.pose_stamped_msg((5.0, 5.0), now, "odom"))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        node.destroy_node()
        context.try_shutdown()
        context.destroy()


def kill_all(each: int, longest_s: float, seed: int) -> list[Death]:
    """Every node and signal `each` times; the nodes side by side, each one's deaths in turn."""
    generator = random.Random(seed)
    nodes = ("world_sim", "virtual_sensor", "planner", "recorder", "replay")
    plan = {
        node: [(s, generator.uniform(0.0, longest_s)) for s in SIGNALS for _ in range(each)]
        for node in nodes
    }
    with tempfile.TemporaryDirectory() as root, private_domain() as domain, traffic(domain):

        def kill_in_turn(node: str) -> list[Death]:
            return [kill_one(node, s, moment_s, domain, Path(root)) for s, moment_s in plan[node]]

        with ThreadPoolExecutor(len(nodes)) as pool:
            return [death for deaths in pool.map(kill_in_turn, nodes) for death in deaths]


def main() -> int:
    """Print a table; exit code 1 where a node did not end well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("each", type=int, help="how often per node and signal")
    parser.add_argument("--longest", type=float, default=3.0, help="latest moment in s")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    deaths = kill_all(options.each, options.longest, options.seed)
    print("node            signal   ended well  median s  longest s")
    for node in dict.fromkeys(death.node for death in deaths):
        for signum in SIGNALS:
            these = [d for d in deaths if (d.node, d.signum) == (node, signum)]
            well = [d for d in these if not d.fault]
            took = sorted(d.took_s for d in these)
            print(
                f"{node:15} {signum.name:8} {len(well):4} of {len(these):3}"
                f"  {took[len(took) // 2]:8.2f}  {took[-1]:9.2f}"
            )
    faults = [death for death in deaths if death.fault]
    for death in faults:
        print(f"{death.node}, {death.signum.name} after {death.moment_s:.3f} s: {death.fault}")
    print(f"{len(deaths) - len(faults)} of {len(deaths)} ended well")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
