# SPDX-License-Identifier: Apache-2.0
"""The simulated robot: drive and its limits, footprint, lidar, sensor noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ..core.errors import ConfigError
from ..core.lidar_extrinsics import LidarExtrinsics
from ..core.option_specs import check, option
from ..core.robot_base import Base
from .footprint import Footprint, parse_footprint

FEWEST_BEAMS = 12
DEFAULT_BEAMS = 360  # of the lidar that a robot without one gets for a planner that reads scans
FULL_CIRCLE_RAD = round(2.0 * math.pi, 4)  # as written in scenario files; slightly above 2 pi


@dataclass(frozen=True, slots=True, kw_only=True)
class Lidar:
    """A simulated lidar, and where its frame is in base_link."""

    beams: int = option(
        0, "number of beams; 0: none, the sectors come from obstacles", minimum=0, maximum=1080
    )
    range_min_m: float = option(
        0.12, "nearer is -inf (REP-117)", unit="m", minimum=0.0, maximum=100.0
    )
    range_max_m: float = option(
        3.5, "farther is +inf (REP-117)", unit="m", minimum=0.1, maximum=1000.0
    )
    x_m: float = option(
        0.0, "where its frame is in base_link, ahead", unit="m", minimum=-10.0, maximum=10.0
    )
    y_m: float = option(
        0.0, "where its frame is in base_link, to the left", unit="m", minimum=-10.0, maximum=10.0
    )
    flipped: bool = option(False, "mounted upside down: its angles run clockwise")
    yaw_rad: float = option(
        0.0, "how its frame is turned in base_link", unit="rad", minimum=-6.4, maximum=6.4
    )
    fov_rad: float = option(
        FULL_CIRCLE_RAD, "angle of view, half of it on each side of its x axis; 6.2832: all round",
        unit="rad", minimum=0.1, maximum=FULL_CIRCLE_RAD,
    )  # fmt: skip
    walls: bool = option(False, "sees the walls, which stop obstacles only (and not the robot)")

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)
        if 0 < self.beams < FEWEST_BEAMS:
            raise ConfigError(
                f"beams={self.beams}: fewer than {FEWEST_BEAMS}; give 0 (no lidar) or more"
            )
        if not self.range_min_m < self.range_max_m:
            raise ConfigError(
                f"range_min_m={self.range_min_m:g}: not below range_max_m={self.range_max_m:g}; "
                "lower it"
            )

    @property
    def extrinsics(self) -> LidarExtrinsics:
        """Where it is on the robot."""
        return LidarExtrinsics(self.x_m, self.y_m, self.yaw_rad, self.flipped)

    @property
    def covered_rad(self) -> float:
        """The angle of view, at most a full circle."""
        return min(self.fov_rad, 2.0 * math.pi)

    @property
    def first_beam_rad(self) -> float:
        """Direction of the first beam in the lidar's frame: the middle of its share.

        All round the shares begin at the x axis, else at the right edge of the view.
        """
        begin = 0.0 if self.covered_rad == 2.0 * math.pi else -0.5 * self.covered_rad
        return begin + 0.5 * self.covered_rad / max(self.beams, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Noise, loss and latency of odometry and scan; 0 by default."""

    odom_m: float = option(
        0.0, "deviation of the position, per axis", unit="m", minimum=0.0, maximum=10.0
    )
    odom_rad: float = option(0.0, "deviation of the heading", unit="rad", minimum=0.0, maximum=3.0)
    odom_loss: float = option(0.0, "share of odometry lost: the last one again", minimum=0.0,
                              maximum=0.99)  # fmt: skip
    odom_latency_s: float = option(
        0.0,
        "age of odometry that its stamp hides, in whole ticks",
        unit="s",
        minimum=0.0,
        maximum=10.0,
    )
    scan_m: float = option(0.0, "deviation of a range", unit="m", minimum=0.0, maximum=10.0)
    scan_dropout: float = option(0.0, "share of beams lost: NaN", minimum=0.0, maximum=0.99)
    scan_loss: float = option(0.0, "share of scans lost: all NaN", minimum=0.0, maximum=0.99)
    scan_latency_s: float = option(
        0.0,
        "age of scans that their stamps hide, in whole ticks",
        unit="s",
        minimum=0.0,
        maximum=10.0,
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)

    @property
    def affects_odometry(self) -> bool:
        """Whether odometry may differ from the true pose."""
        return any((self.odom_m, self.odom_rad, self.odom_loss, self.odom_latency_s))


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot(Base):
    """A base with its sensors and its shape.

    footprint_m are its circles in base_link; empty: the disc of the scenario's robot_radius_m. No
    option of `--set` and no ROS parameter, as these are single values.
    """

    lidar: Lidar = field(default_factory=Lidar)
    noise: Noise = field(default_factory=Noise)
    footprint_m: Footprint = ()

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        Base.__post_init__(self)
        object.__setattr__(self, "footprint_m", parse_footprint(self.footprint_m))

    @property
    def base(self) -> Base:
        """The base without sensors: what a planner needs."""
        return Base(**{name: getattr(self, name) for name in Base.__dataclass_fields__})
