# SPDX-License-Identifier: Apache-2.0
"""The bytes of a bag played to the real nodes, and decisions on the bag itself, to compare."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from ros_graph import Graph

from mfba_planner.core.option_specs import flatten
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_factory import params_for_method
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision, sector_ranges, stamp_ns
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.verification.redecide import RedecideParams, redecide_recording

RADIUS_M, SEED, TICKS = 0.3, 3, 12
PAPER = PlannerParams()
PREDICTIVE = replace(
    params_for_method(Method.PREDICTIVE.value, PAPER, algorithm_1=False), method=Method.PREDICTIVE
)
PLANNERS = {"paper": PAPER, "predictive": PREDICTIVE}


def play(
    graph: Graph, bag: Path, planner: PlannerParams, **more: Any
) -> tuple[list[Any], list[Any]]:
    """Publish the very bytes of a bag to both nodes; planner/decision and sectors."""
    common = {"lockstep": True, "robot_radius_m": RADIUS_M, **more}
    played = [topics.ODOM, topics.SCAN, topics.GOAL_POSE, *topics.TRANSFORMS]
    with BagReader(bag) as reader:
        played = [topic for topic in played if f"/{topic.name.lstrip('/')}" in reader.topics]
    writers = {topic.name.lstrip("/"): graph.writer(topic) for topic in played}
    decisions, sectors = graph.collect(topics.DECISION), graph.collect(topics.SECTORS)
    graph.start(VirtualSensor, {**common, "source": "scan"})
    graph.start(PlannerNode, {**flatten(planner), **common, "seed": SEED})
    with BagReader(bag) as reader:
        for message in reader.messages():
            writers[message.topic.lstrip("/")].publish(message.data)
            graph.settle()
    return decisions, sectors


def live(
    graph: Graph, bag: Path, planner: PlannerParams, **more: Any
) -> list[tuple[Any, Decision]]:
    """The messages of play(), and the decisions in them; those of one stamp belong together."""
    decisions, sectors = play(graph, bag, planner, **more)
    rings = {stamp_ns(ring.header.stamp): sector_ranges(ring) for ring in sectors}
    assert len(rings) == TICKS
    return [
        (message, decision(message, rings[stamp_ns(message.header.stamp)]))
        for message in decisions
    ]


def from_bag(bag: Path, planner: PlannerParams, **more: Any) -> tuple[Decision, ...]:
    given = RedecideParams(robot_radius_m=RADIUS_M, planner=planner, seed=SEED)
    found = redecide_recording(bag, replace(given, sensor=SensorParams(), **more))
    assert not found.faults
    return found.decided


def by_wall(found: Decision) -> Any:
    """What a decision of the paper's planner is apart from the last bits of its ranges."""
    return replace(found, ranges_m=())


def check_alike(
    found: Sequence[Decision],
    expected: Sequence[Decision],
    planner: PlannerParams,
    ticks: int = TICKS,
) -> None:
    """Whether decisions differ by no more than the last bits of ranges, and what follows."""
    assert len(found) == len(expected) == ticks
    assert {one.mode for one in found} == {one.mode for one in expected} != {Mode.STOPPED}
    for one, other in zip(found, expected):
        assert one.vs == other.vs
        assert one.ranges_m == pytest.approx(other.ranges_m, rel=1e-6)
        if planner is PAPER:
            assert by_wall(one) == by_wall(other)
        else:
            assert one.velocity == pytest.approx(other.velocity, abs=0.02)
