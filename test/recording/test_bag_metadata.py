# SPDX-License-Identifier: Apache-2.0
"""metadata.yaml and the rosbag2 record: every field, older versions, refused content."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from recorded_bags import FOREIGN, LATCHED, SECOND, SENSOR, START_NS, write_bag

from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_metadata import (
    BagFile,
    BagMetadata,
    BagTopic,
    dump_file,
    dump_record,
    load_file,
)
from mfba_planner.recording.bag_qos import OfferedQos, from_list
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.message_definitions import definition_of

ROOT = "rosbag2_bagfile_information"


def content_of(directory: Path) -> dict[str, Any]:
    return dict(yaml.safe_load((directory / "metadata.yaml").read_text())[ROOT])


def test_every_field_of_our_metadata_yaml(tmp_path: Path) -> None:
    write_bag(tmp_path / "run1", 50)
    content = content_of(tmp_path / "run1")

    foreign = content_of(FOREIGN)
    assert list(content) == list(foreign)
    assert content["version"] == 9
    assert content["storage_identifier"] == "mcap"
    assert content["duration"] == {"nanoseconds": 49 * SECOND // 100 + 1}
    assert content["starting_time"] == {"nanoseconds_since_epoch": START_NS}
    assert content["message_count"] == 101
    assert (content["compression_format"], content["compression_mode"]) == ("", "")
    assert content["relative_file_paths"] == ["run1_0.mcap"]
    assert content["files"] == [
        {
            "path": "run1_0.mcap",
            "starting_time": content["starting_time"],
            "duration": content["duration"],
            "message_count": 101,
        }
    ]
    assert content["custom_data"] == {}
    assert content["ros_distro"] == "jazzy"

    topics = {t["topic_metadata"]["name"]: t for t in content["topics_with_message_count"]}
    assert {name: t["message_count"] for name, t in topics.items()} == {
        "/odom": 50,
        "/scan": 50,
        "/goal_pose": 1,
    }
    described = topics["/scan"]["topic_metadata"]
    assert list(described) == list(foreign["topics_with_message_count"][0]["topic_metadata"])
    assert described["type"] == "sensor_msgs/msg/LaserScan"
    assert described["serialization_format"] == "cdr"
    assert isinstance(described["offered_qos_profiles"], list)
    assert from_list(described["offered_qos_profiles"]) == (SENSOR, OfferedQos())
    assert described["type_description_hash"] == definition_of(described["type"]).type_hash
    latched = topics["/goal_pose"]["topic_metadata"]["offered_qos_profiles"]
    assert from_list(latched) == (LATCHED,)


def test_the_record_in_the_file_is_metadata_yaml_without_its_root(tmp_path: Path) -> None:
    write_bag(tmp_path / "run1", 5)
    with BagReader(tmp_path / "run1") as reader:
        first, *_, last = [
            content["serialized_metadata"]
            for name, content in reader.metadata_records()
            if name == "rosbag2"
        ]
    assert yaml.safe_load(last) == content_of(tmp_path / "run1")
    at_open = yaml.safe_load(first)
    assert at_open["message_count"] == 0
    assert at_open["starting_time"] == {"nanoseconds_since_epoch": 2**63 - 1}
    assert at_open["topics_with_message_count"] == []


def test_dump_and_load_agree() -> None:
    bag = BagMetadata(
        topics=(
            BagTopic(name="/a", type_name="x/msg/A", qos=(SENSOR,), type_hash="RIHS01_1"),
            BagTopic(name="/b", type_name="x/msg/B", message_count=7),
        ),
        files=(
            BagFile(path="b_0.mcap", start_ns=100, duration_ns=50, message_count=3),
            BagFile(path="b_1.mcap", start_ns=160, duration_ns=10, message_count=4),
            BagFile(path="b_2.mcap"),
        ),
        ros_distro="kilted",
    )
    assert load_file(dump_file(bag), "source") == bag
    assert yaml.safe_load(dump_record(bag))["duration"] == {"nanoseconds": 70}
    assert yaml.safe_load(dump_record(bag))["starting_time"] == {"nanoseconds_since_epoch": 100}


def test_foreign_metadata_loads() -> None:
    bag = load_file((FOREIGN / "metadata.yaml").read_text(), "source")
    assert bag.message_count == 281
    assert {t.name: t.message_count for t in bag.topics}["/scan"] == 133


def test_older_versions_load() -> None:
    """Version 4 has no per-file data, no distro, no hashes, and QoS as text with numbers."""
    qos_text = (
        "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n"
        "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
        "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  avoid_ros_namespace_conventions: false"
    )
    content = {
        "version": 4,
        "storage_identifier": "mcap",
        "relative_file_paths": ["old/old_0.mcap", "old/old_1.mcap"],
        "message_count": 5,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": "/t",
                    "type": "std_msgs/msg/String",
                    "serialization_format": "cdr",
                    "offered_qos_profiles": qos_text,
                },
                "message_count": 5,
            }
        ],
    }
    bag = load_file(yaml.safe_dump({ROOT: content}), "source")
    assert bag.message_count == 5
    assert bag.ros_distro == "unknown"
    assert bag.topics[0].qos == (OfferedQos(history="unknown", depth=0),)
    assert bag.topics[0].type_hash == ""


def changed(**changes: object) -> str:
    content = content_of(FOREIGN)
    content.update(changes)
    return str(yaml.safe_dump({ROOT: content}))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not a readable metadata.yaml"),
        ("{", "not a readable metadata.yaml"),
        ("just text", "not a readable metadata.yaml"),
        (f"{ROOT}: {{}}", "not a readable metadata.yaml .*version"),
        (changed(version="nine"), "not a readable metadata.yaml"),
        (changed(version=10), r"version 10 is not known \(1 to 9 are\); give the .mcap file"),
        (changed(version=0), "version 0 is not known"),
        (changed(compression_format="lz4"), "compressed by 'lz4', only zstd can be read; record"),
        (changed(relative_file_paths=None), "lists no storage file"),
        (changed(relative_file_paths=[]), "lists no storage file"),
        (changed(files=[3]), "not a readable metadata.yaml"),
        (changed(topics_with_message_count=[{}]), "not a readable metadata.yaml"),
        (changed(topics_with_message_count="many"), "not a readable metadata.yaml"),
    ],
)
def test_broken_or_unknown_metadata_is_refused(text: str, reason: str) -> None:
    with pytest.raises(BagError, match=f"^source: {reason}") as caught:
        load_file(text, "source")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("storage", ["", "sqlite3", "another"])
def test_storage_and_serialization_are_not_taken_from_the_metadata(storage: str) -> None:
    content = content_of(FOREIGN) | {"storage_identifier": storage, "compression_mode": "FILE"}
    content["topics_with_message_count"][2]["topic_metadata"]["serialization_format"] = "proto"
    read = load_file(yaml.safe_dump({ROOT: content}), "source")
    assert [topic.name for topic in read.topics] == [
        item["topic_metadata"]["name"] for item in content["topics_with_message_count"]
    ]
