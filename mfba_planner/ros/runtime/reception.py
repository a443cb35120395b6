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


class Reception:
    """Counts dropped messages of a topic, and finds two publishers that send in turn.

    A message carries the sequence number of its publisher, but not who that is: numbers are
    assigned to the sequence that they continue. Two publishers send in turn if an earlier
    sequence goes on after another one has begun; a publisher that was restarted only begins a
    new one.
    """

    def __init__(
        self, name: str, publishers: Callable[[], Sequence[str]], remedy: str, wanted: str = ""
    ) -> None:
        """Publishers returns the nodes that publish at present; wanted is the frame required.

        An empty `wanted` is any frame, as long as it does not change.
        """
        self._name, self._publishers, self._remedy = name, publishers, remedy
        self._wanted = wanted
        self.dropped = 0  # lost, or replaced by a newer one before the node took it
        self.ignored = 0  # from another publisher, in another frame than the wanted one
        self._sequences: list[_Sequence] = []
        self._sent_ns = 0
        self._frame: str | None = None
        self._wanted_s: float | None = None
        self._fault = ""
        self._until_s = 0.0

    def fault(self, now_s: float) -> str:
        """Why no message of this topic may be used at present, "" if there is no reason."""
        return self._fault if now_s < self._until_s else ""

    def received(
        self, sequence: int | None, sent_ns: int, frame: str, now_s: float, limit_s: float
    ) -> bool:
        """A message was taken; False if it must not be used as a newer or better one is there.

        Without sequence numbers (None: not all middleware has them) only frames are compared.
        """
        if sequence is not None and self._is_straggler(sequence, sent_ns):
            return False
        if self._wanted and frame != self._wanted:
            if self._is_from_another(now_s, limit_s):
                self.ignored += 1
                return False
        elif self._wanted:
            self._wanted_s = now_s
        elif self._frame not in (None, frame):
            self._hold(f"{self._name} changes its frame from {self._frame!r} to {frame!r}", now_s)
        self._frame = frame
        competes = sequence is not None and self._competes(sequence, now_s)
        if competes and len(names := self._publishers()) > 1:
            self._hold(
                f"{self._name} has {len(names)} publishers that send in turn "
                f"({', '.join(sorted(names))})",
                now_s,
            )
        return True

    def _is_straggler(self, number: int, sent_ns: int) -> bool:
        """Whether one of two subscriptions delivers what the other one has overtaken."""
        if sent_ns >= self._sent_ns:
            self._sent_ns = sent_ns
            return False
        # Publishers on computers with different clocks send "earlier" ones too, but not these.
        return any(0 < s.last - number <= OVERTAKEN for s in self._sequences)

    def _is_from_another(self, now_s: float, limit_s: float) -> bool:
        """Whether the wanted frame is received too, from one of several publishers."""
        is_fresh = self._wanted_s is not None and now_s - self._wanted_s <= limit_s
        return is_fresh and len(self._publishers()) > 1

    def _hold(self, what: str, now_s: float) -> None:
        self._fault, self._until_s = f"{what}; {self._remedy}", now_s + HELD_S

    def _competes(self, number: int, now_s: float) -> bool:
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
