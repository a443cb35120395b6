# SPDX-License-Identifier: Apache-2.0
"""Player: publishes a bag's messages when they are due, called between two executor spins."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from enum import Enum, auto

from rclpy.event_handler import PublisherEventCallbacks

from ...core.errors import ConfigError, GraphError
from ...recording.bag_reader import BagReader
from ...recording.replay_schedule import (
    UNKNOWN_DEPTH,
    DueMessage,
    Schedule,
    due_messages,
    replay_start_ns,
)
from ..interface import topics
from ..interface.to_messages import clock_msg
from ..runtime.base_node import SPIN_S, GraphNode
from .flow_control import FlowControl, all_acknowledged, windowed
from .reader_readiness import Readiness
from .replay_arguments import ReplaySettings
from .topic_selection import awaited, choose

BURST = 50  # messages published before services and signals are served
POLL_S = 0.002  # between two checks of what the readers have read
LOOP_GAP_NS = 100_000_000  # between the last message and the first of the next round
END_S = 5.0  # longest wait for acknowledgements; Fast DDS may request them after 3 s only


class Phase(Enum):
    """The phases of a replay."""

    WAITING = auto()
    PLAYING = auto()
    ENDING = auto()
    OVER = auto()


class Player:
    """Plays one bag through publishers of a node."""

    def __init__(self, node: GraphNode, settings: ReplaySettings) -> None:
        """Raise ConfigError or BagError for what cannot be played."""
        self.settings = settings
        self.phase = Phase.WAITING
        self.counts: Counter[str] = Counter()
        self._node = node
        self._bag = BagReader(settings.bag)
        try:
            self._prepare()
        except BaseException:
            self._bag.close()
            raise

    def _prepare(self) -> None:
        s = self.settings
        fast = s.as_fast_as_possible
        found, left_out = choose(self._bag.topics, s, self._resolve)
        self._start_ns = replay_start_ns(self._bag, s.start_offset)
        wanted = awaited(found, s, self._resolve)
        self._publishers = {
            topic.recorded: self._node.create_publisher(
                topic.type,
                topic.name,
                windowed(topic.qos) if fast else topic.qos,
                event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
            )
            for topic in found
        }
        self._readiness = Readiness(self._node, self._publishers, wanted, s.inputs_of)
        self._latched = {t.recorded: t.qos.depth or UNKNOWN_DEPTH for t in found if t.latched}
        self._flow = FlowControl(self._node, self._publishers, s.wait_timeout, lossless=fast)
        self._clock = self._node.advertise(topics.CLOCK) if s.clock else None
        self._clock_due_ns = 0
        self._clock_period_ns = round(1e9 / s.clock) if s.clock else 0
        self._schedule = Schedule(None if fast else s.rate, self._start_ns, paused=s.start_paused)
        self._since_ns = time.monotonic_ns()  # start of the present phase
        self._started_ns = self._played_ns = 0
        self._rewind()
        others = (f"left out {text}" for text in self._bag.left_out)
        for line in [*self._bag.problems, *others, *left_out]:
            self._node.get_logger().warning(line)

    def _resolve(self, name: str) -> str:
        try:
            return str(self._node.resolve_topic_name(name, only_expand=True))
        except RuntimeError as error:  # rcl's
            raise ConfigError(
                f"{name!r}: no topic name ({str(error).split(', at /')[0]}); give one like /odom"
            ) from None

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def advance(self) -> float:
        """Publish what is due; return the seconds until the next message is due.

        Raises GraphError when readers are missing or hang, BagError when the bag is damaged.
        """
        now = time.monotonic_ns()
        wait_s = SPIN_S
        if self.phase is Phase.WAITING:
            wait_s = self._wait(now)
        elif self.phase is Phase.PLAYING:
            wait_s = self._play(now)
        elif self.phase is Phase.ENDING:
            wait_s = self._end(now)
        return min(wait_s, self._publish_clock_if_due(time.monotonic_ns()))

    def pause(self) -> None:
        """Stop the replay's time."""
        if not self._schedule.paused:
            self._schedule.pause(time.monotonic_ns())

    def resume(self) -> None:
        """End a pause."""
        self._schedule.resume(time.monotonic_ns())

    def step(self) -> tuple[bool, str]:
        """Publish one message while paused; return success, and what was published or why not."""
        due = self._next
        if not self._schedule.paused:
            return False, "refused: pause first"
        if self.phase is not Phase.PLAYING or due is None:
            return False, f"refused: {self.phase.name.lower()}"
        self._publish(due)
        return True, f"{due.topic} at {(due.time_ns - self._start_ns) / 1e9:.6f} s"

    def _enter(self, phase: Phase, now: int) -> None:
        self.phase, self._since_ns = phase, now

    def _rewind(self) -> None:
        self._messages: Iterator[DueMessage] = due_messages(
            self._bag, self._publishers.keys(), self._latched, self.settings.start_offset
        )
        self._next = next(self._messages, None)
        self._clock_ns = -1
        self._last_ns = self._start_ns

    def _wait(self, now: int) -> float:
        """Wait until all required subscribers and nodes are there."""
        missing = self._readiness.missing()
        if not missing and (
            self._readiness.waits_for_nothing or self._flow.knows_readers(now * 1e-9)
        ):
            self._enter(Phase.PLAYING, now)
            self._started_ns = now
            self._schedule.start(now)
            return 0.0
        timeout_s = self.settings.wait_timeout
        if missing and now - self._since_ns > timeout_s * 1e9:
            raise GraphError(
                f"{missing} after {timeout_s:g} s; start the readers or raise --wait-timeout"
            )
        return 5.0 * POLL_S

    def _play(self, now: int) -> float:
        for _ in range(BURST):
            due = self._next
            if due is None:
                self._enter(Phase.ENDING, now)
                return 0.0
            wait_ns = self._schedule.wait_ns(due.time_ns, now)
            if wait_ns is None:
                return SPIN_S
            if wait_ns > 0:
                return wait_ns * 1e-9
            # Time advances only where everything earlier has been read.
            after_all = self._clock is not None and due.time_ns > self._clock_ns
            allowed = self._flow.allows(due.topic, after_all=after_all)
            if not allowed and not self._flow.settle(now * 1e-9):
                return POLL_S
            self._publish(due)
            now = time.monotonic_ns()
        return 0.0

    def _publish(self, due: DueMessage) -> None:
        self._schedule.advance_to(due.time_ns)
        if self._schedule.is_stepped and due.time_ns > self._clock_ns:
            self._publish_clock(due.time_ns)
        self._publishers[due.topic].publish(due.data)
        self._last_ns = due.time_ns
        self.counts[due.topic] += 1
        self._flow.sent(due.topic)
        self._next = next(self._messages, None)
        if self._next is None and self.settings.loop:
            self._schedule.rewind(due.time_ns, self._start_ns, LOOP_GAP_NS)
            self._rewind()

    def _end(self, now: int) -> float:
        """Wait until everything has arrived; then log what was played."""
        self._played_ns = self._played_ns or now - self._started_ns
        if not self._flow.settle(now * 1e-9):
            return POLL_S
        late = [t for t, p in self._publishers.items() if not all_acknowledged(p)]
        if late and now - self._since_ns < END_S * 1e9:
            return 5.0 * POLL_S
        logger = self._node.get_logger()
        if late:
            logger.warning(f"{', '.join(late)}: not acknowledged by all after {END_S:g} s")
        counts = ", ".join(f"{topic} {count}" for topic, count in sorted(self.counts.items()))
        seconds = self._played_ns * 1e-9
        logger.info(f"played {self.counts.total()} messages in {seconds:.3f} s: {counts}")
        self._enter(Phase.OVER, now)
        return 0.0

    def _publish_clock_if_due(self, now: int) -> float:
        """Publish /clock if due; return seconds until the next. It never overtakes a message."""
        if self._clock is None:
            return SPIN_S
        if now >= self._clock_due_ns:
            self._clock_due_ns = max(self._clock_due_ns, now) + self._clock_period_ns
            limit_ns = self._next.time_ns if self._next else self._last_ns
            time_ns = min(limit_ns, self._schedule.time_ns(now))
            self._publish_clock(max(self._start_ns, time_ns))
        return (self._clock_due_ns - now) * 1e-9

    def _publish_clock(self, time_ns: int) -> None:
        if self._clock is not None:
            self._clock_ns = time_ns
            self._clock.publish(clock_msg(time_ns))
