# SPDX-License-Identifier: Apache-2.0
"""Returns nearer than a lidar's range_min, where that reaches beyond the robot's own radius.

REP-117 says of them only that they are nearer (-inf). Within the robot's radius that is contact,
wherever it is. Of a lidar whose range_min is larger, an obstacle may stand anywhere between the
robot's edge and range_min: a planner must not take it to be at range_min, and drive on. (A sector
is set by it at any range, so sectors need no such care.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.geometry import distance
from ..core.planner_types import Scan

_SLACK_M = 1e-3  # single precision and rounded data sheets


def blind_ring(scan: Scan, robot_radius_m: float) -> str:
    """What to warn of where a lidar does not see all that is about to touch; "" otherwise."""
    offset_m = distance(scan.origin_m, (0.0, 0.0))
    blind_m = scan.range_min_m + offset_m
    if blind_m <= robot_radius_m + _SLACK_M:
        return ""
    mounted = f", {offset_m:g} m from the robot's centre," if offset_m else ""
    return (
        f"the lidar's range_min={scan.range_min_m:g} m{mounted} is beyond "
        f"robot_radius_m={robot_radius_m:g}: it does not tell where something between the two is; "
        f"set robot_radius_m to {blind_m:g}, or use a lidar that sees nearer"
    )


def near_at_contact(scan: Scan, robot_radius_m: float) -> Scan:
    """The scan with -inf taken at the robot's edge, if range_min is farther.

    Of a lidar beside the centre: at the nearest place of the edge, wherever that is.
    """
    edge_m = max(robot_radius_m - distance(scan.origin_m, (0.0, 0.0)), 0.0)
    if scan.range_min_m <= edge_m + _SLACK_M:
        return scan
    ranges = np.asarray(scan.ranges_m, dtype=np.float64)
    # What else is below range_min stays unusable.
    ranges = np.where((ranges >= scan.range_min_m) | np.isneginf(ranges), ranges, np.nan)
    return replace(scan, ranges_m=ranges, range_min_m=edge_m)
