# SPDX-License-Identifier: Apache-2.0
"""Which Twist belongs to which tick, with messages late, lost or sent twice."""

from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.ros.runtime.command_matching import CommandMatching


def test_a_twist_belongs_to_the_goal_step_before_it() -> None:
    matching = CommandMatching()
    matching.add_goal_step(7, sent_ns=10)
    assert matching.take(7) is None
    matching.add_cmd_vel("a", sent_ns=11)
    assert matching.take(8) is None
    assert matching.take(7) == "a"
    assert matching.take(7) is None, "it was taken"


def test_the_sequence_of_arrival_does_not_matter() -> None:
    matching = CommandMatching()
    matching.add_cmd_vel("a", sent_ns=11)
    assert matching.take(7) is None
    matching.add_goal_step(7, sent_ns=10)
    assert matching.take(7) == "a"


def test_a_twist_older_than_every_goal_step_is_dropped() -> None:
    matching = CommandMatching()
    matching.add_cmd_vel("of a planner that is gone", sent_ns=9)
    matching.add_goal_step(7, sent_ns=10)
    assert matching.take(7) is None
    matching.add_cmd_vel("a", sent_ns=11)
    assert matching.take(7) == "a"


def test_a_twist_that_was_taken_does_not_match_a_goal_step_of_its_nanosecond() -> None:
    matching = CommandMatching()
    matching.add_goal_step(7, sent_ns=10)
    matching.add_cmd_vel("seven", sent_ns=11)
    assert matching.take(7) == "seven"
    matching.add_goal_step(8, sent_ns=11)
    matching.add_cmd_vel("eight", sent_ns=12)
    assert matching.take(8) == "eight"


def test_a_second_twist_of_one_tick_does_not_match_the_next() -> None:
    matching = CommandMatching()
    for sent_ns in (10, 20):
        matching.add_goal_step(7, sent_ns)
        matching.add_cmd_vel("seven", sent_ns + 1)
    assert matching.take(7) == "seven"
    assert matching.take(8) is None
    matching.add_cmd_vel("eight", sent_ns=31)
    assert matching.take(8) is None, "its goal_step is not received yet"
    matching.add_goal_step(8, sent_ns=30)
    assert matching.take(8) == "eight"


DELIVERED = st.tuples(st.booleans(), st.booleans())  # whether goal_step, cmd_vel are delivered
ARRIVE = st.sampled_from(["goal_step", "cmd_vel"])


@given(st.lists(DELIVERED | ARRIVE, max_size=40))
def test_no_twist_is_matched_with_another_tick(events: list[tuple[bool, bool] | str]) -> None:
    """A planner commands the open tick any number of times; each topic keeps its sequence."""
    matching = CommandMatching()
    pending: dict[str, list[tuple[int, int]]] = {"goal_step": [], "cmd_vel": []}
    tick = 1
    for now, event in enumerate(events):
        if isinstance(event, tuple):
            for later, (queue, arrives) in enumerate(zip(pending.values(), event)):
                if arrives:
                    queue.append((tick, 10 * now + later))
        elif pending[event]:
            stamp, sent_ns = pending[event].pop(0)
            if event == "goal_step":
                matching.add_goal_step(stamp, sent_ns)
            else:
                matching.add_cmd_vel(stamp, sent_ns)
        taken = matching.take(tick)
        assert taken in (None, tick)
        tick += taken is not None
