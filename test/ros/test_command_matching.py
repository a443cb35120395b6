# SPDX-License-Identifier: Apache-2.0
"""Which Twist answers which tick, whatever is late, lost or said twice."""

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


def test_order_of_arrival_does_not_matter() -> None:
    matching = CommandMatching()
    matching.add_cmd_vel("a", sent_ns=11)
    assert matching.take(7) is None
    matching.add_goal_step(7, sent_ns=10)
    assert matching.take(7) == "a"


def test_a_twist_older_than_every_goal_step_is_nobodys() -> None:
    matching = CommandMatching()
    matching.add_cmd_vel("of a planner that is gone", sent_ns=9)
    matching.add_goal_step(7, sent_ns=10)
    assert matching.take(7) is None
    matching.add_cmd_vel("a", sent_ns=11)
    assert matching.take(7) == "a"


def test_a_twist_that_was_taken_answers_nothing_sent_in_its_nanosecond() -> None:
    matching = CommandMatching()
    matching.add_goal_step(7, sent_ns=10)
    matching.add_cmd_vel("seven", sent_ns=11)
    assert matching.take(7) == "seven"
    matching.add_goal_step(8, sent_ns=11)
    matching.add_cmd_vel("eight", sent_ns=12)
    assert matching.take(8) == "eight"


def test_a_second_answer_to_one_tick_is_none_to_the_next() -> None:
    matching = CommandMatching()
    for sent_ns in (10, 20):
        matching.add_goal_step(7, sent_ns)
        matching.add_cmd_vel("seven", sent_ns + 1)
    assert matching.take(7) == "seven"
    assert matching.take(8) is None
    matching.add_cmd_vel("eight", sent_ns=31)
    assert matching.take(8) is None, "its goal_step is still under way"
    matching.add_goal_step(8, sent_ns=30)
    assert matching.take(8) == "eight"


ANSWER = st.tuples(st.booleans(), st.booleans())  # whether goal_step, cmd_vel get through
ARRIVE = st.sampled_from(["goal_step", "cmd_vel"])


@given(st.lists(ANSWER | ARRIVE, max_size=40))
def test_no_twist_is_ever_taken_for_another_ticks(events: list[tuple[bool, bool] | str]) -> None:
    """A planner answers the open tick any number of times; each topic keeps its own order."""
    matching = CommandMatching()
    pending: dict[str, list[tuple[int, int]]] = {"goal_step": [], "cmd_vel": []}
    tick = 1
    for now, event in enumerate(events):
        if isinstance(event, tuple):
            for later, (queue, arrives) in enumerate(zip(pending.values(), event)):
                if arrives:
                    queue.append((tick, 10 * now + later))
        elif pending[event]:
            about, sent_ns = pending[event].pop(0)
            if event == "goal_step":
                matching.add_goal_step(about, sent_ns)
            else:
                matching.add_cmd_vel(about, sent_ns)
        answer = matching.take(tick)
        assert answer in (None, tick)
        tick += answer is not None
