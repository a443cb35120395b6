# SPDX-License-Identifier: Apache-2.0
"""How long a recorder goes on receiving before its end."""

import time
from pathlib import Path

import pytest
from ros_graph import Graph
from rosgraph_msgs.msg import Clock

from mfba_planner.ros.endpoints.tick_counts import are_unequal
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.runtime.base_node import GraphNode
from mfba_planner.ros.runtime.drain_subscriptions import BEHIND_S, QUIET_S, drain

LATE_S = 0.6  # later than QUIET_S, sooner than BEHIND_S


def test_late_messages_are_waited_for_only_while_some_are_missing(graph: Graph) -> None:
    node = graph.start(GraphNode, {}, name="late")
    received: list[float] = []
    node.create_timer(LATE_S, lambda: received.append(time.monotonic()))
    started = time.monotonic()
    drain(graph.executor, lambda: 0, lambda: not received)
    assert received, "the recorder ended before its last message came"
    assert received[0] - started >= LATE_S / 2
    assert time.monotonic() - received[0] < BEHIND_S, "it has all and still waits"


@pytest.mark.parametrize(("is_behind", "at_least_s"), [(False, QUIET_S), (True, BEHIND_S)])
def test_what_never_comes_is_waited_for_within_limits(
    graph: Graph, is_behind: bool, at_least_s: float
) -> None:
    started = time.monotonic()
    drain(graph.executor, lambda: 0, lambda: is_behind)
    assert time.monotonic() - started >= at_least_s


def test_robots_are_compared_with_themselves() -> None:
    of_ticks = [topic.name for topic in topics.GRAPH if topic.every_tick]
    relative = [name for name in of_ticks if not name.startswith("/")]
    counts = {f"/{name}": 3 for name in relative} | {"/clock": 9, "/trail": 1, "/outcome": 2}
    counts |= {f"/r1/{name}": 5 for name in relative}

    def unequal(namespaces: tuple[str, ...] = ("r1",)) -> bool:
        return are_unequal(counts, namespaces, lambda name: f"/{name}")

    assert not unequal()
    counts[f"/{relative[0]}"] = 0
    assert not unequal(), "nobody publishes it"
    for name in relative[1:]:
        counts[f"/r1/{name}"] = 4
        assert unequal(), name
        assert not unequal(()), "r1 is not of this run"
        counts[f"/r1/{name}"] = 5


def test_a_recorder_waits_for_what_is_missing_of_a_tick(graph: Graph, tmp_path: Path) -> None:
    clock = graph.writer(topics.CLOCK)
    odom, sectors = graph.writer(topics.ODOM), graph.writer(topics.SECTORS)
    recorder = graph.start(Recorder, {"output": str(tmp_path / "bag"), "sim_time": True})
    message = Clock()
    message.clock.sec = 1
    clock.publish(message)
    for writer, topic in ((odom, topics.ODOM), (sectors, topics.SECTORS), (odom, topics.ODOM)):
        writer.publish(topic.type())
    graph.until(lambda: recorder.writer.message_count == 4)
    started = time.monotonic()
    recorder.drain(graph.executor)
    assert time.monotonic() - started >= BEHIND_S
