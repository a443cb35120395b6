# SPDX-License-Identifier: Apache-2.0
"""Bags that cannot be read are refused in one line: path, reason, remedy."""

import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from recorded_bags import FOREIGN, foreign_mcap, write_bag

from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.mcap_index import open_file


def read_all(path: Path) -> int:
    with BagReader(path) as reader:
        list(reader.iter_attachments())
        list(reader.metadata_records())
        return sum(1 for _ in reader.messages())


def refusal(path: Path) -> str:
    with pytest.raises(BagError) as caught:
        read_all(path)
    line = str(caught.value)
    assert "\n" not in line
    assert str(path) in line
    return line.removeprefix(str(path))


def decode_refusal(path: Path) -> str:
    with BagReader(path) as reader, pytest.raises(BagError) as caught:
        list(reader.decoded())
    return str(caught.value)


def test_missing(tmp_path: Path) -> None:
    remedy = "give a bag directory, or a .mcap, .db3 or .bag file"
    assert refusal(tmp_path / "none") == f": does not exist; {remedy}"
    (tmp_path / "dangling").symlink_to(tmp_path / "none")
    assert refusal(tmp_path / "dangling") == f": does not exist; {remedy}"
    (tmp_path / "file").write_text("x")
    assert "does not exist" in refusal(tmp_path / "file" / "below")


def test_no_bag_at_all(tmp_path: Path) -> None:
    remedy = "give a bag directory, or a .mcap, .db3 or .bag file"
    (tmp_path / "empty.mcap").touch()
    assert refusal(tmp_path / "empty.mcap") == f": empty file; {remedy}"
    (tmp_path / "text.mcap").write_text("a shopping list, not a recording")
    assert refusal(tmp_path / "text.mcap") == (
        f": neither MCAP nor sqlite3 nor a ROS 1 bag, by its first bytes; {remedy}"
    )
    (tmp_path / "short.mcap").write_bytes(MCAP0_MAGIC[:5])
    assert "neither MCAP nor sqlite3" in refusal(tmp_path / "short.mcap")
    (tmp_path / "folder").mkdir()
    assert "not a bag, metadata.yaml is missing" in refusal(tmp_path / "folder")
    os.mkfifo(tmp_path / "pipe")
    assert refusal(tmp_path / "pipe") == f": not a file; {remedy}"
    assert "cannot be read (File name too long)" in refusal(tmp_path / ("x" * 300))


def test_files_that_fail_while_being_opened(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"gone: cannot be read \(No such file"):
        open_file(tmp_path / "gone")
    # A process's own memory can be opened, but has no end to seek to.
    with pytest.raises(BagError, match=r"mem: cannot be read \(Invalid argument\); copy it"):
        open_file(Path("/proc/self/mem"))


def test_other_middleware(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    assert "profile 'ros1', only messages of ROS 2" in refusal(foreign_mcap(path, profile="ros1"))
    line = refusal(foreign_mcap(path, message_encoding="protobuf"))
    assert line == (
        ": no topic that can be read: /chatter: 3 messages serialized as 'protobuf', only cdr can "
        "be read; record with ROS 2's default serialization"
    )


def test_truncated(tmp_path: Path) -> None:
    data = write_bag(tmp_path / "run1", 30).read_bytes()
    path = tmp_path / "cut.mcap"
    for size in (60, 500, len(data) // 2, len(data) - 9, len(data) - 1):
        path.write_bytes(data[:size])
        assert refusal(path) == (
            ": truncated, the end of the file is missing (the recording was not closed); "
            f"run `mfba recover {path}`"
        )
    with path.open("wb") as stream:
        Writer(stream).start("ros2", "")
    assert path.stat().st_size < 37  # shorter than a footer
    assert ": truncated, the end of the file is missing" in refusal(path)
    path.write_bytes(data[:12])
    assert "truncated within its header (12 bytes), nothing of it can be" in refusal(path)


def test_a_recording_that_was_killed(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 5)
    (tmp_path / "run1" / "metadata.yaml").unlink()
    with BagReader(tmp_path / "run1") as reader:
        assert reader.problems == ["metadata.yaml is missing: the recording was not closed"]
    assert read_all(tmp_path / "run1") == read_all(path) == 11
    path.write_bytes(path.read_bytes()[:-100])
    assert "the end of the file is missing (the recording was not" in refusal(tmp_path / "run1")


def test_broken_metadata_yaml(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    shutil.copytree(FOREIGN, bag)
    listed = bag / "metadata.yaml"
    sound = listed.read_text()

    listed.write_text(sound.replace("version: 9", "version: 10"))
    assert "metadata.yaml: version 10 is not known" in refusal(bag)
    listed.write_text(sound[:700])
    assert "metadata.yaml: not a readable metadata.yaml" in refusal(bag)
    listed.write_bytes(b"\xff\xfe\x00")
    assert "metadata.yaml: not UTF-8 text" in refusal(bag)
    listed.write_text(sound.replace("rosbag2_foreign_scan_0", "moved"))
    assert "lists moved.mcap, which does not exist" in refusal(bag)
    listed.unlink()
    listed.mkdir()
    assert "cannot be read (Is a directory)" in refusal(bag)


def test_truncated_file_of_a_directory(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 5)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(BagError, match=f"^{path}: truncated"):
        BagReader(tmp_path / "run1")


def damaged(source: Path, target: Path, offset: int) -> Path:
    data = bytearray(source.read_bytes())
    data[offset] ^= 0x55
    target.write_bytes(data)
    return target


def chunk_data_offset(path: Path) -> int:
    """An offset inside the first chunk's compressed data."""
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                return path.read_bytes().index(record.data) + len(record.data) // 2
    raise AssertionError("no chunk")


def test_wrong_crcs(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 30)
    data = path.read_bytes()
    target = tmp_path / "bad.mcap"
    chunk = damaged(path, target, chunk_data_offset(path))
    assert "damaged, the chunk at byte" in refusal(chunk)
    attachment = damaged(path, target, data.index(b"kept"))
    assert "damaged, the attachment 'notes.txt' cannot be read (wrong CRC)" in refusal(attachment)
    summary = damaged(path, target, data.rindex(b"sensor_msgs/msg/LaserScan"))
    assert "damaged, the summary cannot be read (wrong CRC)" in refusal(summary)
    assert f"run `mfba recover {target}`" in refusal(summary)


def test_damage_in_a_file_without_index_or_crc(tmp_path: Path) -> None:
    path = foreign_mcap(tmp_path / "a.mcap", use_chunking=False, enable_crcs=False)
    data = bytearray(path.read_bytes())
    # The first message's length: far beyond the end of the file.
    first = data.index(b"at 3") - 4 - 4 - 22 - 8
    data[first + 6] = 0xFF
    path.write_bytes(data)
    assert "damaged," in refusal(path)
    assert "no whole record; run" in refusal(path)


def test_a_record_that_exceeds_its_chunk(tmp_path: Path) -> None:
    path = foreign_mcap(tmp_path / "a.mcap", compression=CompressionType.NONE, enable_crcs=False)
    data = bytearray(path.read_bytes())
    data[data.index(b"at 2") - 4 - 4 - 22 - 8] += 1
    path.write_bytes(data)
    assert "runs over the end); run" in refusal(path)


def test_an_index_that_points_elsewhere(tmp_path: Path) -> None:
    path = foreign_mcap(tmp_path / "a.mcap")
    file = open_file(path)
    file.stream.close()
    data = bytearray(path.read_bytes())
    data[file.pieces[0].offset] = 7
    path.write_bytes(data)
    assert "(record type 7 instead of 6 at byte" in refusal(path)


def test_a_file_that_shrinks_while_it_is_read(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 20)
    with BagReader(path) as reader:
        os.truncate(path, 1000)
        with pytest.raises(BagError, match="the file became shorter than"):
            list(reader.messages())


def test_a_message_of_an_undefined_channel(tmp_path: Path) -> None:
    path = foreign_mcap(
        tmp_path / "a.mcap",
        use_chunking=False,
        enable_crcs=False,
        repeat_channels=False,
        repeat_schemas=False,
    )
    data = bytearray(path.read_bytes())
    schema = data.index(b"std_msgs/msg/String") - 4 - 2
    data[schema] = 77  # now the channel's schema is missing
    path.write_bytes(data)
    assert "damaged, 3 messages of channel 1, which is not described" in refusal(path)


def test_undecodable_messages_can_still_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    foreign_mcap(path, schema=("std_msgs/msg/String", "ros2idl", b"module std_msgs {};"))
    assert "cannot be decoded (its ros2idl schema does not parse" in decode_refusal(path)
    foreign_mcap(path, schema=("std_msgs/msg/String", "ros2msg", b"what is this"))
    assert "its schema does not parse" in decode_refusal(path)
    foreign_mcap(path, schema=("", "", b""))
    assert (
        "topic /chatter () cannot be decoded (the bag holds no definition of it"
        in decode_refusal(path)
    )
    foreign_mcap(path, schema=("std_msgs/msg/String", "ros2msg", b"string data\nfloat64[30] x"))
    assert "a message on /chatter at 1 ns is not a std_msgs/msg/String" in decode_refusal(path)
    assert read_all(path) == 3
    foreign_mcap(path, schema=("std_msgs/msg/String", "omgidl", b"module std_msgs {};"))
    assert "schema encoding 'omgidl', not ros2msg or ros2idl" in decode_refusal(path)


def count_or_refused(path: Path, read: Callable[[Path], int]) -> int | None:
    """Number of messages read, None for a BagError; other exceptions fail the test."""
    try:
        return read(path)
    except BagError:
        return None


def salvage_all(path: Path) -> int:
    with BagReader(path, salvage=True) as reader:
        found = sum(1 for _ in reader.messages())
        assert found + reader.not_cdr.total() == reader.message_count
        return found


@pytest.mark.parametrize("seed", range(6))
def test_random_damage_is_read_or_refused_but_never_a_traceback(tmp_path: Path, seed: int) -> None:
    generator = random.Random(seed)
    if seed % 2:
        path = write_bag(tmp_path / "run1", 20, chunk_bytes=4000)
        total = 41
    else:
        chunked = seed % 4 == 0
        path = foreign_mcap(
            tmp_path / "a.mcap", times_ns=tuple(range(41)), use_chunking=chunked, chunk_size=300
        )
        total = 41
    data = path.read_bytes()
    target = tmp_path / "bad.mcap"
    refused = 0
    for _ in range(150):
        broken = bytearray(data)
        for _ in range(generator.choice((1, 1, 4, 30))):
            broken[generator.randrange(len(broken))] = generator.randrange(256)
        target.write_bytes(broken)
        found = count_or_refused(target, read_all)
        salvaged = count_or_refused(target, salvage_all)
        refused += found is None
        assert (found or 0) <= total
        assert (salvaged or 0) <= total
    assert refused > 30
