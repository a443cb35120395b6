# SPDX-License-Identifier: Apache-2.0
"""Pairing of odom and sectors in lockstep and in real time, with stale and backward stamps."""

import math

import numpy as np
import pytest

from mfba_planner.core.errors import InputError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.lidar_extrinsics import CENTRED
from mfba_planner.core.planner_types import Scan
from mfba_planner.recording.scan_parts import MountedScan
from mfba_planner.ros.runtime.lockstep_inputs import Inputs, LockstepInputs
from mfba_planner.ros.runtime.stale_inputs import NewestInputs

POSE, OTHER_POSE = Pose2D(1.0, 2.0), Pose2D(3.0, 4.0)
FREE = (math.inf,) * 12
SCAN, NEXT_SCAN = (
    MountedScan(
        Scan(
            ranges_m=np.full(3, range_m), angle_min_rad=0.0, angle_increment_rad=1.0,
            range_min_m=0.1, range_max_m=9.0,
        ),
        CENTRED,
    )
    for range_m in (1.0, 2.0)
)  # fmt: skip


def test_lockstep_returns_pairs_of_one_stamp() -> None:
    inputs = LockstepInputs()
    assert inputs.add_odom(1, POSE, 0.0) is None
    assert inputs.add_odom(2, OTHER_POSE, 0.0) is None
    assert inputs.add_sectors(2, FREE, 99.0) == Inputs(2, OTHER_POSE, FREE, 0.0)
    for add in (inputs.add_odom, inputs.add_sectors):
        with pytest.raises(InputError, match="stamps must rise"):
            add(1, POSE, 0.0)  # type: ignore[operator]


def test_lockstep_returns_the_last_pair_again_when_both_messages_are_repeated() -> None:
    inputs = LockstepInputs()
    for _ in range(3):
        assert inputs.add_odom(2, OTHER_POSE, 0.0) is None
        assert inputs.add_sectors(2, FREE, 99.0) == Inputs(2, OTHER_POSE, FREE, 0.0)


def test_a_refused_message_is_its_reason() -> None:
    inputs = LockstepInputs()
    inputs.add_sectors(1, "sector 3 holds nan", 0.0)
    assert inputs.add_odom(1, POSE, 0.0) == Inputs(1, POSE, "sector 3 holds nan", 0.0)


def test_real_time_returns_every_sectors_with_the_newest_odom_and_its_age() -> None:
    inputs = NewestInputs()
    assert inputs.add_odom(10, POSE, 100.0) is None
    assert inputs.add_odom(11, OTHER_POSE, 101.0) is None
    assert inputs.add_sectors(5, FREE, 101.5) == Inputs(5, OTHER_POSE, FREE, 0.5)
    assert inputs.add_sectors(6, FREE, 103.0) == Inputs(6, OTHER_POSE, FREE, 2.0)


def test_real_time_without_odom_returns_the_reason() -> None:
    assert NewestInputs().add_sectors(5, FREE, 1e6) == Inputs(5, "no odom yet", FREE, 0.0)


def test_real_time_refuses_sectors_that_do_not_rise_and_odom_that_goes_back() -> None:
    inputs = NewestInputs()
    inputs.add_odom(10, POSE, 0.0)
    inputs.add_sectors(10, FREE, 0.0)
    for stamp in (10, 9, -1):
        with pytest.raises(InputError, match=f"sectors stamp {stamp} ns: not newer than 10 ns"):
            inputs.add_sectors(stamp, FREE, 1.0)
    with pytest.raises(InputError, match="odom stamp 9 ns: not newer than 10 ns; stamps must"):
        inputs.add_odom(9, OTHER_POSE, 1.0)
    assert inputs.add_odom(10, OTHER_POSE, 1.0) is None
    assert inputs.add_sectors(11, FREE, 1.0) == Inputs(11, OTHER_POSE, FREE, 1.0)


def test_the_same_stamp_once_more_does_not_make_odom_younger() -> None:
    """As from a driver that repeats its last message after its hardware has failed."""
    inputs = NewestInputs()
    inputs.add_odom(10, POSE, 0.0)
    inputs.add_sectors(10, FREE, 0.0)
    inputs.add_odom(10, POSE, 5.0)
    assert inputs.stale(5.0, 1.0) == Inputs(10, POSE, FREE, 5.0)


def test_a_negative_stamp_is_refused() -> None:
    for add in (
        NewestInputs().add_odom,
        NewestInputs().add_sectors,
        LockstepInputs().add_odom,
        LockstepInputs().add_sectors,
    ):
        with pytest.raises(InputError, match="stamp -1 ns"):
            add(-1, POSE, 0.0)  # type: ignore[operator]


def test_refused_messages_do_not_make_old_inputs_young() -> None:
    inputs = NewestInputs()
    inputs.add_odom(10, POSE, 0.0)
    inputs.add_sectors(10, FREE, 0.0)
    with pytest.raises(InputError):
        inputs.add_sectors(10, FREE, 5.0)
    with pytest.raises(InputError):
        inputs.add_odom(3, POSE, 5.0)
    assert inputs.stale(5.0, 1.0) == Inputs(10, POSE, FREE, 5.0)


def test_stale_is_the_older_of_the_two() -> None:
    inputs = NewestInputs()
    assert inputs.stale(1e9, 1.0) is None, "before the first sectors there is nothing to stop"
    inputs.add_sectors(1, FREE, 10.0)
    assert inputs.stale(11.0, 1.0) is None
    assert inputs.stale(11.5, 1.0) == Inputs(1, "no odom yet", FREE, 1.5)
    inputs.add_odom(1, POSE, 11.0)
    assert inputs.stale(11.25, 1.0) == Inputs(1, POSE, FREE, 1.25)
    inputs.add_sectors(2, FREE, 11.5)
    assert inputs.stale(12.0, 1.0) is None
    assert inputs.stale(12.25, 1.0) == Inputs(2, POSE, FREE, 1.25)


@pytest.mark.parametrize("inputs", [LockstepInputs(), NewestInputs()], ids=["lockstep", "newest"])
def test_sectors_come_with_their_own_scan(inputs: LockstepInputs | NewestInputs) -> None:
    found = []
    for stamp, scan in ((1, SCAN), (2, NEXT_SCAN), (3, None)):
        inputs.add_odom(stamp, POSE, 0.0)
        found.append(inputs.add_sectors(stamp, FREE, 0.0, scan))
    assert [each.scan for each in found if each] == [SCAN, NEXT_SCAN, None]


def test_stale_inputs_keep_their_scan() -> None:
    inputs = NewestInputs()
    inputs.add_odom(1, POSE, 0.0)
    inputs.add_sectors(1, FREE, 0.0, SCAN)
    stale = inputs.stale(now_s=9.0, timeout_s=1.0)
    assert stale is not None
    assert stale.scan is SCAN


@pytest.mark.parametrize("name", ["odom", "sectors"])
def test_a_refused_stamp_leaves_its_reason_and_no_trace_in_the_sequence(name: str) -> None:
    inputs = NewestInputs()
    inputs.add_odom(1, POSE, 0.0)
    inputs.add_sectors(1, FREE, 0.0, SCAN)
    inputs.refuse(name, "too late")
    stale = inputs.stale(now_s=9.0, timeout_s=1.0)
    assert stale is not None
    assert (stale.pose, stale.ranges_m) == (
        ("too late", FREE) if name == "odom" else (POSE, "too late")
    )
    assert (stale.scan is None) == (name == "sectors")
    inputs.add_odom(2, OTHER_POSE, 9.0)
    assert inputs.add_sectors(2, FREE, 9.0, SCAN) == Inputs(2, OTHER_POSE, FREE, 0.0, SCAN)
