# SPDX-License-Identifier: Apache-2.0
"""Messages/s of writing and reading a bag, beside mcap's own writer and reader in the same run.

Run: python bench/recording_speed.py --messages 200000. Rounds alternate, so that a machine
whose speed drifts slows both sides; CPU time, medians. Prints the growth of memory too.
"""

from __future__ import annotations

import argparse
import random
import resource
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import CHUNK_BYTES, BagWriter

ODOMETRY_BYTES = 720


def payloads() -> list[bytes]:
    """Of an Odometry's size, a tenth of it changing from message to message."""
    generator = random.Random(1)
    return [bytes(4) + generator.randbytes(72) + bytes(ODOMETRY_BYTES - 76) for _ in range(1000)]


def write_ours(path: Path, count: int, compression: CompressionType) -> None:
    """One topic through BagWriter."""
    data = payloads()
    with BagWriter(path, compression=compression) as writer:
        writer.add_topic("/odom", "nav_msgs/msg/Odometry", OfferedQos())
        for index in range(count):
            writer.write("/odom", data[index % 1000], index, index)


def write_bare(path: Path, count: int, compression: CompressionType) -> None:
    """The same through mcap's writer alone, with chunks of the same size."""
    data = payloads()
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=compression)
        writer.start("ros2")
        schema_id = writer.register_schema("nav_msgs/msg/Odometry", "ros2msg", b"")
        channel_id = writer.register_channel("/odom", "cdr", schema_id)
        for index in range(count):
            writer.add_message(channel_id, index, data[index % 1000], index)
        writer.finish()


def read_ours(path: Path) -> None:
    """All messages raw, in time order, CRCs checked."""
    with BagReader(path) as reader:
        for _ in reader.messages():
            pass


def read_bare(path: Path) -> None:
    """The same with mcap's reader."""
    with path.open("rb") as stream:
        for _ in make_reader(stream, validate_crcs=True).iter_messages():
            pass


def rate(count: int, work: Callable[[], None]) -> float:
    """Messages per second of CPU time."""
    start = time.process_time()
    work()
    return count / (time.process_time() - start)


def show(what: str, ours: list[float], bare: list[float]) -> None:
    """One line: both medians in thousands, and their ratio."""
    mine, theirs = statistics.median(ours) / 1e3, statistics.median(bare) / 1e3
    print(f"{what:<12} {mine:7.0f} k/s   mcap alone {theirs:7.0f} k/s   ratio {mine / theirs:.2f}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--messages", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    count = options.messages
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        for kind in CompressionType:
            ours, bare = [], []
            for turn in range(options.rounds):
                bag, file = path / f"{kind.name}{turn}", path / f"{kind.name}{turn}.mcap"
                ours.append(rate(count, partial(write_ours, bag, count, kind)))
                bare.append(rate(count, partial(write_bare, file, count, kind)))
            show(f"write {kind.name.lower()}", ours, bare)
            print(f"{'':<12} {file.stat().st_size / 1e6:.1f} MB")
        ours, bare = [], []
        for _ in range(options.rounds):
            ours.append(rate(count, partial(read_ours, bag)))
            bare.append(rate(count, partial(read_bare, file)))
        show("read raw", ours, bare)
        before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        write_ours(path / "long", 5 * count, CompressionType.ZSTD)
        grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
        print(f"memory       {grown_kb / 1e3:.1f} MB more after {5 * count} messages")


if __name__ == "__main__":
    main()
