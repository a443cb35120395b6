# SPDX-License-Identifier: Apache-2.0
"""The robot's base: drive and limits, as planner, command conversion and simulation use them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from .option_specs import check, option


class Drive(Enum):
    """How a base moves: in any direction at once (the paper), or as a unicycle."""

    OMNIDIRECTIONAL = "omnidirectional"
    DIFFERENTIAL = "differential"


@dataclass(frozen=True, slots=True, kw_only=True)
class Base:
    """The robot's base; limits of a differential drive, Nav2's defaults where it has any."""

    drive: Drive = option(Drive.OMNIDIRECTIONAL, "omnidirectional (the paper), or differential")
    max_speed_mps: float = option(
        1.0, "differential: highest speed", unit="m/s", minimum=0.01, maximum=100.0
    )
    max_turn_radps: float = option(
        2.84, "differential: highest rate of turn", unit="rad/s", minimum=0.01, maximum=100.0
    )
    max_accel_mps2: float = option(
        2.5, "differential: highest acceleration", unit="m/s^2", minimum=0.01, maximum=1000.0
    )
    max_turn_accel_radps2: float = option(
        3.2, "differential: highest change of turn", unit="rad/s^2", minimum=0.01, maximum=1000.0
    )
    turn_first_rad: float = option(
        0.8, "differential: heading error from which it turns in place", unit="rad",
        minimum=0.05, maximum=1.5,
    )  # fmt: skip
    reverse: bool = option(True, "differential: drives backwards where that is less of a turn")

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)

    @property
    def turns(self) -> bool:
        """Whether the base has to turn to drive elsewhere: a differential drive."""
        return self.drive is Drive.DIFFERENTIAL
