# SPDX-License-Identifier: Apache-2.0
"""Describe a bag: files, topics, counts, attachments, problems; for `mfba info`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path

from ..core.errors import BagError
from .bag_metadata import BagTopic
from .bag_reader import BagReader


@dataclass(frozen=True, slots=True, kw_only=True)
class BagInfo:
    """Description of a bag; times in ns, start_ns None without messages."""

    path: Path
    files: tuple[Path, ...]
    size_bytes: int
    ros_distro: str
    message_count: int
    start_ns: int | None
    duration_ns: int
    topics: tuple[BagTopic, ...]
    attachments: tuple[tuple[str, str, int], ...]  # name, media type, bytes
    metadata_names: tuple[str, ...]
    problems: tuple[str, ...]
    kind: str = ""
    left_out: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether the bag was closed and nothing is missing from it."""
        return not self.problems


def describe(path: str | Path) -> BagInfo:
    """Describe a bag, also one that was not closed. Raises BagError if nothing is readable."""
    try:
        return _describe(BagReader(path))
    except BagError as refused:
        # Describe what is readable. If nothing is, this raises the same error again.
        info = _describe(BagReader(path, salvage=True))
        return replace(info, problems=info.problems or (str(refused).split("; ")[0],))


def _describe(reader: BagReader) -> BagInfo:
    with reader:
        return BagInfo(
            path=reader.path,
            files=reader.file_paths,
            size_bytes=reader.size_bytes,
            ros_distro=reader.ros_distro,
            message_count=reader.message_count,
            start_ns=reader.start_ns,
            duration_ns=reader.duration_ns,
            topics=tuple(reader.topics.values()),
            attachments=tuple((a.name, a.media_type, a.data_size) for a in reader.attachments),
            metadata_names=tuple(name for name, _ in reader.metadata_records()),
            problems=tuple(reader.problems),
            kind=reader.kind,
            left_out=tuple(reader.left_out),
        )


def format_info(info: BagInfo) -> str:
    """The description as text for a terminal, without a trailing newline."""
    lines = [
        f"Bag:         {info.path}",
        f"Files:       {', '.join(file.name for file in info.files)}",
        f"Size:        {_size(info.size_bytes)}",
        f"Format:      {info.kind}",
        f"ROS distro:  {info.ros_distro}",
        f"Complete:    {'yes' if info.complete else f'no; run `mfba recover {info.path}`'}",
        *(f"  problem:   {problem}" for problem in info.problems),
        f"Messages:    {info.message_count}",
    ]
    if info.start_ns is not None:
        lines += [
            f"Start:       {_date(info.start_ns)}",
            f"Duration:    {info.duration_ns / 1e9:.3f} s",
        ]
    name_width = max((len(topic.name) for topic in info.topics), default=0)
    type_width = max((len(topic.type_name) for topic in info.topics), default=0)
    for topic in info.topics:
        offered = "; ".join(
            f"{q.reliability}, {q.durability}, {q.history} {q.depth}" for q in topic.qos
        )
        lines.append(
            f"Topic:       {topic.name:<{name_width}}  {topic.type_name:<{type_width}}  "
            f"{topic.message_count:>8}  {offered}".rstrip()
        )
    lines += [f"Left out:    {text}" for text in info.left_out]
    lines += [
        f"Attachment:  {name} ({media_type}, {_size(size)})"
        for name, media_type, size in info.attachments
    ]
    return "\n".join(lines)


def _size(size: float) -> str:
    if size < 1000:
        return f"{int(size)} B"
    for unit in ("kB", "MB"):
        size /= 1000
        if size < 1000:
            return f"{size:.1f} {unit}"
    return f"{size / 1000:.1f} GB"


def _date(time_ns: int) -> str:
    """Wall time in UTC; seconds for a bag in simulated time, which starts near zero."""
    if time_ns < 10**9 * 86400 * 365:
        return f"{time_ns / 1e9:.3f} s"
    time = datetime.fromtimestamp(time_ns // 10**9, tz=timezone.utc)
    return f"{time:%Y-%m-%d %H:%M:%S}.{time_ns % 10**9 // 10**6:03d} UTC"
