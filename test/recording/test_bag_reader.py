# SPDX-License-Identifier: Apache-2.0
"""Read bags of rosbag2 and mfba: any index, several files, odd content, merge by time."""

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer
from rclpy.serialization import deserialize_message
from recorded_bags import (
    FOREIGN,
    LATCHED,
    SECOND,
    SENSOR,
    START_NS,
    foreign_mcap,
    odometry,
    scan,
    text,
    write_bag,
)
from sensor_msgs.msg import LaserScan

from mfba_planner.recording import mcap_walk
from mfba_planner.recording.bag_metadata import BagFile, BagMetadata, dump_file
from mfba_planner.recording.bag_qos import INFINITE_NS, OfferedQos
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.merge_by_time import RawMessage, Source, merge_by_log_time

FOREIGN_COUNTS = {"/scan": 133, "/odom": 133, "/chatter": 13, "/goal_pose": 1, "/tf_static": 1}


@pytest.mark.parametrize("path", [FOREIGN, FOREIGN / "rosbag2_foreign_scan_0.mcap"])
def test_a_bag_of_the_real_rosbag2(path: Path) -> None:
    with BagReader(path) as reader:
        assert reader.complete
        assert reader.problems == []
        assert {t.name: t.message_count for t in reader.topics.values()} == FOREIGN_COUNTS
        assert reader.message_count == 281
        assert reader.ros_distro == "jazzy"
        assert reader.start_ns == 1795307211275673617
        assert reader.duration_ns == 13202142833
        assert reader.attachments == ()
        assert reader.file_paths == (FOREIGN / "rosbag2_foreign_scan_0.mcap",)
        latched = reader.topics["/goal_pose"]
        assert latched.type_name == "geometry_msgs/msg/PoseStamped"
        assert latched.qos == (
            OfferedQos(history="unknown", depth=0, durability="transient_local"),
        )
        assert latched.qos[0].lifespan_ns == INFINITE_NS
        assert latched.type_hash.startswith("RIHS01_10f3786d")

        raw = list(reader.messages())
        assert Counter(message.topic for message in raw) == FOREIGN_COUNTS
        assert [m.log_time_ns for m in raw] == sorted(m.log_time_ns for m in raw)
        scans = list(reader.decoded(["/scan"]))
        assert len(scans) == 133
        assert all(len(item.message.ranges) == 360 for item in scans)
        # Types that are not installed decode too: the bag contains their schemas.
        (static,) = reader.decoded({"/tf_static"})
        assert static.type_name == "tf2_msgs/msg/TFMessage"
        assert static.message.transforms


def test_our_own_bag(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 60)
    for given_path in (tmp_path / "run1", path, str(path)):
        with BagReader(given_path) as reader:
            assert reader.complete
            assert reader.topics["/goal_pose"].qos == (LATCHED,)
            assert reader.topics["/scan"].qos == (SENSOR, OfferedQos())
            assert (reader.start_ns, reader.message_count) == (START_NS, 121)
            assert reader.size_bytes == path.stat().st_size
            assert reader.ros_distro == "jazzy"
            assert reader.attachment("notes.txt") == b"kept"
            assert reader.attachment("other.txt") is None
            assert [a.media_type for a in reader.iter_attachments()] == ["text/plain"]
            assert ("lab", {"robot": "turtle"}) in list(reader.metadata_records())
            for index, raw in enumerate(reader.messages(["/scan"])):
                # The bytes may differ: CDR padding is not initialised.
                assert deserialize_message(raw.data, LaserScan) == scan(index)
                assert raw.log_time_ns == START_NS + index * SECOND // 100 + 1
                assert raw.publish_time_ns == raw.log_time_ns - 1
                assert (raw.sequence, raw.type_name) == (index, "sensor_msgs/msg/LaserScan")
            for index, item in enumerate(reader.decoded(["/odom"])):
                assert list(item.message.pose.covariance) == list(odometry(index).pose.covariance)


def test_start_offset(tmp_path: Path) -> None:
    write_bag(tmp_path / "run1", 100)
    with BagReader(tmp_path / "run1") as reader:
        late = list(reader.messages(start_offset_s=0.5))
        assert [m.topic for m in late[:2]] == ["/odom", "/scan"]
        assert late[0].log_time_ns == START_NS + SECOND // 2
        assert len(late) == 100
        assert len(list(reader.decoded(start_offset_s=0.5))) == 100
        assert list(reader.messages(start_offset_s=5.0)) == []
        assert len(list(reader.messages(["/odom", "/unknown"]))) == 100


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"use_chunking": False, "use_statistics": False, "index_types": IndexType.NONE},
        {"index_types": IndexType.NONE},
        {"use_statistics": False},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"enable_crcs": False},
        {"index_types": IndexType.CHUNK, "use_summary_offsets": False},
        {
            "index_types": IndexType.NONE,
            "use_statistics": False,
            "repeat_channels": False,
            "repeat_schemas": False,
            "use_summary_offsets": False,
        },
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.ZSTD},
        {"chunk_size": 1},
    ],
    ids=str,
)
def test_files_with_any_kind_of_index(tmp_path: Path, options: dict[str, Any]) -> None:
    path = foreign_mcap(tmp_path / "a.mcap", times_ns=(5, 3, 9, 3, 7), **options)
    for salvage in (False, True):
        with BagReader(path, salvage=salvage) as reader:
            assert reader.complete
            assert reader.topics["/chatter"].message_count == 5
            decoded = [m.message.data for m in reader.decoded()]
            assert decoded == ["at 3", "at 3", "at 5", "at 7", "at 9"]
            assert [m.sequence for m in reader.messages(in_file_order=True)] == [0] * 5
            assert (reader.start_ns, reader.end_ns) == (3, 9)
            assert reader.ros_distro == "unknown"


def test_attachments_and_metadata_without_an_index(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream, index_types=IndexType.NONE)
        writer.start("ros2")
        writer.add_attachment(1, 2, "x", "text/plain", b"one")
        writer.add_attachment(3, 4, "x", "text/plain", b"two")
        writer.add_metadata("note", {"k": "v"})
        writer.add_metadata("rosbag2", {"serialized_metadata": "version: 4"})
        writer.finish()
    with BagReader(tmp_path / "a.mcap") as reader:
        assert reader.attachment("x") == b"two"
        assert [(a.log_time, a.data) for a in reader.iter_attachments()] == [
            (2, b"one"),
            (4, b"two"),
        ]
        assert next(reader.metadata_records()) == ("note", {"k": "v"})
        assert reader.ros_distro == "unknown"


def test_long_runs_of_messages_outside_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_walk, "_UNCHUNKED_RUN_BYTES", 500)
    path = foreign_mcap(tmp_path / "a.mcap", times_ns=tuple(range(200, 0, -1)), use_chunking=False)
    with BagReader(path) as reader:
        assert reader.chunk_count > 10
        assert [m.log_time_ns for m in reader.messages()] == list(range(1, 201))


def split_bag(directory: Path, paths: tuple[str, ...] = ("part_0.mcap", "part_1.mcap")) -> Path:
    """Two files that overlap in time, as rosbag2 writes them when it splits a bag."""
    directory.mkdir()
    times = ((10, 30, 50), (20, 50, 60))
    for name, times_ns in zip(("part_0.mcap", "part_1.mcap"), times):
        foreign_mcap(directory / name, times_ns=times_ns, chunk_size=1)
    files = tuple(BagFile(path=path, message_count=3) for path in paths)
    bag = BagMetadata(topics=(), files=files, ros_distro="kilted")
    (directory / "metadata.yaml").write_text(dump_file(bag))
    return directory


@pytest.mark.parametrize(
    "paths", [("part_0.mcap", "part_1.mcap"), ("old/part_0.mcap", "old/part_1.mcap")]
)
def test_a_bag_of_several_files(tmp_path: Path, paths: tuple[str, ...]) -> None:
    with BagReader(split_bag(tmp_path / "bag", paths)) as reader:
        assert reader.complete
        assert reader.ros_distro == "kilted"
        assert reader.topics["/chatter"].message_count == 6
        assert len(reader.file_paths) == 2
        assert [m.log_time_ns for m in reader.messages()] == [10, 20, 30, 50, 50, 60]
        in_file = [m.log_time_ns for m in reader.messages(in_file_order=True)]
        assert in_file == [10, 30, 50, 20, 50, 60]


def test_metadata_yaml_supplies_what_the_channel_lacks(tmp_path: Path) -> None:
    foreign_mcap(tmp_path / "a.mcap")
    content = yaml.safe_load((FOREIGN / "metadata.yaml").read_text())
    information = content["rosbag2_bagfile_information"]
    information["relative_file_paths"] = ["a.mcap"]
    (tmp_path / "metadata.yaml").write_text(yaml.safe_dump(content))
    with BagReader(tmp_path) as reader:
        topic = reader.topics["/chatter"]
        assert topic.qos == (OfferedQos(history="unknown", depth=0),)
        assert topic.type_hash.startswith("RIHS01_df668c74")
        # It counts 281 messages, in a file of another name; this file holds 3.
        assert not reader.complete
        assert reader.problems == ["metadata.yaml counts 0 messages, the files hold 3"]


def test_odd_but_readable_content_is_a_problem_not_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        types = [
            writer.register_schema(f"std_msgs/msg/{name}", "ros2msg", b"string data")
            for name in ("String", "Other")
        ]
        broken = {"offered_qos_profiles": "- {history: [", "topic_type_hash": "RIHS01_x"}
        channels = [writer.register_channel("/t", "cdr", types[0], broken)]
        channels.append(writer.register_channel("/t", "cdr", types[1]))
        channels.append(writer.register_channel("/t", "cdr", types[0]))
        for index, channel in enumerate((0, 1, 1, 2)):
            writer.add_message(channels[channel], index, text(), index)
        writer.finish()
    with BagReader(path) as reader:
        assert not reader.complete
        quality, second = reader.problems
        assert quality.startswith("/t: offered_qos_profiles '- {history: ['")
        assert second == "/t: left out 2 messages of a second type, std_msgs/msg/Other"
        assert reader.topics["/t"].message_count == 2
        assert reader.topics["/t"].type_hash == "RIHS01_x"
        assert [m.log_time_ns for m in reader.messages()] == [0, 3]
        assert {m.type_name for m in reader.decoded()} == {"std_msgs/msg/String"}


CHUNKS = st.lists(st.lists(st.integers(0, 20), max_size=6), max_size=6)


@given(CHUNKS)
def test_merge_is_a_stable_sort_that_holds_only_overlapping_chunks(
    chunks: list[list[int]],
) -> None:
    loaded: list[int] = []

    def source(number: int, times: list[int]) -> Source:
        def load() -> list[RawMessage]:
            loaded.append(number)
            return [
                RawMessage("/t", "T", bytes([number]), time, 0, i) for i, time in enumerate(times)
            ]

        return Source(min(times, default=0), load)

    expected = sorted(
        ((time, number, i) for number, times in enumerate(chunks) for i, time in enumerate(times))
    )
    found = []
    for message in merge_by_log_time([source(n, times) for n, times in enumerate(chunks)]):
        found.append((message.log_time_ns, message.data[0], message.sequence))
        later = [n for n, t in enumerate(chunks) if min(t, default=0) > message.log_time_ns]
        assert not set(loaded) & set(later)
    assert found == expected
    assert sorted(loaded) == list(range(len(chunks)))
