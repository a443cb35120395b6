# SPDX-License-Identifier: Apache-2.0
"""The index that a recorder keeps: the same file, in little memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from mcap.reader import make_reader

from mfba_planner.recording import bag_writer
from mfba_planner.recording.bag_writer import BagWriter

TOPICS = [f"/topic_{k}" for k in range(16)]


def write_chunks(writer: BagWriter, chunks: int) -> None:
    """Every chunk holds a message of each topic."""
    for chunk in range(chunks):
        for topic in TOPICS:
            writer.write(topic, b"\0\1\0\0\1\0\0\0\0", chunk, chunk)
        writer.flush()


def open_bag(directory: Path) -> BagWriter:
    writer = BagWriter(directory)
    for topic in TOPICS:
        writer.add_topic(topic, "std_msgs/msg/String")
    return writer


def test_the_file_is_as_without_packing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_bag(tmp_path / "packed" / "bag") as writer:
        write_chunks(writer, 5)
    with monkeypatch.context() as patch:
        patch.setattr(bag_writer, "pack_last_chunk_index", lambda _: None)
        with open_bag(tmp_path / "plain" / "bag") as writer:
            write_chunks(writer, 5)
    packed, plain = (
        (tmp_path / name / "bag" / "bag_0.mcap").read_bytes() for name in ("packed", "plain")
    )
    assert packed == plain


def test_the_index_finds_the_messages_of_a_topic(tmp_path: Path) -> None:
    with open_bag(tmp_path / "bag") as writer:
        write_chunks(writer, 7)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        assert [len(index.message_index_offsets) for index in summary.chunk_indexes] == [16] * 7
        found = list(reader.iter_messages(topics=[TOPICS[3]]))
    assert [message.log_time for _, _, message in found] == list(range(7))
    assert {channel.topic for _, channel, _ in found} == {TOPICS[3]}


def test_a_chunk_leaves_a_few_hundred_bytes_in_memory(tmp_path: Path) -> None:
    """Three kilobytes of objects each were 150 MB after eight hours."""
    with open_bag(tmp_path / "bag") as writer:
        write_chunks(writer, 20)
        tracemalloc.start()
        try:
            write_chunks(writer, 100)
            size, _ = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert size < 100 * 500


def test_an_end_without_a_message_leaves_the_index_as_it_is(tmp_path: Path) -> None:
    with open_bag(tmp_path / "bag") as writer:
        writer.flush()
        write_chunks(writer, 1)
        writer.flush()
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == 1
