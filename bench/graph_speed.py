# SPDX-License-Identifier: Apache-2.0
"""How fast the graph turns in lockstep, as a ratio to a bare three-hop loop in the same run.

Both run in turn (A B A B ...), so that a machine whose speed drifts slows both. The bare loop
sends the same three messages (Odometry, LaserScan of 12 beams, Twist) around three nodes that
do nothing else, in one process or in three, on rclpy's SingleThreadedExecutor: what anybody gets
who writes such a loop. The graph decides, publishes all its topics and records them on top.

In one process the CPU time of a step and of a tick is printed too, of all threads: it depends
less on what else the machine does.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("RCUTILS_LOGGING_MIN_SEVERITY", "WARN")
os.environ["ROS_DOMAIN_ID"] = "101"

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.ros.interface.topics import TICK_QOS
from mfba_planner.scenarios.run_config import RunConfig
from mfba_planner.scenarios.scenario_files import load_scenario

HOPS = ("world", "sensor", "planner")
TICKS = 500
FIRST = 50  # ticks before CPU time is measured


def make_hop(name: str, on_turn: Callable[[], bool]) -> tuple[Node, Callable[[], None]]:
    """One idle node of the bare loop, and what starts a turn (for the first of them)."""
    node = rclpy.create_node(name)
    if name == "world":
        odom = node.create_publisher(Odometry, "odom", TICK_QOS)

        def on_twist(_: Twist) -> None:
            if on_turn():
                odom.publish(Odometry())

        node.create_subscription(Twist, "cmd_vel", on_twist, TICK_QOS)
        return node, lambda: odom.publish(Odometry())
    if name == "sensor":
        sectors = node.create_publisher(LaserScan, "sectors", TICK_QOS)
        scan = LaserScan(ranges=[0.0] * 12, intensities=[0.0] * 12)
        node.create_subscription(Odometry, "odom", lambda _: sectors.publish(scan), TICK_QOS)
    else:
        cmd_vel = node.create_publisher(Twist, "cmd_vel", TICK_QOS)
        node.create_subscription(
            LaserScan, "sectors", lambda _: cmd_vel.publish(Twist()), TICK_QOS
        )
    return node, lambda: None


def turn(names: tuple[str, ...], steps: int) -> tuple[float, float]:
    """Spin the named hops of the bare loop for so many steps: steps per second, CPU ms of each."""
    rclpy.init()
    count = 0

    def on_turn() -> bool:
        nonlocal count
        count += 1
        return count < steps

    made = [make_hop(name, on_turn) for name in names]
    executor = SingleThreadedExecutor()
    for node, _ in made:
        executor.add_node(node)
    first = made[0][0]
    if len(names) == 1:  # the others are processes of their own: wait until all are matched
        print("up", flush=True)
        while first.count_subscribers("odom") < 1 or first.count_publishers("cmd_vel") < 1:
            executor.spin_once(timeout_sec=0.01)
    if names == ("world",):
        sys.stdin.readline()
    started, cpu_s = time.perf_counter(), time.process_time()
    made[0][1]()
    while count < steps:
        executor.spin_once(timeout_sec=1.0)
    took, cpu_s = time.perf_counter() - started, time.process_time() - cpu_s
    rclpy.shutdown()
    return steps / took, 1e3 * cpu_s / steps


def bare_processes(steps: int) -> float:
    """The bare loop with each hop in a process of its own."""
    me = [sys.executable, __file__, "--steps", str(steps), "--hop"]
    hops = [
        subprocess.Popen([*me, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for name in HOPS
    ]
    world = hops[0]
    assert world.stdin
    assert world.stdout
    for hop in hops:
        assert hop.stdout
        assert hop.stdout.readline() == "up\n"
    time.sleep(1.0)  # all pairs of endpoints matched, also where no count can be read
    world.stdin.write("go\n")
    world.stdin.flush()
    rate = float(world.stdout.readline().split()[0])
    for hop in hops:
        hop.kill()
        hop.wait()
    return rate


def cpu_ms_of_tick(root: Path) -> float:
    """CPU time of a tick of the graph in this process, with the recorder."""
    times: dict[int, float] = {}

    def on_turn(world: Any) -> bool:
        times.setdefault(world.tick, time.process_time())
        return bool(world.tick < TICKS)

    config = RunConfig(scenario=load_scenario(str(scenario(root))))
    run_in_process(
        config, root / "bag", domain_id=int(os.environ["ROS_DOMAIN_ID"]), on_turn=on_turn
    )
    last = max(times)
    return 1e3 * (times[last] - times[FIRST]) / (last - FIRST)


def in_child(hop: str, steps: int) -> list[float]:
    """The numbers that this program prints with --hop."""
    me = [sys.executable, __file__, "--steps", str(steps), "--hop", hop]
    found = subprocess.run(me, capture_output=True, text=True, check=True)
    return [float(word) for word in found.stdout.split()]


def graph(driver: str, seed: int, root: Path) -> float:
    """Ticks per second of the whole graph with the recorder on, over TICKS ticks."""
    out = root / f"{driver}{seed}"
    command = [
        "run",
        str(scenario(root)),
        "--planner=paper",
        f"--driver={driver}",
        f"--seed={seed}",
    ]
    code = "import sys; from mfba_planner import entry_points; sys.exit(entry_points.mfba())"
    subprocess.run(
        [sys.executable, "-c", code, *command, "--out", str(out), "--no-picture"],
        check=False,  # a collision ends a run as a failure; its speed counts all the same
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    result = json.loads((out / "result.json").read_text())
    return float(result["result"]["ticks"] / result["extra"]["wall_s"])


def scenario(root: Path) -> Path:
    """Case study 2's five obstacles on a long trip, so that starting and stopping weigh little."""
    side = 0.3 * TICKS / 2**0.5
    rows = [
        {
            "center_m": [side * (k + 1) / 6, side * (k + 1) / 6 + (2.0 if k % 2 else -2.0)],
            "radius_m": 0.3,
            "speed_mps": 0.1,
            "heading_deg": 45.0 + 90.0 * k,
        }
        for k in range(5)
    ]
    path = root / "far.yaml"
    task = {"name": "far", "start_m": [0, 0], "goal_m": [side, side], "obstacles": rows}
    path.write_text(json.dumps(task | {"time_limit_s": 3000.0}))
    return path


def main() -> None:
    """Print both rates and the ratio, pair by pair."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--driver", choices=("in-process", "multi-process"), default="in-process")
    parser.add_argument("--hop", choices=(*HOPS, "all", "graph"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.hop == "graph":
        with tempfile.TemporaryDirectory() as directory:
            print(cpu_ms_of_tick(Path(directory)))
        return
    if options.hop:
        names = HOPS if options.hop == "all" else (options.hop,)
        print(*turn(names, options.steps), flush=True)
        return
    rows, cpu = [], []
    with tempfile.TemporaryDirectory() as root:
        for seed in range(options.pairs):
            if options.driver == "in-process":
                bare, cpu_ms = in_child("all", options.steps)
                cpu.append((cpu_ms, *in_child("graph", options.steps)))
            else:
                bare = bare_processes(options.steps)
            rows.append((bare, graph(options.driver, seed, Path(root))))
    ratios = sorted(ours / bare for bare, ours in rows)
    print(f"{options.driver}: {options.pairs} pairs, seeds 0..{options.pairs - 1}")
    print(f"bare 3-hop loop   median {statistics.median(b for b, _ in rows):7.0f} steps/s")
    print(f"graph + recorder  median {statistics.median(o for _, o in rows):7.0f} ticks/s")
    print(f"ratio  median {statistics.median(ratios):.3f}, {ratios[0]:.3f} .. {ratios[-1]:.3f}")
    if cpu:
        bare_ms, tick_ms = (statistics.median(column) for column in zip(*cpu))
        ratio = f"{tick_ms / bare_ms:.2f}"
        print(f"CPU    bare step {bare_ms:.2f} ms, tick {tick_ms:.2f} ms, ratio {ratio}")


if __name__ == "__main__":
    main()
