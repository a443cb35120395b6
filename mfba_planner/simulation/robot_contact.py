# SPDX-License-Identifier: Apache-2.0
"""Clearances of the whole robot: of its disc, or of the circles of its footprint, which turn.

Between two ticks base_link moves uniformly on a straight line, as in all metrics, and the yaw
changes uniformly, by the shorter turn. A circle beside base_link then moves along a curve. Its
step is cut into pieces, each with the chord instead of the curve; the bound of their distance is
subtracted from the gap. So a gap is never larger than the true one, and at most 2 CURVE_M smaller;
where the robot does not turn it is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .batched_motion import Array, Motion, StepClearances
from .footprint import FootprintCircle
from .scenario import Scenario
from .wall_contact import WallClearances

CURVE_M = 1e-4  # largest distance of a circle's curve from the chord of a piece
_STEPS = 64  # taken together, so that their pieces fit into memory


class RobotContact:
    """Gaps between the robot of a scenario and everything else, for many steps."""

    def __init__(self, scenario: Scenario) -> None:
        """Build the motion of all obstacles once for each different radius."""
        self.disc = Motion(scenario)  # of the disc of robot_radius_m around base_link
        self._circles = scenario.robot.footprint_m
        radii = {circle.radius for circle in self._circles}
        self._motions = {radius: Motion(scenario, radius) for radius in radii}

    def steps(self, times_s: Array, poses: Array) -> StepClearances:
        """K steps through poses (3, K + 1), x, y (m) and yaw (rad), at times (K + 1,).

        With a footprint a gap is that of the nearest circle, contact_s the time until the first
        contact if each circle keeps the velocity it has at the start of the step, and distance_m
        still that of base_link.
        """
        if not self._circles or poses.shape[1] < 2:
            return self.disc.steps(times_s, poses[:2])
        count = poses.shape[1] - 1
        spans = [slice(first, first + _STEPS + 1) for first in range(0, count, _STEPS)]
        with np.errstate(invalid="ignore"):  # a pose that is not finite was refused
            found = _joined(
                [self._nearest(times_s[s], poses[:, s]) for s in spans], np.concatenate
            )
        return replace(found, distance_m=self.disc.steps(times_s, poses[:2]).distance_m)

    def _nearest(self, times_s: Array, poses: Array) -> StepClearances:
        """The steps of the nearest circle for each obstacle; distance_m is that of no point."""
        turn = _turns(poses[2])
        counts = _pieces(turn, max(circle.offset_m for circle in self._circles))
        first = np.cumsum(counts) - counts
        step = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(len(step)) - first[step]) / counts[step]
        moments = np.append(times_s[step] + share * np.diff(times_s)[step], times_s[-1])
        change = np.stack([*np.diff(poses[:2]), turn])
        between = np.column_stack([poses[:, step] + share * change[:, step], poses[:, -1]])
        found = [
            self._of_circle(circle, moments, between, first, turn / counts)
            for circle in self._circles
        ]
        return _joined(found, lambda arrays: np.min(arrays, axis=0))

    def _of_circle(
        self, circle: FootprintCircle, times_s: Array, poses: Array, first: Array, turn: Array
    ) -> StepClearances:
        """K steps of one circle in M pieces, base_link at poses (3, M + 1).

        first (K,): number of the first piece of each step; turn (K,): of each of its pieces, rad.
        """
        x, y, yaw = poses
        c, s = np.cos(yaw), np.sin(yaw)
        positions = np.stack([x + c * circle.x - s * circle.y, y + s * circle.x + c * circle.y])
        pieces = self._motions[circle.radius].steps(times_s, positions)
        # A curve whose second derivative over the piece is |c| turn^2 is within 1/8 of that of
        # its chord, at the same moment.
        slack_m = np.nan_to_num(circle.offset_m * turn * turn / 8.0)
        gap_m = np.minimum.reduceat(pieces.gap_m, first, axis=0) - slack_m[:, None]
        walls = pieces.walls
        if walls is not None:
            wall_gap_m = np.minimum.reduceat(walls.gap_m, first) - slack_m
            walls = WallClearances(wall_gap_m, walls.contact_s[first])
        return StepClearances(gap_m, pieces.contact_s[first], pieces.distance_m, walls)


def _joined(parts: list[StepClearances], join: Callable[[list[Array]], Array]) -> StepClearances:
    """Gaps and times of all parts joined; the distances are those of the first."""
    walls = [part.walls for part in parts if part.walls is not None]
    return StepClearances(
        join([part.gap_m for part in parts]),
        join([part.contact_s for part in parts]),
        parts[0].distance_m,
        WallClearances(join([w.gap_m for w in walls]), join([w.contact_s for w in walls]))
        if walls
        else None,
    )


def _turns(yaw_rad: Array) -> Array:
    """The shorter turn (K,) between successive headings (K + 1,), in [-pi, pi)."""
    change = np.diff(yaw_rad)
    turn: Array = np.remainder(change + math.pi, 2.0 * math.pi) - math.pi
    return np.where(change == 0.0, 0.0, turn)


def _pieces(turn_rad: Array, reach_m: float) -> Array:
    """Into how many pieces (K,) a step is cut: chords of at most CURVE_M from their curve."""
    wanted = np.ceil(np.abs(turn_rad) * math.sqrt(reach_m / (8.0 * CURVE_M)))
    found: Array = np.maximum(np.nan_to_num(wanted), 1.0).astype(np.intp)
    return found
