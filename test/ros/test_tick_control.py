# SPDX-License-Identifier: Apache-2.0
"""When the simulated world may tick: lockstep, pauses, repetitions."""

from typing import Any

import pytest

from mfba_planner.core.errors import GraphError
from mfba_planner.ros.node_settings import WorldSimSettings
from mfba_planner.ros.runtime.tick_control import TickControl


def tick_control(**settings: Any) -> TickControl:
    defaults = {"lockstep": True, "answer_timeout_s": 2.0, "answer_retries": 3}
    return TickControl(WorldSimSettings(**(defaults | settings)))


def test_a_tick_is_open_until_its_commands_are_received() -> None:
    control = tick_control()
    assert control.may_advance()
    control.open_tick(0.0)
    assert control.is_open
    assert not control.may_advance()
    control.close_tick()
    assert control.may_advance()


def test_during_a_pause_the_commands_are_kept() -> None:
    control = tick_control()
    control.open_tick(0.0)
    control.paused = True
    assert control.step_refusal() == "refused: the present tick has no command yet"
    control.close_tick()
    assert not control.may_advance()
    assert control.step_refusal() == ""
    assert control.resume()
    assert control.step_refusal() == "refused: not paused; pause first"
    assert not control.resume(), "it was not paused"


def test_after_a_pause_an_open_tick_still_waits() -> None:
    control = tick_control(start_paused=True)
    control.open_tick(0.0)
    assert not control.resume()
    assert control.close_tick()


def test_a_tick_is_repeated_after_each_timeout_and_then_given_up() -> None:
    control = tick_control()
    assert not control.must_repeat(100.0, 0), "nothing is open"
    control.open_tick(10.0)
    times = [11.9, 12.0, 13.9, 14.1, 15.0, 16.2]
    assert [control.must_repeat(now, 7) for now in times] == [
        False,
        True,
        False,
        True,
        False,
        True,
    ]
    line = r"^tick 7: no goal_step of its stamp and cmd_vel though published 4 times, 2 s apart"
    with pytest.raises(GraphError, match=line):
        control.must_repeat(18.3, 7)


def test_a_command_ends_the_repetitions_and_the_next_tick_has_all_of_them() -> None:
    control = tick_control(answer_retries=1)
    for tick in range(3):
        start = 10.0 * tick
        control.open_tick(start)
        assert control.must_repeat(start + 2.0, tick)
        control.close_tick()
        assert not control.must_repeat(start + 9.0, tick)


def test_no_retries_at_all() -> None:
    control = tick_control(answer_retries=0)
    control.open_tick(0.0)
    with pytest.raises(GraphError, match="published 1 times"):
        control.must_repeat(2.0, 0)


def test_in_real_time_no_tick_is_open_and_no_command_advances_the_world() -> None:
    control = tick_control(lockstep=False)
    control.open_tick(0.0)
    assert not control.is_open
    assert not control.may_advance()
    assert not control.must_repeat(1e9, 0)
