# SPDX-License-Identifier: Apache-2.0
"""Waypoint among what stands: eq. 1 with the distance to go, by headings, then by a swarm."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import Bits
from ..perception.distance_field import DistanceField
from ..perception.known_map import UnclearedMap
from ..perception.static_map import StaticMap
from ..swarm.optimizer import Evaluate, Found
from ..swarm.search_region import Vector
from .distance_to_go import DistanceToGo, RouteParams
from .map_rollout import FORBIDDEN_M, MapRollout
from .trajectory_cost import RiskParams
from .turn_delay import TurnDelay

Array = np.ndarray
Candidates = tuple[Array, Array, Array]  # (m,) x, y (m, relative to the robot), t1 (s)

_NO_CANDIDATES: Candidates = (np.empty(0),) * 3
LENGTHS = (0.25, 0.5, 0.75, 1.0)  # distances of waypoints, in reach_m
WAITS_S = (0.4, 1.0, 2.0)
SPEEDS = (1e-6, 0.5)
LEAST_SHARE = 0.5  # of the speed, where nothing moves
BATCH, GROWTH = 40, 10
MARGIN_M = 0.1  # beside what stands, in which a path costs more
WINDOW_M = 6.5  # side of the square in which clearances are known
_STEP_M = 0.1
SIDE_ROOM_M = (0.12, 0.07, 0.025)  # room beside a line of sight


class FoundWaypoint(NamedTuple):
    """The chosen waypoint, relative to the robot in the map's frame, and how it was found."""

    waypoint: Point
    t1: float
    cost: float
    to_go_m: float
    closed: Bits
    candidates: tuple[Point, ...]
    free: bool


class MapSearch:
    """Keeps the distance to go and the clearances between decisions."""

    def __init__(
        self,
        route: RouteParams,
        radius_m: float,
        headings: int,
        reach_m: float,
        known_map: UnclearedMap | None = None,
    ) -> None:
        """radius_m is the robot's; headings is the number of bits."""
        self._radius_m, self._n, self._reach_m = radius_m, headings, reach_m
        self.to_go = DistanceToGo(route, radius_m, known_map)
        self.headings_rad = 2.0 * math.pi / headings * np.arange(1, headings + 1)
        self._cos, self._sin = np.cos(self.headings_rad), np.sin(self.headings_rad)
        lengths = np.array(LENGTHS) * reach_m
        self._qx = (self._cos[:, None] * lengths).ravel()
        self._qy = (self._sin[:, None] * lengths).ravel()
        self._length = np.tile(lengths, headings)
        self._clearance: tuple[int, DistanceField] | None = None
        self._was_free = True  # the last decision's way: of no influence but on time

    def clearance(self, known: StaticMap, position: Point, stamp_ns: int) -> DistanceField:
        """Distances to what stands around the robot."""
        if self._clearance is None or self._clearance[0] != stamp_ns:
            field = known.distance_field(position, WINDOW_M, known.params.cell_m)
            self._clearance = (stamp_ns, field)
        return self._clearance[1]

    def search(
        self,
        rollout: MapRollout,
        position: Point,
        risk: RiskParams,
        speed_mps: float,
        tick_s: float,
        turn_delay: TurnDelay | None,
        observed: Array | None,
        last: Point | None,
        refine: Callable[[Point, Evaluate], Found | None],
    ) -> FoundWaypoint:
        """The cheapest waypoint.

        observed (n,): headings that may be driven; None: all. last: the last waypoint.
        refine: a search around a waypoint; it returns None if there is none.
        """
        evaluate = _Evaluation(rollout, position, risk, speed_mps, self.to_go, turn_delay)
        to_go = self.to_go
        here = float(to_go.at(np.array([position[0]]), np.array([position[1]]))[0])
        ahead = self._ahead(position)
        if observed is not None:
            ahead = [q for q in ahead if observed[self._headings(*np.array([q]).T)[0]]]
        ax, ay = np.array(ahead).reshape(-1, 2).T
        on = (ax, ay, np.maximum(np.sqrt(ax * ax + ay * ay) / speed_mps, tick_s))
        best = _Best(evaluate, on)
        if self._was_free and best.take_ahead():
            return FoundWaypoint(*best.waypoint, best.cost, here, (), (), True)
        qx, qy, t = self._candidates(ahead, speed_mps, tick_s, last, waits=not rollout.alone)
        if observed is not None:
            kept = observed[self._headings(qx, qy)]
            qx, qy, t = qx[kept], qy[kept], t[kept]
        length = np.sqrt(qx * qx + qy * qy)
        lower = length + to_go.at(qx + position[0], qy + position[1])
        lower += risk.waiting * (speed_mps * t - length)
        order = np.argsort(lower, kind="stable")
        self._was_free = best.take(order, lower, (qx, qy, t))
        if self._was_free:
            return FoundWaypoint(*best.waypoint, best.cost, here, (), (), True)
        closed = self._closed(rollout, risk, observed)

        def costs(points: list[Vector]) -> list[float]:
            x, y = np.array(points).T
            t = np.maximum(np.sqrt(x * x + y * y) / speed_mps, tick_s)
            cost, _ = evaluate(x, y, t)
            if observed is not None:
                cost[~observed[self._headings(x, y)]] = math.inf
            values: list[float] = cost.tolist()
            return values

        refined = refine(best.waypoint[0], costs)
        asked: tuple[Point, ...] = ()
        if refined is not None:
            asked = tuple((x, y) for x, y in refined.candidates)
            if refined.best_value < best.cost:
                (x, y), best.cost = refined.best_x, refined.best_value
                best.waypoint = ((x, y), max(math.hypot(x, y) / speed_mps, tick_s))
        return FoundWaypoint(*best.waypoint, best.cost, here, closed, asked, False)

    def _headings(self, x: Array, y: Array) -> Array:
        """Index (k,) of the heading nearest to each direction."""
        number = np.round(np.arctan2(y, x) * self._n / (2.0 * math.pi)).astype(int)
        index: Array = (number - 1) % self._n
        return index

    def _ahead(self, position: Point) -> list[Point]:
        """The farthest points of the shortest way in line of sight, with more room and less."""
        to_go, clearance = self.to_go, self._clearance
        assert clearance is not None
        field = clearance[1]
        if to_go.is_straight:
            dx, dy = to_go.goal[0] - position[0], to_go.goal[1] - position[1]
            away = math.sqrt(dx * dx + dy * dy)
            part = min(1.0, self._reach_m / max(away, 1e-9))
            return [(dx * part, dy * part)]
        path = to_go.line(position, _STEP_M, round(self._reach_m / _STEP_M))
        ends = np.array(path)
        share = np.linspace(0.0, 1.0, 26)[1:]
        xs = position[0] + ends[:, :1] * share
        ys = position[1] + ends[:, 1:] * share
        now = float(field.at(np.array([position[0]]), np.array([position[1]]))[0])
        least = field.at(xs, ys).min(axis=1)
        found = set()
        for room_m in SIDE_ROOM_M:
            clear = least > min(self._radius_m + room_m, now - 0.005)
            found.add(int(np.flatnonzero(clear)[-1]) if clear.any() else 0)
        return [path[k] for k in sorted(found)]

    def _candidates(
        self,
        ahead: list[Point],
        speed_mps: float,
        tick_s: float,
        last: Point | None,
        waits: bool,
    ) -> Candidates:
        qx, qy, t = self._qx, self._qy, self._length / speed_mps
        extra = []
        for x, y in ahead if waits else ():
            length = math.hypot(x, y) or 1.0
            ux, uy = x / length * speed_mps, y / length * speed_mps
            extra += [(ux * s * w, uy * s * w, w) for s in SPEEDS for w in WAITS_S]
        if last is not None:
            extra.append((*last, max(math.hypot(*last) / speed_mps, tick_s)))
        ex, ey, et = np.array(extra).reshape(-1, 3).T
        return np.concatenate((ex, qx)), np.concatenate((ey, qy)), np.concatenate((et, t))

    def _closed(self, rollout: MapRollout, risk: RiskParams, observed: Array | None) -> Bits:
        """Bits: 1 for a heading whose shortest waypoint is not reached without contact."""
        length_m = LENGTHS[0] * self._reach_m
        closed = rollout.touches(length_m * self._cos, length_m * self._sin, risk)
        if observed is not None:
            closed |= ~observed
        return tuple(closed.astype(int).tolist())


class _Best:
    """The cheapest of many waypoints, in few calls: one costs more than all its waypoints.

    The points ahead, along the shortest way, come first: if the cheapest of them is without risk,
    it is taken. Where the last decision took none of them, they are evaluated with others.
    """

    def __init__(self, evaluate: _Evaluation, ahead: Candidates) -> None:
        """ahead: the points ahead."""
        self._evaluate, self._ahead = evaluate, ahead
        self.waypoint, self.cost = ((0.0, 0.0), 0.0), math.inf

    def take_ahead(self) -> bool:
        """Whether a point ahead is free; it is the best then."""
        ahead, self._ahead = self._ahead, _NO_CANDIDATES
        return bool(ahead[0].size) and self._take(ahead, ahead[0].size)

    def take(self, order: Array, lower: Array, others: Candidates) -> bool:
        """take_ahead(), unless it was, and the others, in order of their least possible costs."""
        done, size = 0, BATCH
        while done < order.size or self._ahead[0].size:
            batch = order[done : done + size]
            done, size = done + size, order.size
            batch = batch[lower[batch] < self.cost]
            first = self._ahead[0].size
            if not first and not batch.size:
                break
            both = [np.concatenate((a, b[batch])) for a, b in zip(self._ahead, others)]
            self._ahead = _NO_CANDIDATES
            if self._take((both[0], both[1], both[2]), first):
                return True
        return False

    def _take(self, found: Candidates, first: int) -> bool:
        """Evaluate; whether the cheapest of the first few is without risk."""
        x, y, t1 = found
        cost, risk = self._evaluate(x, y, t1)
        k = int(cost[:first].argmin()) if first else 0
        free = first > 0 and bool(risk[k] <= 0.0)
        if not free:
            k = int(cost.argmin())
        if free or cost[k] < self.cost:
            self.waypoint, self.cost = ((float(x[k]), float(y[k])), float(t1[k])), float(cost[k])
        return free


class _Evaluation:
    """The cost of waypoints (m,): eq. 1 with the distance to go, waiting, turning and risk."""

    def __init__(
        self,
        rollout: MapRollout,
        position: Point,
        risk: RiskParams,
        speed_mps: float,
        to_go: DistanceToGo,
        turn_delay: TurnDelay | None,
    ) -> None:
        self._rollout, self._position = rollout, position
        self._risk, self.speed_mps, self._to_go = risk, speed_mps, to_go
        self._turn_delay = turn_delay

    def __call__(self, qx: Array, qy: Array, t1: Array) -> tuple[Array, Array]:
        """Cost and risk, m."""
        risk, speed = self._risk, self.speed_mps
        length = np.sqrt(qx * qx + qy * qy)
        cost = length + self._to_go.at(qx + self._position[0], qy + self._position[1])
        cost += risk.waiting * (speed * t1 - length)
        if self._turn_delay is not None:
            cost += risk.waiting * speed * self._turn_delay.towards_all(qx, qy)
        paths = self._rollout.paths(qx, qy, t1)
        cost += paths.slowed_m
        standing = self._rollout.standing_risk(paths, risk, MARGIN_M)
        harm = np.maximum(standing, self._rollout.moving_risk(paths, risk))
        cost += harm
        if self._rollout.alone:  # what stands does not go away: waiting for it is of no use
            (px, py), (gx, gy) = self._position, self._to_go.goal
            slow = length < LEAST_SHARE * np.minimum(speed * t1, math.hypot(gx - px, gy - py))
            cost[slow] += FORBIDDEN_M
        return cost, harm
