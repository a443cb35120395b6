# SPDX-License-Identifier: Apache-2.0
"""When the world may tick, as a table of what happens."""

from typing import Any

import pytest

from mfba_planner.core.errors import GraphError
from mfba_planner.ros.node_parameters import WorldSimSettings
from mfba_planner.ros.runtime.tick_control import TickControl


def tick_control(**settings: Any) -> TickControl:
    defaults = {"lockstep": True, "answer_timeout_s": 2.0, "answer_retries": 3}
    return TickControl(WorldSimSettings(**(defaults | settings)))


def test_a_tick_stays_open_until_its_answer() -> None:
    world = tick_control()
    assert world.may_advance()
    world.open_tick(0.0)
    assert world.is_open
    assert not world.may_advance()
    world.close_tick()
    assert world.may_advance()


def test_a_pause_keeps_the_answer_for_later() -> None:
    world = tick_control()
    world.open_tick(0.0)
    world.paused = True
    assert world.step_refusal() == "refused: the planner has not answered the present tick yet"
    world.close_tick()
    assert not world.may_advance()
    assert world.step_refusal() == ""
    assert world.resume()
    assert world.step_refusal() == "refused: not paused; pause first"
    assert not world.resume(), "it was not paused"


def test_after_a_pause_an_open_tick_still_waits() -> None:
    world = tick_control(start_paused=True)
    world.open_tick(0.0)
    assert not world.resume()
    assert world.close_tick()


def test_a_tick_is_repeated_after_each_timeout_and_then_given_up() -> None:
    world = tick_control()
    assert not world.must_repeat(100.0, 0), "nothing is open"
    world.open_tick(10.0)
    times = [11.9, 12.0, 13.9, 14.1, 15.0, 16.2]
    assert [world.must_repeat(now, 7) for now in times] == [False, True, False, True, False, True]
    line = r"^tick 7: no goal_step of its stamp and cmd_vel though published 4 times, 2 s apart"
    with pytest.raises(GraphError, match=line):
        world.must_repeat(18.3, 7)


def test_an_answer_ends_the_repetitions_and_the_next_tick_has_all_of_them() -> None:
    world = tick_control(answer_retries=1)
    for tick in range(3):
        start = 10.0 * tick
        world.open_tick(start)
        assert world.must_repeat(start + 2.0, tick)
        world.close_tick()
        assert not world.must_repeat(start + 9.0, tick)


def test_no_retries_at_all() -> None:
    world = tick_control(answer_retries=0)
    world.open_tick(0.0)
    with pytest.raises(GraphError, match="published 1 times"):
        world.must_repeat(2.0, 0)


def test_in_real_time_no_tick_is_open_and_no_answer_moves_the_world() -> None:
    world = tick_control(lockstep=False)
    world.open_tick(0.0)
    assert not world.is_open
    assert not world.may_advance()
    assert not world.must_repeat(1e9, 0)
