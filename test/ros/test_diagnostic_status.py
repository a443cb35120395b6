# SPDX-License-Identifier: Apache-2.0
"""Input health, goal queue and command timeout, without ROS."""

import pytest

from mfba_planner.planning.recovery import Phase
from mfba_planner.ros.interface.diagnostic_status import (
    InputHealth,
    InputRate,
    Level,
    driving_status,
)
from mfba_planner.ros.node_settings import WorldSimSettings
from mfba_planner.ros.runtime.command_timeout import CommandTimeout
from mfba_planner.ros.runtime.goal_queue import GoalQueue
from mfba_planner.ros.runtime.stale_inputs import watch_period_s


def test_a_rate_is_that_of_the_last_messages_and_falls_without_any() -> None:
    rate = InputRate()
    assert (rate.age_s(5.0), rate.rate_hz(5.0)) == (None, 0.0)
    for k in range(100):
        rate.add(k, 0.1 * k)
    assert round(rate.rate_hz(9.9), 6) == 10.0
    assert round(rate.age_s(10.9) or 0.0, 6) == 1.0
    assert 6.0 < rate.rate_hz(10.9) < 7.0
    rate.add(99, 11.0)
    assert rate.age_s(11.0) is not None, "the same stamp does not count"
    assert round(rate.age_s(11.0) or 0.0, 6) == 1.1


def test_inputs_are_sound_stale_or_refused() -> None:
    health = InputHealth(("odom", "sectors"))
    assert health.status(0.0, 1.0, {}).level is Level.STALE
    health.received("odom", 1, 0.0)
    health.received("sectors", 1, 0.5)
    sound = health.status(1.0, 1.0, {})
    assert (sound.level, sound.message) == (Level.OK, "odom and sectors are sound")
    stale = health.status(1.25, 1.0, {})
    assert stale.message == "odom stale for 1.25 s (input_timeout_s=1)"
    health.set_fault("odom", "odom is in frame")
    refused = health.status(1.25, 1.0, {"odom: frame": 2, "odom: value": 3})
    assert refused.level is Level.ERROR
    assert refused.message.startswith("refused: odom is in frame; odom stale for")
    assert refused.values["refused"] == "5"
    assert refused.values["refused odom: frame"] == "2"


def test_a_note_is_a_warning_unless_something_is_worse() -> None:
    health = InputHealth(("odom",))
    health.received("odom", 1, 0.0)
    status = health.status(0.0, 1.0, {}, "the clock is another", {"odom: dropped": "3"})
    assert (status.level, status.message) == (
        Level.WARN,
        "odom are sound, but the clock is another",
    )
    assert status.values["odom: dropped"] == "3"
    assert health.status(9.0, 1.0, {}, "the clock is another").level is Level.STALE


def test_the_figures_of_a_fault_are_no_change_of_it() -> None:
    health = InputHealth(("odom",))
    kinds = set()
    for fault in ("odom is 1.25 s late", "odom is 31.5 s late"):
        health.set_fault("odom", fault)
        kinds.add(health.kinds_of_fault)
    assert len(kinds) == 1


def test_a_planner_that_is_not_active_is_ok() -> None:
    status = driving_status(None, Phase.FREE, "inactive", {})
    assert (status.level, status.message) == (Level.OK, "inactive: commands nothing")


A, B, C = (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)


def test_goals_are_visited_in_sequence() -> None:
    goal_queue = GoalQueue()
    assert (goal_queue.goal, goal_queue.goal_index) == (None, "")
    assert goal_queue.set_goals((A, B, C), finished=False)
    assert (goal_queue.goal, goal_queue.goal_index, goal_queue.goal_id) == (A, "1 of 3", 1)
    assert goal_queue.advance((0.5, 0.0), 0.1) == 0
    assert goal_queue.advance((0.95, 0.0), 0.1) == 1
    assert (goal_queue.goal, goal_queue.goal_index, goal_queue.goal_id) == (B, "2 of 3", 1)
    assert goal_queue.advance(B, 0.1) == 1
    assert goal_queue.advance(C, 0.1) == 0, "the planner itself decides on the last one"
    assert goal_queue.goal == C


def test_goals_at_one_position_are_reached_together() -> None:
    goal_queue = GoalQueue()
    goal_queue.set_goals((A, A, A, B), finished=False)
    assert goal_queue.advance(A, 0.1) == 3


def test_the_same_goals_again_are_ignored_unless_finished() -> None:
    goal_queue = GoalQueue()
    goal_queue.set_goals((A, B), finished=False)
    goal_queue.advance(A, 0.1)
    assert not goal_queue.set_goals((A, B), finished=False)
    assert (goal_queue.goal, goal_queue.goal_id) == (B, 1)
    assert goal_queue.set_goals((A, B), finished=True)
    assert (goal_queue.goal, goal_queue.goal_id) == (A, 2)
    assert goal_queue.set_goals((B,), finished=False)
    assert goal_queue.goal_index == "1 of 1"


def test_after_cancel_there_is_no_goal_and_the_same_may_be_set_again() -> None:
    goal_queue = GoalQueue()
    assert goal_queue.cancel() is None
    goal_queue.set_goals((A,), finished=False)
    assert goal_queue.cancel() == A
    assert (goal_queue.goal, goal_queue.goal_id) == (None, 2)
    assert goal_queue.cancel() is None
    assert goal_queue.set_goals((A,), finished=False)


def test_a_twist_holds_for_the_timeout_but_never_less_than_its_tick() -> None:
    def holds(timeout_s: float, after_s: float, tick_s: float = 0.1, factor: float = 1.0) -> bool:
        command_timeout = CommandTimeout(
            WorldSimSettings(
                cmd_vel_timeout_s=timeout_s, tick_ns=round(tick_s * 1e9), speed_factor=factor
            )
        )
        command_timeout.received(100.0)
        return not command_timeout.has_expired(100.0 + after_s)

    assert holds(0.5, 0.49)
    assert not holds(0.5, 0.51)
    assert holds(0.01, 0.12)
    assert not holds(0.01, 0.13)
    assert holds(0.5, 10.0, factor=0.01), "a tick lasts 10 s in such slow motion"
    assert holds(0.0, 1e6), "0: never"


@pytest.mark.parametrize(
    ("timeout_s", "period_s"), [(0.25, 0.0625), (1.0, 0.25), (60.0, 0.25), (0.001, 0.02)]
)
def test_stale_inputs_are_checked_several_times_per_timeout(
    timeout_s: float, period_s: float
) -> None:
    assert watch_period_s(timeout_s, lockstep=False) == period_s
    assert watch_period_s(timeout_s, lockstep=True) == 0.5
