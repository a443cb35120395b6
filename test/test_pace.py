# SPDX-License-Identifier: Apache-2.0
"""When the world may tick, as a table of what happens and as any sequence of it."""

from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from mfba_planner.core.errors import GraphError
from mfba_planner.ros.pace import Pace
from mfba_planner.ros.settings import WorldSimSettings


def pace(**settings: Any) -> Pace:
    defaults = {"lockstep": True, "answer_timeout_s": 2.0, "answer_retries": 3}
    return Pace(WorldSimSettings(**(defaults | settings)))


def test_a_tick_stays_open_until_its_one_answer() -> None:
    world = pace()
    assert world.may_move_on()
    world.published(0.0)
    assert not world.may_move_on()
    assert world.take_answer()
    assert world.may_move_on()
    assert not world.take_answer(), "nothing was asked"


def test_a_pause_keeps_the_answer_for_later() -> None:
    world = pace()
    world.published(0.0)
    world.paused = True
    assert world.cannot_step() == "refused: the planner has not answered the present tick yet"
    assert world.take_answer()
    assert not world.may_move_on()
    assert world.cannot_step() == ""
    world.paused = False
    assert world.may_move_on()
    assert world.cannot_step() == "refused: not paused; pause first"


def test_an_answer_to_a_tick_before_the_reset_does_not_count() -> None:
    world = pace()
    world.published(0.0)
    world.reset()
    assert world.may_move_on()
    world.published(1.0)
    assert not world.take_answer(), "the old tick's"
    assert not world.may_move_on()
    assert world.take_answer()
    assert world.may_move_on()


def test_nobody_waits_for_ever_for_an_old_answer() -> None:
    """Its planner may have died with it; the new one answers what is published again."""
    world = pace()
    world.published(0.0)
    world.reset()
    world.published(1.0)
    assert world.must_repeat(3.0, 0)
    assert world.take_answer()


def test_a_tick_is_repeated_after_each_timeout_and_then_given_up() -> None:
    world = pace()
    assert not world.must_repeat(100.0, 0), "nothing is open"
    world.published(10.0)
    times = [11.9, 12.0, 13.9, 14.1, 15.0, 16.2]
    assert [world.must_repeat(now, 7) for now in times] == [False, True, False, True, False, True]
    with pytest.raises(
        GraphError, match=r"^tick 7: no cmd_vel though published 4 times, 2 s apart"
    ):
        world.must_repeat(18.3, 7)


def test_an_answer_ends_the_repetitions_and_the_next_tick_has_all_of_them() -> None:
    world = pace(answer_retries=1)
    for tick in range(3):
        start = 10.0 * tick
        world.published(start)
        assert world.must_repeat(start + 2.0, tick)
        assert world.take_answer()
        assert not world.must_repeat(start + 9.0, tick)


def test_no_retries_at_all() -> None:
    world = pace(answer_retries=0)
    world.published(0.0)
    with pytest.raises(GraphError, match="published 1 times"):
        world.must_repeat(2.0, 0)


def test_in_real_time_every_twist_counts_and_none_moves_the_world() -> None:
    world = pace(lockstep=False)
    world.published(0.0)
    assert world.take_answer()
    assert world.take_answer()
    assert not world.may_move_on()
    assert not world.must_repeat(1e9, 0)


class Loop(RuleBasedStateMachine):
    """A world and a planner that answers each tick once, with pauses and resets in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.pace = pace()
        self.run = 0
        self.to_answer: list[int] = []  # the run of each tick that is under way to the planner
        self.open_run: int | None = None

    def publish(self) -> None:
        self.pace.published(0.0)
        self.to_answer.append(self.run)
        self.open_run = self.run

    @precondition(lambda self: self.pace.may_move_on())
    @rule()
    def tick(self) -> None:
        self.publish()

    @precondition(lambda self: not self.pace.cannot_step())
    @rule()
    def step(self) -> None:
        self.publish()

    @precondition(lambda self: self.to_answer)
    @rule()
    def answer(self) -> None:
        counts = self.pace.take_answer()
        assert counts == (self.to_answer.pop(0) == self.run)
        if counts:
            self.open_run = None

    @rule()
    def reset(self) -> None:
        self.pace.reset()
        self.run += 1
        self.open_run = None

    @rule(paused=st.booleans())
    def pause(self, paused: bool) -> None:
        self.pace.paused = paused

    @invariant()
    def one_tick_of_this_run_at_most_is_under_way(self) -> None:
        assert self.to_answer.count(self.run) <= 1
        assert self.pace._is_open == (self.open_run == self.run)


Loop.TestCase.settings = settings(max_examples=30, stateful_step_count=30)
TestLoop = Loop.TestCase
