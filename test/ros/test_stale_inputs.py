# SPDX-License-Identifier: Apache-2.0
"""What a planner decides on in lockstep and in real time, stale and backward inputs included."""

import math

import pytest

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.ros.runtime.stale_inputs import Lockstep, Newest, Ready

HERE, THERE = Pose2D(1.0, 2.0), Pose2D(3.0, 4.0)
FREE = (math.inf,) * 12


def test_lockstep_answers_pairs_of_one_stamp() -> None:
    inputs = Lockstep()
    assert inputs.odom(1, HERE, 0.0) is None
    assert inputs.odom(2, THERE, 0.0) is None
    assert inputs.sectors(2, FREE, 99.0) == Ready(2, THERE, FREE, 0.0)
    for take in (inputs.odom, inputs.sectors):
        with pytest.raises(InputError, match="stamps must rise"):
            take(1, HERE, 0.0)  # type: ignore[operator]


def test_lockstep_takes_the_last_pair_once_more_when_both_parts_come_again() -> None:
    inputs = Lockstep()
    for _ in range(3):
        assert inputs.odom(2, THERE, 0.0) is None
        assert inputs.sectors(2, FREE, 99.0) == Ready(2, THERE, FREE, 0.0)


def test_a_refused_part_travels_as_its_reason() -> None:
    inputs = Lockstep()
    inputs.sectors(1, "sector 3 holds nan", 0.0)
    assert inputs.odom(1, HERE, 0.0) == Ready(1, HERE, "sector 3 holds nan", 0.0)


def test_real_time_answers_every_sectors_with_the_newest_odom_and_its_age() -> None:
    inputs = Newest()
    assert inputs.odom(10, HERE, 100.0) is None
    assert inputs.odom(11, THERE, 101.0) is None
    assert inputs.sectors(5, FREE, 101.5) == Ready(5, THERE, FREE, 0.5)
    assert inputs.sectors(6, FREE, 103.0) == Ready(6, THERE, FREE, 2.0)


def test_real_time_without_odom_says_so() -> None:
    assert Newest().sectors(5, FREE, 1e6) == Ready(5, "no odom yet", FREE, 0.0)


def test_real_time_refuses_sectors_that_do_not_rise_and_odom_that_goes_back() -> None:
    inputs = Newest()
    inputs.odom(10, HERE, 0.0)
    inputs.sectors(10, FREE, 0.0)
    for stamp in (10, 9, -1):
        with pytest.raises(InputError, match=f"sectors stamp {stamp} ns: not newer than 10 ns"):
            inputs.sectors(stamp, FREE, 1.0)
    with pytest.raises(InputError, match="odom stamp 9 ns: not newer than 10 ns; stamps must"):
        inputs.odom(9, THERE, 1.0)
    assert inputs.odom(10, THERE, 1.0) is None
    assert inputs.sectors(11, FREE, 1.0) == Ready(11, THERE, FREE, 1.0)


def test_the_same_stamp_once_more_does_not_make_odom_younger() -> None:
    """As a driver does that repeats its last message when its hardware has gone."""
    inputs = Newest()
    inputs.odom(10, HERE, 0.0)
    inputs.sectors(10, FREE, 0.0)
    inputs.odom(10, HERE, 5.0)
    assert inputs.stale(5.0, 1.0) == Ready(10, HERE, FREE, 5.0)


def test_a_negative_stamp_is_refused() -> None:
    for take in (Newest().odom, Newest().sectors, Lockstep().odom, Lockstep().sectors):
        with pytest.raises(InputError, match="stamp -1 ns"):
            take(-1, HERE, 0.0)  # type: ignore[operator]


def test_refused_messages_do_not_make_old_inputs_young() -> None:
    inputs = Newest()
    inputs.odom(10, HERE, 0.0)
    inputs.sectors(10, FREE, 0.0)
    with pytest.raises(InputError):
        inputs.sectors(10, FREE, 5.0)
    with pytest.raises(InputError):
        inputs.odom(3, HERE, 5.0)
    assert inputs.stale(5.0, 1.0) == Ready(10, HERE, FREE, 5.0)


def test_stale_is_the_older_of_the_two() -> None:
    inputs = Newest()
    assert inputs.stale(1e9, 1.0) is None, "before the first sectors there is nothing to stop"
    inputs.sectors(1, FREE, 10.0)
    assert inputs.stale(11.0, 1.0) is None
    assert inputs.stale(11.5, 1.0) == Ready(1, "no odom yet", FREE, 1.5)
    inputs.odom(1, HERE, 11.0)
    assert inputs.stale(11.25, 1.0) == Ready(1, HERE, FREE, 1.25)
    inputs.sectors(2, FREE, 11.5)
    assert inputs.stale(12.0, 1.0) is None
    assert inputs.stale(12.25, 1.0) == Ready(2, HERE, FREE, 1.25)
