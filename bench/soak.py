# SPDX-License-Identifier: Apache-2.0
"""Long runs whose memory, descriptors and shared memory must stay flat and whose bag is whole.

    python bench/soak.py in-process --ticks 1000000
    python bench/soak.py disturbed --hours 8 --speed 20

in-process: all nodes and the recorder in one process, in lockstep; the robot is put back to its
start again and again, so that it never arrives.

disturbed: a process per node in real time, as a robot with a lidar of 360 beams and the default
planner; every --every s at random the planner is killed with -9 and started again, the robot is
kidnapped, the goal is changed, the world is paused, or the virtual sensor is stopped for a
second, so that messages are lost.

Readings are taken after the first tenth and 20 times from there. Exit code 1 where a process has
grown by more than 5 MB or 2 descriptors, shared memory by more than 1 MB, or where the bag lacks
a tick.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from manual_run import ManualRun
from mcap.reader import make_reader
from memory import resident_mb
from rclpy.context import Context
from rclpy.node import Node

from mfba_planner.core.geometry import Point, distance
from mfba_planner.core.planner_types import NANO
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.launcher.ros_domain import private_domain
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.serialized_message import header_stamp_ns
from mfba_planner.ros.shared_memory import SHARED_MEMORY
from mfba_planner.scenarios.run_config import Driver, RunConfig, with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.scenario import Kidnapping, Scenario

READINGS = 20
MOST_MB, MOST_DESCRIPTORS, MOST_SHARED_MB = 5.0, 2, 1.0
TICKS_TO_START = 8000
FREE = [(1.0, 1.0), (4.0, 1.0), (1.0, 4.2), (6.0, 4.2), (9.0, 4.0), (6.0, 2.6)]  # in the rooms


@dataclass
class Readings:
    """What each process held, MB and descriptors, and shared memory of Fast DDS, MB."""

    processes: dict[tuple[str, int], list[tuple[float, int]]] = field(default_factory=dict)
    shared_mb: list[float] = field(default_factory=list)
    known: set[int] = field(default_factory=set)

    def take(self, pids: dict[str, int], progress: str) -> None:
        """Read all, and print a line."""
        for name, pid in pids.items():
            is_young = bool(self.shared_mb) and pid not in self.known
            self.known.add(pid)
            if is_young:
                continue  # it still loads what it needs
            reading = resident_mb(pid), len(os.listdir(f"/proc/{pid}/fd"))
            self.processes.setdefault((name, pid), []).append(reading)
        sizes = [_size(path) for path in SHARED_MEMORY.glob("fastrtps_*")]
        self.shared_mb.append(sum(sizes) / 1e6)
        now = ", ".join(
            f"{name} {mb:.1f} MB {count}"
            for (name, pid), values in self.processes.items()
            if pids.get(name) == pid
            for mb, count in values[-1:]
        )
        print(f"{progress}: {now}; shared {self.shared_mb[-1]:.1f} MB", flush=True)

    def growth(self) -> bool:
        """Print what each process has grown by; whether that was too much."""
        bad = False
        for (name, _), values in self.processes.items():
            (first_mb, first), (last_mb, last) = values[0], values[-1]
            grown_mb, more = last_mb - first_mb, last - first
            bad |= grown_mb > MOST_MB or more > MOST_DESCRIPTORS
            if len(values) > 1:
                print(
                    f"{name:15} {len(values):3} readings {grown_mb:+6.1f} MB {more:+3} descriptors"
                )
        grown_mb = self.shared_mb[-1] - self.shared_mb[0]
        print(f"shared memory {grown_mb:+.1f} MB")
        return bad or grown_mb > MOST_SHARED_MB


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def lacks_ticks(bag: Path, tick_ns: int) -> bool:
    """Whether a bag lacks odometry of a tick, or an index; prints its topics."""
    (path,) = bag.glob("*.mcap")
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            return True
        counts = summary.statistics.channel_message_counts
        for channel in summary.channels.values():
            print(f"{channel.topic:30} {counts.get(channel.id, 0):9} messages")
        stamps: set[int] = set()
        for _, _, message in reader.iter_messages(topics=["/odom"]):
            stamps.add(header_stamp_ns(message.data) // tick_ns)
    lacking = sorted(set(range(min(stamps), max(stamps) + 1)) - stamps)
    print(f"/odom: ticks {min(stamps)} to {max(stamps)}, {len(lacking)} missing {lacking[:5]}")
    return bool(lacking)


def in_process(ticks: int, root: Path) -> bool:
    """One run of that many ticks in this process; whether something was wrong."""
    scenario = load_scenario("walled")
    params = PlannerParams(step_length_m=0.001, speed_mps=0.8)
    tick_s = params.tick_ns * NANO
    back = tuple(
        _free_place(scenario, k * TICKS_TO_START * tick_s)
        for k in range(1, ticks // TICKS_TO_START + 1)
    )
    scenario = replace(scenario, kidnappings=back, time_limit_s=ticks * tick_s)
    config = RunConfig(scenario=scenario, planner=params, driver=Driver.IN_PROCESS)
    readings, due = Readings(), ticks // 10

    def on_turn(world: Any) -> bool:
        nonlocal due
        if world.tick >= due:
            due += (ticks - ticks // 10) // READINGS
            readings.take({"all nodes": os.getpid()}, f"tick {world.tick}")
        return True

    with private_domain() as domain:
        took_s = run_in_process(
            config, root / "bag", domain_id=domain, timeout_s=1e6, on_turn=on_turn
        )
    print(f"{took_s:.0f} s")
    return readings.growth() | lacks_ticks(root / "bag", params.tick_ns)


def _free_place(scenario: Scenario, at_s: float) -> Kidnapping:
    """Near the start at that time."""
    circles = scenario.enlarged(at_s)
    x, y = scenario.start_m
    for k in range(1000):
        place = x + 0.05 * (k % 30), y + 0.05 * (k // 30)
        if all(distance(place, center) > radius + 0.1 for center, radius in circles):
            return Kidnapping(at_s=at_s, to_m=place)
    raise AssertionError(f"no free place at {at_s} s")


class Disturber:
    """Disturbs a run in one of five ways at a time."""

    def __init__(self, run: ManualRun, node: Node, rng: random.Random) -> None:
        """Advertise goals and poses from node."""
        self._run, self._rng = run, rng
        self.counts: Counter[str] = Counter()
        self._goal = node.create_publisher(PoseStamped, "goal_pose", topics.GOAL_POSE.qos)
        self._pose = node.create_publisher(
            PoseWithCovarianceStamped, "initialpose", topics.INITIALPOSE.qos
        )
        self._kinds: list[Callable[[], None]] = [
            self.restart, self.kidnap, self.change_goal, self.pause, self.lose,
        ]  # fmt: skip

    def disturb(self) -> None:
        """Do one of them."""
        kind = self._rng.choice(self._kinds)
        self.counts[kind.__name__] += 1
        kind()

    def restart(self) -> None:
        """Kill the planner, start another, and give it a goal."""
        self._run.replace_planner()
        self.change_goal()

    def kidnap(self) -> None:
        """Put the robot elsewhere."""
        message = PoseWithCovarianceStamped()
        message.header.frame_id = "odom"
        pose = message.pose.pose
        pose.position.x, pose.position.y = self._free()
        pose.orientation.w = 1.0
        self._pose.publish(message)

    def change_goal(self) -> None:
        """Send the robot elsewhere."""
        message = PoseStamped()
        message.header.frame_id = "odom"
        message.pose.position.x, message.pose.position.y = self._free()
        message.pose.orientation.w = 1.0
        self._goal.publish(message)

    def pause(self) -> None:
        """Pause the world for half a second."""
        for paused in (True, False):
            self._run.until(self._run.monitor.call_pause(paused).response, "pause")
            self._run.wait(0.5)

    def lose(self) -> None:
        """Stop the virtual sensor for a second: it loses what does not fit its queues."""
        (sensor,) = (
            child for child in self._run.processes.children if child.name == topics.VIRTUAL_SENSOR
        )
        sensor.send_signal(signal.SIGSTOP)
        self._run.wait(1.0)
        sensor.send_signal(signal.SIGCONT)

    def _free(self) -> Point:
        return self._rng.choice(FREE)


@contextmanager
def _node(domain: int) -> Iterator[Node]:
    context = Context()
    context.init(domain_id=domain)
    node = Node("disturber", context=context, start_parameter_services=False)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def disturbed(hours: float, speed: float, every_s: float, seed: int, root: Path) -> bool:
    """A run in real time with a process per node; whether something was wrong."""
    scenario = load_scenario("rooms")
    scenario = replace(scenario, robot=replace(scenario.robot, lidar=Lidar(beams=360)))
    scenario, params = with_perception(scenario, preset(PlannerParams()))
    config = RunConfig(scenario=scenario, planner=params, real_time=True, speed_factor=speed)
    ticks = int(hours * 3600 / (params.tick_ns * NANO))
    readings, due, begun = Readings(), ticks // 10, time.monotonic()
    with ManualRun(config, root / "bag", run_on=True) as run, _node(run.domain) as node:
        run.start()
        disturber = Disturber(run, node, random.Random(seed))
        while (tick := run.tick()) < ticks:
            run.wait(every_s)
            if tick >= due:
                due += (ticks - ticks // 10) // READINGS
                pids = {child.name: child.pid for child in run.processes.children}
                readings.take(pids, f"tick {tick}")
            disturber.disturb()
        run.wait(1.0)
    print(f"{tick} ticks in {time.monotonic() - begun:.0f} s; {dict(disturber.counts)}")
    return readings.growth() | lacks_ticks(root / "bag", params.tick_ns)


def main() -> int:
    """Run one of them; 1 if something was wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kind", choices=["in-process", "disturbed"])
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--hours", type=float, default=8.0, help="simulated")
    parser.add_argument("--speed", type=float, default=20.0, help="simulated s per wall s")
    parser.add_argument("--every", type=float, default=5.0, help="wall s between disturbances")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfba_soak_") as root:
        if options.kind == "in-process":
            bad = in_process(options.ticks, Path(root))
        else:
            bad = disturbed(options.hours, options.speed, options.every, options.seed, Path(root))
    print("WRONG" if bad else "flat and whole")
    return int(bad)


if __name__ == "__main__":
    sys.exit(main())
