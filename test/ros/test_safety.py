# SPDX-License-Identifier: Apache-2.0
"""Every fault in the real graph stops the robot and is named on /diagnostics."""

import json
import math
import time
from copy import deepcopy
from itertools import groupby
from typing import Any

import pytest
from message_relay import SPEED_FACTOR, TIMEOUT_S, RelayedGraph, Tamper
from ros_graph import Graph
from std_srvs.srv import SetBool

from mfba_planner.core.option_specs import flatten
from mfba_planner.planning.recovery import RecoveryParams, longest_s
from mfba_planner.recording.from_messages import stamp_ns
from mfba_planner.ros.endpoints.diagnostics_publisher import DiagnosticsPublisher
from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.to_messages import pose_stamped_msg
from mfba_planner.ros.nodes.planner import PlannerNode

INF, NAN = math.inf, math.nan
FAR = json.dumps(
    {"name": "far", "start_m": [0.0, 0.0], "goal_m": [50.0, 0.0], "time_limit_s": 600.0}
)
SOON_S = 0.3  # of simulated time


def lost(_: Any) -> None:
    """The message is lost."""


def changed(path: str, value: Any) -> Tamper:
    """The message with one attribute changed."""

    def tamper(message: Any) -> Any:
        copy = deepcopy(message)
        *parents, last = path.split(".")
        target = copy
        for name in parents:
            target = getattr(target, name)
        setattr(target, last, value)
        return copy

    return tamper


def repeated() -> Tamper:
    """The same message again and again, as from a driver whose hardware has failed."""
    first: list[Any] = []

    def tamper(message: Any) -> Any:
        first.append(message)
        return first[0]

    return tamper


OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"
BLIND = [NAN] * 12
FAULTS = {
    "stale scan": ("scan", lost, STALE, "sectors stale for"),
    "stale odom": ("odom", lost, STALE, "odom stale for"),
    "odom with one stamp": ("odom", repeated(), STALE, "odom stale for"),
    "stale sectors": ("sectors", lost, STALE, "sectors stale for"),
    "frame of scan": (
        "scan",
        changed("header.frame_id", "rear"),
        ERROR,
        "refused: sector 1 holds nan",
    ),
    "NaN scan": ("scan", changed("ranges", [NAN] * 360), ERROR, "refused: sector 1 holds nan"),
    "NaN sectors": ("sectors", changed("ranges", BLIND), ERROR, "refused: sector 1 holds nan"),
    "NaN odom": (
        "odom",
        changed("pose.pose.position.x", NAN),
        ERROR,
        "refused: odom position holds nan",
    ),
    "inf odom": (
        "odom",
        changed("pose.pose.position.y", math.inf),
        ERROR,
        "refused: odom position holds inf",
    ),
    "frame of odom": (
        "odom",
        changed("header.frame_id", "map"),
        ERROR,
        "refused: odom is in frame 'map', not 'odom'",
    ),
    "frame of sectors": (
        "sectors",
        changed("header.frame_id", "laser"),
        ERROR,
        "refused: sectors is in frame 'laser', not 'odom'",
    ),
}

# Where the planner only gets blind sectors or none, virtual_sensor reports the cause.
CAUSES = {
    "stale scan": (STALE, "scan stale for"),
    "stale odom": (STALE, "odom stale for"),
    "odom with one stamp": (STALE, "odom stale for"),
    "frame of scan": (
        ERROR,
        "refused: scan is in frame 'rear', not 'base_link'; transform it, or set scan_frame",
    ),
    "NaN scan": (ERROR, "refused: scan of 360 beams without one usable range; check the lidar"),
    "NaN odom": (ERROR, "refused: odom position holds nan"),
    "inf odom": (ERROR, "refused: odom position holds inf"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_of_the_inputs_stops_the_robot_and_is_named(graph: Graph, fault: str) -> None:
    where, tamper, level, text = FAULTS[fault]
    relayed = RelayedGraph(graph, FAR)
    last_good_ns = relayed.drive()
    assert relayed.status("inputs").level == OK
    relayed.tamper[where] = tamper
    assert relayed.rest_after(last_good_ns) <= SOON_S
    graph.until(lambda: relayed.status("inputs").message.startswith(text))
    assert relayed.status("inputs").level == level
    assert relayed.status("driving").level == ERROR
    level, text = CAUSES.get(fault, (OK, "odom and scan are sound"))
    graph.until(lambda: relayed.status("inputs", "virtual_sensor").message.startswith(text))
    assert relayed.status("inputs", "virtual_sensor").level == level
    relayed.tamper.clear()
    graph.until(relayed.is_moving)
    for node in ("planner", "virtual_sensor"):
        graph.until(lambda node=node: relayed.status("inputs", node).level == OK)  # type: ignore[misc]


def test_a_paused_world_stops_the_commands_and_is_named(graph: Graph) -> None:
    relayed = RelayedGraph(graph, FAR)
    relayed.drive()
    graph.call(SetBool, "world_sim/pause", SetBool.Request(data=True))
    graph.settle()
    since_s = time.monotonic()
    graph.until(lambda: is_rest(relayed.cmd_vel[-1]))
    assert (time.monotonic() - since_s) * SPEED_FACTOR <= SOON_S
    for name in ("odom", "sectors"):
        text = f"{name} stale for"
        graph.until(lambda text=text: text in relayed.status("inputs").message)  # type: ignore[misc]
    assert relayed.status("inputs").level == STALE
    ages = values(relayed.status("inputs"))
    assert float(ages["odom: age [s]"]) > TIMEOUT_S / SPEED_FACTOR
    assert 0.0 < float(ages["odom: rate [Hz]"]) < 10.0


def is_rest(twist: Any) -> bool:
    return (twist.linear.x, twist.linear.y, twist.angular.z) == (0.0, 0.0, 0.0)


def values(status: Any) -> dict[str, str]:
    return {item.key: item.value for item in status.values}


def test_before_any_input_it_reports_what_it_waits_for(graph: Graph) -> None:
    received = graph.collect(topics.DIAGNOSTICS)
    graph.start(PlannerNode, {"hardware_id": "rosie"})
    graph.until(lambda: bool(received))
    inputs, driving, _ = received[0].status
    assert (inputs.level, inputs.message) == (STALE, "no odom yet; no sectors yet")
    assert (driving.level, driving.message) == (OK, "nothing decided yet")
    assert {inputs.hardware_id, driving.hardware_id} == {"rosie"}
    assert (inputs.name, driving.name) == ("planner: inputs", "planner: driving")


def test_diagnostics_come_once_a_period_and_at_once_when_a_level_changes(graph: Graph) -> None:
    relayed = RelayedGraph(graph, FAR, diagnostics_period_s=3600.0)
    relayed.drive()
    count = len(relayed.diagnostics())
    start_ns = stamp_ns(relayed.odom[-1].header.stamp)
    graph.until(lambda: stamp_ns(relayed.odom[-1].header.stamp) > start_ns + 5 * 10**8)
    assert len(relayed.diagnostics()) == count, "nothing has changed"
    relayed.tamper["sectors"] = lost
    graph.until(lambda: relayed.status("inputs").level == STALE)
    assert len(relayed.diagnostics()) <= count + 3


def test_while_inputs_are_stale_diagnostics_continue_once_a_period(graph: Graph) -> None:
    relayed = RelayedGraph(graph, FAR, diagnostics_period_s=1.0)
    relayed.drive()
    relayed.tamper["sectors"] = lost
    graph.until(lambda: relayed.status("inputs").level == STALE)
    count = len(relayed.diagnostics())

    def ages() -> list[float]:
        inputs = [message.status[0] for message in relayed.diagnostics()[count:]]
        return [float(values(status)["sectors: age [s]"]) for status in inputs]

    graph.until(lambda: len(ages()) > 1 and ages()[-1] > ages()[0] + 3.0)
    assert len(ages()) <= ages()[-1] - ages()[0] + 4


def test_a_repeated_stamp_does_not_delay_diagnostics(graph: Graph) -> None:
    node = graph.start(PlannerNode, {"diagnostics_period_s": 1.0})
    topic = DiagnosticsPublisher(node, node.settings)
    topic.set_time(10**9, 0.0)
    topic.publish([], 0.0, changed=False)
    assert not topic.is_due(0.5)
    topic.set_time(10**9, 0.9)
    assert topic.is_due(1.5)
    topic.set_time(2 * 10**9 - 1, 1.5)
    assert not topic.is_due(1.5)


def test_when_every_gap_is_closed_it_rests_and_reports_it(graph: Graph) -> None:
    relayed = RelayedGraph(graph, FAR)
    since_ns = relayed.drive()
    relayed.beams = [0.7] * 360
    assert relayed.rest_after(since_ns) <= SOON_S
    graph.until(lambda: relayed.status("driving").level == WARN)
    assert relayed.status("driving").message.endswith("set: every gap is closed")
    assert values(relayed.status("driving"))["mode"] == "blocked"


def test_recovery_backs_off_and_gives_up_in_bounded_time(graph: Graph) -> None:
    recovery = RecoveryParams(
        enabled=True, wait_s=0.3, back_off_s=0.3, back_off_mps=0.1, attempts=2
    )
    parameters = {f"recovery.{name}": value for name, value in flatten(recovery).items()}
    relayed = RelayedGraph(graph, FAR, **parameters)
    since_ns = relayed.drive()
    relayed.beams = [0.7] * 180 + [0.9] * 180  # more room behind
    graph.until(
        lambda: values(relayed.status("driving"))["recovery"] == "given_up", timeout_s=30.0
    )
    took_s = (stamp_ns(relayed.odom[-1].header.stamp) - since_ns) * 1e-9
    assert took_s < longest_s(recovery, 0.1) + SOON_S
    assert relayed.status("driving").level == ERROR
    assert relayed.status("driving").message == "gave up after 2 attempts; send a goal to go on"
    phases = [values(m.status[1])["recovery"] for m in relayed.diagnostics()]
    sequence = [name for name, _ in groupby(phases)]
    expected = ["wait", "back_off", "replan"] * 2 + ["wait", "given_up"]
    assert sequence[-len(expected) :] == expected
    relayed.rest_after(stamp_ns(relayed.odom[-1].header.stamp))
    backwards = {
        d.status[0].message for d in relayed.decisions if "backing off" in d.status[0].message
    }
    assert backwards == {"backing off, attempt 1 of 2", "backing off, attempt 2 of 2"}
    # No obstacle is left: nothing happens until a goal is sent, even the same one.
    relayed.beams = [INF] * 360
    goal = graph.writer(topics.GOAL_POSE)
    assert not relayed.is_moving()
    goal.publish(pose_stamped_msg((50.0, 0.0), 1, "odom"))
    graph.until(relayed.is_moving)


def test_a_killed_planner_leaves_the_robot_at_rest(graph: Graph) -> None:
    """Killed: it publishes nothing any more. world_sim stops as a base controller would."""
    relayed = RelayedGraph(graph, FAR)
    since_ns = relayed.drive()
    graph.executor.remove_node(relayed.planner)
    assert relayed.rest_after(since_ns) <= SOON_S + 1e-9


def test_a_planner_that_is_stopped_commands_rest_last(graph: Graph) -> None:
    relayed = RelayedGraph(graph, FAR)
    relayed.drive()
    graph.stop(relayed.planner)
    graph.settle()
    assert is_rest(relayed.cmd_vel[-1])


def test_the_speed_limit_slows_it_down_near_obstacles(graph: Graph) -> None:
    relayed = RelayedGraph(
        graph, FAR, **{"speed_limit.slow_within_m": 0.8, "speed_limit.least_share": 0.1}
    )
    relayed.drive()
    fast = speed(relayed.cmd_vel[-1])
    relayed.beams = [INF] * 170 + [0.7] * 20 + [INF] * 170  # 0.4 m behind, enlarged by 0.3 m
    graph.until(lambda: 0.0 < speed(relayed.cmd_vel[-1]) < 0.6 * fast)
    assert relayed.decisions[-1].status[0].message.endswith("50 % speed so near")


def speed(twist: Any) -> float:
    return math.hypot(twist.linear.x, twist.linear.y)
