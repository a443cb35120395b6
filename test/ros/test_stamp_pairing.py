# SPDX-License-Identifier: Apache-2.0
"""Two topics joined by stamp, in any sequence of arrival."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test

from mfba_planner.core.errors import InputError
from mfba_planner.ros.runtime import stamp_pairing
from mfba_planner.ros.runtime.stamp_pairing import StampPairs

Pairs = StampPairs[str, str]


@st.composite
def interleavings(draw: st.DrawFn) -> list[tuple[str, int]]:
    """Two topics with rising stamps, interleaved at random."""
    both = sorted(draw(st.sets(st.integers(0, 10_000), max_size=12)))
    sides = draw(st.lists(st.booleans(), min_size=2 * len(both), max_size=2 * len(both)))
    waiting = {"a": iter(both), "b": iter(both)}
    mixed = []
    for side in ["a" if is_a else "b" for is_a in sides] + ["a", "b"] * len(both):
        stamp = next(waiting[side], None)
        if stamp is not None:
            mixed.append((side, stamp))
    return mixed


def add(pairs: Pairs, side: str, stamp_ns: int) -> tuple[str, str] | None:
    take = pairs.add_a if side == "a" else pairs.add_b
    return take(stamp_ns, f"{side}{stamp_ns}")


@given(interleavings())
def test_every_stamp_is_paired_exactly_once_and_in_sequence(mixed: list[tuple[str, int]]) -> None:
    pairs = Pairs()
    pairs_found = [pair for side, stamp in mixed if (pair := add(pairs, side, stamp))]
    stamps = sorted({stamp for _, stamp in mixed})
    assert pairs_found == [(f"a{stamp}", f"b{stamp}") for stamp in stamps]
    assert not pairs._a
    assert not pairs._b


@given(interleavings(), st.sets(st.integers(0, 10_000)))
def test_a_lost_message_delays_no_other_pair(mixed: list[tuple[str, int]], lost: set[int]) -> None:
    pairs = Pairs()
    arrived = [(side, stamp) for side, stamp in mixed if side == "a" or stamp not in lost]
    pairs_found = [pair for side, stamp in arrived if (pair := add(pairs, side, stamp))]
    stamps = sorted({stamp for _, stamp in mixed} - lost)
    assert pairs_found == [(f"a{stamp}", f"b{stamp}") for stamp in stamps]


@pytest.mark.parametrize("repeat", [False, True])
@pytest.mark.parametrize("side", ["a", "b"])
def test_a_stamp_that_goes_back_is_refused(side: str, repeat: bool) -> None:
    pairs = Pairs(repeat=repeat)
    add(pairs, "a", 10)
    assert add(pairs, "b", 10) == ("a10", "b10")
    for old in (9, 0, -1):
        with pytest.raises(InputError, match=rf"^stamp {old} ns: not newer than 10 ns"):
            add(pairs, side, old)
    assert add(pairs, side, 11) is None


@pytest.mark.parametrize("side", ["a", "b"])
def test_a_repeated_stamp_is_refused(side: str) -> None:
    pairs = Pairs()
    add(pairs, "a", 10)
    add(pairs, "b", 10)
    with pytest.raises(
        InputError, match="not newer than 10 ns, answered before; stamps must rise"
    ):
        add(pairs, side, 10)


def test_with_repeat_a_pair_is_returned_again_when_both_messages_are_repeated() -> None:
    pairs = Pairs(repeat=True)
    pairs_found = [add(pairs, side, stamp) for side, stamp in zip("abbaab", [7] * 6)]
    assert pairs_found == [None, ("a7", "b7"), None, ("a7", "b7"), None, ("a7", "b7")]
    assert add(pairs, "a", 8) is None
    assert add(pairs, "b", 8) == ("a8", "b8")
    with pytest.raises(InputError):
        add(pairs, "a", 7)


def test_the_newest_of_two_messages_with_one_stamp_counts() -> None:
    pairs = Pairs()
    pairs.add_a(5, "old")
    pairs.add_a(5, "new")
    assert pairs.add_b(5, "b5") == ("new", "b5")


class BoundedMemory(RuleBasedStateMachine):
    """Any stamps at all, on either side: memory stays bounded, paired stamps only rise."""

    def __init__(self) -> None:
        super().__init__()
        self.pairs = Pairs()
        self.paired_ns = -1

    @rule(side=st.sampled_from("ab"), stamp=st.integers(-5, 200))
    def message(self, side: str, stamp: int) -> None:
        try:
            pair = add(self.pairs, side, stamp)
        except InputError:
            assert stamp <= self.paired_ns
            return
        if pair:
            assert stamp > self.paired_ns
            self.paired_ns = stamp

    @invariant()
    def nothing_piles_up(self) -> None:
        limit = stamp_pairing.WAITING_LIMIT
        assert len(self.pairs._a) <= limit
        assert len(self.pairs._b) <= limit


def test_memory_is_bounded_for_any_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stamp_pairing, "WAITING_LIMIT", 4)
    run_state_machine_as_test(
        BoundedMemory, settings=settings(max_examples=30, stateful_step_count=40)
    )


def test_a_topic_without_partner_drops_its_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stamp_pairing, "WAITING_LIMIT", 3)
    pairs = Pairs()
    for stamp in range(10):
        assert add(pairs, "a", stamp) is None
    assert add(pairs, "b", 6) is None
    assert add(pairs, "b", 7) == ("a7", "b7")


def test_the_limit_of_waiting_messages_may_be_given() -> None:
    pairs = StampPairs[str, str](limit=2)
    for stamp in range(5):
        add(pairs, "a", stamp)
    assert add(pairs, "b", 2) is None
    assert add(pairs, "b", 3) == ("a3", "b3")
