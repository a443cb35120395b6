# SPDX-License-Identifier: Apache-2.0
"""A disk that fills up while recording, simulated by errors of the kernel."""

import os
import shutil
from pathlib import Path
from typing import IO, Any

import pytest
from full_disk import file_size_limit
from recorded_bags import count_with_all, fill, text, write_bag

from mfba_planner.core.errors import OutputError
from mfba_planner.recording import atomic_files
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.recover import recover


def test_a_full_disk_at_any_moment(tmp_path: Path) -> None:
    """The error counts the stored messages, recover finds at least these."""
    whole = write_bag(tmp_path / "whole", 60, chunk_bytes=9000, beams=40).stat().st_size
    directory, out = tmp_path / "run1", tmp_path / "out"
    outcomes = {"at once": 0, "nothing": 0, "some": 0, "at close": 0}
    opened: set[int] = set()
    for size in range(0, whole - 500, whole // 40):
        with file_size_limit(size), pytest.raises(OutputError) as caught:
            write_bag(directory, 60, chunk_bytes=9000, beams=40)
        line = str(caught.value)
        assert "\n" not in line
        if not directory.exists():
            outcomes["at once"] += 1
            assert f"{directory}: cannot be created (File too large); choose" in line
            continue
        assert f"{directory}: disk full after " in line
        assert f"(File too large); make room and run `mfba recover {directory}`" in line
        (file,) = directory.iterdir()
        assert file.stat().st_size <= size
        stored = int(line.split("disk full after ")[1].split()[0])
        if stored:
            report = recover(directory, out)
            assert report.messages >= stored
            assert report.bytes_lost == 0  # the file ends with a whole record
            if stored not in opened:
                opened.add(stored)
                assert count_with_all(out).total() == report.messages
            shutil.rmtree(out)
        outcomes["at close" if stored == 121 else "some" if stored else "nothing"] += 1
        shutil.rmtree(directory)
    assert all(outcomes.values()), outcomes


def test_later_writes_raise_the_first_error_again(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run1")
    fill(writer, 20)
    with (
        file_size_limit(1000),
        pytest.raises(OutputError, match="disk full after 0 messages") as first,
    ):
        writer.flush()
    with pytest.raises(OutputError) as again:
        writer.write("/odom", text(), 1, 1)
    assert str(again.value) == str(first.value)
    writer.close()
    assert not (tmp_path / "run1" / "metadata.yaml").exists()


def test_no_room_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **options: Any) -> IO[Any]:
        return open("/dev/full", "wb", **options)

    monkeypatch.setattr(atomic_files, "open", full, raising=False)
    with pytest.raises(OutputError, match=r"run1: cannot be created \(No space left on device\)"):
        BagWriter(tmp_path / "new" / "run1")
    assert list(tmp_path.iterdir()) == []


def test_no_room_for_metadata_yaml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = BagWriter(tmp_path / "run1")
    fill(writer, 10)

    def full(path: Path, mode: str, **options: Any) -> IO[Any]:
        path.touch()
        return open("/dev/full", "w", **options)

    monkeypatch.setattr(atomic_files, "open", full, raising=False)
    with pytest.raises(OutputError, match=r"disk full after 21 messages \(No space left"):
        writer.close()
    monkeypatch.undo()
    assert [p.name for p in (tmp_path / "run1").iterdir()] == ["run1_0.mcap"]
    with BagReader(writer.path) as reader:
        assert (reader.complete, reader.message_count) == (True, 21)
    assert recover(tmp_path / "run1", tmp_path / "out").messages == 21


def test_recover_onto_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    source = write_bag(tmp_path / "run1", 60, beams=40)
    before = source.read_bytes()
    for size in (100, len(before) // 2, len(before) - 1000):
        with file_size_limit(size), pytest.raises(OutputError):
            recover(tmp_path / "run1", tmp_path / "new" / "out")
        assert [p.name for p in tmp_path.iterdir()] == ["run1"]
    assert source.read_bytes() == before


def test_other_errors_of_the_disk_are_not_called_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = BagWriter(tmp_path / "run1")
    fill(writer, 3)
    # A pipe without reader refuses each write with EPIPE.
    read_end, write_end = os.pipe()
    os.close(read_end)
    with writer._stream._file, open(write_end, "wb", buffering=0) as broken:
        monkeypatch.setattr(writer._stream, "_file", broken)
        with pytest.raises(OutputError, match=r"cannot be written after 0 messages \(Broken pipe"):
            writer.flush()
