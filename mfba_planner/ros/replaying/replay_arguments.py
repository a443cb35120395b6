# SPDX-License-Identifier: Apache-2.0
"""The command line of replay."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ...core.argument_parser import Parser
from ...core.errors import ConfigError
from ...core.option_specs import check, did_you_mean, option, walk

CLOCK_HZ = 40.0  # as `ros2 bag play --clock`

_EPILOG = """\
~/pause, ~/resume and ~/step (one message) are std_srvs/Trigger services.

With --as-fast-as-possible at most 5 messages of a topic are sent before all subscribed nodes
have acknowledged them and responded to a call of their parameter service, which an executor
serves only after the messages. So a reader whose history holds 10 (the default) loses nothing,
however slow it is; but what was recorded best effort is offered best effort. With --clock time
advances only when everything earlier has been read.

A latched message is read before any later one is published; at a fixed rate only where the
readers respond within 0.1 s.

With --loop the stamps go back at each restart: give --clock, and use_sim_time to the readers,
so that they notice. With --clock the bag's own /clock is not played.

--ros-args -r FROM:=TO and the like may follow.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySettings:
    """Settings of replay; topic names as given, not resolved yet."""

    bag: str
    rate: float = option(1.0, "bag seconds per second", minimum=0.001, maximum=1_000_000.0)
    loop: bool = option(False, "restart at the end, until stopped")
    start_offset: float = option(
        0.0, "skip this much; latched messages are still sent", unit="s", minimum=0.0
    )
    clock: float = option(
        0.0,
        f"rate of /clock ({CLOCK_HZ:g} without a number); 0: not at all",
        unit="Hz",
        minimum=0.0,
        maximum=1000.0,
    )
    start_paused: bool = option(False, "wait for ~/resume or ~/step")
    as_fast_as_possible: bool = option(False, "as fast as the readers can read, losing nothing")
    wait_timeout: float = option(
        10.0, "longest wait for subscribers, and for their responses", unit="s", minimum=0.0
    )
    topics: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    inputs_of: tuple[str, ...] = ()
    remap: tuple[tuple[str, str], ...] = ()
    # None: wait for no subscriber; (): see the help; otherwise one number, or topics
    wait_for_subscribers: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range, or two that exclude each other."""
        check(self)
        if self.as_fast_as_possible and self.rate != 1.0:
            raise ConfigError(
                f"rate={self.rate:g} with --as-fast-as-possible: one excludes the other; "
                "leave one out"
            )


def parse(args: list[str]) -> ReplaySettings:
    """Settings from a command line without ROS arguments. Raises ConfigError."""
    parser = Parser(
        prog="replay",
        description="Play a bag of this package, of rosbag2 or of ROS 1: a directory or a file.",
        epilog=_EPILOG,
    )
    parser.add_argument("bag", metavar="BAG", help="run or bag directory, or file")
    for name, default, item in walk(ReplaySettings(bag="")):
        flag, spec = "--" + name.replace("_", "-"), item.metadata["spec"]
        if isinstance(default, bool):
            parser.add_argument(flag, action="store_true", help=spec.doc)
            continue
        optional_value: dict[str, Any] = (
            {"nargs": "?", "const": CLOCK_HZ} if name == "clock" else {}
        )
        help_text = f"{spec.doc} (default {default:g})"
        parser.add_argument(
            flag,
            type=float,
            default=default,
            metavar=spec.unit.upper() or "R",
            help=help_text,
            **optional_value,
        )
    _add_lists(parser)
    values: dict[str, Any] = vars(parser.parse(args))
    values["remap"] = [_rule(text) for text in values["remap"]]
    for name, value in values.items():
        values[name] = tuple(value) if isinstance(value, list) else value
    return ReplaySettings(**values)


def _add_lists(parser: Parser) -> None:
    for flag, metavar, text in (
        ("--topics", "TOPIC", "play only these"),
        ("--exclude", "TOPIC", "do not play these"),
        ("--inputs-of", "NODE", "play only what these nodes of the graph read from others"),
        ("--remap", "FROM:=TO", "play topics under another name"),
    ):
        parser.add_argument(flag, nargs="+", default=[], metavar=metavar, help=text)
    parser.add_argument(
        "--wait-for-subscribers",
        nargs="*",
        metavar="N|TOPIC",
        help="start when each played topic has N subscribers, or each of these has one; without "
        "a value: when any has one, or with --inputs-of when each has one and the nodes' ~/ready "
        "succeeds (the default with --as-fast-as-possible)",
    )


def _rule(text: str) -> tuple[str, str]:
    old, separator, new = text.partition(":=")
    if not (old and separator and new):
        raise ConfigError(f"--remap {text}: not a rule; give FROM:=TO")
    return old, new


def known(names: Iterable[str], of: Iterable[str], what: str) -> list[str]:
    """The names, each of which must be among `of`; ConfigError with the nearest otherwise."""
    choice = sorted(of)
    chosen = list(names)
    for name in chosen:
        if name not in choice:
            raise ConfigError(f"{what} {name}: not there; {did_you_mean(name, choice)}")
    return chosen
