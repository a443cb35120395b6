# SPDX-License-Identifier: Apache-2.0
"""Which Twist answers which tick, whatever is late, lost or said twice."""

from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.ros.runtime.command_matching import CommandMatching


def test_a_twist_belongs_to_the_goal_step_before_it() -> None:
    heard = CommandMatching()
    heard.goal_step(7, sent_ns=10)
    assert heard.take(7) is None
    heard.cmd_vel("a", sent_ns=11)
    assert heard.take(8) is None
    assert heard.take(7) == "a"
    assert heard.take(7) is None, "it was taken"


def test_order_of_arrival_does_not_matter() -> None:
    heard = CommandMatching()
    heard.cmd_vel("a", sent_ns=11)
    assert heard.take(7) is None
    heard.goal_step(7, sent_ns=10)
    assert heard.take(7) == "a"


def test_a_twist_older_than_every_goal_step_is_nobodys() -> None:
    heard = CommandMatching()
    heard.cmd_vel("of a planner that is gone", sent_ns=9)
    heard.goal_step(7, sent_ns=10)
    assert heard.take(7) is None
    heard.cmd_vel("a", sent_ns=11)
    assert heard.take(7) == "a"


def test_a_twist_that_was_taken_answers_nothing_sent_in_its_nanosecond() -> None:
    heard = CommandMatching()
    heard.goal_step(7, sent_ns=10)
    heard.cmd_vel("seven", sent_ns=11)
    assert heard.take(7) == "seven"
    heard.goal_step(8, sent_ns=11)
    heard.cmd_vel("eight", sent_ns=12)
    assert heard.take(8) == "eight"


def test_a_second_answer_to_one_tick_is_none_to_the_next() -> None:
    heard = CommandMatching()
    for sent_ns in (10, 20):
        heard.goal_step(7, sent_ns)
        heard.cmd_vel("seven", sent_ns + 1)
    assert heard.take(7) == "seven"
    assert heard.take(8) is None
    heard.cmd_vel("eight", sent_ns=31)
    assert heard.take(8) is None, "its goal_step is still under way"
    heard.goal_step(8, sent_ns=30)
    assert heard.take(8) == "eight"


ANSWER = st.tuples(st.booleans(), st.booleans())  # whether goal_step, cmd_vel get through
ARRIVE = st.sampled_from(["goal_step", "cmd_vel"])


@given(st.lists(ANSWER | ARRIVE, max_size=40))
def test_no_twist_is_ever_taken_for_another_ticks(events: list[tuple[bool, bool] | str]) -> None:
    """A planner answers the open tick any number of times; each topic keeps its own order."""
    heard = CommandMatching()
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
                heard.goal_step(about, sent_ns)
            else:
                heard.cmd_vel(about, sent_ns)
        answer = heard.take(tick)
        assert answer in (None, tick)
        tick += answer is not None
