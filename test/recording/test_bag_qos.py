# SPDX-License-Identifier: Apache-2.0
"""QoS profiles in rosbag2's YAML: round trip, comparison with rosbags, refused lists."""

from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded_bags import FOREIGN
from rosbags.rosbag2.metadata import dump_qos_v8, dump_qos_v9, parse_qos

from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_qos import (
    DURABILITY,
    HISTORY,
    INFINITE_NS,
    LIVELINESS,
    RELIABILITY,
    OfferedQos,
    from_list,
    to_list,
    to_text,
)

DURATIONS = st.one_of(st.just(INFINITE_NS), st.integers(0, INFINITE_NS))
PROFILES = st.builds(
    OfferedQos,
    history=st.sampled_from(HISTORY),
    depth=st.integers(0, 2**31),
    reliability=st.sampled_from(RELIABILITY),
    durability=st.sampled_from(DURABILITY),
    deadline_ns=DURATIONS,
    lifespan_ns=DURATIONS,
    liveliness=st.sampled_from(LIVELINESS),
    liveliness_lease_duration_ns=DURATIONS,
    avoid_ros_namespace_conventions=st.booleans(),
)


@given(st.lists(PROFILES, max_size=3).map(tuple))
def test_profiles_survive_list_and_text(profiles: tuple[OfferedQos, ...]) -> None:
    assert from_list(to_list(profiles)) == profiles
    assert from_list(to_text(profiles)) == profiles


@settings(max_examples=25)  # its YAML parser is slow
@given(st.lists(PROFILES, min_size=1, max_size=3).map(tuple))
def test_rosbags_reads_the_same_and_its_numbers_are_understood(
    profiles: tuple[OfferedQos, ...],
) -> None:
    theirs = parse_qos(to_text(profiles))
    assert [item.depth for item in theirs] == [item.depth for item in profiles]
    # Its enumerations lack manual_by_node and some best_available: these become unknown.
    for ours, back in zip(profiles, from_list(dump_qos_v9(theirs))):
        assert back.deadline_ns == ours.deadline_ns
        assert back.history == ours.history
        assert back.reliability in (ours.reliability, "unknown")
        assert back.durability in (ours.durability, "unknown")
    assert from_list(dump_qos_v8(theirs)) == from_list(dump_qos_v9(theirs))


def test_words_are_rosbag2s() -> None:
    theirs = yaml.safe_load((FOREIGN / "metadata.yaml").read_text())
    topics = theirs["rosbag2_bagfile_information"]["topics_with_message_count"]
    for topic in topics:
        recorded = topic["topic_metadata"]["offered_qos_profiles"]
        (offered,) = from_list(recorded)
        assert offered.deadline_ns == INFINITE_NS
        assert to_list([offered]) == recorded
        assert list(to_list([offered])[0]) == list(recorded[0])  # with the same sequence of keys


def test_more_than_the_longest_duration_is_infinite() -> None:
    item: dict[str, Any] = to_list([OfferedQos()])[0]
    item["lifespan"] = {"sec": 2**31 * 10**9, "nsec": 0}
    assert from_list([item])[0].lifespan_ns == INFINITE_NS


@pytest.mark.parametrize("nothing", [None, "", [], "[]"])
def test_no_profiles(nothing: object) -> None:
    assert from_list(nothing) == ()


@pytest.mark.parametrize(
    "broken",
    [
        5,
        "- history: [",
        [{}],
        ["keep_last"],
        [{**to_list([OfferedQos()])[0], "reliability": "rather"}],
        [{**to_list([OfferedQos()])[0], "history": 17}],
        [{**to_list([OfferedQos()])[0], "depth": "deep"}],
        [{**to_list([OfferedQos()])[0], "deadline": 3}],
    ],
)
def test_broken_lists_are_refused_in_one_line(broken: object) -> None:
    with pytest.raises(BagError, match="not a list of QoS profiles") as caught:
        from_list(broken)
    assert "\n" not in str(caught.value)
