# SPDX-License-Identifier: Apache-2.0
"""When the simulated world may tick: pauses, answers in lockstep, repetitions. No ROS here."""

from __future__ import annotations

from ...core.errors import GraphError
from ..node_parameters import WorldSimSettings


class TickControl:
    """Lockstep: a tick stays open until its answer comes; otherwise the wall timer drives."""

    def __init__(self, settings: WorldSimSettings) -> None:
        """Start before tick 0."""
        self.settings = settings
        self.paused = settings.start_paused
        self.is_open = False
        self._published_s = 0.0
        self._repetitions = 0

    def published(self, now_s: float) -> None:
        """A new tick went out; now_s is of any steady clock."""
        self.is_open = self.settings.lockstep
        self._published_s = now_s
        self._repetitions = 0

    def answered(self) -> bool:
        """The answer to the open tick came, or a reset has swept it away; may_move_on() then."""
        self.is_open = False
        return self.may_move_on()

    def resume(self) -> bool:
        """Go on from a pause; whether the world may move on that could not before."""
        was_paused, self.paused = self.paused, False
        return was_paused and self.may_move_on()

    def may_move_on(self) -> bool:
        """Lockstep: the tick is answered and nobody holds the world."""
        return self.settings.lockstep and not self.is_open and not self.paused

    def cannot_step(self) -> str:
        """Why a single step cannot be taken now; empty when it can."""
        if not self.paused:
            return "refused: not paused; pause first"
        if self.is_open:
            return "refused: the planner has not answered the present tick yet"
        return ""

    def must_repeat(self, now_s: float, tick: int) -> bool:
        """Whether to publish an unanswered tick again; GraphError when that was done enough."""
        timeout_s = self.settings.answer_timeout_s
        if not self.is_open or now_s - self._published_s < timeout_s:
            return False
        if self._repetitions >= self.settings.answer_retries:
            raise GraphError(
                f"tick {tick}: no goal_step of its stamp and cmd_vel though published "
                f"{self._repetitions + 1} times, {timeout_s:g} s apart; is the planner running?"
            )
        self._published_s = now_s
        self._repetitions += 1
        return True
