# SPDX-License-Identifier: Apache-2.0
"""Recover truncated and damaged bags, and bags that were never closed."""

import random
import shutil
from collections import Counter
from pathlib import Path

import pytest
import zstandard
from mcap.writer import IndexType
from recorded_bags import (
    FOREIGN,
    SENSOR,
    START_NS,
    count_with_all,
    count_with_rosbags,
    fill,
    foreign_mcap,
    write_bag,
)

from mfba_planner.core.errors import BagError, OutputError
from mfba_planner.recording.bag_metadata import BagFile, BagMetadata, dump_file
from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.mcap_index import open_file
from mfba_planner.recording.merge_by_time import RawMessage
from mfba_planner.recording.message_definitions import definition_of
from mfba_planner.recording.recover import recover


def content(path: Path) -> list[RawMessage]:
    with BagReader(path) as reader:
        return list(reader.messages(in_file_order=True))


def test_truncation_anywhere(tmp_path: Path) -> None:
    """All messages of all whole chunks are recovered; an error if no chunk is whole."""
    source = write_bag(tmp_path / "run1", 60, chunk_bytes=9000, beams=40)
    data, written = source.read_bytes(), content(source)
    file = open_file(source)
    ends = [piece.offset + piece.length for piece in file.pieces]
    sizes = [len(file.messages(piece)) for piece in file.pieces]
    file.stream.close()
    assert len(ends) > 5

    generator = random.Random(20240501)
    cuts = sorted(generator.sample(range(8, len(data)), 190))
    # ... and the critical offsets: around each chunk's end, and at the end of the file.
    cuts += [end + step for end in ends[:4] for step in (-1, 0, 1)]
    cuts += [len(data) - 1, len(data) - 8, len(data) - 40]
    truncated, out = tmp_path / "cut.mcap", tmp_path / "out"
    failures = 0
    opened: set[bytes] = set()
    for size in cuts:
        truncated.write_bytes(data[:size])
        whole = sum(count for count, end in zip(sizes, ends) if end <= size)
        if not whole:
            failures += 1
            with pytest.raises(BagError) as caught:
                recover(truncated, out)
            assert "\n" not in str(caught.value)
            assert not out.exists()
        else:
            report = recover(truncated, out)
            assert report.messages == whole
            assert report.problems
            recovered = (out / "out_0.mcap").read_bytes()
            if recovered not in opened:  # the readers check the same bytes only once
                opened.add(recovered)
                assert content(out) == written[:whole]
                expected = Counter(message.topic for message in written[:whole])
                assert count_with_all(out) == expected
            shutil.rmtree(out)
        assert truncated.read_bytes() == data[:size]
    assert 0 < failures < len(cuts) / 2
    assert len(opened) == len(ends)


def test_a_directory_without_metadata(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 30)
    (source.parent / "metadata.yaml").unlink()
    source.write_bytes(source.read_bytes()[:-2000])
    report = recover(tmp_path / "run1", tmp_path / "out")
    assert report.messages == 61
    assert report.problems[0] == "metadata.yaml is missing: the recording was not closed"
    assert report.output == tmp_path / "out"
    assert count_with_all(tmp_path / "out").total() == 61
    assert sorted(p.name for p in source.parent.iterdir()) == ["run1_0.mcap"]


def test_attachments_metadata_and_topics_are_recovered(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 30)
    truncated = tmp_path / "cut.mcap"
    truncated.write_bytes(source.read_bytes()[:-500])
    report = recover(truncated, tmp_path / "out")
    assert report.attachments == 1
    with BagReader(source) as before, BagReader(tmp_path / "out") as after:
        assert after.complete
        assert after.topics == before.topics
        assert after.definitions == before.definitions
        assert list(after.iter_attachments()) == list(before.iter_attachments())
        records = [record for record in after.metadata_records() if record[0] != "rosbag2"]
        assert records == [("lab", {"robot": "turtle"})]
        assert list(after.messages()) == list(before.messages())
        assert after.ros_distro == before.ros_distro


def test_a_complete_bag_is_copied_unchanged(tmp_path: Path) -> None:
    report = recover(FOREIGN, tmp_path / "out")
    assert (report.messages, report.bytes_lost, report.problems) == (281, 0, ())
    assert content(tmp_path / "out") == content(FOREIGN)
    assert count_with_all(tmp_path / "out").total() == 281
    with BagReader(FOREIGN) as before, BagReader(tmp_path / "out") as after:
        assert after.topics == before.topics
    # An empty bag too: it is complete.
    with BagWriter(tmp_path / "quiet") as writer:
        writer.add_topic("/scan", "sensor_msgs/msg/LaserScan", SENSOR)
    assert recover(tmp_path / "quiet", tmp_path / "quiet_too").messages == 0
    with BagReader(tmp_path / "quiet_too") as reader:
        assert reader.topics["/scan"].qos == (SENSOR,)


def test_messages_outside_chunks(tmp_path: Path) -> None:
    times = tuple(range(100))
    data = foreign_mcap(
        tmp_path / "a.mcap", times_ns=times, use_chunking=False, index_types=IndexType.NONE
    ).read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: data.index(b"at 77")])
    report = recover(tmp_path / "cut.mcap", tmp_path / "out")
    assert report.messages == 77
    assert report.bytes_lost == 9 + 22 + 8  # the frame, header and CDR start of number 77
    assert count_with_all(tmp_path / "out") == {"/chatter": 77}


def damage_chunk(path: Path, number: int) -> None:
    """Make one chunk unreadable."""
    file = open_file(path)
    piece = file.pieces[number]
    file.stream.close()
    data = bytearray(path.read_bytes())
    data[piece.offset + piece.length // 2] ^= 0xFF
    path.write_bytes(data)


def test_a_damaged_chunk_in_the_middle_is_skipped(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 60)
    before = content(source)
    damage_chunk(source, 2)
    report = recover(tmp_path / "run1", tmp_path / "out")
    (lost, counts) = report.problems
    assert lost.startswith("run1_0.mcap: lost ")
    assert counts.startswith("metadata.yaml counts 121 messages")
    assert 0 < report.bytes_lost < source.stat().st_size / 2
    after = content(tmp_path / "out")
    assert 0 < len(after) < len(before)
    assert [m for m in before if m in after] == after
    assert count_with_all(tmp_path / "out").total() == report.messages


def flipped(data: bytes, offset: int, bit: int) -> bytes:
    return data[:offset] + bytes([data[offset] ^ 1 << bit]) + data[offset + 1 :]


def header_bytes(data: bytes) -> int:
    """Length of the magic bytes and the header record."""
    return 8 + 9 + int.from_bytes(data[9:17], "little")


@pytest.mark.parametrize("bit", [0, 2, 7])
def test_a_bit_before_the_first_record_of_data_costs_nothing(bit: int, tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 10, chunk_bytes=9000)
    data, before = source.read_bytes(), content(source)
    damaged = tmp_path / "damaged.mcap"
    for offset in range(header_bytes(data)):
        damaged.write_bytes(flipped(data, offset, bit))
        report = recover(damaged, tmp_path / f"out{offset}")
        assert (report.messages, report.attachments) == (len(before), 1), offset
        assert content(tmp_path / f"out{offset}") == before
        if offset in (0, 20, 24):
            (problem,) = report.problems
            assert problem == "damaged.mcap: its header is damaged, or not of ROS 2"


def test_a_changed_length_costs_one_record_only(tmp_path: Path) -> None:
    """Of every chunk but the first, also without summary: the next chunk is found by its start."""
    source = write_bag(tmp_path / "run1", 60, chunk_bytes=9000, beams=40)
    data, before = source.read_bytes(), content(source)
    file = open_file(source)
    pieces, sizes = file.pieces, [len(file.messages(piece)) for piece in file.pieces]
    file.stream.close()
    assert len(pieces) > 4
    damaged = tmp_path / "damaged.mcap"
    for bytes_cut in (0, 40):  # with the summary, and without
        for number in range(1, len(pieces) - 1):
            bits = [(0, 3), (0, 0), (1, 0), (1, 6), (2, 2), (3, 5), (8, 7)]
            for byte, bit in [*bits, (0, 7)] if not bytes_cut else bits:
                whole = flipped(data, pieces[number].offset + byte, bit)
                damaged.write_bytes(whole[: len(whole) - bytes_cut])
                out = tmp_path / f"out{bytes_cut}_{number}_{byte}_{bit}"
                report = recover(damaged, out)
                assert report.problems
                assert report.bytes_lost > 0
                assert report.messages >= len(before) - sizes[number], (number, byte, bit)
                after = content(out)
                assert [m for m in before if m in after] == after


def test_no_remedy_names_the_command_that_has_failed(tmp_path: Path) -> None:
    """Recover names itself never, verify and info only where it finds more than they do."""
    source = foreign_mcap(tmp_path / "a.mcap", profile="ros1")
    data = source.read_bytes()
    generator = random.Random(5)
    damaged = tmp_path / "damaged.mcap"
    for number in range(150):
        offset = generator.randrange(len(data))
        damaged.write_bytes(flipped(data, offset, number % 8)[: len(data) - number % 3 * 40])
        assert "mfba recover" not in refusal_of(damaged, tmp_path / f"out{number}")
    cut = tmp_path / "cut.mcap.zstd"
    cut.write_bytes(zstandard.compress(data)[:4] + b"\xff" * 20)
    with pytest.raises(BagError, match="; nothing of it can be recovered, record again"):
        recover(cut, tmp_path / "out")


def refusal_of(source: Path, out: Path) -> str:
    """Why recover refuses; "" if it does not."""
    try:
        recover(source, out)
    except BagError as error:
        return str(error)
    return ""


def test_messages_without_definitions_are_not_recovered(tmp_path: Path) -> None:
    """Only the first chunk and the summary define the channels."""
    source = write_bag(tmp_path / "run1", 60)
    damage_chunk(source, 0)
    source.write_bytes(source.read_bytes()[:-8])
    with pytest.raises(BagError, match="not one whole chunk"):
        # Without summary no definition is left; with all but its last bytes, all are found.
        recover(truncate_before_summary(source), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    report = recover(source, tmp_path / "out")
    assert report.messages > 50


def truncate_before_summary(path: Path) -> Path:
    truncated = path.with_name("cut.mcap")
    data = path.read_bytes()
    # DataEnd: opcode 15, length 4, then its CRC.
    truncated.write_bytes(data[: data.rindex(b"\x0f\x04" + bytes(7))])
    return truncated


def test_zeros_after_a_power_cut(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 30, chunk_bytes=9000)
    file = open_file(source)
    first = file.pieces[0]
    file.stream.close()
    end = first.offset + first.length
    source.write_bytes(source.read_bytes()[:end] + bytes(5000))
    report = recover(source, tmp_path / "out")
    assert (report.chunks, report.bytes_lost) == (1, 5000)
    assert count_with_all(tmp_path / "out").total() == report.messages > 0


def test_several_files_become_one(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    for number in (0, 1, 2, 10):
        foreign_mcap(bag / f"bag_{number}.mcap", times_ns=(number * 10, number * 10 + 1))
    last = bag / "bag_10.mcap"
    last.write_bytes(last.read_bytes()[:-20])
    # An unusable metadata.yaml is no obstacle.
    listed = BagMetadata(topics=(), files=(BagFile(path="gone.mcap"),), ros_distro="kilted")
    (bag / "metadata.yaml").write_text(dump_file(listed))
    report = recover(bag, tmp_path / "out")
    assert report.messages == 8
    assert report.problems[0].endswith("lists gone.mcap, which does not exist")
    assert report.problems[1] == "bag_10.mcap: the end of the file is missing"
    times = [message.log_time_ns for message in content(tmp_path / "out")]
    assert times == [0, 1, 10, 11, 20, 21, 100, 101]  # 10 after 2


def test_a_bag_with_types_that_are_not_installed(tmp_path: Path) -> None:
    # Of a type with one string, data; rosbags computes it from the schema and compares.
    type_hash = "RIHS01_134dbc5b563ba6a8f3539b907dd992d0eeee76157fb90e4dfc28b104a458bf62"
    path = foreign_mcap(
        tmp_path / "a.mcap",
        schema=("their_msgs/msg/Word", "ros2msg", b"string data"),
        channel_metadata={"topic_type_hash": type_hash},
    )
    recover(path, tmp_path / "out")
    assert count_with_all(tmp_path / "out") == {"/chatter": 3}
    with BagReader(tmp_path / "out") as reader:
        assert reader.topics["/chatter"].type_hash == type_hash
        assert reader.topics["/chatter"].type_name == "their_msgs/msg/Word"
        assert reader.ros_distro == "unknown"


def test_existing_output_is_refused_and_the_source_unchanged(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 5)
    before = source.read_bytes()
    for out in (tmp_path / "run1", tmp_path):
        with pytest.raises(OutputError, match="exists already and is never overwritten"):
            recover(source, out)
    assert source.read_bytes() == before
    assert sorted(p.name for p in source.parent.iterdir()) == ["metadata.yaml", "run1_0.mcap"]


def test_nothing_to_recover(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1")
    writer.add_topic("/odom", "nav_msgs/msg/Odometry", OfferedQos())
    text = definition_of("nav_msgs/msg/Odometry").text  # only in memory so far
    assert text.encode() not in writer.path.read_bytes()
    with pytest.raises(BagError, match=r"run1: not one whole chunk in \d+ bytes, .*record again"):
        recover(tmp_path / "run1", tmp_path / "out")
    fill(writer, 3)
    writer.close()
    with pytest.raises(BagError, match="does not exist"):
        recover(tmp_path / "none", tmp_path / "out")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BagError, match="not a bag"):
        recover(tmp_path / "folder", tmp_path / "out")
    (tmp_path / "text.mcap").write_text("a shopping list")
    with pytest.raises(BagError, match="neither MCAP nor sqlite3 nor a ROS 1 bag"):
        recover(tmp_path / "text.mcap", tmp_path / "out")
    broken = tmp_path / "folder" / "metadata.yaml"
    broken.write_text("{")
    with pytest.raises(BagError, match="not a readable metadata"):
        recover(tmp_path / "folder", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_recovering_twice_makes_no_further_change(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 30)
    source.write_bytes(source.read_bytes()[:-700])
    recover(source, tmp_path / "once")
    recover(tmp_path / "once", tmp_path / "twice")
    once, twice = tmp_path / "once" / "once_0.mcap", tmp_path / "twice" / "twice_0.mcap"
    assert content(once) == content(twice)
    assert once.stat().st_size == twice.stat().st_size - 4 * len("e")  # names in the records
    assert content(once)[0].log_time_ns == START_NS
    assert count_with_rosbags(tmp_path / "twice").total() == 61
