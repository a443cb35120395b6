# SPDX-License-Identifier: Apache-2.0
"""When the simulated world may tick: pauses, lockstep, repeated ticks. No ROS here."""

from __future__ import annotations

from ...core.errors import GraphError
from ..node_settings import WorldSimSettings


class TickControl:
    """Lockstep: a tick is open until all its commands are received. Real time: none is open."""

    def __init__(self, settings: WorldSimSettings) -> None:
        """Start before tick 0."""
        self.settings = settings
        self.paused = settings.start_paused
        self.is_open = False
        self._published_s = 0.0
        self._repetitions = 0

    def open_tick(self, now_s: float) -> None:
        """A new tick was published; now_s is of any steady clock."""
        self.is_open = self.settings.lockstep
        self._published_s = now_s
        self._repetitions = 0

    def close_tick(self) -> bool:
        """The open tick's commands were received, or ~/reset ended it; return may_advance()."""
        self.is_open = False
        return self.may_advance()

    def resume(self) -> bool:
        """End a pause; return whether the world may advance that could not before."""
        was_paused, self.paused = self.paused, False
        return was_paused and self.may_advance()

    def may_advance(self) -> bool:
        """Lockstep: whether no tick is open and the world is not paused."""
        return self.settings.lockstep and not self.is_open and not self.paused

    def step_refusal(self) -> str:
        """Why ~/step must be refused now; empty when it need not."""
        if not self.paused:
            return "refused: not paused; pause first"
        if self.is_open:
            return "refused: the present tick has no command yet"
        return ""

    def must_repeat(self, now_s: float, tick: int) -> bool:
        """Whether to publish the open tick again; GraphError after answer_retries repetitions."""
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
