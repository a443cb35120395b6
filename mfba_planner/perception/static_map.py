# SPDX-License-Identifier: Apache-2.0
"""Local map: what stands around the robot, marked by returns and cleared by rays.

A rolling window of measured points, at most one per cell. What moves is kept out: tracks that
move, and returns where a scan of a moment ago saw farther on. Each scan is matched to the map
(scan_matching.py), so the noise of the odometry does not smear it.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.geometry import Point, Pose2D
from ..core.planner_types import NANO
from .distance_field import DistanceField, distance_field
from .free_space import FreeSpace
from .moving_returns import MovingReturns
from .occupancy_grid import ObservedCells, OccupancyGrid, cut_to_known, occupancy
from .scan_beams import Beams, clear_lengths
from .scan_matching import ScanMatching
from .scan_surfaces import Surfaces, surfaces
from .static_map_params import StaticMapParams
from .static_map_points import (  # fmt: skip
    FIRST,
    HITS,
    LAST,
    MISSED,
    NX,
    NY,
    WEAK,
    WIDTH,
    MapPoints,
    X,
    Y,
)

__all__ = ["StaticMap", "StaticMapParams"]

Array = np.ndarray

_LAGS_S, _MARGIN_M = (1.2, 0.4), 0.05  # of the scans that tell what appeared
_COARSE_M = 0.05  # where beams are farther apart, tracks that may move are not marked
_FEWEST_HITS, _BRIEF_S = 3.0, 2.0  # points seen less often are dropped so long after
_STANDING_HITS = 6.0  # points seen so often stand, whatever a track seems to do
_YOUNG_S = 4.0  # a moving circle takes younger points with it
_BEGIN_S = 0.3  # after the first scan
_ESTABLISHED_S = 1.0  # scans are matched to points that are older
_STILL_M = 5e-4  # points are not moved by less
_ALIKE = 0.3  # cosine between normals of the same surface
_CREEP_M, _CREEP_SD = 0.006, 5.0  # of the mean of a scan's returns from their point
_MOST_HITS = 20.0  # that count in a point's mean
_SAME_M, _SAME_SD, _MOST_SAME_M = 0.025, 2.5, 0.05  # returns nearer to a point are its own
_ALONE_M = 0.006  # so near to a beam is a point that is thinner than the beams are apart
_NOISE_SD = 2.5
_FEWEST_WEAK = 3.0
_LIMIT_M = 0.15  # returns so near to the longest range are not used
_PRESENT_M = 4.0  # returns of the last scan count for distances up to here
_FARTHEST_END_M = 0.03
_FIELD_M = 10.0  # side of the window in which distance() knows


class StaticMap:
    """Points that stand, in a frame of the map's own.

    The map's frame is that of odom less the error of the pose that came with the last scan:
    to_map() brings what is known by that pose into it. With an exact odometry they are the same.
    version rises when the points change.
    """

    def __init__(self, params: StaticMapParams | None = None) -> None:
        """Start with nothing known."""
        self.params = params or StaticMapParams()
        p = self.params
        self._points = MapPoints(p.cell_m, p.size_m)
        self._moving = MovingReturns(p.size_m)
        self.matching = ScanMatching(p.cell_m)
        self._free = FreeSpace(_LAGS_S, _MARGIN_M)
        self._observed = ObservedCells(p.size_m)
        self._stamp_ns: int | None = None
        self._time_s = self._begin_s = 0.0
        self._surely_moves = False  # something, by the last scan
        self._origin: Point = (0.0, 0.0)
        self._field: tuple[int, DistanceField] | None = None
        self._present: Array = np.empty((0, 2))
        self._ends: Array = np.empty((0, 2))
        self.version = 0

    def forget(self) -> None:
        """Drop all that is known, as after a jump of the odometry."""
        for part in (self._points, self._moving, self._free, self._observed):
            part.clear()
        self.matching.reset()
        self._stamp_ns, self._field, self._begin_s = None, None, self._time_s
        self.version += 1

    @property
    def count(self) -> int:
        """Number of points."""
        return self._points.count

    @property
    def noise_m(self) -> float:
        """Standard deviation of a return from the surfaces of the map, as learnt."""
        return self.matching.noise_m

    def update(
        self,
        stamp_ns: int,
        pose: Pose2D,
        beams: Beams,
        moving: Array | None = None,
        surely: Array | None = None,
        pose_error: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Update by the beams of a scan, taken from the pose, and by circles that move.

        moving (m, 5) are rows (x, y, vx, vy, r) in odom by that pose and surely (m,) whether
        they surely move, as Tracker.moving() gives them; those slower than moving_mps are
        ignored. pose_error is what is known of the pose's error (Tracker.pose_error).
        An older stamp drops the map, an equal one is ignored.
        """
        if self._stamp_ns is not None:
            dt = (stamp_ns - self._stamp_ns) * NANO
            if dt == 0.0:
                return
            if dt < 0.0:
                self.forget()
            else:
                self._time_s += dt
                self._free.pass_time(dt)
        self._stamp_ns, self._origin = stamp_ns, pose.position
        moving = np.empty((0, 5)) if moving is None else moving
        surely = np.ones(moving.shape[0], dtype=bool) if surely is None else surely
        vx, vy = moving[:, 2], moving[:, 3]
        fast = vx * vx + vy * vy >= self.params.moving_mps**2
        dx, dy = moving[:, 0] - pose.x, moving[:, 1] - pose.y
        coarse_m = _COARSE_M / beams.spacing_rad
        kept_out = fast & (surely | (dx * dx + dy * dy > coarse_m * coarse_m))
        moving, surely = moving[kept_out], moving[fast & surely]
        self._surely_moves = surely.shape[0] > 0
        found = surfaces(beams)
        changed = False
        self._present = self._ends = np.empty((0, 2))
        if found is not None:
            changed = self._mark(found, beams, moving, pose_error)
            stands = (found.range_m > 0.0) & (found.range_m < _PRESENT_M)
            stands &= ~self._moving.near_any(found.x, found.y, surely)
            self._present = np.stack(self.to_map(found.x[stands], found.y[stands]), axis=1)
            self._ends = np.stack(self.to_map(*_ends(found, stands)), axis=1)
        changed |= self._clear(beams, surely)
        x, y = self._robot
        changed |= self._points.roll(x, y)
        self._observed.update(self._time_s, x, y, self.matching.error[2], beams)
        self._free.add(beams, self.matching.error, self.matching.sd_rad)
        self.version += changed

    @property
    def _robot(self) -> Point:
        """The robot's position in the map's frame."""
        ex, ey, _ = self.matching.error
        return (self._origin[0] - ex, self._origin[1] - ey)

    def _mark(
        self, found: Surfaces, beams: Beams, moving: Array, pose_error: tuple[float, float, float]
    ) -> bool:
        """Match the scan, and mark what stands; whether the points changed."""
        p, points, matching, motion = self.params, self._points, self.matching, self._moving
        in_track = motion.near_any(found.x, found.y, moving)
        usable = found.range_m > 0.0
        usable &= found.range_m < beams.longest_m - _LIMIT_M
        usable &= found.range_m * beams.spacing_rad <= p.spacing_m
        still = np.flatnonzero(usable & ~in_track)
        matching.estimate(found, still, self._origin, self._nearest, pose_error)
        x, y = matching.corrected(found.x, found.y, self._origin)
        index, away = points.nearest(x, y)
        same_m = min(_SAME_M + _SAME_SD * matching.noise_m, _MOST_SAME_M)
        same = usable & (away <= same_m)
        flagged = in_track | motion.spread(found, self._appeared(x, y, index, same))
        motion.remember(x[flagged], y[flagged], self._time_s)
        width = found.width_m[found.segment]
        changed = self._average(found, index, x, y, width, same, same & ~flagged)
        new = usable & ~flagged & ~same
        if new.any():
            settled = self._time_s - p.settle_s
            new = new.nonzero()[0]
            new = new[~motion.recent(x[new], y[new], settled)]
            new = new[self._inside(x[new], y[new])]
            added = points.add(
                x[new], y[new], self._time_s, width[new], found.nx[new], found.ny[new]
            )
            changed |= added > 0
        return changed

    def _appeared(self, x: Array, y: Array, index: Array, same: Array) -> Array:
        """Whether returns (k,) are in space that was seen free; where a point stands is none."""
        standing = same.copy()
        standing[same] = self._points.data[HITS][index[same]] >= _STANDING_HITS
        asked = (~standing).nonzero()[0]
        appeared = np.zeros(x.size, dtype=bool)
        margin = 3.0 * self.matching.noise_m + 2.0 * self.matching.sd_m
        appeared[asked] = self._free.appeared(x[asked], y[asked], margin)
        return appeared

    def _inside(self, x: Array, y: Array) -> Array:
        rx, ry = self._robot
        half = self.params.size_m * 0.5
        inside: Array = (np.abs(x - rx) <= half) & (np.abs(y - ry) <= half)
        return inside

    def _nearest(
        self, x: Array, y: Array, nx: Array, ny: Array, reach: int
    ) -> tuple[Array, Array, Array]:
        index, away = self._points.nearest(x, y, reach)
        if not self.count:
            return x, y, away
        data = self._points.data
        # What is seen from behind is another surface: walls are thin.
        usable = data[NX][index] * nx + data[NY][index] * ny > _ALIKE
        usable &= (data[FIRST] <= max(self._time_s - _ESTABLISHED_S, 0.0))[index]
        return data[X][index], data[Y][index], np.where(usable, away, np.inf)

    def _average(
        self, found: Surfaces, index: Array, x: Array, y: Array, width: Array, hit: Array,
        steady: Array,
    ) -> bool:  # fmt: skip
        """Count hits of points, and move them towards their returns, along the normals."""
        points = self._points
        data, n = points.data, points.count
        of = index[hit]
        if not of.size:
            return False
        data[HITS, of] += 1.0  # once per scan
        data[LAST, of] = self._time_s
        data[MISSED, of] = 0.0
        data[NX, of], data[NY, of] = found.nx[hit], found.ny[hit]
        np.maximum.at(data[WIDTH], of, width[hit])
        chosen = np.flatnonzero(steady)
        of = index[chosen]
        if not of.size:
            return False
        c, s = math.cos(self.matching.error[2]), math.sin(self.matching.error[2])
        nx, ny = found.nx[chosen], found.ny[chosen]
        nx, ny = c * nx + s * ny, c * ny - s * nx
        rest = nx * (x[chosen] - data[X][of]) + ny * (y[chosen] - data[Y][of])
        count = np.bincount(of, minlength=n)
        met = count.nonzero()[0]
        dx = np.bincount(of, rest * nx, n)[met] / count[met]
        dy = np.bincount(of, rest * ny, n)[met] / count[met]
        # A point whose returns have left it follows them at once: what creeps is in the map too.
        noise_m = self.matching.noise_m / np.sqrt(count[met])
        left = dx * dx + dy * dy > (_CREEP_M + _CREEP_SD * noise_m) ** 2
        data[HITS, met[left]] = 1.0
        data[FIRST, met[left]] = self._time_s
        gain = 1.0 / np.minimum(data[HITS][met], _MOST_HITS)
        dx *= gain
        dy *= gain
        far = np.abs(dx) + np.abs(dy) > _STILL_M
        if not far.any():
            return False
        met = met[far]
        points.move(met, data[X][met] + dx[far], data[Y][met] + dy[far])
        return True

    def _clear(self, beams: Beams, moving: Array) -> bool:
        """Clear points that the beams see through, and young ones where something moves."""
        points, p, m = self._points, self.params, self.matching
        if not (points.count and beams.range_m.size):
            return False
        data, (ox, oy) = points.data, self._robot
        reach = min(beams.longest_m, p.spacing_m / beams.spacing_rad)
        dx, dy = data[X] - ox, data[Y] - oy
        d2 = dx * dx + dy * dy
        judged = np.flatnonzero((d2 < reach * reach) & (data[LAST] < self._time_s))
        gone = np.zeros(points.count, dtype=bool)
        if judged.size:
            d = np.sqrt(d2[judged])
            bearing = np.arctan2(dy[judged], dx[judged]) + m.error[2]
            spacing_m = d * beams.spacing_rad
            clear, off = clear_lengths(beams, bearing, m.sd_rad)
            passes = clear - d
            unsure_m = off * d + m.sd_rad * d + m.sd_m
            thin = (data[WIDTH][judged] < spacing_m) & (unsure_m > _ALONE_M)
            margin = p.margin_m + 0.5 * spacing_m
            strong = (passes > margin + _NOISE_SD * m.noise_m + m.sd_m) & ~thin
            data[MISSED, judged] = np.where(strong, data[MISSED][judged] + 1.0, 0.0)
            data[WEAK, judged] += (passes > 0.5 * margin + 0.01) & ~thin
            gone[judged] = (data[MISSED][judged] >= p.scans) | (
                data[WEAK][judged] >= _FEWEST_WEAK + 0.5 * data[HITS][judged]
            )
            cleared = judged[data[MISSED][judged] >= p.scans]
            self._moving.remember(data[X][cleared], data[Y][cleared], self._time_s)
        gone |= (data[HITS] < _FEWEST_HITS) & (data[LAST] < self._time_s - _BRIEF_S)
        if moving.shape[0]:
            young = (data[FIRST] > self._time_s - _YOUNG_S) & (data[HITS] < _STANDING_HITS)
            young = young.nonzero()[0]
            x, y = m.measured(data[X][young], data[Y][young], self._origin)
            gone[young] |= self._moving.near_any(x, y, moving)
        if not gone.any():
            return False
        points.keep(~gone)
        return True

    def to_map(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Positions (k,) in odom, by the pose of the last scan, in the map's frame."""
        return self.matching.corrected(x, y, self._origin)

    def points(self) -> Array:
        """Points (n, 2) in odom, by the pose of the last scan."""
        data = self._points.data
        x, y = self.matching.measured(data[X], data[Y], self._origin)
        return np.stack((x, y), axis=1)

    def map_points(self) -> Array:
        """Points (n, 2) in the map's frame."""
        data: Array = self._points.data[:2].T
        return data

    def present_points(self) -> Array:
        """Points (n, 2) of the map and returns of the last scan, but those of what surely moves.

        What creeps, or has just come into view, is in the map too late.
        """
        return np.concatenate((self.map_points(), self._present))

    def contact_points(self) -> Array:
        """present_points(), and how far surfaces may reach beyond their last returns."""
        return np.concatenate((self.present_points(), self._ends))

    def established_points(self) -> Array:
        """Those of the points that have been met for a while, without moving: no ghosts."""
        data = self._points.data
        points: Array = data[:2, self._established()].T
        return points

    def _established(self) -> Array:
        data = self._points.data
        until_s = self._time_s - self.params.establish_s
        if not self._surely_moves and self._time_s >= self._begin_s + _BEGIN_S:
            until_s = max(until_s, self._begin_s)  # the first scan's: who moves is known so soon
        return np.asarray(data[FIRST] <= until_s)

    def distance_field(self, center: Point, window_m: float, cell_m: float) -> DistanceField:
        """Distances to the nearest present point in a square, in the map's frame.

        Capped at widest_m; array[j, i] belongs to origin + ((i + 0.5) cell, (j + 0.5) cell).
        """
        half = 0.5 * window_m
        low, high = (center[0] - half, center[1] - half), (center[0] + half, center[1] + half)
        x, y = self.present_points().T
        return distance_field(x, y, low, high, cell_m, self.params.widest_m)

    def rectangle_field(self, low: Point, high: Point, cell_m: float) -> DistanceField:
        """distance_field() between two corners, of the established points alone."""
        data = self._points.data[:2, self._established()]
        return distance_field(data[X], data[Y], low, high, cell_m, self.params.widest_m)

    def distance(self, x: Array, y: Array) -> Array:
        """Distance to the nearest point at positions (k,) in odom, capped at widest_m.

        Interpolated; beyond 5 m from the robot it is the cap.
        """
        if self._field is None or self._field[0] != self.version:
            window = min(_FIELD_M, self.params.size_m)
            field = self.distance_field(self._robot, window, self.params.cell_m)
            self._field = (self.version, field)
        return self._field[1].at(*self.to_map(x, y))

    def occupancy_grid(self) -> tuple[Point, Array]:
        """Origin (the map's frame) and cells (h, w) int8 as in nav_msgs/OccupancyGrid.

        100 occupied, 0 seen free, -1 unknown. The window of size_m around the robot.
        """
        data = self._points.data
        return occupancy(
            data[X], data[Y], self._robot, self.params.size_m, self.params.cell_m, self._observed
        )

    def known_grid(self) -> OccupancyGrid | None:
        """occupancy_grid() cut to its known cells, with its pose in odom; None before a scan."""
        if self._stamp_ns is None:
            return None
        (left, low), cells = cut_to_known(*self.occupancy_grid(), self.params.cell_m)
        x, y = self.matching.measured(np.array([left]), np.array([low]), self._origin)
        origin = Pose2D(float(x[0]), float(y[0]), float(self.matching.error[2]))
        return OccupancyGrid(self._stamp_ns, origin, self.params.cell_m, cells)


def _ends(found: Surfaces, stands: Array) -> tuple[Array, Array]:
    """Where the surfaces that stand may end: as far beyond an end as its neighbour is before it.

    A surface seen at a grazing angle ends up to one spacing of the beams after its last return.
    """
    wide = (found.last > found.first) & stands[found.first] & stands[found.last]
    first, last = found.first[wide], found.last[wide]
    end, inner = np.append(first, last), np.append(first + 1, last - 1)
    dx, dy = found.x[end] - found.x[inner], found.y[end] - found.y[inner]
    share = np.minimum(1.0, _FARTHEST_END_M / np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9))
    return found.x[end] + share * dx, found.y[end] + share * dy
