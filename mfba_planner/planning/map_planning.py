# SPDX-License-Identifier: Apache-2.0
"""The predictive planner among what stands: local map, distance to go, waypoint, velocity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.geometry import Point
from ..core.planner_types import Circle, Observation
from ..core.random_streams import stream
from ..perception.distance_field import DistanceField
from ..perception.obstacle_tracker import Tracker
from ..perception.static_map import StaticMap, StaticMapParams
from ..swarm.bat_swarm import BatSwarm
from ..swarm.search_region import Disc
from .base_planner import Move
from .differential_drive import Speeds, brake
from .distance_to_go import RouteParams
from .map_rollout import FORBIDDEN_M, SLOW_ROOM_M, SLOWEST, MapRollout
from .map_search import Found, MapSearch
from .mode_transitions import Event
from .obstacles_at_rest import STOPPING_TICKS, ObstaclesAtRest
from .planner_params import PlannerParams
from .trajectory_cost import RiskParams
from .turn_delay import TurnDelay

NEAR_M = 3.5  # what stands farther away does not matter while the straight way is clear
NEAR_POINTS_M = 1.0  # contact within a tick is ruled out with what stands so near
_LEAST_M = 0.005  # kept from what stands, beyond the robot's radius
_MAPPED_M = 0.1  # so near to its outline is a point of the map on a circle at rest
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
    ) -> None:
        """Start with an empty map."""
        self._params, self._seed = params, seed
        self._risk = risk.for_turning() if params.turns else risk
        self._search_m = search_m
        self.map = StaticMap(map_params)
        self._search = MapSearch(route, params.robot_radius_m, headings, reach_m)
        self._reach_m = 0.0

    def update(self, stamp_ns: int, observation_pose: Observation, tracker: Tracker) -> None:
        """Take the scan that the tracker has just taken."""
        pose = (observation_pose.sensed or (0, observation_pose.pose))[1]
        assert tracker.beams is not None
        moving, surely = tracker.moving()
        self._reach_m = self.map.params.spacing_m / tracker.beams.spacing_rad
        self.map.update(stamp_ns, pose, tracker.beams, moving, surely, tracker.pose_error)

    def move(
        self,
        obs: Observation,
        goal: Point,
        circles: Sequence[Circle],
        speeds: Speeds,
        unobserved: np.ndarray | None,
        last_waypoint: Point | None,
        tick_s: float,
    ) -> Move | None:
        """The next move; None where nothing stands in the way."""
        known, params = self.map, self._params
        if not known.count:
            return None
        position, turn = self._in_map(obs.pose.position)
        to_go = self._search.to_go
        to_go.update(obs.pose_ns, known, position, self._in_map(goal)[0])
        if to_go.closed_by:
            return Move(
                velocity=(0.0, 0.0), reason=f"no way to the goal: closed by {to_go.closed_by}",
                event=Event.NO_GAP,
            )  # fmt: skip
        points = known.map_points()
        away = np.sqrt(((points - position) ** 2).sum(axis=1))
        if to_go.is_straight and float(away.min()) > NEAR_M:
            return None
        clearance = self._search.clearance(known, position, obs.pose_ns)
        circles = self._not_in_map(circles, position, clearance)
        speed = params.speed_mps
        rollout = MapRollout(
            position, obs.pose.yaw + turn, speeds, params, params.robot_radius_m, speed,
            tick_s, to_go, clearance, circles, self._risk.horizon_s,
        )  # fmt: skip
        last = None
        if last_waypoint is not None:
            (lx, ly), _ = self._in_map(last_waypoint)
            last = (lx - position[0], ly - position[1])
        delay = None
        if params.turns:
            delay = TurnDelay(params, obs.pose.yaw + turn, speeds.omega)
        near_m = max(NEAR_POINTS_M, params.robot_radius_m + _LEAST_M + self._stopping_m(tick_s))
        observed = None if unobserved is None else ~unobserved
        found = self._search.search(
            rollout, position, self._risk, speed, tick_s, delay, observed, last,
            lambda center: self._swarm(center, obs.stamp_ns),
        )  # fmt: skip
        return self._as_move(obs, found, position, turn, points[away < near_m], circles, tick_s)

    def _swarm(self, center: Point, stamp_ns: int) -> BatSwarm:
        bat = self._params.bat
        return BatSwarm(
            bat, Disc(self._search_m, center), stream(self._seed, stamp_ns), ahead=bat.iterations
        )

    def _in_map(self, point: Point) -> tuple[Point, float]:
        """A position in the map's frame, and the turn from odom to that frame (rad)."""
        x, y = self.map.to_map(
            np.array([point[0], point[0] + 1.0]), np.array([point[1], point[1]])
        )
        turn = math.atan2(float(y[1] - y[0]), float(x[1] - x[0]))
        return (float(x[0]), float(y[0])), turn

    def _not_in_map(
        self, circles: Sequence[Circle], position: Point, clearance: DistanceField
    ) -> list[Circle]:
        """Circles that move, or stand and are not in the map, in the map's frame."""
        if not circles:
            return []
        rows = np.array([(*c.center_m, *c.velocity_mps, c.radius_m) for c in circles])
        x, y = self.map.to_map(rows[:, 0], rows[:, 1])
        dx, dy = x - position[0], y - position[1]
        kept = (rows[:, 2] != 0.0) | (rows[:, 3] != 0.0)
        kept |= dx * dx + dy * dy > self._reach_m * self._reach_m
        # What may move is not marked, but may have been marked before it began to.
        outline_m = rows[:, 4] - self._params.robot_radius_m + _MAPPED_M
        kept |= clearance.at(x, y) > outline_m
        return [
            replace(c, center_m=(cx, cy))
            for c, cx, cy, keep in zip(circles, x.tolist(), y.tolist(), kept.tolist())
            if keep
        ]

    def _braking_share(
        self, at_rest: ObstaclesAtRest, yaw_rad: float, velocity: Point, tick_s: float
    ) -> float:
        """Share of the velocity from which a differential base stops before contact.

        While it brakes it rolls on along its heading.
        """
        (ux, uy), held_s = velocity, STOPPING_TICKS * tick_s
        speed = math.sqrt(ux * ux + uy * uy)
        hx, hy = math.cos(yaw_rad), math.sin(yaw_rad)
        if self._params.reverse and hx * ux + hy * uy < 0.0:
            hx, hy = -hx, -hy
        far_m = self._stopping_m(tick_s)
        free_m = far_m * at_rest.allowed_share((far_m * hx, far_m * hy), 1.0)
        return min(brake(free_m, self._params.max_accel_mps2, held_s) / max(speed, 1e-9), 1.0)

    def _stopping_m(self, tick_s: float) -> float:
        """The way on which the base stops from its full speed."""
        params = self._params
        if not params.turns:
            return 0.0
        speed = min(params.speed_mps, params.max_speed_mps)
        return speed * (STOPPING_TICKS * tick_s + 0.5 * speed / params.max_accel_mps2)

    def _as_move(
        self,
        obs: Observation,
        found: Found,
        position: Point,
        turn: float,
        near: np.ndarray,
        circles: Sequence[Circle],
        tick_s: float,
    ) -> Move:
        params = self._params
        if found.cost >= FORBIDDEN_M:
            reason = "what stands leaves no way out"
            return Move(
                velocity=(0.0, 0.0), reason=reason, event=Event.NO_GAP, vs=found.closed,
                vg=found.closed,
            )  # fmt: skip
        (qx, qy), to_go = found.waypoint, self._search.to_go
        length = math.sqrt(qx * qx + qy * qy)
        scale = 1.0 / max(found.t1, length / params.speed_mps)
        if params.turns:
            clearance = self._search.clearance(self.map, position, obs.pose_ns)
            room = float(clearance.at(np.array([position[0]]), np.array([position[1]]))[0])
            room -= params.robot_radius_m
            scale *= min(max(room / SLOW_ROOM_M, SLOWEST), 1.0)
        goal_m = math.hypot(to_go.goal[0] - position[0], to_go.goal[1] - position[1])
        speed = length * scale
        if speed * tick_s > goal_m:
            scale *= goal_m / (speed * tick_s)
        ux, uy = qx * scale, qy * scale
        radius = params.robot_radius_m + _LEAST_M
        standing = [Circle(center_m=(x, y), radius_m=radius) for x, y in near.tolist()]
        at_rest = ObstaclesAtRest(position, [*standing, *circles])
        share = at_rest.allowed_share((ux, uy), STOPPING_TICKS * tick_s)
        if params.turns:
            share *= self._braking_share(
                at_rest, obs.pose.yaw + turn, (share * ux, share * uy), tick_s
            )
        c, s = math.cos(turn), math.sin(turn)
        velocity = (share * (c * ux + s * uy), share * (c * uy - s * ux))
        waypoint = (obs.pose.x + c * qx + s * qy, obs.pose.y + c * qy - s * qx)
        percent = 1e2 * share * math.hypot(ux, uy) / params.speed_mps
        way = _STRAIGHT
        if not found.free or not to_go.is_straight:
            way = f"the way through the map is {found.to_go_m:.3g} m"
            if not found.free:
                way += f"; costs {found.cost - found.to_go_m:.3g} m more"
        return Move(
            velocity=velocity,
            reason=f"{way}, at {percent:.0f} % speed",
            event=Event.CLEAR if found.free and to_go.is_straight else Event.OBSTACLE,
            vs=found.closed,
            vg=found.closed,
            gap=0,
            waypoint=waypoint,
            candidates=tuple(
                (obs.pose.x + c * x + s * y, obs.pose.y + c * y - s * x)
                for x, y in found.candidates
            ),
        )
