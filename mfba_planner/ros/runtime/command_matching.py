# SPDX-License-Identifier: Apache-2.0
"""Which cmd_vel belongs to which tick. No ROS here."""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

KEPT = 1000  # of each topic; where a planner is farther apart, the tick is published again


class Sent(NamedTuple):
    """Something a planner sent, and when by the planner's clock."""

    sent_ns: int
    value: Any


class CommandMatching:
    """Joins cmd_vel, which has no stamp, with goal_step, which has the tick's.

    A planner sends goal_step, then cmd_vel. A Twist therefore belongs to the last goal_step sent
    before it. Whether one of them is late, sent twice, lost or from an earlier planner: a Twist
    is never matched with another tick.
    """

    def __init__(self) -> None:
        """Start with nothing received."""
        self._goal_steps: deque[Sent] = deque(maxlen=KEPT)
        self._twists: deque[Sent] = deque(maxlen=KEPT)

    def add_goal_step(self, stamp_ns: int, sent_ns: int) -> None:
        """Add the stamp of a goal_step."""
        self._goal_steps.append(Sent(sent_ns, stamp_ns))

    def add_cmd_vel(self, message: Any, sent_ns: int) -> None:
        """Add a Twist, or any value in its stead."""
        self._twists.append(Sent(sent_ns, message))

    def take(self, stamp_ns: int) -> Any:
        """Return the first Twist of this stamp and drop all sent up to it; None: none."""
        for sent_ns, message in self._twists:
            before = [step for step in self._goal_steps if step.sent_ns <= sent_ns]
            if before and max(before).value == stamp_ns:
                for queue in (self._goal_steps, self._twists):
                    kept = [item for item in queue if item.sent_ns > sent_ns]
                    queue.clear()
                    queue.extend(kept)
                return message
        return None
