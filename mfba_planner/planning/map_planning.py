# SPDX-License-Identifier: Apache-2.0
"""The predictive planner among what stands: local map, distance to go, waypoint, velocity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.geometry import Point, Pose2D, distance, rotated, towards
from ..core.planner_types import Circle, Observation
from ..core.random_streams import stream
from ..optimizers.registry import NONE, optimize
from ..perception.known_map import KnownMap, UnclearedMap
from ..perception.obstacle_tracker import Tracker
from ..perception.static_map import StaticMap, StaticMapParams
from ..swarm.optimizer import Evaluate, Found
from ..swarm.search_region import Disc
from .base_planner import Move, blocked
from .blocked_headings import BlockedHeadings, PlaceCheck
from .differential_drive import Speeds
from .distance_to_go import RouteParams, is_clear
from .map_rollout import FORBIDDEN_M, MapRollout
from .map_search import FoundWaypoint, MapSearch
from .mode_transitions import Event
from .obstacles_at_rest import STOPPING_TICKS, ObstaclesAtRest
from .planner_params import PlannerParams
from .stopping_path import clear_velocity
from .trajectory_cost import RiskParams
from .turn_delay import TurnDelay
from .turning_rollout import SLOW_ROOM_M, SLOWEST

Array = np.ndarray

NEAR_M = 3.5  # of a straight way: with so much room beside it the map is not needed
ROOM_M = 0.25
NEAR_POINTS_M = 1.0  # contact within a tick is ruled out with what stands so near
_LEAST_M = 0.005  # kept from what stands, beyond the robot's radius
_BESIDE_M, _AHEAD_M = 0.15, 0.1
_MOVING_M = 1.0  # edge to edge: the robot may be waiting for what moves so near
_SLOW_MPS, _ESTABLISHED_M = 0.5, 0.05
_EXACT_M = 0.005  # standard deviation of poses from which they hide slow motion
_DRIVES_MPS = 0.1  # a slower velocity is a wait
_NONE = np.zeros(0, dtype=bool)
ENCLOSED = "what stands leaves no way out"
_STRAIGHT = "the straight way is free"


class MapPlanning:
    """The local map of one robot, and decisions by it."""

    def __init__(
        self,
        params: PlannerParams,
        map_params: StaticMapParams,
        route: RouteParams,
        risk: RiskParams,
        headings: int,
        reach_m: float,
        search_m: float,
        seed: int,
        known_map: KnownMap | None = None,
    ) -> None:
        """Start with an empty map, beside the one that is known before the drive."""
        self._params, self._seed = params, seed
        moving = risk.for_turning() if params.turns else risk
        self._horizon_s = moving.horizon_s  # for what moves
        self._risk = replace(moving, horizon_s=risk.horizon_s)
        self._search_m = search_m
        self.map = StaticMap(map_params)
        self._known_map: UnclearedMap | None = None
        if known_map is not None and known_map.count:
            self._known_map = UnclearedMap(known_map, map_params.spacing_m)
        self.search = MapSearch(route, params.robot_radius_m, headings, reach_m, self._known_map)
        self._reach_m = 0.0
        self._radii_m = np.empty(0)  # of the tracks
        self.pose_variance = (0.0, 0.0)  # of single poses, m^2 and rad^2, as far as learnt
        self._may_move = _NONE  # of them, where the odometry hides it
        self._blocked, self._place = BlockedHeadings(), PlaceCheck()

    def update(self, stamp_ns: int, pose: Pose2D, tracker: Tracker) -> None:
        """Take the scan that the tracker has just taken, from the pose."""
        assert tracker.beams is not None
        moving, surely = tracker.moving()
        self._radii_m = tracker.radii_m
        self._reach_m = self.map.params.spacing_m / tracker.beams.spacing_rad
        self.map.update(stamp_ns, pose, tracker.beams, moving, surely, tracker.pose_error)
        # Walls that come into view look like errors of poses to the tracker, but not to the map.
        (vm, vr), by_map = tracker.pose_variance, self.map.matching.variance
        self.pose_variance = min(vm, by_map[0]), min(vr, by_map[1])
        hidden = self.pose_variance[0] > _EXACT_M * _EXACT_M
        self._may_move = tracker.may_move() if hidden else _NONE
        if self._known_map is not None:
            self._known_map.update(tracker.beams, *self._in_map(pose.position))

    def move(
        self,
        obs: Observation,
        goal: Point,
        circles: Sequence[Circle],
        speeds: Speeds,
        unobserved: np.ndarray | None,
        last_waypoint: Point | None,
        tick_s: float,
        *,
        bats: bool = True,
    ) -> Move | None:
        """The next move; None where nothing stands in the way."""
        known, params = self.map, self._params
        if not known.count and self._known_map is None:
            return None
        position, turn = self._in_map(obs.pose.position)
        to_go = self.search.to_go
        to_go.update(obs.pose_ns, known, position, self._in_map(goal)[0])
        if to_go.closed_by:
            self._place.reset()
            return blocked(f"no way to the goal: closed by {to_go.closed_by}")
        if to_go.is_straight:
            away_m = distance(position, to_go.goal)
            share = min(1.0, NEAR_M / max(away_m, NEAR_M))
            gx, gy = to_go.goal
            near = (
                position[0] + share * (gx - position[0]),
                position[1] + share * (gy - position[1]),
            )
            room_m = params.robot_radius_m + ROOM_M
            if is_clear(known, position, near, room_m) and not self._is_beside(position):
                self._place.reset()
                return None
        points = known.contact_points()
        away = np.sqrt(((points - position) ** 2).sum(axis=1))
        clearance = self.search.clearance(known, position, obs.pose_ns)
        circles = self._not_in_map(circles, position)
        speed = params.speed_mps
        rollout = MapRollout(
            position, obs.pose.yaw + turn, speeds, params, params.robot_radius_m, speed,
            tick_s, to_go, clearance, circles, self._horizon_s,
        )  # fmt: skip
        last = None
        if last_waypoint is not None:
            (lx, ly), _ = self._in_map(last_waypoint)
            last = (lx - position[0], ly - position[1])
        delay = None
        if params.turns:
            delay = TurnDelay(params, obs.pose.yaw + turn, speeds.omega)
        near_m = max(NEAR_POINTS_M, params.robot_radius_m + _LEAST_M + self._stopping_m(tick_s))
        open_ = [
            self._blocked.open(obs.pose_ns, position, self.search.headings_rad),
            to_go.open(position, self.search.headings_rad),
            None if unobserved is None else ~unobserved,
        ]
        masks = [mask for mask in open_ if mask is not None]
        drivable = np.logical_and.reduce(masks) if masks else None
        found = self.search.search(
            rollout, position, self._risk, speed, tick_s, delay, drivable, last,
            lambda center, costs: self._refine(center, costs, obs.stamp_ns) if bats else None,
        )  # fmt: skip
        # Who moves in a passage leaves it again: the robot waits.
        waits = any(distance(c.center_m, position) < c.radius_m + _MOVING_M for c in circles)
        came_rad = None if waits else self._place.stays(obs.pose_ns, position)
        if came_rad is not None:
            wanted_rad = math.atan2(found.waypoint[1], found.waypoint[0])
            on = math.cos(wanted_rad - came_rad) > 0.0
            self._close_ahead(obs.pose_ns, position, wanted_rad if on else came_rad)
        return self._as_move(
            obs, found, position, turn, speeds, points[away < near_m], circles, tick_s, waits
        )

    def path_heading_rad(self, pose: Pose2D) -> float:
        """Direction of the shortest way in odom, after move() has not returned None."""
        (x, y), turn = self._in_map(pose.position)
        ux, uy = self.search.to_go.direction_at(x, y)
        return math.atan2(uy, ux) - turn

    def _refine(self, center: Point, evaluate: Evaluate, stamp_ns: int) -> Found | None:
        """A search around a waypoint; None without an optimiser."""
        params = self._params
        if params.optimizer == NONE:
            return None
        disc, generator = Disc(self._search_m, center), stream(self._seed, stamp_ns)
        return optimize(params.optimizer, params.bat, disc, generator, evaluate)

    def _in_map(self, point: Point) -> tuple[Point, float]:
        """A position in the map's frame, and the turn from odom to that frame (rad)."""
        x, y = self.map.to_map(
            np.array([point[0], point[0] + 1.0]), np.array([point[1], point[1]])
        )
        turn = math.atan2(float(y[1] - y[0]), float(x[1] - x[0]))
        return (float(x[0]), float(y[0])), turn

    def _not_in_map(self, circles: Sequence[Circle], position: Point) -> list[Circle]:
        """Circles that move, or are too far away for the map, in the map's frame."""
        if not circles:
            return []
        rows = np.array([(*c.center_m, *c.velocity_mps, c.radius_m) for c in circles])
        x, y = self.map.to_map(rows[:, 0], rows[:, 1])
        dx, dy = x - position[0], y - position[1]
        kept = ((rows[:, 2] != 0.0) | (rows[:, 3] != 0.0)) & ~self._in_established(
            rows, x, y, dx, dy
        )
        kept |= dx * dx + dy * dy > self._reach_m * self._reach_m
        kept[: self._may_move.size] |= self._may_move
        return [
            replace(c, center_m=(cx, cy))
            for c, cx, cy, keep in zip(circles, x.tolist(), y.tolist(), kept.tolist())
            if keep
        ]

    def _close_ahead(self, stamp_ns: int, position: Point, heading_rad: float) -> None:
        """Count the passage right ahead of the robot as closed for a while."""
        place = towards(position, heading_rad, self._params.robot_radius_m + _AHEAD_M)
        self.search.to_go.close(stamp_ns, place)

    def _is_beside(self, position: Point) -> bool:
        """Whether something stands so near that it may be touched by a turn away from it."""
        beside_m = self._params.robot_radius_m + _BESIDE_M
        away = self.map.established_points() - position
        return bool(((away**2).sum(axis=1) < beside_m * beside_m).any())

    def _kept_off(
        self,
        velocity: Point,
        goal_m: float,
        yaw_rad: float,
        speeds: Speeds,
        position: Point,
        near: np.ndarray,
        circles: Sequence[Circle],
        tick_s: float,
    ) -> tuple[Point, float]:
        """The velocity by which nothing that stands is touched before the robot can stop."""
        params = self._params
        radius = params.robot_radius_m + _LEAST_M
        if params.turns:
            # The end of a wall that comes into view may be taken for something slow.
            slow = [c for c in circles if math.hypot(*c.velocity_mps) < _SLOW_MPS]
            rows = [(x, y, radius) for x, y in near.tolist()]
            rows += [(*c.center_m, c.radius_m) for c in slow]
            standing = np.array(rows).reshape(-1, 3) - (*position, 0.0)
            return clear_velocity(velocity, goal_m, yaw_rad, speeds, params, tick_s, standing)
        points = [Circle(center_m=(x, y), radius_m=radius) for x, y in near.tolist()]
        at_rest = ObstaclesAtRest(position, [*points, *circles])
        share = at_rest.allowed_share(velocity, STOPPING_TICKS * tick_s)
        return (share * velocity[0], share * velocity[1]), share

    def _stopping_m(self, tick_s: float) -> float:
        """The way on which the base stops from its full speed."""
        params = self._params
        if not params.turns:
            return 0.0
        speed = min(params.speed_mps, params.max_speed_mps)
        return speed * (STOPPING_TICKS * tick_s + 0.5 * speed / params.max_accel_mps2)

    def _in_established(self, rows: Array, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        """Slow tracks whose near side is where something has stood for long: ends of walls."""
        points = self.map.established_points()
        slow = rows[:, 2] ** 2 + rows[:, 3] ** 2 < _SLOW_MPS * _SLOW_MPS
        if not points.shape[0]:
            return np.zeros(x.size, dtype=bool)
        r = np.zeros(x.size)
        r[: self._radii_m.size] = self._radii_m
        r = np.minimum(r / (np.sqrt(dx * dx + dy * dy) + 1e-9), 1.0)
        near_x, near_y = x - r * dx, y - r * dy
        away = (near_x[:, None] - points[:, 0]) ** 2 + (near_y[:, None] - points[:, 1]) ** 2
        return slow & (away.min(axis=1) < _ESTABLISHED_M * _ESTABLISHED_M)

    def _as_move(
        self,
        obs: Observation,
        found: FoundWaypoint,
        position: Point,
        turn: float,
        speeds: Speeds,
        near: np.ndarray,
        circles: Sequence[Circle],
        tick_s: float,
        waits: bool,
    ) -> Move:
        params = self._params
        if found.cost >= FORBIDDEN_M:
            return blocked(ENCLOSED, found.closed)
        (qx, qy), to_go = found.waypoint, self.search.to_go
        length = math.sqrt(qx * qx + qy * qy)
        scale = 1.0 / max(found.t1, length / params.speed_mps)
        if params.turns:
            clearance = self.search.clearance(self.map, position, obs.pose_ns)
            room = float(clearance.at(np.array([position[0]]), np.array([position[1]]))[0])
            room -= params.robot_radius_m
            scale *= min(max(room / SLOW_ROOM_M, SLOWEST), 1.0)
        goal_m = math.hypot(to_go.goal[0] - position[0], to_go.goal[1] - position[1])
        speed = length * scale
        if speed * tick_s > goal_m:
            scale *= goal_m / (speed * tick_s)
        ux, uy = qx * scale, qy * scale
        (ux, uy), share = self._kept_off(
            (ux, uy), goal_m, obs.pose.yaw + turn, speeds, position, near, circles, tick_s
        )
        if waits or (ux, uy) != (0.0, 0.0) or speed < _DRIVES_MPS:
            self._blocked.drives()
        elif self._blocked.stands(obs.pose_ns, position, math.atan2(qy, qx)):
            self._close_ahead(obs.pose_ns, position, math.atan2(qy, qx))
        percent = 1e2 * share * speed / params.speed_mps
        reason = _STRAIGHT
        if not found.free or not to_go.is_straight:
            reason = f"the way through the map is {found.to_go_m:.3g} m"
            if not found.free:
                reason += f"; costs {found.cost - found.to_go_m:.3g} m more"
        return Move(
            velocity=rotated((ux, uy), -turn),
            reason=f"{reason}, at {percent:.0f} % speed",
            event=Event.CLEAR if found.free and to_go.is_straight else Event.OBSTACLE,
            vs=found.closed,
            vg=found.closed,
            gap=0,
            waypoint=_in_odom(obs.pose, (qx, qy), turn),
            candidates=tuple(_in_odom(obs.pose, q, turn) for q in found.candidates),
        )


def _in_odom(pose: Pose2D, offset: Point, turn: float) -> Point:
    """A position in odom, from its offset to the robot in the map's frame."""
    (x, y), c, s = offset, math.cos(turn), math.sin(turn)
    return (pose.x + c * x + s * y, pose.y + c * y - s * x)
