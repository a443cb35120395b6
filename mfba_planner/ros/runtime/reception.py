# SPDX-License-Identifier: Apache-2.0
"""What reaches a node on one topic: messages it was too slow for, and publishers that compete.

No ROS here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

REMEMBERED_S = 10.0  # a node that stalls counts what it missed; then a sequence is forgotten
OVERTAKEN = 3  # messages by which two subscriptions to one topic may be apart
HELD_S = 1.0  # how long a change of frame, or a second publisher, is a fault


@dataclass(slots=True)
class _Sequence:
    """The publication sequence numbers of one publisher."""

    last: int
    at_s: float


class _Flow:
    """The sequences of publishers whose messages may not be mixed."""

    def __init__(self) -> None:
        """Start without messages."""
        self.dropped = 0
        self._sequences: list[_Sequence] = []
        self._sent_ns = 0

    def is_straggler(self, number: int, sent_ns: int) -> bool:
        """Whether one of two subscriptions delivers what the other one has overtaken."""
        if sent_ns >= self._sent_ns:
            self._sent_ns = sent_ns
            return False
        # Publishers on computers with different clocks send "earlier" ones too, but not these.
        return any(0 < s.last - number <= OVERTAKEN for s in self._sequences)

    def competes(self, number: int, now_s: float) -> bool:
        """Assign a sequence number; whether it continues another sequence than the last one."""
        newest = self._sequences[-1] if self._sequences else None
        self._sequences = [s for s in self._sequences if now_s - s.at_s <= REMEMBERED_S]
        # The nearest one; of two that are equally near, the one that has waited longer.
        earlier = [s for s in self._sequences if s.last < number]
        before = max(earlier, key=lambda s: s.last, default=None)
        if before is None:
            self._sequences.append(_Sequence(number, now_s))
            return False
        self.dropped += number - before.last - 1
        before.last, before.at_s = number, now_s
        self._sequences.remove(before)
        self._sequences.append(before)
        return before is not newest


class Reception:
    """Counts dropped messages of a topic, and finds two publishers that send in turn.

    A message carries the sequence number of its publisher, but not who that is: numbers are
    assigned to the sequence that they continue. Two publishers send in turn if an earlier
    sequence goes on after another one has begun; a publisher that was restarted only begins a
    new one. Where frames are merged, each may have a publisher, and is looked at for itself.
    """

    def __init__(
        self,
        name: str,
        publishers: Callable[[], Sequence[str]],
        remedy: str,
        wanted: str = "",
        is_merged: Callable[[str], bool] = lambda _: False,
    ) -> None:
        """Publishers returns the nodes that publish at present; wanted is the frame required.

        An empty `wanted` is any frame, as long as it does not change but between merged ones.
        """
        self._name, self._publishers, self._remedy = name, publishers, remedy
        self._wanted, self._is_merged = wanted, is_merged
        self.ignored = 0  # from another publisher, in another frame than the wanted one
        self._frame: str | None = None
        self._merged: set[str] = set()  # frames so far
        self._flows: dict[str, _Flow] = {}  # by frame if there is a publisher for each
        self._by_frame = False
        self._wanted_s: float | None = None
        self._fault = ""
        self._until_s = 0.0

    @property
    def dropped(self) -> int:
        """Messages that were lost, or replaced by a newer one before the node took them."""
        return sum(flow.dropped for flow in self._flows.values())

    def fault(self, now_s: float) -> str:
        """Why no message of this topic may be used at present, "" if there is no reason."""
        return self._fault if now_s < self._until_s else ""

    def received(
        self, sequence: int | None, sent_ns: int, frame: str, now_s: float, limit_s: float
    ) -> bool:
        """A message was taken; False if it must not be used as a newer or better one is there.

        Without sequence numbers (None: not all middleware has them) only frames are compared.
        """
        flow = self._flows.setdefault(frame if self._by_frame else "", _Flow())
        if sequence is not None and flow.is_straggler(sequence, sent_ns):
            return False
        if self._wanted and frame != self._wanted:
            if self._is_from_another(now_s, limit_s):
                self.ignored += 1
                return False
        elif self._wanted:
            self._wanted_s = now_s
        elif self._frame not in (None, frame) and not self._are_merged(self._frame, frame):
            self._hold(f"{self._name} changes its frame from {self._frame!r} to {frame!r}", now_s)
        self._frame = frame
        if sequence is not None and flow.competes(sequence, now_s):
            self._compete(self._publishers(), now_s)
        return True

    def _are_merged(self, *frames: str | None) -> bool:
        """Whether scans of these frames may come in turn."""
        if not all(frame and self._is_merged(frame) for frame in frames):
            return False
        self._merged.update(frame for frame in frames if frame)
        return True

    def _compete(self, names: Sequence[str], now_s: float) -> None:
        """Publishers send in turn: a fault, unless there is one for each merged frame."""
        if len(names) < 2:
            return
        if not self._by_frame and 1 < len(self._merged) <= len(names):
            self._by_frame = True
            self._flows = {"": _Flow()}
            return
        self._hold(
            f"{self._name} has {len(names)} publishers that send in turn "
            f"({', '.join(sorted(names))})",
            now_s,
        )

    def _is_from_another(self, now_s: float, limit_s: float) -> bool:
        """Whether the wanted frame is received too, from one of several publishers."""
        is_fresh = self._wanted_s is not None and now_s - self._wanted_s <= limit_s
        return is_fresh and len(self._publishers()) > 1

    def _hold(self, what: str, now_s: float) -> None:
        self._fault, self._until_s = f"{what}; {self._remedy}", now_s + HELD_S
