# SPDX-License-Identifier: Apache-2.0
"""Options of the obstacle tracker."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.option_specs import check, option


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingParams:
    """Noise of the sensor, prior of a new obstacle, and limits of association and output.

    No size is assumed: the prior of the radius is wide, and a scan shows the width itself.
    """

    radius_m: float = option(
        0.25, "expected radius of a new obstacle", unit="m", minimum=0.01, maximum=10.0
    )
    radius_sd_m: float = option(
        0.25, "standard deviation of the radius", unit="m", minimum=1e-6, maximum=10.0
    )
    speed_sd_mps: float = option(
        1.0, "standard deviation of a new obstacle's velocity, per axis", unit="m/s", minimum=1e-3,
        maximum=100.0,
    )  # fmt: skip
    range_sd_m: float = option(
        0.005, "least standard deviation of a range", unit="m", minimum=1e-4, maximum=10.0
    )
    acceleration_sd: float = option(
        0.05,
        "white-noise acceleration of an obstacle at rest",
        unit="m/s^1.5",
        minimum=0.0,
        maximum=100.0,
    )
    gate_m: float = option(
        0.2, "largest distance of returns from their prediction, beside its uncertainty", unit="m",
        minimum=0.01, maximum=10.0,
    )  # fmt: skip
    join_m: float = option(
        0.15,
        "least distance of neighbouring returns at which a segment is cut",
        unit="m",
        minimum=0.01,
        maximum=10.0,
    )
    hump_m: float = option(
        0.02, "height of a hump of the ranges that cuts a segment", unit="m", minimum=1e-3,
        maximum=10.0,
    )  # fmt: skip
    widest_m: float = option(
        1.3, "radius above which a segment is a wall", unit="m", minimum=0.01, maximum=100.0
    )
    position_sd_factor: float = option(
        1.0,
        "standard deviations of the centre by which a circle is enlarged",
        minimum=0.0,
        maximum=10.0,
    )
    speed_sd_factor_s: float = option(
        0.1, "time for which the velocity's standard deviation enlarges it", unit="s", minimum=0.0,
        maximum=10.0,
    )  # fmt: skip
    allowance_m: float = option(
        0.005, "enlargement of every tracked circle", unit="m", minimum=0.0, maximum=1.0
    )
    noise_factor: float = option(
        1.0,
        "standard deviations of a range by which a circle is enlarged",
        minimum=0.0,
        maximum=10.0,
    )
    forget_s: float = option(
        2.0, "time without a return after which a moving track is dropped", unit="s", minimum=0.0,
        maximum=100.0,
    )  # fmt: skip
    forget_standing_s: float = option(
        5.0, "the same for a track at rest", unit="s", minimum=0.0, maximum=1000.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
