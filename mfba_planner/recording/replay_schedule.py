# SPDX-License-Identifier: Apache-2.0
"""When each message of a bag is played again: its order, and log time mapped to steady time."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from ..core.errors import ConfigError
from .bag_reader import BagReader
from .qos_profiles import OfferedQos

UNKNOWN_DEPTH = 1000  # messages; rosbag2 records depth 0 when the middleware did not tell it


class Due(NamedTuple):
    """One message to play: CDR bytes, and its log time in ns (never before the start of play)."""

    topic: str
    data: bytes
    time_ns: int


def begin_ns(bag: BagReader, start_offset_s: float) -> int:
    """The log time where play begins. Raises ConfigError beyond the end of the bag."""
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
) -> Iterator[Due]:
    """The messages of `topics` in log-time order, from the offset on.

    They are led by the newest messages from before the offset of each topic in `latched`
    (depth by name): what a late subscriber would still have got. Raises BagError, ConfigError.
    """
    start_ns = begin_ns(bag, start_offset_s)
    if start_offset_s > 0.0 and latched:
        for topic, data in _held(bag, latched, start_ns):
            yield Due(topic, data, start_ns)
    for message in bag.messages(topics, start_offset_s=start_offset_s):
        yield Due(message.topic, message.data, message.log_time_ns)


def _held(
    bag: BagReader, latched: Mapping[str, int], start_ns: int
) -> Iterator[tuple[str, bytes]]:
    held = {name: deque[tuple[int, bytes]](maxlen=depth) for name, depth in latched.items()}
    for order, message in enumerate(bag.messages(latched.keys())):
        if message.log_time_ns >= start_ns:
            break
        held[message.topic].append((order, message.data))
    kept = sorted((order, name, data) for name in held for order, data in held[name])
    return ((name, data) for _, name, data in kept)


def offer(profiles: tuple[OfferedQos, ...]) -> OfferedQos:
    """The one QoS that stands for all publishers recorded on a topic.

    Where they differed it is the strongest, which matches every subscriber that one of them did.
    """
    if len(profiles) < 2:
        return profiles[0] if profiles else OfferedQos(depth=0)
    return replace(
        profiles[0],
        depth=0 if any(p.depth == 0 for p in profiles) else max(p.depth for p in profiles),
        history=_any_of("keep_all", (p.history for p in profiles), profiles[0].history),
        reliability="reliable"
        if any(p.reliability != "best_effort" for p in profiles)
        else "best_effort",
        durability=_any_of(
            "transient_local", (p.durability for p in profiles), profiles[0].durability
        ),
        deadline_ns=min(p.deadline_ns for p in profiles),
        lifespan_ns=max(p.lifespan_ns for p in profiles),
        liveliness_lease_duration_ns=min(p.liveliness_lease_duration_ns for p in profiles),
    )


def _any_of(strong: str, words: Iterator[str], otherwise: str) -> str:
    return strong if strong in words else otherwise


class Schedule:
    """Log time against steady time, both in ns: deadlines, so that no error adds up.

    `rate` is log seconds per steady second, None for as fast as possible.
    """

    def __init__(self, rate: float | None, start_ns: int, *, paused: bool = False) -> None:
        """Stand at start_ns until `start` is called."""
        self.rate = rate
        self.paused = paused
        self._started = False
        self._log_ns = start_ns  # where time stood ...
        self._steady_ns: int | None = None  # ... at this moment; None while it stands

    def start(self, now_ns: int) -> None:
        """Let time run from now on, unless paused."""
        self._started = True
        if not self.paused:
            self._steady_ns = now_ns

    def pause(self, now_ns: int) -> None:
        """Let time stand still."""
        self._log_ns, self._steady_ns = self.time_ns(now_ns), None
        self.paused = True

    def resume(self, now_ns: int) -> None:
        """Go on from where time stood; nothing while it runs."""
        if self.paused:
            self.paused = False
            self._steady_ns = now_ns if self._started else None

    @property
    def by_steps(self) -> bool:
        """Whether time moves with `step_to` only, not by itself."""
        return self._steady_ns is None or self.rate is None

    def time_ns(self, now_ns: int) -> int:
        """The log time at a steady time; by_steps or not."""
        if self._steady_ns is None or self.rate is None:
            return self._log_ns
        return self._log_ns + round((now_ns - self._steady_ns) * self.rate)

    def step_to(self, time_ns: int) -> None:
        """Move on to the log time of a message; nothing where time runs by itself."""
        if self.by_steps:
            self._log_ns = max(self._log_ns, time_ns)

    def wait_ns(self, time_ns: int, now_ns: int) -> int | None:
        """How long until a log time is due: at most 0 when it is, None while time stands."""
        if self._steady_ns is None:
            return None
        if self.rate is None:
            return 0
        return self._steady_ns + round((time_ns - self._log_ns) / self.rate) - now_ns

    def rewind(self, end_ns: int, start_ns: int, gap_ns: int) -> None:
        """Begin again at start_ns, gap_ns of steady time after end_ns was due."""
        if self._steady_ns is not None and self.rate is not None:
            self._steady_ns += round((end_ns - self._log_ns) / self.rate) + gap_ns
        self._log_ns = start_ns
