# SPDX-License-Identifier: Apache-2.0
"""When the simulated world may tick: pauses, answers in lockstep, repetitions. No ROS here."""

from __future__ import annotations

from ..core.errors import GraphError
from .settings import WorldSimSettings


class Pace:
    """Lockstep: a tick stays open until its cmd_vel comes; otherwise the wall timer drives.

    A Twist carries no stamp, so answers are counted: one for every tick that was published,
    however often it was.
    """

    def __init__(self, settings: WorldSimSettings) -> None:
        """Start before tick 0."""
        self.settings = settings
        self.paused = settings.start_paused
        self._is_open = False
        self._obsolete = 0  # answers under way to ticks that a reset has swept away
        self._published_s = 0.0
        self._repetitions = 0

    def published(self, now_s: float) -> None:
        """A new tick went out; now_s is of any steady clock."""
        self._is_open = self.settings.lockstep
        self._published_s = now_s
        self._repetitions = 0

    def take_answer(self) -> bool:
        """A cmd_vel came: whether it counts. In lockstep only the one that answers the tick."""
        if not self.settings.lockstep:
            return True
        if self._obsolete:
            self._obsolete -= 1
            return False
        was_open, self._is_open = self._is_open, False
        return was_open

    def may_move_on(self) -> bool:
        """Lockstep: the tick is answered and nobody holds the world."""
        return self.settings.lockstep and not self._is_open and not self.paused

    def cannot_step(self) -> str:
        """Why a single step cannot be taken now; empty when it can."""
        if not self.paused:
            return "refused: not paused; pause first"
        if self._is_open:
            return "refused: the planner has not answered the present tick yet"
        return ""

    def reset(self) -> None:
        """The world starts again: the answer to the open tick will be of the past."""
        self._obsolete += self._is_open
        self._is_open = False

    def must_repeat(self, now_s: float, tick: int) -> bool:
        """Whether to publish an unanswered tick again; GraphError when that was done enough."""
        timeout_s = self.settings.answer_timeout_s
        if not self._is_open or now_s - self._published_s < timeout_s:
            return False
        if self._repetitions >= self.settings.answer_retries:
            raise GraphError(
                f"tick {tick}: no cmd_vel though published {self._repetitions + 1} times, "
                f"{timeout_s:g} s apart; is the planner running?"
            )
        self._published_s = now_s
        self._repetitions += 1
        self._obsolete = 0  # what did not come in that long will not come
        return True
