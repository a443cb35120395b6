# SPDX-License-Identifier: Apache-2.0
"""A bag's metadata: read and write metadata.yaml version 9 and MCAP's `rosbag2` record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from ..core.errors import BagError
from . import bag_qos, yaml_text
from .bag_qos import OfferedQos

FILE_NAME = "metadata.yaml"
RECORD_NAME = "rosbag2"
RECORD_KEY = "serialized_metadata"
ROS_DISTRO = "jazzy"
VERSION = 9
NO_TIME_NS = 2**63 - 1  # rosbag2 writes this as the start of a bag without messages
ZSTD = "zstd"
_ROOT = "rosbag2_bagfile_information"


@dataclass(frozen=True, slots=True, kw_only=True)
class BagTopic:
    """One topic of a bag: name, type, offered QoS, RIHS01 hash ("": unknown), count."""

    name: str
    type_name: str
    qos: tuple[OfferedQos, ...] = ()
    type_hash: str = ""
    message_count: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BagFile:
    """One storage file of a bag; start and duration in ns."""

    path: str
    start_ns: int = NO_TIME_NS
    duration_ns: int = 0
    message_count: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BagMetadata:
    """The content of metadata.yaml."""

    topics: tuple[BagTopic, ...]
    files: tuple[BagFile, ...]
    ros_distro: str = ROS_DISTRO

    @property
    def message_count(self) -> int:
        """Messages in all files."""
        return sum(file.message_count for file in self.files)


def dump_record(bag: BagMetadata) -> str:
    """YAML text of the `rosbag2` metadata record: metadata.yaml without its root key."""
    return yaml_text.dump(_content(bag))


def dump_file(bag: BagMetadata) -> str:
    """YAML text of metadata.yaml."""
    return yaml_text.dump({_ROOT: _content(bag)}) + "\n"


def _content(bag: BagMetadata) -> dict[str, Any]:
    starts = [file.start_ns for file in bag.files if file.message_count]
    ends = [file.start_ns + file.duration_ns for file in bag.files if file.message_count]
    start_ns = min(starts, default=NO_TIME_NS)
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": max(ends, default=start_ns) - start_ns},
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "message_count": bag.message_count,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": bag_qos.to_list(topic.qos),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.message_count,
            }
            for topic in bag.topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.path for file in bag.files],
        "files": [
            {
                "path": file.path,
                "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                "duration": {"nanoseconds": file.duration_ns},
                "message_count": file.message_count,
            }
            for file in bag.files
        ],
        "custom_data": {},
        "ros_distro": bag.ros_distro,
    }


def load_file(text: str, source: str) -> BagMetadata:
    """Parse metadata.yaml of versions 1 to 9; `source` is its name in errors. Raises BagError."""
    try:
        content = yaml_text.load(text)[_ROOT]
        version = int(content["version"])
    except (yaml.YAMLError, TypeError, KeyError, ValueError) as error:
        raise _unreadable(source, error) from error
    if not 1 <= version <= VERSION:
        raise BagError(
            f"{source}: version {version} is not known (1 to {VERSION} are); "
            "give the .mcap file itself"
        )
    try:
        return _parse(content, source)
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise _unreadable(source, error) from error


def _unreadable(source: str, error: Exception) -> BagError:
    reason = f"{type(error).__name__}: {error}".split("\n")[0]
    return BagError(
        f"{source}: not a readable metadata.yaml ({reason}); "
        "give the .mcap file itself, or run `mfba recover` on the directory"
    )


def _parse(content: Mapping[str, Any], source: str) -> BagMetadata:
    # Which storage the files are of, and how each is compressed, their first bytes tell.
    compression = str(content.get("compression_format") or ZSTD).lower()
    if compression != ZSTD:
        raise BagError(
            f"{source}: compressed by {compression!r}, only {ZSTD} can be read; "
            "record with --compression-format zstd, or without compression"
        )
    if not content["relative_file_paths"]:
        raise BagError(f"{source}: lists no storage file; give the .mcap or .db3 file itself")
    # Before version 5 there are no per-file counts: the first file gets the whole bag's count.
    per_file = content.get("files") or [
        {"path": path, "message_count": content["message_count"] if i == 0 else 0}
        for i, path in enumerate(content["relative_file_paths"])
    ]
    by_path = {str(file["path"]): file for file in per_file}
    return BagMetadata(
        topics=tuple(_topic(item) for item in content["topics_with_message_count"] or ()),
        files=tuple(
            _file(str(path), by_path.get(str(path), {})) for path in content["relative_file_paths"]
        ),
        ros_distro=str(content.get("ros_distro") or "unknown"),
    )


def _topic(item: Mapping[str, Any]) -> BagTopic:
    topic = item["topic_metadata"]
    return BagTopic(
        name=str(topic["name"]),
        type_name=str(topic["type"]),
        qos=bag_qos.from_list(topic.get("offered_qos_profiles")),
        type_hash=str(topic.get("type_description_hash") or ""),
        message_count=int(item["message_count"]),
    )


def _file(path: str, item: Mapping[str, Any]) -> BagFile:
    return BagFile(
        path=path,
        start_ns=int(item.get("starting_time", {}).get("nanoseconds_since_epoch", NO_TIME_NS)),
        duration_ns=int(item.get("duration", {}).get("nanoseconds", 0)),
        message_count=int(item.get("message_count", 0)),
    )
