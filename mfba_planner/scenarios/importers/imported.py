# SPDX-License-Identifier: Apache-2.0
"""What an importer is given and what it returns; checks that all of them need."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from ...core.errors import ConfigError
from ...core.geometry import Point
from ...core.option_specs import check, option, require_range

Plain = dict[str, Any]  # a scenario as plain data, as a YAML file holds it
MOST_OBSTACLES = 5000
DIGITS = 6  # of metres and seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """What files do not say. None: the value that the format's authors use, if there is one."""

    start_m: Point | None = None
    goal_m: Point | None = None
    robot_radius_m: float | None = None
    time_limit_s: float | None = None
    person_radius_m: float = option(
        0.3, "radius of a recorded person", unit="m", minimum=0.01, maximum=10.0
    )
    fps: float = option(
        25.0, "frames per second of ETH/UCY frame numbers", unit="1/s", minimum=0.01, maximum=1e4
    )
    count: int = option(10, "crossings per recording", minimum=1, maximum=100_000)
    every_s: float = option(
        0.0, "one crossing every so many seconds of the recording; 0: at drawn moments",
        unit="s", minimum=0.0, maximum=1e6,
    )  # fmt: skip
    speed_mps: float = option(
        1.0, "speed of the robot, at which a crossing is made to meet people", unit="m/s",
        minimum=0.01, maximum=100.0,
    )  # fmt: skip
    seed: int = option(0, "seed of drawn crossings", minimum=0, maximum=2**31 - 1)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
        for name in ("robot_radius_m", "time_limit_s"):
            value = getattr(self, name)
            if value is not None:
                require_range(name, value, 0, 100_000, name.rpartition("_")[2], above=True)
        for name in ("start_m", "goal_m"):
            value = getattr(self, name)
            if value is not None and not all(map(math.isfinite, value)):
                raise ConfigError(f"{name}={list(value)}: not finite; give two numbers in metres")


class Source(NamedTuple):
    """A file: its text, a name for its scenario, and its folder, where it may name others."""

    text: str
    name: str
    folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """Scenarios of one file, and one line for each kind of thing in it that is lost."""

    scenarios: list[Plain]
    lost: list[str] = field(default_factory=list)


def static_shapes(
    boxes: list[Plain],
    polygons: list[list[list[float]]] | None = None,
    segments: list[list[float]] | None = None,
) -> Plain:
    """The keys of a scenario for what stands and is no circle; those that are used."""
    shapes = {"boxes": boxes, "polygons_m": polygons, "segments_m": segments}
    return {key: given for key, given in shapes.items() if given}


def rounded(*values: float) -> list[float]:
    """Numbers as written into a scenario file; -0.0 becomes 0.0."""
    return [round(value, DIGITS) + 0.0 for value in values]


def check_count(what: str, count: int) -> None:
    """Raise ConfigError for more obstacles than a scenario may hold."""
    if count > MOST_OBSTACLES:
        raise ConfigError(
            f"{count} {what}: more than {MOST_OBSTACLES}; take a part of the file, or a map"
        )


def number(value: object, what: str) -> float:
    """The finite number that a value spells. Raises ConfigError, naming what it is."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise ConfigError(f"{what}={str(value)[:40]!r}: not a number; mend the file") from None
    if not math.isfinite(found):
        raise ConfigError(f"{what}={found}: not finite; mend the file")
    return found


def numbers(value: object, count: int, what: str) -> list[float]:
    """At least count finite numbers from a list; the first ones. Raises ConfigError."""
    if not isinstance(value, list | tuple) or len(value) < count:
        raise ConfigError(f"{what}={str(value)[:40]!r}: give a list of {count} numbers")
    return [number(entry, what) for entry in value[:count]]
