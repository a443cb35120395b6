# SPDX-License-Identifier: Apache-2.0
"""Every ordinary bag opens: storages, compressions, splits, versions, ROS 1, foreign channels."""

import json
import re
import shutil
import sqlite3
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import foreign_bags
import pytest
import yaml
from foreign_bags import START_NS, TICK_NS, drive, write, write_ros1
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from mfba_planner import cli
from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_info import describe, format_info
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.message_definitions import definition_of
from mfba_planner.recording.recover import recover
from mfba_planner.verification.redecide import RedecideParams, redecide_recording

ROBOT = RedecideParams(robot_radius_m=0.3)
ZSTD = b"\x28\xb5\x2f\xfd"


def copied(source: Path, target: Path, *, profile: str = "ros2", **options: object) -> Path:
    """The messages of an MCAP bag, written by another program."""
    with next(source.glob("*.mcap")).open("rb") as stream, target.open("wb") as out:
        writer = McapWriter(out, **options)  # type: ignore[arg-type]
        writer.start(profile=profile, library="another writer")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(stream).iter_messages():
            assert schema is not None
            if channel.id not in channels:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, "cdr", schema_id, dict(channel.metadata)
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        writer.finish()
    return target


def split(path: Path, storage: StoragePlugin) -> Path:
    """A bag of two files, the second of which begins between a pose and its scan."""
    messages = sorted(drive(), key=lambda found: found.time_ns)
    path.mkdir()
    halves = (messages[:41], messages[41:])
    names, counts = [], []
    for number, half in enumerate(halves):
        part = write(path.with_name(f"{path.name}_{number}"), half, storage=storage)
        content = yaml.safe_load((part / "metadata.yaml").read_text())
        root = content["rosbag2_bagfile_information"]
        for name in root["relative_file_paths"]:
            shutil.move(part / name, path / name)
            names.append(name)
        counts.append(len(half))
    root["relative_file_paths"] = names
    root["message_count"] = sum(counts)
    root["files"] = [
        {
            "path": name,
            "starting_time": {"nanoseconds_since_epoch": START_NS},
            "duration": {"nanoseconds": 0},
            "message_count": count,
        }
        for name, count in zip(names, counts)
    ]
    (path / "metadata.yaml").write_text(yaml.safe_dump(content))
    return path


def without_metadata(path: Path, storage: StoragePlugin) -> Path:
    (write(path, drive(), storage=storage) / "metadata.yaml").unlink()
    return path


def older_sqlite(path: Path) -> Path:
    """A sqlite3 file of Humble: without message definitions."""
    source = next(write(path.with_suffix(".new"), drive(), storage=SQLITE).glob("*.db3"))
    connection = sqlite3.connect(source)
    for statement in (
        "drop table schema",
        "drop table message_definitions",
        "drop table metadata",
        "alter table topics drop column type_description_hash",
    ):
        connection.execute(statement)
    connection.commit()
    connection.close()
    return Path(shutil.move(source, path))


def changed_metadata(path: Path, **values: object) -> Path:
    file = write(path, drive(), storage=SQLITE) / "metadata.yaml"
    content = yaml.safe_load(file.read_text())
    content["rosbag2_bagfile_information"].update(values)
    file.write_text(yaml.safe_dump(content))
    return path


MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3
Writer = Callable[[Path], Path]
FORMATS: dict[str, Writer] = {
    "sqlite3": lambda d: write(d / "a", drive(), storage=SQLITE),
    "sqlite3 file": lambda d: next(write(d / "a", drive(), storage=SQLITE).glob("*.db3")),
    "sqlite3 of Humble": lambda d: older_sqlite(d / "a.db3"),
    "sqlite3, zstd per message": lambda d: write(
        d / "a", drive(), storage=SQLITE, compression=CompressionMode.MESSAGE
    ),
    "sqlite3, zstd per file": lambda d: write(
        d / "a", drive(), storage=SQLITE, compression=CompressionMode.FILE
    ),
    "sqlite3, split": lambda d: split(d / "a", SQLITE),
    "sqlite3 without metadata": lambda d: without_metadata(d / "a", SQLITE),
    "sqlite3 after a reindex": lambda d: changed_metadata(d / "a", storage_identifier=""),
    "metadata version 8": lambda d: write(d / "a", drive(), version=8),
    "metadata version 2": lambda d: changed_metadata(d / "a", version=2, files=None),
    "mcap": lambda d: write(d / "a", drive()),
    "mcap file": lambda d: next(write(d / "a", drive()).glob("*.mcap")),
    "mcap, zstd per message": lambda d: write(
        d / "a", drive(), compression=CompressionMode.MESSAGE
    ),
    "mcap file, zstd per message": lambda d: next(
        write(d / "a", drive(), compression=CompressionMode.MESSAGE).glob("*.mcap")
    ),
    "mcap, zstd per file": lambda d: write(d / "a", drive(), compression=CompressionMode.FILE),
    "mcap.zstd file": lambda d: next(
        write(d / "a", drive(), compression=CompressionMode.FILE).glob("*.zstd")
    ),
    "mcap, zstd chunks": lambda d: write(d / "a", drive(), compression=CompressionMode.STORAGE),
    "mcap, lz4 chunks": lambda d: copied(
        write(d / "a", drive()), d / "b.mcap", compression=CompressionType.LZ4
    ),
    "mcap, no compression": lambda d: copied(
        write(d / "a", drive()), d / "b.mcap", compression=CompressionType.NONE
    ),
    "mcap, no chunks": lambda d: copied(write(d / "a", drive()), d / "b.mcap", use_chunking=False),
    "mcap, no index": lambda d: copied(
        write(d / "a", drive()),
        d / "b.mcap",
        use_statistics=False,
        repeat_channels=False,
        repeat_schemas=False,
        index_types=IndexType.NONE,
    ),
    "mcap, no profile": lambda d: copied(write(d / "a", drive()), d / "b.mcap", profile=""),
    "mcap, split": lambda d: split(d / "a", MCAP),
    "mcap without metadata": lambda d: without_metadata(d / "a", MCAP),
    "ROS 1": lambda d: write_ros1(d / "a.bag", drive()),
    "run directory": lambda d: write(d / "a" / "bag", drive()).parent,
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_recording_gives_the_same_decisions_in_every_format(name: str, tmp_path: Path) -> None:
    path = FORMATS[name](tmp_path)
    found = redecide_recording(path, ROBOT)
    assert found.digest == "117c0c7d27c5f57da8b2d8675da6f392dc084263809a7fb84b8695eabe5decd2"
    # what is recovered of it is an MCAP bag of the same messages
    report = recover(path, tmp_path / "recovered")
    assert (report.messages, report.bytes_lost) == (82, 0)
    assert redecide_recording(tmp_path / "recovered", ROBOT).digest == found.digest
    with BagReader(tmp_path / "recovered") as reader:
        assert all(message.data[:2] == b"\0\1" for message in reader.messages())


@pytest.mark.parametrize("name", FORMATS)
def test_info_describes_every_format(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["info", str(FORMATS[name](tmp_path))]) == 0
    out = capsys.readouterr().out
    assert "Messages:    82" in out
    assert "Duration:    4.000 s" in out
    assert "/scan       sensor_msgs/msg/LaserScan" in out


def test_the_format_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a", drive(), storage=SQLITE, compression=CompressionMode.FILE)
    assert "Format:      sqlite3, zstd per file\n" in format_info(describe(path))


def with_json_channel(tmp_path: Path) -> Path:
    path = tmp_path / "mixed.mcap"
    text = definition_of("std_msgs/msg/String")
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="", library="another writer")
        schema = writer.register_schema(text.type_name, "ros2msg", text.text.encode())
        cdr = writer.register_channel("/chatter", "cdr", schema, {})
        schema = writer.register_schema("Event", "jsonschema", b"{}")
        events = writer.register_channel("/events", "json", schema, {})
        for k in range(3):
            writer.add_message(cdr, k, b"\0\1\0\0\2\0\0\0a\0", k)
            writer.add_message(events, k, b"{}", k)
        writer.finish()
    return path


def test_other_channels_are_left_out_by_name(tmp_path: Path) -> None:
    path = with_json_channel(tmp_path)
    line = "/events: 3 messages serialized as 'json', only cdr can be read"
    with BagReader(path) as reader:
        assert [message.data for message in reader.decoded() for message in [message.message]] == [
            "a"
        ] * 3
        assert reader.left_out == [line]
    assert f"Left out:    {line}" in format_info(describe(path))
    report = recover(path, tmp_path / "recovered")
    assert (report.messages, report.problems) == (3, (f"left out {line}",))


def test_what_is_neither_cdr_nor_compressed_cdr_is_refused(tmp_path: Path) -> None:
    source = write(tmp_path / "a", drive(2))
    path = copied(source, tmp_path / "b.mcap", compression=CompressionType.NONE, enable_crcs=False)
    sound = path.read_bytes()
    # the CDR header before the stamp and the frames of the first odometry
    start = sound.rindex(b"\0\1\0\0", 0, sound.index(b"odom\0\0\0\0\x0a"))
    for broken in (b"Obj\1", ZSTD):
        path.write_bytes(sound[:start] + broken + sound[start + 4 :])
        with BagReader(path) as reader, pytest.raises(BagError) as caught:
            list(reader.messages())
        shown = broken.hex(" ")
        assert f"is not CDR (its first bytes are {shown}); leave the topic out" in str(
            caught.value
        )
        shutil.rmtree(tmp_path / "recovered", ignore_errors=True)
        report = recover(path, tmp_path / "recovered")
        assert report.messages == 5
        (problem,) = report.problems
        assert problem.endswith("left out 1 messages that are not CDR")
        with BagReader(tmp_path / "recovered") as reader:
            assert len(list(reader.decoded())) == 5


@pytest.mark.parametrize("unset_ns", [0, 2**64 - 1, 2**63 - 1])
def test_an_unset_log_time_is_that_of_the_message_before(tmp_path: Path, unset_ns: int) -> None:
    path = tmp_path / "a.mcap"
    times = [START_NS, unset_ns, START_NS + TICK_NS, START_NS + 2 * TICK_NS, unset_ns]
    definition = definition_of("std_msgs/msg/String")
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2", library="another writer")
        schema = writer.register_schema(definition.type_name, "ros2msg", definition.text.encode())
        channel = writer.register_channel("/chatter", "cdr", schema, {})
        for time_ns in times:
            writer.add_message(channel, time_ns, b"\0\1\0\0\2\0\0\0a\0", time_ns)
        writer.finish()
    with BagReader(path) as reader:
        assert (reader.start_ns, reader.end_ns) == (START_NS, START_NS + 2 * TICK_NS)
        offsets = [(m.log_time_ns - START_NS) // TICK_NS for m in reader.messages()]
    assert offsets == [0, 0, 1, 2, 2]
    assert recover(path, tmp_path / "recovered").messages == 5


def test_a_bag_in_simulated_time_may_start_at_0(tmp_path: Path) -> None:
    scans = [foreign_bags.scan(k * TICK_NS, time_ns=k * TICK_NS) for k in range(3)]
    with BagReader(write(tmp_path / "a", scans)) as reader:
        assert (reader.start_ns, reader.end_ns) == (0, 2 * TICK_NS)
        assert [m.log_time_ns for m in reader.messages()] == [0, TICK_NS, 2 * TICK_NS]


@pytest.mark.parametrize("name", ["sqlite3", "ROS 1"])
def test_without_rosbags_the_extra_is_named(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = FORMATS[name](tmp_path)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(BagError, match=r"rosbags is not installed; pip install 'mfba_planner\[b"):
        BagReader(path)


@pytest.mark.parametrize("name", ["sqlite3 file", "ROS 1"])
def test_a_damaged_file_is_refused_and_recovered_as_far_as_it_goes(
    name: str, tmp_path: Path
) -> None:
    path = FORMATS[name](tmp_path)
    data = path.read_bytes()
    broken = tmp_path / f"broken{path.suffix}"
    lost = 0
    for part in range(1, 20):
        cut = bytearray(data)
        cut[len(data) * part // 20 :][:200] = b""
        begin = len(data) * part // 20
        cut[begin : begin + 2000] = b"\xff" * min(2000, len(data) - begin)
        broken.write_bytes(cut)
        with suppress(BagError), BagReader(broken) as reader:
            list(reader.messages())
        try:
            shutil.rmtree(tmp_path / "recovered", ignore_errors=True)
            lost += recover(broken, tmp_path / "recovered").messages < 82
        except BagError:
            lost += 1
    assert lost > 3


def test_a_truncated_sqlite_file_is_refused(tmp_path: Path) -> None:
    path = FORMATS["sqlite3 file"](tmp_path)
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(BagError, match="damaged, cannot be read as sqlite3"):
        redecide_recording(path, ROBOT)


def test_a_sqlite_journal_that_was_left_is_named_and_can_be_brought_in(tmp_path: Path) -> None:
    source = FORMATS["sqlite3 file"](tmp_path)
    path = tmp_path / "killed.db3"
    connection = sqlite3.connect(source)
    connection.execute("pragma journal_mode=wal")
    connection.execute("insert into messages (topic_id, timestamp, data) select topic_id, "
                       "timestamp + 10000000000, data from messages where id > 40")  # fmt: skip
    connection.commit()
    for suffix in ("", "-wal"):  # as the recorder leaves them when it is killed
        shutil.copy(f"{source}{suffix}", f"{path}{suffix}")
    connection.close()
    remedy = f"sqlite3 {path} 'pragma wal_checkpoint(truncate)'"
    with pytest.raises(BagError, match=re.escape(f"run `{remedy}`, or `mfba recover`")):
        BagReader(path)
    report = recover(path, tmp_path / "recovered")
    assert report.messages == 82
    assert "-wal holds messages that are not in the file yet" in report.problems[0]
    connection = sqlite3.connect(path)
    connection.execute("pragma wal_checkpoint(truncate)")
    connection.close()
    with BagReader(path) as reader:
        assert reader.message_count == 124


def test_a_sqlite_file_of_another_name_is_read_after_it_was_renamed(tmp_path: Path) -> None:
    path = FORMATS["sqlite3 file"](tmp_path)
    other = path.rename(path.with_suffix(".sqlite"))
    with pytest.raises(BagError, match=r"rename it so that it ends in \.db3"):
        BagReader(other)
    assert redecide_recording(other.rename(path), ROBOT).decided


def test_several_recordings_in_one_directory_are_refused(tmp_path: Path) -> None:
    write_ros1(tmp_path / "a.bag", drive(2))
    write_ros1(tmp_path / "b.bag", drive(2))
    with pytest.raises(BagError, match=r"holds several recordings, a.bag, b.bag; give one"):
        BagReader(tmp_path)
    with BagReader(tmp_path / "b.bag") as reader:
        assert reader.message_count == 6


def test_messages_of_an_unknown_type_are_read_but_not_decoded(tmp_path: Path) -> None:
    path = older_sqlite(tmp_path / "a.db3")
    connection = sqlite3.connect(path)
    connection.execute("update topics set type = 'their_msgs/msg/Own' where name = '/odom'")
    connection.commit()
    connection.close()
    with BagReader(path) as reader:
        assert len(list(reader.messages(["/odom"]))) == 40
        with pytest.raises(BagError, match=r"/odom .*the bag holds no definition of it"):
            list(reader.decoded(["/odom"]))
    assert json.dumps(describe(path).problems) == "[]"
