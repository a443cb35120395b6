# SPDX-License-Identifier: Apache-2.0
"""What a node publishes last reaches a reader that does not run at that moment."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from builtin_interfaces.msg import Time
from project import ROOT
from ros_graph import Graph

from mfba_planner.core.shipped_files import config_path
from mfba_planner.ros.interface import topics
from mfba_planner.ros.runtime.base_node import GraphNode

READER = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rosgraph_msgs.msg import Clock
rclpy.init()
node = rclpy.create_node("reader")
node.create_subscription(Clock, "/clock", lambda m: print(m.clock.sec, flush=True), 10)
print("up", flush=True)
executor = SingleThreadedExecutor()
executor.add_node(node)
while True:
    executor.spin_once(timeout_sec=0.1)
"""
WRITER = """
import sys
from builtin_interfaces.msg import Time
from mfba_planner.ros.interface import topics
from mfba_planner.ros.runtime.base_node import GraphNode
from mfba_planner.ros.runtime.spin_node import spin_node

class Writer(GraphNode):
    def __init__(self):
        super().__init__("writer")
        self.publisher = self.advertise(topics.CLOCK)

    def spin_once(self, executor):
        super().spin_once(executor)
        if self.publisher.get_subscription_count():
            print("met", flush=True)

    def drain(self, executor):
        self.publisher.publish(topics.CLOCK.type(clock=Time(sec=7)))
        print("published", flush=True)

sys.exit(spin_node(Writer, []))
"""


@contextmanager
def started(code: str, env: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    env = {**os.environ, **env, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def read_until(process: subprocess.Popen[str], line: str) -> None:
    assert process.stdout is not None
    for found in process.stdout:
        if found.strip() == line:
            return
    pytest.fail(f"ended without {line!r}")


def test_a_process_stays_until_a_halted_reader_has_its_last_message(
    ros_env: dict[str, str],
) -> None:
    with started(READER, ros_env) as reader, started(WRITER, ros_env) as writer:
        read_until(reader, "up")
        read_until(writer, "met")
        reader.send_signal(signal.SIGSTOP)
        writer.send_signal(signal.SIGINT)
        read_until(writer, "published")
        with pytest.raises(subprocess.TimeoutExpired):
            writer.wait(0.3)
        reader.send_signal(signal.SIGCONT)
        read_until(reader, "7")
        assert writer.wait(30.0) == 0


def test_a_reader_that_never_runs_again_does_not_keep_the_node(
    graph: Graph, ros_env: dict[str, str]
) -> None:
    class Writer(GraphNode):
        pass

    node = graph.start(Writer, {}, name="writer")
    publisher = node.advertise(topics.CLOCK)
    assert node.wait_for_readers(600.0), "there is none"
    with started(READER, ros_env) as reader:
        read_until(reader, "up")
        graph.until(lambda: publisher.get_subscription_count() == 1)
        publisher.publish(topics.CLOCK.type(clock=Time(sec=1)))
        read_until(reader, "1")
        assert node.wait_for_readers(600.0)
        reader.send_signal(signal.SIGSTOP)
        publisher.publish(topics.CLOCK.type(clock=Time(sec=2)))
        assert not node.wait_for_readers(0.2)


ASKING = """
import rclpy
from builtin_interfaces.msg import Time
from mfba_planner.ros.interface import topics
from mfba_planner.ros.runtime.base_node import GraphNode
rclpy.init()
node = GraphNode("asking")
publisher = node.advertise(topics.CLOCK)
while not publisher.get_subscription_count():
    rclpy.spin_once(node, timeout_sec=0.05)
for sec in range(1, 6):
    publisher.publish(topics.CLOCK.type(clock=Time(sec=sec)))
    if not node.wait_for_readers(1.0):  # without the profile it takes up to 3 s
        print("not acknowledged", flush=True)
print("done", flush=True)
"""


def test_nodes_of_a_run_need_not_wait_for_acknowledgements(ros_env: dict[str, str]) -> None:
    profile = {"FASTRTPS_DEFAULT_PROFILES_FILE": str(config_path("private_discovery.xml"))}
    env = {**ros_env, **profile}
    with started(READER, env) as reader, started(ASKING, env) as asking:
        read_until(reader, "up")
        assert asking.stdout is not None
        lines = asking.stdout.read().split("\n")
        assert lines.count("not acknowledged") <= 1, "but for one that discovery delayed"
        assert "done" in lines
