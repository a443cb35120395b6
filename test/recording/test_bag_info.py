# SPDX-License-Identifier: Apache-2.0
"""Describe bags: complete, foreign, unclosed, damaged and empty ones."""

from dataclasses import replace
from pathlib import Path

import pytest
from recorded_bags import FOREIGN, START_NS, foreign_mcap, numbers, write_bag

from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_info import describe, format_info
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter


def test_our_bag(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 30)
    info = describe(tmp_path / "run1")
    assert info.complete
    assert info.files == (path,)
    assert (info.message_count, info.start_ns, info.ros_distro) == (61, START_NS, "jazzy")
    assert info.attachments == (("notes.txt", "text/plain", 4),)
    assert info.metadata_names == ("rosbag2", "lab", "rosbag2")
    with BagReader(path) as reader:
        assert info.topics == tuple(reader.topics.values())
    text = format_info(info).splitlines()
    assert text[0] == f"Bag:         {tmp_path / 'run1'}"
    assert "Complete:    yes" in text
    assert "Start:       2023-11-14 22:13:20.000 UTC" in text
    assert "Duration:    0.290 s" in text
    assert "Attachment:  notes.txt (text/plain, 4 B)" in text
    (scan,) = [line for line in text if "/scan" in line]
    assert " ".join(scan.split()) == (
        "Topic: /scan sensor_msgs/msg/LaserScan 30 "
        "best_effort, volatile, keep_last 5; reliable, volatile, keep_last 10"
    )


def test_the_foreign_bag() -> None:
    text = format_info(describe(FOREIGN))
    assert "Messages:    281" in text
    assert "Size:        80.2 kB" in text
    assert "2026-11-22 00:26:51.275 UTC" in text


def test_bag_that_was_not_closed(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 30)
    path.write_bytes(path.read_bytes()[:-100])
    (tmp_path / "run1" / "metadata.yaml").unlink()
    info = describe(tmp_path / "run1")
    assert not info.complete
    assert info.message_count == 61
    text = format_info(info)
    assert f"Complete:    no; run `mfba recover {tmp_path / 'run1'}`" in text
    assert "problem:   run1_0.mcap: the end of the file is missing" in text


def test_damage_that_salvaging_avoids_is_still_a_problem(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run1", 30)
    data = bytearray(path.read_bytes())
    data[data.rindex(b"sensor_msgs/msg/LaserScan")] ^= 1
    path.write_bytes(data)
    info = describe(path)
    assert not info.complete
    assert info.message_count == 61
    assert info.problems == (f"{path}: damaged, the summary cannot be read (wrong CRC)",)


def test_simulated_time_and_an_empty_bag(tmp_path: Path) -> None:
    text = format_info(describe(foreign_mcap(tmp_path / "a.mcap", times_ns=(1_500_000_000,))))
    assert "Start:       1.500 s" in text
    BagWriter(tmp_path / "empty").close()
    text = format_info(describe(tmp_path / "empty"))
    assert "Messages:    0" in text
    assert "Start:" not in text


def test_sizes(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run1") as writer:
        writer.attach("big", "a/b", bytes(2_345_678))
        writer.add_topic("/n", "std_msgs/msg/Float64MultiArray")
        writer.write("/n", numbers([1.0]), 1, 1)
    info = describe(tmp_path / "run1")
    assert "Attachment:  big (a/b, 2.3 MB)" in format_info(info)
    assert "Size:        5.4 GB" in format_info(replace(info, size_bytes=5_400_000_000))
    with (tmp_path / "sparse").open("wb") as stream:
        stream.truncate(5_400_000_000)
    with pytest.raises(BagError, match="neither MCAP nor sqlite3 nor a ROS 1 bag"):
        describe(tmp_path / "sparse")


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="does not exist"):
        describe(tmp_path / "none")
    with pytest.raises(BagError, match="3 messages serialized as 'ros1', only cdr can be read"):
        describe(foreign_mcap(tmp_path / "a.mcap", profile="ros1", message_encoding="ros1"))
    # What is readable is described, with the problem that keeps others from reading it.
    (problem,) = describe(foreign_mcap(tmp_path / "b.mcap", profile="ros1")).problems
    assert problem == "b.mcap: its header is damaged, or not of ROS 2"
