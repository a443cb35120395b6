# SPDX-License-Identifier: Apache-2.0
"""Schedule of a replay: sequence of the messages, log time mapped to steady time, QoS."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from ..core.errors import ConfigError
from .bag_qos import OfferedQos
from .bag_reader import BagReader

UNKNOWN_DEPTH = 1000  # messages; rosbag2 records depth 0 if the middleware does not report it


class DueMessage(NamedTuple):
    """One message to replay: CDR bytes, and log time in ns, not before the start of the replay."""

    topic: str
    data: bytes
    time_ns: int


def replay_start_ns(bag: BagReader, start_offset_s: float) -> int:
    """The log time at which the replay starts. Raises ConfigError beyond the end of the bag."""
    offset_ns = round(start_offset_s * 1e9)
    if offset_ns > bag.duration_ns:
        raise ConfigError(
            f"start_offset={start_offset_s:g} s: beyond the end of {bag.path}, "
            f"which lasts {bag.duration_ns / 1e9:g} s; give less"
        )
    return (bag.start_ns or 0) + offset_ns


def due_messages(
    bag: BagReader,
    topics: Collection[str],
    latched: Mapping[str, int],
    start_offset_s: float = 0.0,
) -> Iterator[DueMessage]:
    """The messages of `topics` sorted by log time, from the offset on.

    First come the newest messages before the offset of each topic in `latched` (depth by name),
    as a late subscriber would have received them. Raises BagError, ConfigError.
    """
    start_ns = replay_start_ns(bag, start_offset_s)
    if start_offset_s > 0.0 and latched:
        for topic, data in _latched_before(bag, latched, start_ns):
            yield DueMessage(topic, data, start_ns)
    for message in bag.messages(topics, start_offset_s=start_offset_s):
        yield DueMessage(message.topic, message.data, message.log_time_ns)


def _latched_before(
    bag: BagReader, latched: Mapping[str, int], start_ns: int
) -> Iterator[tuple[str, bytes]]:
    newest = {name: deque[tuple[int, bytes]](maxlen=depth) for name, depth in latched.items()}
    for index, message in enumerate(bag.messages(latched.keys())):
        if message.log_time_ns >= start_ns:
            break
        newest[message.topic].append((index, message.data))
    in_sequence = sorted((index, name, data) for name in newest for index, data in newest[name])
    return ((name, data) for _, name, data in in_sequence)


def merged_qos(profiles: tuple[OfferedQos, ...]) -> OfferedQos:
    """One QoS for a topic on which several publishers were recorded.

    If they differ, the strongest: it matches every subscriber that one of them matched.
    """
    if len(profiles) < 2:
        return profiles[0] if profiles else OfferedQos(depth=0)
    return replace(
        profiles[0],
        depth=0 if any(p.depth == 0 for p in profiles) else max(p.depth for p in profiles),
        history=_strongest("keep_all", (p.history for p in profiles), profiles[0].history),
        reliability="reliable"
        if any(p.reliability != "best_effort" for p in profiles)
        else "best_effort",
        durability=_strongest(
            "transient_local", (p.durability for p in profiles), profiles[0].durability
        ),
        deadline_ns=min(p.deadline_ns for p in profiles),
        lifespan_ns=max(p.lifespan_ns for p in profiles),
        liveliness_lease_duration_ns=min(p.liveliness_lease_duration_ns for p in profiles),
    )


def _strongest(strongest: str, words: Iterator[str], default: str) -> str:
    return strongest if strongest in words else default


class Schedule:
    """Maps log time to steady time, both in ns; absolute deadlines, so errors do not add up.

    `rate` is log seconds per steady second, None for as fast as possible.
    """

    def __init__(self, rate: float | None, start_ns: int, *, paused: bool = False) -> None:
        """Log time stays at start_ns until `start` is called."""
        self.rate = rate
        self.paused = paused
        self._started = False
        self._log_ns = start_ns  # log time at which time last started or stopped ...
        self._steady_ns: int | None = None  # ... and its steady time; None while stopped

    def start(self, now_ns: int) -> None:
        """Start log time at now_ns, unless paused."""
        self._started = True
        if not self.paused:
            self._steady_ns = now_ns

    def pause(self, now_ns: int) -> None:
        """Stop log time."""
        self._log_ns, self._steady_ns = self.time_ns(now_ns), None
        self.paused = True

    def resume(self, now_ns: int) -> None:
        """Continue log time; does nothing while it runs."""
        if self.paused:
            self.paused = False
            self._steady_ns = now_ns if self._started else None

    @property
    def is_stepped(self) -> bool:
        """Whether log time advances only with the messages: stopped, or as fast as possible."""
        return self._steady_ns is None or self.rate is None

    def time_ns(self, now_ns: int) -> int:
        """The log time at a steady time."""
        if self._steady_ns is None or self.rate is None:
            return self._log_ns
        return self._log_ns + round((now_ns - self._steady_ns) * self.rate)

    def advance_to(self, time_ns: int) -> None:
        """Advance to the log time of a message; does nothing while time runs."""
        if self.is_stepped:
            self._log_ns = max(self._log_ns, time_ns)

    def wait_ns(self, time_ns: int, now_ns: int) -> int | None:
        """Steady ns until a log time is due: at most 0 if it is, None while time is stopped."""
        if self._steady_ns is None:
            return None
        if self.rate is None:
            return 0
        return self._steady_ns + round((time_ns - self._log_ns) / self.rate) - now_ns

    def rewind(self, end_ns: int, start_ns: int, gap_ns: int) -> None:
        """Restart at log time start_ns, gap_ns of steady time after end_ns was due."""
        if self._steady_ns is not None and self.rate is not None:
            self._steady_ns += round((end_ns - self._log_ns) / self.rate) + gap_ns
        self._log_ns = start_ns
