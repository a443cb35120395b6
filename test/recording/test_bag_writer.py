# SPDX-License-Identifier: Apache-2.0
"""Write bags: format, chunk size and age, refused writes, failures, close and discard."""

import resource
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Header
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from recorded_bags import (
    SECOND,
    SENSOR,
    START_NS,
    count_with_all,
    count_with_rosbags,
    fill,
    numbers,
    odometry,
    text,
    write_bag,
)
from rosbags.highlevel import AnyReader

from mfba_planner.core.errors import InputError, OutputError
from mfba_planner.recording.bag_qos import OfferedQos, from_list
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.message_definitions import definition_of


def chunk_count(path: Path) -> int:
    """Whole chunks in a file that may not be closed."""
    with BagReader(path, salvage=True) as reader:
        return reader.chunk_count


def test_four_readers_open_count_and_decode_a_bag(tmp_path: Path) -> None:
    write_bag(tmp_path / "run1", 300)
    assert count_with_all(tmp_path / "run1") == {"/odom": 300, "/scan": 300, "/goal_pose": 1}
    assert sorted(p.name for p in (tmp_path / "run1").iterdir()) == [
        "metadata.yaml",
        "run1_0.mcap",
    ]


def test_content_is_unchanged(tmp_path: Path) -> None:
    """Fixed arrays and nested fields, as an independent reader decodes them."""
    write_bag(tmp_path / "run1", 40)
    with AnyReader([tmp_path / "run1"]) as reader:
        connections = [c for c in reader.connections if c.topic == "/odom"]
        for index, (connection, _, data) in enumerate(reader.messages(connections)):
            message: Any = reader.deserialize(data, connection.msgtype)
            expected = odometry(index)
            assert message.child_frame_id == expected.child_frame_id
            assert list(message.pose.covariance) == list(expected.pose.covariance)
            assert message.pose.pose.position.x == expected.pose.pose.position.x


def test_the_file_has_the_format_of_rosbag2(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 200)
    with path.open("rb") as stream:
        records = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
        header, chunks = records[0], [r for r in records if isinstance(r, Chunk)]
        assert isinstance(header, Header)
        assert header.profile == "ros2"
        assert len(chunks) > 5
        assert all(chunk.compression == "zstd" and chunk.uncompressed_crc for chunk in chunks)
        stream.seek(0)
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == len(chunks)
    assert all(index.message_index_offsets for index in summary.chunk_indexes)
    by_topic = {channel.topic: channel for channel in summary.channels.values()}
    channel = by_topic["/scan"]
    schema = summary.schemas[channel.schema_id]
    definition = definition_of("sensor_msgs/msg/LaserScan")
    assert channel.message_encoding == "cdr"
    assert (schema.name, schema.encoding) == ("sensor_msgs/msg/LaserScan", "ros2msg")
    assert schema.data.decode() == definition.text
    assert channel.metadata["topic_type_hash"] == definition.type_hash
    assert from_list(channel.metadata["offered_qos_profiles"]) == (SENSOR, OfferedQos())


@pytest.mark.parametrize("compression", list(CompressionType))
def test_every_compression_reads(tmp_path: Path, compression: CompressionType) -> None:
    with BagWriter(tmp_path / "run1", chunk_bytes=8000, compression=compression) as writer:
        fill(writer, 50)
    assert count_with_all(tmp_path / "run1").total() == 101
    with BagReader(tmp_path / "run1") as reader:
        assert sum(1 for _ in reader.messages()) == 101


def test_an_empty_bag_and_a_topic_without_messages(tmp_path: Path) -> None:
    BagWriter(tmp_path / "nothing").close()
    with BagWriter(tmp_path / "quiet") as writer:
        writer.add_topic("/chatter", "std_msgs/msg/String")
    for name, topics in (("nothing", []), ("quiet", ["/chatter"])):
        assert count_with_rosbags(tmp_path / name).total() == 0
        with BagReader(tmp_path / name) as reader:
            assert list(reader.topics) == topics
            assert reader.message_count == 0
            assert reader.start_ns is reader.end_ns is None
            assert reader.duration_ns == 0
            assert list(reader.messages()) == []
            assert reader.complete


def test_topics_added_late_and_types_stored_once(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run1") as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
        writer.write("/a", text(), 1, 1)
        writer.flush()
        writer.add_topic("/b", "std_msgs/msg/String", OfferedQos(depth=1))
        writer.add_topic("/b", "std_msgs/msg/String")  # again: changes nothing
        writer.write("/b", text(), 2, 2)
        writer.write("/a", text(), 3, 3)
        assert {name: t.message_count for name, t in writer.topics.items()} == {"/a": 2, "/b": 1}
    assert count_with_all(tmp_path / "run1") == {"/a": 2, "/b": 1}
    with writer.path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.schemas) == 1
    with BagReader(tmp_path / "run1") as reader:
        assert reader.topics["/b"].qos == (OfferedQos(depth=1),)
        assert [m.sequence for m in reader.messages(["/a"])] == [0, 1]


def test_refused_writes_do_not_end_the_recording(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run1") as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
        with pytest.raises(OutputError, match="/a: recorded as std_msgs/msg/String, not as"):
            writer.add_topic("/a", "std_msgs/msg/Bool")
        with pytest.raises(InputError, match="not installed"):
            writer.add_topic("/tf", "tf2_msgs/msg/NoSuchThing")
        with pytest.raises(OutputError, match="/b: not a topic of this bag"):
            writer.write("/b", text(), 1, 1)
        for log_ns, publish_ns in ((-1, 1), (1, -1), (2**63 - 1, 1), (1, 2**63 - 1)):
            with pytest.raises(OutputError, match="ns cannot be stored; give 0 to"):
                writer.write("/a", text(), log_ns, publish_ns)
        writer.write("/a", text(), 0, 2**63 - 2)
    assert count_with_all(tmp_path / "run1") == {"/a": 1}


def test_an_existing_path_is_never_touched(tmp_path: Path) -> None:
    folder, file, dangling = tmp_path / "folder", tmp_path / "file", tmp_path / "dangling"
    folder.mkdir()
    file.write_text("precious")
    dangling.symlink_to(tmp_path / "missing")
    for path in (folder, file, dangling):
        with pytest.raises(OutputError, match=f"^{path}: exists already and is never overwritten"):
            BagWriter(path)
    assert list(folder.iterdir()) == []
    assert file.read_text() == "precious"
    assert dangling.is_symlink()
    assert not (tmp_path / "missing").exists()


def test_failed_creation_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot be created \(Not a directory\); choose"):
        BagWriter(tmp_path / "file" / "run1")
    # The directory name is allowed, the longer name of the file in it is not.
    with pytest.raises(OutputError, match=r"cannot be created \(File name too long\)"):
        BagWriter(tmp_path / "new" / "parents" / ("x" * 253))
    with pytest.raises(OutputError, match=r"cannot be created \(File name too long\)"):
        BagWriter(tmp_path / "new" / "parents" / ("x" * 300))
    with pytest.raises(OutputError, match="cannot be created"):
        BagWriter("/proc/mfba")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_missing_parents_are_made_and_relative_paths_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with BagWriter("out/today/run1") as writer:
        fill(writer, 2)
        # The bag stays in the directory of its start.
        monkeypatch.chdir("/")
    assert count_with_all(tmp_path / "out" / "today" / "run1").total() == 5


def test_an_old_mcap_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(Writer, "flush")
    with pytest.raises(OutputError, match=r"install mcap 1\.5 or newer"):
        BagWriter(tmp_path / "run1")
    assert list(tmp_path.iterdir()) == []


def test_writes_after_close_are_refused(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1")
    fill(writer, 3)
    writer.close()
    before = writer.path.read_bytes()
    writer.close()
    for late in (
        lambda: writer.write("/odom", text(), 1, 1),
        lambda: writer.add_topic("/late", "std_msgs/msg/String"),
        lambda: writer.attach("late", "text/plain", b""),
        lambda: writer.add_metadata("late", {}),
        writer.flush,
    ):
        with pytest.raises(OutputError, match="run1: the recording has ended; record into a new"):
            late()
    assert writer.path.read_bytes() == before
    assert count_with_all(tmp_path / "run1").total() == 7


def test_an_interrupt_while_writing_leaves_a_recoverable_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Writer, "start", interrupted)
        with pytest.raises(KeyboardInterrupt):
            BagWriter(tmp_path / "start")
    assert list(tmp_path.iterdir()) == []
    for method in ("add_message", "flush"):
        with BagWriter(tmp_path / method, chunk_bytes=2000) as writer:
            fill(writer, 20)
            writer.flush()
            with monkeypatch.context() as patch:
                patch.setattr(Writer, method, interrupted)
                with pytest.raises(KeyboardInterrupt):
                    fill(writer, 10)
            with pytest.raises(OutputError, match="the recording has ended"):
                writer.write("/odom", text(), 1, 1)
        assert not (tmp_path / method / "metadata.yaml").exists()
        with BagReader(writer.path, salvage=True) as reader:
            assert reader.message_count == 41


def test_the_bag_is_closed_when_the_body_raises(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="/none"), BagWriter(tmp_path / "run1") as writer:  # noqa: PT012
        fill(writer, 4)
        writer.write("/none", b"", 1, 1)
    assert count_with_all(tmp_path / "run1").total() == 9


def test_discard_leaves_nothing(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "new" / "run1")
    fill(writer, 4)
    writer.discard()
    assert list(tmp_path.iterdir()) == []
    writer.discard()


def test_chunks_end_by_size(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1", chunk_bytes=10_000)
    writer.add_topic("/n", "std_msgs/msg/Float64MultiArray")
    for index in range(11):
        writer.write("/n", numbers([float(index)] * 300), index, index)  # 2.4 kB each
    assert chunk_count(writer.path) == 2
    writer.close()
    assert chunk_count(writer.path) == 3


def test_chunks_end_by_age_for_any_timer_and_rate(tmp_path: Path) -> None:
    """No message is older than the limit, for any message rate and any timer period."""
    for period_ns in (SECOND // 50, SECOND // 4, SECOND // 3):
        for gap_ns in (SECOND // 200, SECOND // 7, SECOND * 3):
            case = f"run_{period_ns}_{gap_ns}"
            writer = BagWriter(tmp_path / case, max_chunk_age_s=1.0)
            writer.add_topic("/a", "std_msgs/msg/String")
            now_ns = 50 * SECOND
            pending: list[int] = []
            oldest_ns = 0
            calls = [now_ns + index * period_ns for index in range(10 * SECOND // period_ns)]
            arrivals = [now_ns + 1 + index * gap_ns for index in range(9 * SECOND // gap_ns)]
            for time_ns, is_call in sorted(
                [(t, True) for t in calls] + [(t, False) for t in arrivals]
            ):
                if pending:
                    oldest_ns = max(oldest_ns, time_ns - pending[0])
                if is_call:
                    before = writer._stored_count
                    writer.flush_if_due(time_ns)
                    if writer._stored_count > before:
                        pending.clear()
                else:
                    writer.write("/a", text(), time_ns, time_ns)
                    pending.append(time_ns)
            assert oldest_ns <= SECOND, case
            assert not pending or calls[-1] - pending[0] < SECOND
            # ... and no chunk ends much earlier than necessary.
            writer.close()
            if gap_ns < SECOND:
                assert chunk_count(writer.path) <= 10 * SECOND // (SECOND - 2 * period_ns) + 1


def test_messages_before_the_first_timer_call_are_flushed_by_it(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1")
    writer.add_topic("/a", "std_msgs/msg/String")
    writer.write("/a", text(), 1, 1)
    writer.flush_if_due(5 * SECOND)
    assert chunk_count(writer.path) == 1
    writer.flush_if_due(6 * SECOND)
    writer.close()
    assert chunk_count(writer.path) == 1


def test_flushed_messages_are_in_the_file_immediately(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1")
    fill(writer, 10)
    with BagReader(writer.path, salvage=True) as reader:
        assert reader.message_count == 0
    writer.flush()
    with BagReader(writer.path, salvage=True) as reader:
        assert reader.message_count == 21
        assert [a.name for a in reader.attachments] == ["notes.txt"]
    writer.close()


def test_a_long_recording_holds_only_its_chunk_indexes(tmp_path: Path) -> None:
    assert sys.platform == "linux"  # ru_maxrss is kB there
    with BagWriter(tmp_path / "run1", chunk_bytes=2000) as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
        data = text("x" * 400)

        def record(count: int) -> int:
            for index in range(count):
                writer.write("/a", data, index, index)
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        first_kb = record(2_000)
        grown_kb = record(20_000) - first_kb  # 8.6 MB of messages, 4000 chunks
    assert grown_kb < 5_000
    with BagReader(tmp_path / "run1") as reader:
        assert reader.message_count == 22_000
        assert 4000 < reader.chunk_count < 6000


def test_unsorted_messages(tmp_path: Path) -> None:
    times = [START_NS + (index * 7919) % 1000 for index in range(1000)]
    with BagWriter(tmp_path / "run1", chunk_bytes=3000) as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
        for time_ns in times:
            writer.write("/a", text(str(time_ns)), time_ns, time_ns)
    with BagReader(tmp_path / "run1") as reader:
        read = [message.log_time_ns for message in reader.messages()]
        assert read == sorted(times)
        assert all(a <= b for a, b in pairwise(read))
        in_file = [message.log_time_ns for message in reader.messages(in_file_order=True)]
        assert in_file == times
        assert (reader.start_ns, reader.duration_ns) == (START_NS, 999)
    assert count_with_all(tmp_path / "run1") == {"/a": 1000}
