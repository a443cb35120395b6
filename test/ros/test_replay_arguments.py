# SPDX-License-Identifier: Apache-2.0
"""replay's command line: the settings it gives, and what is refused in one line."""

import pytest

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.ros_arguments import split_ros_args
from mfba_planner.ros.replaying.replay_arguments import (
    CLOCK_HZ,
    ReplaySettings,
    parse,
)


def test_every_option_is_parsed() -> None:
    line = (
        "bag --rate 2 --loop --start-offset 1.5 --clock --start-paused --wait-timeout 3"
        " --topics a b --exclude c --inputs-of planner --remap a:=d b:=/e"
        " --wait-for-subscribers a"
    )
    assert parse(line.split()) == ReplaySettings(
        bag="bag",
        rate=2.0,
        loop=True,
        start_offset=1.5,
        clock=CLOCK_HZ,
        start_paused=True,
        wait_timeout=3.0,
        topics=("a", "b"),
        exclude=("c",),
        inputs_of=("planner",),
        remap=(("a", "d"), ("b", "/e")),
        wait_for_subscribers=("a",),
    )


def test_the_defaults_are_those_of_the_settings() -> None:
    assert parse(["bag"]) == ReplaySettings(bag="bag")
    assert parse(["bag", "--wait-for-subscribers"]).wait_for_subscribers == ()
    assert parse(["bag", "--clock", "100"]).clock == 100.0
    assert parse(["bag", "--as-fast-as-possible"]).as_fast_as_possible


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("", "the following arguments are required: BAG; see `replay --help`"),
        ("bag --rate 0", "rate=0.0: out of range"),
        ("bag --rate -1", "rate=-1.0: out of range"),
        ("bag --rate nan", "rate=nan: not finite"),
        ("bag --rate inf", "rate=inf: not finite"),
        ("bag --rate fast", "--rate: invalid float value: 'fast'; see `replay --help`"),
        ("bag --start-offset -1", "start_offset=-1.0: out of range"),
        ("bag --start-offset nan", "start_offset=nan: not finite"),
        ("bag --clock -5", "clock=-5.0: out of range"),
        ("bag --wait-timeout -1", "wait_timeout=-1.0: out of range"),
        ("bag --looop", "--looop: unknown argument; did you mean '--loop'?"),
        ("bag other", "other: unknown argument"),
        ("bag --remap a", "--remap a: not a rule; give FROM:=TO"),
        ("bag --remap :=b", "--remap :=b: not a rule"),
        ("bag --remap", "--remap: expected at least one argument"),
        ("bag --as-fast-as-possible --rate 2", "rate=2 with --as-fast-as-possible: one excludes"),
    ],
)
def test_mistakes_are_reported_in_one_line(line: str, text: str) -> None:
    with pytest.raises(ConfigError) as error:
        parse(line.split())
    assert str(error.value).startswith(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("line", "own", "for_ros"),
    [
        ("bag --remap a:=b", "bag --remap a:=b", ""),
        ("bag --ros-args -r a:=b", "bag", "--ros-args -r a:=b"),
        ("--ros-args -r a:=b -- bag", "bag", "--ros-args -r a:=b --"),
        (
            "bag --ros-args -r x:=y -- --loop --ros-args -p z:=1",
            "bag --loop",
            "--ros-args -r x:=y -- --ros-args -p z:=1",
        ),
    ],
)
def test_ros_gets_its_own_arguments_only(line: str, own: str, for_ros: str) -> None:
    assert split_ros_args(line.split()) == (own.split(), for_ros.split())
