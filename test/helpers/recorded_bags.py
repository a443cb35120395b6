# SPDX-License-Identifier: Apache-2.0
"""Bags for tests: messages, a small bag, a foreign writer, four independent readers."""

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import small_mcap
from geometry_msgs.msg import PoseStamped
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from nav_msgs.msg import Odometry
from project import TEST_DATA
from pybag.mcap_reader import McapFileReader
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64MultiArray, String

from mfba_planner.recording.bag_qos import OfferedQos
from mfba_planner.recording.bag_writer import BagWriter
from mfba_planner.recording.message_definitions import definition_of

FOREIGN = TEST_DATA / "rosbag2_foreign_scan"
SECOND = 1_000_000_000
START_NS = 1_700_000_000 * SECOND

LATCHED = OfferedQos(depth=1, durability="transient_local")
SENSOR = OfferedQos(depth=5, reliability="best_effort", deadline_ns=SECOND // 10)


def odometry(index: int) -> Odometry:
    """An Odometry with distinct content in every element of its fixed arrays."""
    message = Odometry()
    message.header.stamp.sec = index
    message.header.frame_id = "odom"
    message.child_frame_id = f"base_{index}"
    message.pose.pose.position.x = float(index)
    message.pose.covariance = [float(index + i) for i in range(36)]
    return message


def scan(index: int, beams: int = 12) -> LaserScan:
    """A scan with random ranges, which compress badly."""
    generator = random.Random(index)
    message = LaserScan(angle_max=6.0, range_max=10.0)
    message.header.stamp.sec = index
    message.ranges = [generator.random() for _ in range(beams)]
    return message


def write_bag(
    directory: Path, count: int = 100, *, chunk_bytes: int = 16_000, beams: int = 12
) -> Path:
    """A closed bag: /odom, /scan and one latched /goal_pose, 10 ms apart; returns its file."""
    with BagWriter(directory, chunk_bytes=chunk_bytes) as writer:
        fill(writer, count, beams)
    return writer.path


def fill(writer: BagWriter, count: int, beams: int = 12) -> None:
    """Write count messages on /odom and /scan each, and one on /goal_pose."""
    writer.attach("notes.txt", "text/plain", b"kept")
    writer.add_metadata("lab", {"robot": "turtle"})
    writer.add_topic("/odom", "nav_msgs/msg/Odometry", OfferedQos())
    writer.add_topic("/scan", "sensor_msgs/msg/LaserScan", [SENSOR, OfferedQos()])
    writer.add_topic("/goal_pose", "geometry_msgs/msg/PoseStamped", LATCHED)
    writer.write("/goal_pose", serialize_message(PoseStamped()), START_NS, START_NS)
    for index in range(count):
        time_ns = START_NS + index * SECOND // 100
        writer.write("/odom", serialize_message(odometry(index)), time_ns, time_ns)
        writer.write("/scan", serialize_message(scan(index, beams)), time_ns + 1, time_ns)


def text(content: str = "hello") -> bytes:
    return bytes(serialize_message(String(data=content)))


def numbers(values: list[float]) -> bytes:
    return bytes(serialize_message(Float64MultiArray(data=values)))


def foreign_mcap(
    path: Path,
    *,
    profile: str = "ros2",
    message_encoding: str = "cdr",
    channel_metadata: dict[str, str] | None = None,
    schema: tuple[str, str, bytes] | None = None,
    times_ns: tuple[int, ...] = (3, 1, 2),
    compression: CompressionType = CompressionType.LZ4,
    topic: str = "/chatter",
    **options: Any,
) -> Path:
    """A file as another program may write it: other options, unsorted messages."""
    definition = definition_of("std_msgs/msg/String")
    name, encoding, data = schema or (
        definition.type_name,
        definition.encoding,
        definition.text.encode(),
    )
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, **options)
        writer.start(profile=profile, library="other program")
        schema_id = writer.register_schema(name, encoding, data) if name else 0
        channel_id = writer.register_channel(
            topic, message_encoding, schema_id, channel_metadata or {}
        )
        for time_ns in times_ns:
            writer.add_message(channel_id, time_ns, text(f"at {time_ns}"), time_ns)
        writer.finish()
    return path


def count_with_rosbags(directory: Path) -> Counter[str]:
    """Counts by topic; deserializes every message and checks the counts of metadata.yaml."""
    found: Counter[str] = Counter()
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            found[connection.topic] += 1
        listed = {c.topic: c.msgcount for c in reader.connections if c.msgcount}
        assert dict(found) == listed
        assert reader.message_count == found.total()
    return found


def count_with_mcap(file: Path) -> Counter[str]:
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = Counter(item.channel.topic for item in reader.iter_decoded_messages())
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == found.total()
    return found


def count_with_pybag(file: Path) -> Counter[str]:
    with McapFileReader.from_file(file, enable_crc_check=True) as reader:
        return Counter(message.topic for message in reader.messages("*"))


def count_with_small_mcap(file: Path) -> Counter[str]:
    with file.open("rb") as stream:
        factory = DecoderFactory()
        found: Counter[str] = Counter()
        messages: Any = small_mcap.read_message(stream, validate_crc=True)
        for schema, channel, message in messages:
            decode = factory.decoder_for(channel.message_encoding, schema)
            assert decode is not None
            decode(bytes(message.data))  # message.data is a memoryview
            found[channel.topic] += 1
    return found


FILE_READERS: tuple[Callable[[Path], Counter[str]], ...] = (
    count_with_mcap,
    count_with_pybag,
    count_with_small_mcap,
)


def count_with_all(directory: Path) -> Counter[str]:
    """Counts by topic of a bag directory; four independent readers must agree."""
    found = count_with_rosbags(directory)
    for count in FILE_READERS:
        assert count(directory / f"{directory.name}_0.mcap") == found, count.__name__
    return found
