# SPDX-License-Identifier: Apache-2.0
"""Distance to go: length of the shortest way to the goal through the local map.

In eq. 1 it takes the place of the straight line from a waypoint to the goal. It solves the
eikonal equation |grad D| F = 1 by fast marching (Sethian 1996) from the goal; F is the share of
the full speed, small near what stands, by the lidar or by a known map. Unknown space counts as
free.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from ..core.geometry import Point, distance
from ..core.option_specs import check, option
from ..core.planner_types import NANO
from ..perception.bilinear_grid import BilinearGrid
from ..perception.distance_field import DistanceField, bilinear, distance_field
from ..perception.known_map import UnclearedMap
from ..perception.static_map import StaticMap
from .eikonal import CLOSED, cell_of, downhill, march, speed_share
from .known_route import KnownRoute

Array = np.ndarray

_LEAST_LINE_M = 1e-6  # a shorter one has no direction: squares of lengths would underflow
_CLEAR_M = 0.04  # beside the robot's radius: a straight line with so much room is driven
_MARGIN_M, _LEAST_MARGIN_M = 5.0, 3.0  # around robot and goal
_MOST_CELLS = 20_000  # about 8 ms
_SAME_GOAL_M = 0.1  # noise of the odometry moves the goal in the map's frame
_CLOSED_NS = 1_500_000_000
_PASSAGE_NS = 30_000_000_000  # so long a passage counts as closed that the robot did not pass
_NEAR_M = 2.0  # farther off such passages are left to the distance to go
_FARTHEST_M = 20.0  # a goal farther away is replaced by a point on the line to it


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteParams:
    """Options of the distance to go."""

    refresh_s: float = option(
        0.3, "time after which the distance to go is computed again, if the map has changed",
        unit="s", minimum=0.0, maximum=10.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


class DistanceToGo:
    """The distance to go to one goal, computed again when the map has changed.

    All positions are in the map's frame. While the straight line from the robot is clear, the
    distance to go is the straight line.
    """

    def __init__(
        self, params: RouteParams, radius_m: float, known_map: UnclearedMap | None = None
    ) -> None:
        """radius_m is the robot's."""
        self._params, self._radius_m = params, radius_m
        self.known_map = known_map
        self._route = None if known_map is None else KnownRoute(known_map, radius_m)
        self._by_route = False  # also to a goal that is near: its way leads far round
        self.goal: Point = (0.0, 0.0)
        self.is_straight = True
        self.closed_by = ""  # what stands between robot and goal on every way, "" if one is open
        self._closing = ""  # the same, at this moment
        self._closed_ns: int | None = None  # since when
        self._margin_m = _MARGIN_M
        self._not_passed: list[tuple[int, Point]] = []
        # stamp, versions of the maps, goal
        self._computed: tuple[int, tuple[int, int], Point] | None = None
        self._to_go: Array | None = None
        self._beyond_m = 0.0
        self._down: BilinearGrid | None = None  # unit vectors of the shortest way, complex
        self._origin: Point = (0.0, 0.0)
        self._cell_m = 1.0

    def update(self, stamp_ns: int, known: StaticMap, position: Point, goal: Point) -> None:
        """Take the map as it is now."""
        self.goal = goal
        room_m = self._radius_m + _CLEAR_M
        self.is_straight = is_clear(known, position, goal, room_m) and self._is_clear(
            position, goal, room_m
        )
        if self.is_straight:
            self.closed_by, self._closing, self._closed_ns = "", "", None
            self._margin_m, self._by_route = _MARGIN_M, False
            return
        now = (known.version, self.known_map.version if self.known_map else 0)
        if self._computed is not None:
            then_ns, versions, then_goal = self._computed
            age_s = (stamp_ns - then_ns) * NANO
            fresh = 0.0 <= age_s < self._params.refresh_s or versions == now
            same = distance(then_goal, goal) < _SAME_GOAL_M
            if fresh and same and self._is_inside(position):
                self._closed_for(stamp_ns)
                return
        self._not_passed = [
            (then_ns, place)
            for then_ns, place in self._not_passed
            if 0 <= stamp_ns - then_ns < _PASSAGE_NS
        ]
        self._closing = self._compute(stamp_ns, known, position, goal)
        self._computed = (stamp_ns, now, goal)
        self._closed_for(stamp_ns)

    def close(self, stamp_ns: int, position: Point) -> None:
        """Count the passage at a position as closed for a while: the robot does not pass it."""
        self._not_passed.append((stamp_ns, position))
        self._computed = None

    def open(self, position: Point, headings_rad: Array) -> Array | None:
        """Whether each heading (n,) leads past the passages that count as closed; None: all do."""
        found = None
        for _, (x, y) in self._not_passed:
            dx, dy = x - position[0], y - position[1]
            away = math.sqrt(dx * dx + dy * dy)
            if not self._radius_m < away < _NEAR_M:
                continue
            wide = math.sqrt(1.0 - (self._radius_m / away) ** 2)
            past = np.cos(headings_rad - math.atan2(dy, dx)) < wide
            found = past if found is None else found & past
        return found

    def _is_clear(self, start: Point, end: Point, room_m: float) -> bool:
        """is_clear() by the known map."""
        return self.known_map is None or are_clear(
            self.known_map.along(start, end, room_m), start, end, room_m
        )

    def _field(self, known: StaticMap, low: Point, high: Point, cell_m: float) -> DistanceField:
        """Distances to what stands in a rectangle, by the lidar and by the known map."""
        if self.known_map is None:
            return known.rectangle_field(low, high, cell_m)
        cap_m = known.params.widest_m
        beside = cap_m + cell_m
        more = self.known_map.near(
            (low[0] - beside, low[1] - beside), (high[0] + beside, high[1] + beside)
        )
        # In a cell with points of both the last counts, which is the lidar's.
        x, y = np.concatenate((more, known.established_points())).T
        return distance_field(x, y, low, high, cell_m, cap_m)

    def _closed_for(self, stamp_ns: int) -> None:
        """Say what closes the way once it has for long enough."""
        if not self._closing or self._closed_ns is None:
            self._closed_ns = stamp_ns if self._closing else None
        # A person who passes a door closes it too, but not for long.
        lasts = self._closed_ns is not None and stamp_ns - self._closed_ns >= _CLOSED_NS
        self.closed_by = self._closing if lasts else ""

    def _compute(self, stamp_ns: int, known: StaticMap, position: Point, goal: Point) -> str:
        """Compute the distance to go; what closes every way to the goal, "" if nothing."""
        target, low, high = goal, position, goal
        self._beyond_m = 0.0
        away = distance(position, goal)
        if self._route is not None and (self._by_route or away > _FARTHEST_M):
            stood = known.established_points()
            target, self._beyond_m, low, high = self._route.part(stamp_ns, position, goal, stood)
        elif away > _FARTHEST_M:
            share = _FARTHEST_M / away
            target = (
                position[0] + share * (goal[0] - position[0]),
                position[1] + share * (goal[1] - position[1]),
            )
            high, self._beyond_m = target, distance(target, goal)
        fine = known.params.cell_m
        low, high, per_cell = _domain(low, high, fine, self._margin_m)
        self._cell_m = fine * per_cell
        field = self._field(known, low, high, fine)
        self._origin = field.origin_m
        widest_m = _widest(field.distance_m, per_cell)
        speed = speed_share(widest_m, self._radius_m)
        height, width = speed.shape
        for _, (x, y) in self._not_passed:
            dx = self._origin[0] + (np.arange(width) + 0.5) * self._cell_m - x
            dy = self._origin[1] + (np.arange(height)[:, None] + 0.5) * self._cell_m - y
            speed[dx * dx + dy * dy < self._radius_m**2] = CLOSED
        end = cell_of(target, self._origin, self._cell_m, speed.shape)
        self._to_go = march(speed, end, self._cell_m)
        self._down = BilinearGrid(downhill(self._to_go), self._origin, self._cell_m)
        if self._beyond_m:
            return ""  # the map does not reach so far
        cell = (position[0] - self._origin[0]) / self._cell_m
        row = (position[1] - self._origin[1]) / self._cell_m
        closing, leads_out = self._closed(field, widest_m, (int(row), int(cell)), end, goal)
        all_m = 0.5 * known.params.size_m + _LEAST_MARGIN_M
        if leads_out and self._margin_m < all_m:
            # Beyond what the map holds, all is free: a way round is known or assumed there.
            self._margin_m = all_m
            return self._compute(stamp_ns, known, position, goal)
        if leads_out and self._route is not None and not self._by_route:
            self._by_route = True
            return self._compute(stamp_ns, known, position, goal)
        if closing and self.known_map is not None:
            closing += ", by the known map or the lidar"
        return closing

    def _closed(
        self,
        field: DistanceField,
        widest_m: Array,
        start: tuple[int, int],
        end: tuple[int, int],
        goal: Point,
    ) -> tuple[str, bool]:
        """What closes every way between two cells: none is as wide as the robot.

        And whether ways lead out of the domain on both sides of it: then nothing is closed.
        """
        from scipy.ndimage import label

        nearest_m = float(field.at(np.array([goal[0]]), np.array([goal[1]]))[0])
        if nearest_m < self._radius_m - _CLEAR_M:
            return f"what stands {nearest_m:.2f} m from its middle", False
        open_ = widest_m > self._radius_m
        open_[max(start[0] - 1, 0) : start[0] + 2, max(start[1] - 1, 0) : start[1] + 2] = True
        open_[end] = True
        number = label(open_, np.ones((3, 3)))[0]
        if number[start] == number[end]:
            return "", False
        border = np.ones(number.shape, dtype=bool)
        border[1:-1, 1:-1] = False
        if (number[border] == number[start]).any() and (number[border] == number[end]).any():
            return "", True
        inside = np.count_nonzero(number == number[end]) < np.count_nonzero(
            number == number[start]
        )
        around = "the goal" if inside else "the robot"
        return f"what stands around {around}, without a gap as wide as the robot", False

    def _is_inside(self, position: Point) -> bool:
        if self._to_go is None:
            return False
        height, width = self._to_go.shape
        u = (position[0] - self._origin[0]) / self._cell_m
        v = (position[1] - self._origin[1]) / self._cell_m
        return 10.0 <= u <= width - 10.0 and 10.0 <= v <= height - 10.0

    def at(self, x: Array, y: Array) -> Array:
        """Distance to go (m) at positions of any shape."""
        if self.is_straight or self._to_go is None:
            dx, dy = x - self.goal[0], y - self.goal[1]
            straight: Array = np.sqrt(dx * dx + dy * dy)
            return straight
        return bilinear(self._to_go, *self._cells(x, y)) + self._beyond_m

    def direction(self, xy: Array) -> Array:
        """Unit vectors (2, m) of the shortest way at positions (2, m)."""
        if self.is_straight or self._down is None:
            step: Array = np.array(self.goal)[:, None] - xy
            step /= np.sqrt(step[0] * step[0] + step[1] * step[1]) + 1e-12
            return step
        down = self._down.at(xy)
        down /= np.abs(down) + 1e-12
        return down.view(np.float64).reshape(-1, 2).T

    def line(self, position: Point, step_m: float, steps: int) -> list[Point]:
        """Points along the shortest way, one per step, relative to its begin."""
        x, y, found = *position, []
        for _ in range(steps):
            ux, uy = self.direction_at(x, y)
            x, y = x + step_m * ux, y + step_m * uy
            found.append((x - position[0], y - position[1]))
        return found

    def direction_at(self, x: float, y: float) -> Point:
        """direction() at one position."""
        if self.is_straight or self._down is None:
            step = complex(self.goal[0] - x, self.goal[1] - y)
        else:
            step = self._down.at_one(x, y)
        length = math.sqrt(step.real * step.real + step.imag * step.imag) + 1e-12
        return step.real / length, step.imag / length

    def _cells(self, x: Array, y: Array) -> tuple[Array, Array]:
        assert self._to_go is not None
        height, width = self._to_go.shape
        u = (x - self._origin[0]) / self._cell_m - 0.5
        v = (y - self._origin[1]) / self._cell_m - 0.5
        np.maximum(u, 0.0, out=u)
        np.minimum(u, width - 1.001, out=u)
        np.maximum(v, 0.0, out=v)
        np.minimum(v, height - 1.001, out=v)
        return u, v


def is_clear(known: StaticMap, start: Point, end: Point, room_m: float) -> bool:
    """Whether no point of the map is nearer to the line than room_m.

    What stands beside its start does not count; a line of less than 1 um is clear.
    """
    return are_clear(known.established_points(), start, end, room_m)


def are_clear(points: Array, start: Point, end: Point, room_m: float) -> bool:
    """is_clear() of points (n, 2)."""
    if not points.shape[0]:
        return True
    x, y = points[:, 0] - start[0], points[:, 1] - start[1]
    dx, dy = end[0] - start[0], end[1] - start[1]
    length2 = dx * dx + dy * dy
    if length2 < _LEAST_LINE_M * _LEAST_LINE_M:
        return True
    share = np.clip((x * dx + y * dy) / length2, 0.0, 1.0)
    x, y = x - share * dx, y - share * dy
    near = x * x + y * y < room_m * room_m
    # What stands beside the robot already does not close a line that leads away from it.
    return not bool((near & (share > 0.0)).any())


def _domain(
    position: Point, goal: Point, fine_m: float, margin_m: float
) -> tuple[Point, Point, int]:
    """Corners of the rectangle, and how many cells of the map make one of its cells."""
    margin, per_cell = margin_m, 2
    least_m = max(_LEAST_MARGIN_M, margin_m - 2.0)
    while True:
        low = (min(position[0], goal[0]) - margin, min(position[1], goal[1]) - margin)
        high = (max(position[0], goal[0]) + margin, max(position[1], goal[1]) + margin)
        cell = fine_m * per_cell
        if (high[0] - low[0]) * (high[1] - low[1]) <= _MOST_CELLS * cell * cell:
            return low, high, per_cell
        if margin > least_m:
            margin -= 0.5
        else:
            margin, per_cell = margin_m, per_cell + 1


def _widest(values: Array, per_cell: int) -> Array:
    """The largest value within each cell: the widest part decides, or narrow doors would close."""
    height, width = (n // per_cell * per_cell for n in values.shape)
    parts = [values[:height, i:width:per_cell] for i in range(per_cell)]
    rows = functools.reduce(np.maximum, parts)
    largest: Array = functools.reduce(np.maximum, [rows[j::per_cell] for j in range(per_cell)])
    return largest
