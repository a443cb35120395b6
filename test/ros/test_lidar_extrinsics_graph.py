# SPDX-License-Identifier: Apache-2.0
"""The same wall by lidars with several extrinsics: the same decisions, live and from a bag."""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import tf2_msgs_package
from foreign_bags import START_NS, TICK_NS, Recorded, goal, odom, scan, transform, write
from mounted_lidars import MOUNTED, wall_ranges
from ros_graph import Graph

from mfba_planner.core.lidar_extrinsics import LidarExtrinsics
from mfba_planner.core.option_specs import flatten
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_factory import params_for_method
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.from_messages import decision, decision_field, sector_ranges
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
EACH = pytest.mark.parametrize("name", MOUNTED)


@pytest.fixture(scope="module")
def tf2_msgs_directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tf2_msgs_package.build(tmp_path_factory.mktemp("tf2_msgs"))


@pytest.fixture
def with_tf(tf2_msgs_directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The type TFMessage, with tf2_msgs installed for this test alone."""
    monkeypatch.syspath_prepend(str(tf2_msgs_directory))
    monkeypatch.setattr(topics, "TRANSFORMS", topics.transform_topics())
    assert [topic.name for topic in topics.TRANSFORMS] == ["/tf", "/tf_static"]
    yield topics.TRANSFORMS[0].type
    for name in [name for name in sys.modules if name.split(".")[0] == "tf2_msgs"]:
        del sys.modules[name]


def recording(mounted: LidarExtrinsics, *more: Recorded) -> list[Recorded]:
    """A robot that creeps along the wall to its left, to a goal behind it."""
    x, y, yaw, flipped = mounted
    static = transform(START_NS, x=x, y=y, yaw=yaw, roll=math.pi if flipped else 0.0)
    found = [static, goal(START_NS, 1.0, 5.0), *more]
    for k in range(1, TICKS + 1):
        stamp = START_NS + k * TICK_NS
        found += [odom(stamp, yaw=0.4), scan(stamp, wall_ranges(mounted).tolist(), range_min=0.1)]
    return found


def live(graph: Graph, bag: Path, planner: PlannerParams, **more: Any) -> list[Any]:
    """Publish the very bytes of a bag to both nodes; planner/decision."""
    common = {"lockstep": True, "robot_radius_m": RADIUS_M, **more}
    kinds = {t.name: t for t in (topics.ODOM, topics.SCAN, topics.GOAL_POSE, *topics.TRANSFORMS)}
    with BagReader(bag) as reader:
        messages = list(reader.messages())
    used = {message.topic.lstrip("/"): message for message in messages}
    writers = {
        name: graph.writer(topic) for name, topic in kinds.items() if name.lstrip("/") in used
    }
    decisions, sectors = graph.collect(topics.DECISION), graph.collect(topics.SECTORS)
    graph.start(VirtualSensor, {**common, "source": "scan"})
    parameters = {**flatten(planner), **common, "seed": SEED}
    graph.start(PlannerNode, parameters)
    for message in messages:
        writer = writers.get(message.topic) or writers.get(message.topic.lstrip("/"))
        if writer is not None:
            writer.publish(message.data)
            graph.settle()
    assert len(decisions) == len(sectors) == TICKS
    return [
        (message, decision(message, sector_ranges(ring)))
        for message, ring in zip(decisions, sectors)
    ]


def from_bag(bag: Path, planner: PlannerParams, **more: Any) -> tuple[Decision, ...]:
    given = RedecideParams(robot_radius_m=RADIUS_M, planner=planner, seed=SEED)
    found = redecide_recording(bag, replace(given, sensor=SensorParams(), **more))
    assert not found.faults
    return found.decided


def by_wall(found: Decision) -> Any:
    """What a decision of the paper's planner is apart from the last bits of its ranges."""
    return replace(found, ranges_m=())


@EACH
@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_by_parameters(graph: Graph, name: str, planner: PlannerParams, tmp_path: Path) -> None:
    mounted = MOUNTED[name]
    bag = write(tmp_path / "bag", recording(mounted)[1:])
    found = [one for _, one in live(graph, bag, planner, **mounted.parameters)]
    assert tuple(found) == from_bag(bag, planner, extrinsics=mounted)
    straight = write(tmp_path / "straight", recording(MOUNTED["straight"]))
    check_alike(found, from_bag(straight, planner), planner)


@EACH
@pytest.mark.parametrize("planner", PLANNERS.values(), ids=PLANNERS)
def test_by_tf(
    graph: Graph, name: str, planner: PlannerParams, tmp_path: Path, with_tf: Any
) -> None:
    bag = write(tmp_path / "bag", recording(MOUNTED[name]))
    found = live(graph, bag, planner)
    assert tuple(one for _, one in found) == from_bag(bag, planner)
    straight = write(tmp_path / "straight", recording(MOUNTED["straight"]))
    check_alike([one for _, one in found], from_bag(straight, planner), planner)
    told = [decision_field(message, "scan_extrinsics") for message, _ in found]
    assert all(told) == (planner is PREDICTIVE)


def check_alike(
    found: list[Decision], expected: tuple[Decision, ...], planner: PlannerParams
) -> None:
    assert len(found) == len(expected) == TICKS
    assert {one.mode for one in found} == {one.mode for one in expected} != {Mode.STOPPED}
    for one, other in zip(found, expected):
        assert one.vs == other.vs
        assert one.ranges_m == pytest.approx(other.ranges_m, rel=1e-6)
        if planner is PAPER:
            assert by_wall(one) == by_wall(other)
        else:
            assert one.velocity == pytest.approx(other.velocity, abs=0.02)
