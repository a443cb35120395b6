# SPDX-License-Identifier: Apache-2.0
"""Options of the local map."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.option_specs import check, option


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticMapParams:
    """Size of the rolling window, and what is marked and cleared."""

    cell_m: float = option(
        0.05, "side of a cell; each holds at most one point", unit="m", minimum=0.01, maximum=1.0
    )
    size_m: float = option(
        20.0, "side of the square kept around the robot", unit="m", minimum=2.0, maximum=100.0
    )
    spacing_m: float = option(
        0.12, "where neighbouring beams are farther apart nothing is marked or cleared",
        unit="m", minimum=0.01, maximum=10.0,
    )  # fmt: skip
    margin_m: float = option(
        0.03, "a point is cleared if the beams beside it end so much behind it, beside noise",
        unit="m", minimum=0.0, maximum=1.0,
    )  # fmt: skip
    scans: int = option(
        2, "scans in a row that must see through a point to clear it", minimum=1, maximum=100
    )
    moving_mps: float = option(
        0.08, "tracks that are slower are marked", unit="m/s", minimum=0.0, maximum=10.0
    )
    settle_s: float = option(
        0.4, "time after a motion before what is there is marked", unit="s", minimum=0.0,
        maximum=60.0,
    )  # fmt: skip
    establish_s: float = option(
        0.8, "time after which a point counts for the way to the goal; what creeps never does",
        unit="s", minimum=0.0, maximum=60.0,
    )  # fmt: skip
    widest_m: float = option(
        0.8, "distances are given up to so much", unit="m", minimum=0.05, maximum=10.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
