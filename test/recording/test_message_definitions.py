# SPDX-License-Identifier: Apache-2.0
"""Message definitions and type hashes of installed types and sourced workspaces."""

import json
import sys
from pathlib import Path

import pytest
from mcap_ros2._dynamic import generate_dynamic
from recorded_bags import FOREIGN
from rosbags.typesys import get_types_from_msg

from mfba_planner.core.errors import InputError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.message_definitions import definition_of

INSTALLED = sorted(
    f"{file.parts[-3]}/msg/{file.stem}" for file in Path(sys.prefix).glob("share/*/msg/*.msg")
)


def test_types_are_installed() -> None:
    assert len(INSTALLED) > 100


@pytest.mark.parametrize("type_name", INSTALLED)
def test_every_installed_type_parses_and_has_its_hash(type_name: str) -> None:
    definition = definition_of(type_name)
    package, _, name = type_name.split("/")

    assert type_name in generate_dynamic(type_name, definition.text)
    assert type_name in get_types_from_msg(definition.text, type_name)

    facts = json.loads(Path(sys.prefix, "share", package, "msg", f"{name}.json").read_text())
    hashes = {item["type_name"]: item["hash_string"] for item in facts["type_hashes"]}
    assert definition.type_hash == hashes[type_name]
    assert definition.type_hash.startswith("RIHS01_")
    # The type and all its dependencies, each once, as rosidl lists them.
    described = [line[5:] for line in definition.text.splitlines() if line.startswith("MSG: ")]
    expected = {dependency.replace("/msg/", "/") for dependency in hashes} - {f"{package}/{name}"}
    assert sorted(described) == sorted(expected)


def test_text_and_hash_are_those_of_the_real_rosbag2() -> None:
    with BagReader(FOREIGN) as reader:
        recorded = reader.definitions
    recorded.pop("tf2_msgs/msg/TFMessage")  # not among the wheels
    assert len(recorded) == 4
    for type_name, definition in recorded.items():
        assert definition_of(type_name) == definition


def test_sourced_workspace_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    overlay, other = tmp_path / "overlay", tmp_path / "other"
    folder = overlay / "share" / "my_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Pair.msg").write_text(
        "# a comment with a std_msgs/String\n"
        "int32 LIMIT=3\n"
        "Leaf[<=2] leaves  # of this package\n"
        "std_msgs/Header header\n"
        "std_msgs/Header[2] more\n"
        "string<=5 name 'x'\n"
    )
    (folder / "Leaf.msg").write_text("float64[3] values\n")
    hashes = [{"type_name": "my_msgs/msg/Pair", "hash_string": "RIHS01_" + "a" * 64}]
    (folder / "Pair.json").write_text(json.dumps({"type_hashes": hashes}))

    with pytest.raises(InputError, match=r"my_msgs/msg/Pair: this message type is not installed"):
        definition_of("my_msgs/msg/Pair")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{other}:{overlay}")
    definition = definition_of("my_msgs/msg/Pair")

    assert definition.type_hash == "RIHS01_" + "a" * 64
    described = [line for line in definition.text.splitlines() if line.startswith("MSG: ")]
    assert described == [
        "MSG: my_msgs/Leaf",
        "MSG: std_msgs/Header",
        "MSG: builtin_interfaces/Time",
    ]
    assert "my_msgs/msg/Pair" in generate_dynamic("my_msgs/msg/Pair", definition.text)

    with pytest.raises(InputError, match=r"Leaf\.json: holds no type hash .* install"):
        definition_of("my_msgs/msg/Leaf")
    (folder / "Leaf.json").write_text('{"type_hashes": []}')
    with pytest.raises(InputError, match="StopIteration"):
        definition_of("my_msgs/msg/Leaf")


@pytest.mark.parametrize(
    "type_name", ["String", "std_msgs/String", "std_msgs/srv/Empty", "/msg/String", "a/b/c/d", ""]
)
def test_other_names_are_refused(type_name: str) -> None:
    with pytest.raises(InputError, match="not a message type; write package/msg/Name"):
        definition_of(type_name)


@pytest.mark.parametrize("type_name", ["std_msgs/msg/Strin", "no_such_msgs/msg/Thing"])
def test_a_type_that_is_not_installed_is_named(type_name: str) -> None:
    package = type_name.split("/")[0]
    with pytest.raises(InputError, match=f"^{type_name}: .* not installed; .*package {package}"):
        definition_of(type_name)
