# SPDX-License-Identifier: Apache-2.0
"""Kill a recording process with kill -9 at random moments, recover each bag, count the loss.

Run: python bench/recording_kill.py --kills 50. One line per kill; exit code 1 if any loss is
above 1 s, or if a recovered bag is not read in full by rosbags, mcap and pybag alike.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pybag.mcap_reader import McapFileReader
from rosbags.highlevel import AnyReader

from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.recover import recover

MAX_LOSS_S = 1.0
TIMER_NS = 250_000_000  # as the recorder node's


def record(directory: Path, rate_hz: float) -> None:
    """Record until killed: log times are the steady clock's, which all processes share."""
    from nav_msgs.msg import Odometry
    from rclpy.serialization import serialize_message

    message = Odometry()
    generator = random.Random(1)
    message.pose.covariance = [generator.random() for _ in range(36)]
    data = bytes(serialize_message(message))
    writer = BagWriter(directory)
    writer.attach("notes.txt", "text/plain", b"kept")
    writer.add_topic("/odom", "nav_msgs/msg/Odometry", OfferedQos())
    print("recording", flush=True)
    due_ns = time.monotonic_ns()
    while True:
        now_ns = time.monotonic_ns()
        writer.write("/odom", data, now_ns, now_ns)
        if now_ns >= due_ns:
            writer.flush_if_due(now_ns)
            due_ns = now_ns + TIMER_NS
        if rate_hz:
            time.sleep(1 / rate_hz)


def kill_one(directory: Path, rate_hz: float, after_s: float) -> tuple[float, int]:
    """Record, kill, recover, read; the loss in s and the messages saved."""
    command = [sys.executable, __file__, "--record", str(directory), "--rate", str(rate_hz)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        started_ns = time.monotonic_ns()
        try:
            process.wait(after_s)
        except subprocess.TimeoutExpired:
            killed_ns = time.monotonic_ns()
            process.kill()
        else:
            raise RuntimeError("the recording process ended by itself")
    out = directory.with_name(directory.name + "_recovered")
    try:
        report = recover(directory, out)
    except BagError:
        return (killed_ns - started_ns) / 1e9, 0
    with BagReader(out) as reader:
        assert reader.complete
        assert reader.end_ns is not None
        assert reader.attachment("notes.txt") == b"kept"
        # A message written between taking the time and the kill is no negative loss.
        loss_s = max(killed_ns - reader.end_ns, 0) / 1e9
    counts = (_with_rosbags(out), _with_mcap(out), _with_pybag(out))
    assert all(count == {"/odom": report.messages} for count in counts), counts
    return loss_s, report.messages


def _with_rosbags(bag: Path) -> Counter[str]:
    found: Counter[str] = Counter()
    with AnyReader([bag]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            found[connection.topic] += 1
    return found


def _with_mcap(bag: Path) -> Counter[str]:
    with (bag / f"{bag.name}_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return Counter(item.channel.topic for item in reader.iter_decoded_messages())


def _with_pybag(bag: Path) -> Counter[str]:
    with McapFileReader.from_file(bag / f"{bag.name}_0.mcap", enable_crc_check=True) as reader:
        return Counter(message.topic for message in reader.messages("*"))


def main() -> int:
    """Kill as often as asked; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rate", type=float, default=1000.0, help="messages/s, 0: flat out")
    parser.add_argument("--longest", type=float, default=3.0, help="s until a kill, at most")
    parser.add_argument("--record", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.record:
        record(options.record, options.rate)
    generator = random.Random(options.seed)
    losses = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.kills):
            after_s = generator.uniform(0.05, options.longest)
            loss_s, saved = kill_one(Path(folder, f"run{number}"), options.rate, after_s)
            losses.append(loss_s)
            print(f"kill {number}: after {after_s:.2f} s, saved {saved}, lost {loss_s:.3f} s")
    within = sum(loss_s <= MAX_LOSS_S for loss_s in losses)
    print(f"{within} of {len(losses)} within {MAX_LOSS_S} s, most {max(losses):.3f} s")
    return int(within < len(losses))


if __name__ == "__main__":
    sys.exit(main())
