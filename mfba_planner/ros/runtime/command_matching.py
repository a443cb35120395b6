# SPDX-License-Identifier: Apache-2.0
"""Which cmd_vel answers which tick. No ROS here."""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

KEPT = 1000  # of each; a planner that is that far ahead or behind is asked again


class Sent(NamedTuple):
    """Something a planner sent, and when by its own clock."""

    sent_ns: int
    value: Any


class CommandMatching:
    """Joins cmd_vel, which has no stamp, with goal_step, which has the tick's.

    A planner sends goal_step, then cmd_vel. A Twist therefore belongs to the last goal_step sent
    before it; whether one of them came late, twice, from a planner that is gone or not at all,
    no Twist is ever taken for the answer to another tick.
    """

    def __init__(self) -> None:
        """Start with nothing heard."""
        self._steps: deque[Sent] = deque(maxlen=KEPT)
        self._twists: deque[Sent] = deque(maxlen=KEPT)

    def goal_step(self, stamp_ns: int, sent_ns: int) -> None:
        """Take the stamp of a goal_step."""
        self._steps.append(Sent(sent_ns, stamp_ns))

    def cmd_vel(self, message: Any, sent_ns: int) -> None:
        """Take a Twist, or anything that stands for it."""
        self._twists.append(Sent(sent_ns, message))

    def take(self, stamp_ns: int) -> Any:
        """Return the first Twist that answers this stamp and forget all up to it; None: none."""
        for sent_ns, message in self._twists:
            before = [step for step in self._steps if step.sent_ns <= sent_ns]
            if before and max(before).value == stamp_ns:
                for heard in (self._steps, self._twists):
                    kept = [item for item in heard if item.sent_ns > sent_ns]
                    heard.clear()
                    heard.extend(kept)
                return message
        return None
