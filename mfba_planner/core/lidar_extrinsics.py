# SPDX-License-Identifier: Apache-2.0
"""Where a planar lidar is mounted on the robot, and the nodes' parameters that say so."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from .geometry import Point

PARAMETERS = ("scan_x", "scan_y", "scan_yaw", "scan_flipped")


class LidarExtrinsics(NamedTuple):
    """Pose of a scan's frame in the robot's (base_link, REP-105): x, y in m, yaw in rad.

    flipped: upside down (rolled by pi), so that its angles run clockwise seen from above.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0
    flipped: bool = False

    @property
    def offset_m(self) -> Point:
        """Where the beams begin, in the robot's frame."""
        return (self.x_m, self.y_m)

    @property
    def parameters(self) -> dict[str, float | bool]:
        """The extrinsics as parameters of virtual_sensor and planner."""
        return dict(zip(PARAMETERS, self))

    @classmethod
    def of_parameters(cls, values: Mapping[str, Any]) -> LidarExtrinsics:
        """Inverse of parameters; those that are missing have their defaults."""
        given = {
            name: type(default)(values.get(parameter, default))
            for parameter, (name, default) in zip(PARAMETERS, cls._field_defaults.items())
        }
        return cls(**given)


CENTRED = LidarExtrinsics()
