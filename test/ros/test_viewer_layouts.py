# SPDX-License-Identifier: Apache-2.0
"""The viewer layouts name existing topics, with types and QoS that their displays accept."""

import json
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import pytest
import yaml
from planner_talk import LOCKSTEP, PlannerHarness
from project import ROOT
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.ros.interface import topics
from mfba_planner.ros.interface.serialized_message import type_name

LAYOUT = ROOT / "layout"
GRAPH = {f"/{topic.name.lstrip('/')}": topic for topic in topics.GRAPH}
PLUGINS = "rviz_default_plugins/"
# What rviz_default_plugins' plugins_description.xml (Jazzy) lists for those used here.
DISPLAYS = {
    "Grid": None,
    "Map": "nav_msgs/msg/OccupancyGrid",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Path": "nav_msgs/msg/Path",
    "Pose": "geometry_msgs/msg/PoseStamped",
    "Odometry": "nav_msgs/msg/Odometry",
    "LaserScan": "sensor_msgs/msg/LaserScan",
}
TOOLS = {
    "MoveCamera": None,
    "Select": None,
    "Measure": None,
    "SetInitialPose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "SetGoal": "geometry_msgs/msg/PoseStamped",
}
PANELS = {"Displays", "Tool Properties", "Views", "Time"}


@pytest.fixture(scope="module")
def rviz() -> Any:
    return yaml.safe_load((LAYOUT / "mfba.rviz").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def foxglove() -> Any:
    return json.loads((LAYOUT / "foxglove.json").read_text(encoding="utf-8"))


def test_rviz_plugins_exist(rviz: Any) -> None:
    manager = rviz["Visualization Manager"]
    assert {panel["Class"] for panel in rviz["Panels"]} == {f"rviz_common/{p}" for p in PANELS}
    assert {d["Class"] for d in manager["Displays"]} == {PLUGINS + name for name in DISPLAYS}
    assert {t["Class"] for t in manager["Tools"]} == {PLUGINS + name for name in TOOLS}
    assert manager["Views"]["Current"]["Class"] == PLUGINS + "TopDownOrtho"
    assert manager["Global Options"]["Fixed Frame"] == "odom"
    names = [display["Name"] for display in manager["Displays"]]
    assert len(set(names)) == len(names)


def test_rviz_shows_topics_of_the_graph_with_their_type_and_qos(rviz: Any) -> None:
    manager = rviz["Visualization Manager"]
    known = {PLUGINS + name: kind for name, kind in (DISPLAYS | TOOLS).items()}
    shown = 0
    for item in (*manager["Displays"], *manager["Tools"]):
        kind = known[item["Class"]]
        assert (kind is not None) == ("Topic" in item), item["Class"]
        if kind is None:
            continue
        asked = item["Topic"]
        topic = GRAPH[asked["Value"]]
        assert type_name(topic.type) == kind, asked["Value"]
        latched = topic.qos.durability.short_key == "transient_local"
        if asked["Durability Policy"] == "Transient Local":
            assert latched
            assert topic.writers, "another's writer need not be latched"
        shown += 1
    assert shown >= 9


def paths(layout: Any) -> Iterator[str]:
    """Every topic or message path of a panel."""
    for name, panel in layout["configById"].items():
        if name.startswith("3D!"):
            yield from panel["topics"]
            yield from (panel["publish"][key] for key in ("poseTopic", "poseEstimateTopic"))
        yield from (panel[key] for key in ("topicToRender", "topicPath") if key in panel)
        yield from (path["value"] for path in panel.get("paths", []))


def test_foxglove_topics_and_fields_exist(foxglove: Any) -> None:
    used = set()
    for path in paths(foxglove):
        name = re.match(r"/[a-z_/]+", path)
        assert name, path
        topic = GRAPH[name.group()]
        used.add(name.group())
        kind: Any = topic.type
        for field in re.findall(r"\.(\w+)", path[name.end() :]):
            fields = kind.get_fields_and_field_types()
            assert field in fields, path
            inner = re.sub(r"sequence<(.+)>|\[\d*\]", r"\1", fields[field])
            package, _, name_of = inner.partition("/")
            kind = getattr(import_module(f"{package}.msg"), name_of) if name_of else None
    assert len(used) >= 10


def test_foxglove_lays_out_every_panel_once_and_their_types_exist(foxglove: Any) -> None:
    def leaves(node: Any) -> list[str]:
        if isinstance(node, str):
            return [node]
        assert node["direction"] in ("row", "column")
        assert 0 < node["splitPercentage"] < 100
        return leaves(node["first"]) + leaves(node["second"])

    placed = leaves(foxglove["layout"])
    assert sorted(placed) == sorted(foxglove["configById"])
    kinds = {"3D", "CallService", "DiagnosticSummary", "Plot", "RawMessages", "StateTransitions"}
    assert {name.partition("!")[0] for name in placed} == kinds
    assert {"globalVariables", "userNodes", "playbackConfig"} <= set(foxglove)


def test_the_service_that_foxglove_calls_exists(graph: Graph, foxglove: Any) -> None:
    panel = foxglove["configById"]["CallService!cancel"]
    PlannerHarness(graph, LOCKSTEP)
    assert json.loads(panel["requestPayload"]) == {}
    assert graph.call(Trigger, panel["serviceName"]).success
