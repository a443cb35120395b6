# SPDX-License-Identifier: Apache-2.0
"""docs/reference and config/planner.yaml are up to date; the listed services are the nodes'."""

from pathlib import Path
from typing import Any

import pytest
import reference
from reference_text import SERVICES
from ros_graph import Graph

from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode
from mfba_planner.ros.nodes.recorder import Recorder
from mfba_planner.ros.nodes.replay import Replay
from mfba_planner.ros.nodes.virtual_sensor import VirtualSensor
from mfba_planner.ros.nodes.world_sim import WorldSim
from mfba_planner.ros.replaying.replay_arguments import parse

# rclpy adds services of these types to nodes.
RCLPY_TYPES = ("rcl_interfaces/", "type_description_interfaces/")
PARAMETER_SERVICES = {
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
}


@pytest.mark.parametrize("path", reference.generated(), ids=lambda path: str(path.name))
def test_generated_files_are_up_to_date(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text == reference.generated()[path], "run `python tools/reference.py --write`"


def test_every_page_of_the_folder_is_generated() -> None:
    found = set(reference.PAGES_FOLDER.glob("*.md"))
    assert found == set(reference.generated()) - {reference.YAML}


def test_pages_list_every_topic_and_every_service() -> None:
    topics_page, services_page = reference.page("topics"), reference.page("services")
    for topic in topics.GRAPH:
        assert f"`{topic.name}`" in topics_page
    for node, name, kind, _ in SERVICES:
        assert f"| `{node}/{name}` | {kind} | {node} |" in services_page


def test_a_stale_file_is_named_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reference, "ROOT", tmp_path)
    monkeypatch.setattr(reference, "PAGES_FOLDER", tmp_path / "reference")
    monkeypatch.setattr(reference, "YAML", tmp_path / "planner.yaml")
    assert reference.main([]) == 1
    assert "planner.yaml: out of date; run" in capsys.readouterr().out
    assert reference.main(["--write"]) == 0
    assert reference.main([]) == 0
    assert capsys.readouterr().out == ""
    with (tmp_path / "reference/topics.md").open("a", encoding="utf-8") as file:
        file.write("more\n")
    assert reference.main([]) == 1
    expected = "reference/topics.md: out of date; run `python tools/reference.py --write`\n"
    assert capsys.readouterr().out == expected


def test_listed_services_are_those_of_the_nodes(graph: Graph, tmp_path: Path) -> None:
    kinds: dict[str, Any] = {
        "world_sim": WorldSim,
        "virtual_sensor": VirtualSensor,
        "planner": PlannerNode,
        "recorder": Recorder,
    }
    for name, kind in kinds.items():
        graph.start(kind, {"output": str(tmp_path / "bag")} if name == "recorder" else {})
    bag = reference.ROOT / "test/data/rosbag2_foreign_scan"
    graph.start(Replay, {}, settings=parse([str(bag), "--start-paused"]))
    nodes = (*kinds, "replay")
    graph.until(lambda: all(services_of(graph, name) for name in nodes))
    found = {entry for name in nodes for entry in services_of(graph, name)}
    listed = {(f"/{node}/{service}", kind) for node, service, kind, _ in SERVICES}
    own = {(name, kind) for name, kind in found if not kind.startswith(RCLPY_TYPES)}
    assert own == listed
    parameters = {name for name, kind in found if kind.startswith("rcl_interfaces/")}
    assert parameters == {f"/{name}/{service}" for name in kinds for service in PARAMETER_SERVICES}


def services_of(graph: Graph, node: str) -> set[tuple[str, str]]:
    """Name and type of each service of a node."""
    found = graph.probe.get_service_names_and_types_by_node(node, "/")
    return {(name, kind) for name, kinds in found for kind in kinds}
