# SPDX-License-Identifier: Apache-2.0
"""The predictive planner: bits and gaps as in the paper, but of predicted obstacle motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.geometry import Point, Pose2D, bearing, distance, rotated
from ..core.planner_types import NANO, Bits, Circle, Decision, Observation, Ranges
from ..core.random_streams import stream
from ..optimizers.registry import NONE, optimize, require_optimizer
from ..perception.known_map import KnownMap
from ..perception.obstacle_memory import ObstacleMemory
from ..perception.obstacle_tracker import Tracker
from ..perception.scan_coverage import ScanCoverage
from ..perception.sensory_vector import SensorParams, sense_circles
from ..perception.static_map import StaticMap
from ..swarm.optimizer import Found
from ..swarm.search_region import Disc, Vector
from .base_planner import BasePlanner, Move, blocked
from .candidate_waypoints import HEADINGS_IF_CLOSED, CandidateWaypoints, nearest_free
from .dead_reckoning import DeadReckoning
from .differential_drive import Speeds, apply_command, command
from .drive_rollout import DriveRollout
from .map_planning import ENCLOSED, MapPlanning
from .mode_transitions import Event
from .obstacles_at_rest import STOPPING_TICKS, ObstaclesAtRest
from .planner_params import PlannerParams
from .predictive_params import PredictiveParams
from .sector_changes import SectorChanges
from .stopping_path import clear_velocity
from .trajectory_cost import (
    Candidate,
    TrajectoryCost,
    circles_from_sectors,
    predicted_circles,
)
from .turn_to_observe import turn_to_observe

TOWARDS = math.cos(math.radians(80.0))
UNOBSERVED = "no direction that the lidar has covered leads on"
_FREE_M = 1e-9
_LAST_WAYPOINT = -1  # candidate number of the last tick's waypoint


def preset(params: PlannerParams | None = None) -> PlannerParams:
    """The given options with the goal step and the swarm tuned for the predictive planner.

    A goal step of 0.08 m takes 0.1 s at 0.8 m/s, so obstacles move little between ticks. One
    iteration of five bats per tick is enough, as the next tick continues from their best.
    """
    params = params or PlannerParams()
    bat = replace(params.bat, population=5, iterations=1)
    return replace(params, step_length_m=0.08, bat=bat)


class Predictive(BasePlanner):
    """Straight to the goal if free; otherwise the cheapest candidate waypoint, refined by bats.

    A heading's bit is set if at full speed the robot comes too close to a circle within tau. The
    candidates lie in the nearest free headings on both sides of the goal direction (in every
    sixth heading if all are closed), and on the straight line after waiting at rest or at half
    speed. The bats then search a disc around the best. The objective of all is
    TrajectoryCost.cost: eq. 1 through the waypoint, plus waiting, plus risk. The waypoint of the
    last tick is a candidate again, so that the search continues from tick to tick.
    """

    reads_sectors = False
    has_bats = True
    has_map = True
    preset = staticmethod(preset)
    _perceived: Sequence[Circle] = ()
    _by_sectors = True
    _speeds: Speeds = Speeds()
    _unobserved: np.ndarray | None = None  # headings the lidar has not covered; None: none
    _coverage: ScanCoverage
    _known_map: KnownMap | None = None

    def __init__(
        self,
        params: PlannerParams,
        sensor: SensorParams,
        seed: int,
        options: PredictiveParams | None = None,
    ) -> None:
        """Start idle; ConfigError for a negative seed or an unknown optimiser."""
        require_optimizer(params.optimizer)
        self.options = options or PredictiveParams()
        n = self.options.headings
        angles = 2.0 * math.pi / n * np.arange(1, n + 1)
        self._cos, self._sin = np.cos(angles), np.sin(angles)
        self._candidates = CandidateWaypoints(
            self._cos.tolist(), self._sin.tolist(), self.options.reach_m
        )
        self._waypoint: Point | None = None
        super().__init__(params, sensor, seed)

    def move(self, obs: Observation, goal: Point) -> Move:
        """Choose waypoint and speed, and never touch what stands before the robot can stop."""
        self._perceived = self._circles(obs)
        among = self._beside_the_scan(obs)
        move = self._turned_to_observe(self._move(among, goal), among, goal)
        turn = obs.pose.yaw - among.pose.yaw
        return replace(move, velocity=rotated(move.velocity, turn)) if turn else move

    def _turned_to_observe(self, move: Move, obs: Observation, goal: Point) -> Move:
        if self._unobserved is None or not self.params.turns:
            return move
        if move.reason == ENCLOSED:
            wanted_rad = self._map_planning.path_heading_rad(obs.pose)
        elif move.reason == UNOBSERVED:
            wanted_rad = bearing(obs.pose.position, goal)
        else:
            return move
        return turn_to_observe(
            move, self._unobserved, wanted_rad, obs.pose.yaw, self._speeds, self.params
        )

    def _move(self, obs: Observation, goal: Point) -> Move:
        position = obs.pose.position
        last_waypoint, self._waypoint = self._waypoint, None
        circles = self._perceived
        self._by_sectors = obs.circles is None and obs.scan is None
        self._unobserved = None if obs.scan is None else self._coverage.unsafe(obs.pose_ns)
        if obs.scan is not None and obs.circles is None and self.has_map:
            among = self._map_planning.move(
                obs, goal, circles, self._speeds, self._unobserved, last_waypoint, self.tick_s,
                bats=self.has_bats,
            )  # fmt: skip
            if among is not None:
                self._waypoint = among.waypoint if among.event is Event.OBSTACLE else None
                return among
        if not circles and self._is_observed((goal[0] - position[0], goal[1] - position[1])):
            self._changes.not_enclosed()
            straight = self.straight(position, goal, self.params.speed_mps)
            return Move(velocity=straight, reason="no obstacle in range")
        at_rest = ObstaclesAtRest(position, circles)
        if misplaced := at_rest.misplaced():
            return blocked(misplaced)
        chosen = self._choose(obs, goal, last_waypoint, at_rest)
        move = self._kept_off(chosen, at_rest, obs.pose, distance(position, goal))
        if not all(move.vs or (0,)):
            self._changes.not_enclosed()
        return move

    def _choose(
        self,
        obs: Observation,
        goal: Point,
        last_waypoint: Point | None,
        at_rest: ObstaclesAtRest,
    ) -> Move:
        """The cheapest waypoint and speed; no search while the straight line is free."""
        position, circles = obs.pose.position, self._perceived
        speed, tick_s = self.params.speed_mps, self.tick_s
        (x, y), (gx, gy) = position, goal
        to_goal, goal_distance = (gx - x, gy - y), distance(position, goal)
        drive = self._drive_rollout(obs)
        risk = self.options.risk if drive is None else self.options.risk.for_turning()
        costs = TrajectoryCost(position, circles, risk, tick_s, speed, drive)
        share = min(1.0, speed * tick_s / goal_distance)
        waypoint, t1 = (to_goal[0] * share, to_goal[1] * share), share * goal_distance / speed
        observed = self._is_observed(to_goal)
        least = costs.cost(waypoint, t1, to_goal, speed) if observed else math.inf
        if least <= goal_distance + _FREE_M:
            straight = self.straight(position, goal, speed)
            return Move(velocity=straight, reason="the straight way is free")
        vs = self._closed_headings(costs)
        enclosure = "" if 0 in vs else self._enclosure(position, at_rest)
        if enclosure and self._changes.at_rest(obs):
            return blocked(enclosure, vs)
        if self._unobserved is not None and not self._is_towards(to_goal):
            return blocked(UNOBSERVED, vs)
        gaps = nearest_free(vs, to_goal)
        if drive is not None:  # where the bits, which know the turn but not the arc, are wrong
            gaps = sorted({*gaps, *range(0, len(vs), len(vs) // HEADINGS_IF_CLOSED)})
        candidates = self._waypoints(gaps, to_goal, goal_distance)
        if last_waypoint is not None:  # often still the best: then most others need no evaluation
            q = (last_waypoint[0] - x, last_waypoint[1] - y)
            candidates.insert(
                0, (-math.inf, q, max(distance((0.0, 0.0), q) / speed, tick_s), _LAST_WAYPOINT)
            )
        if self._unobserved is not None:
            candidates = [item for item in candidates if self._is_observed(item[1])]
        found = costs.cheapest(candidates, to_goal, speed, least)
        if found is not None:
            waypoint, t1, least = found
        refined = self._refine(costs, waypoint, to_goal, least, obs.stamp_ns)
        if not min(refined.best_value, least) < math.inf:
            return blocked(UNOBSERVED, vs)
        if refined.best_value < least:
            (qx, qy), least = refined.best_x, refined.best_value
            waypoint = (qx, qy)
            t1 = max(math.sqrt(qx * qx + qy * qy) / speed, tick_s)
        if distance((0.0, 0.0), waypoint) > 0.999 * t1 * speed:
            self._waypoint = (x + waypoint[0], y + waypoint[1])
        scale = 1.0 / max(t1, distance((0.0, 0.0), waypoint) / speed)
        u = (waypoint[0] * scale, waypoint[1] * scale)
        gap, excess = self._gap(waypoint), least - goal_distance
        reason = f"the straight way closes; {excess:.3g} m longer"
        if all(vs):
            reason, gap = f"every heading closes; the least risk costs {excess:.3g} m", 0
        elif vs[gap - 1]:
            gap = 0
        return Move(
            velocity=u,
            reason=f"{reason}, at {1e2 * distance((0.0, 0.0), u) / speed:.0f} % speed",
            event=Event.OBSTACLE,
            vs=vs,
            vg=vs,  # here a heading is both sector and gap
            gap=gap,
            waypoint=(x + waypoint[0], y + waypoint[1]),
            candidates=tuple((x + dx, y + dy) for dx, dy in refined.candidates),
        )

    def _closed_headings(self, costs: TrajectoryCost) -> Bits:
        speed = self.params.speed_mps
        closed = costs.closed(self._cos * speed, self._sin * speed)
        if self._unobserved is not None:
            closed |= self._unobserved
        return tuple(closed.tolist())

    def _is_observed(self, offset: Point) -> bool:
        """Whether the lidar has covered an offset's direction; waiting has that of the goal."""
        if self._unobserved is None:
            return True
        return not self._unobserved[self._gap(offset) - 1]

    def _enclosure(self, position: Point, at_rest: ObstaclesAtRest) -> str:
        """Why no path leads out between obstacles at rest; "" if one does, or a heading is open.

        Obstacles that move are left out: their ring opens again.
        """
        if len(at_rest.circles) < len(self._perceived):
            risk, speed = self.options.risk, self.params.speed_mps
            costs = TrajectoryCost(position, at_rest.circles, risk, self.tick_s, speed)
            if 0 in self._closed_headings(costs):
                return ""
        return at_rest.enclosure()

    def _kept_off(self, move: Move, at_rest: ObstaclesAtRest, pose: Pose2D, goal_m: float) -> Move:
        """The move, shortened so that it touches nothing at rest until the robot can stop."""
        (vx, vy), params = move.velocity, self.params
        if params.turns:
            velocity, share = clear_velocity(
                (vx, vy), goal_m, pose.yaw, self._speeds, params, self.tick_s, at_rest.rows()
            )
        else:
            share = at_rest.allowed_share((vx, vy), STOPPING_TICKS * self.tick_s)
            velocity = (share * vx, share * vy)
        if share == 1.0:
            return move
        note = f"{1e2 * share:.0f} % of it, as contact is near"
        return replace(move, velocity=velocity, reason=f"{move.reason}; {note}")

    def surroundings(self, position: Point) -> Ranges:
        """Range per sector to the circles of the last decision, inf where there are none.

        0 where no beam has covered a direction; empty if the decision was made on sectors.
        """
        if self._by_sectors:
            return ()
        sensor = replace(self.sensor, sensing_range_m=self.options.reach_m)
        circles = [(circle.center_m, circle.radius_m) for circle in self._perceived]
        ranges = list(sense_circles(position, circles, sensor))
        if self._unobserved is not None:
            count, n = len(ranges), self.options.headings
            for k in np.flatnonzero(self._unobserved).tolist():
                ranges[(k + 1) * count // n % count] = 0.0
        return tuple(ranges)

    def local_map(self) -> StaticMap:
        """What stands, as seen in the scans; empty without scans."""
        return self._map_planning.map

    def plan(self, obs: Observation) -> Decision:
        """Decide, and for a differential drive keep the speeds that the decision leads to."""
        decision = super().plan(obs)
        pose, tick_ns = obs.pose, self.params.tick_ns
        if self.params.turns:
            given = command(decision, self.params, tick_ns)
            after, self._speeds = apply_command(pose, self._speeds, given, self.params, tick_ns)
        else:
            (vx, vy), tick_s = decision.velocity, self.tick_s
            after = Pose2D(pose.x + vx * tick_s, pose.y + vy * tick_s, pose.yaw)
        self._dead_reckoning.command(obs.pose_ns, pose, after)
        return decision

    def replan(self) -> None:
        """Drop the last waypoint; what has been perceived is kept."""
        self._waypoint = None
        self._changes = SectorChanges()

    def forget(self) -> None:
        """Drop the last waypoint, the map, the tracks and the remembered circles."""
        self._waypoint = None
        self._perceived = ()
        self._speeds = Speeds()
        self._unobserved = None
        self._coverage = ScanCoverage(self.options.headings, self.options.coverage_s)
        self._changes = SectorChanges()
        self._memory = ObstacleMemory(self.options.memory)
        self.tracker = Tracker(self.options.tracking)
        self._dead_reckoning = DeadReckoning(self.params.tick_ns)
        self._map_planning = MapPlanning(
            self.params, self.options.map, self.options.route, self.options.risk,
            self.options.headings, self.options.reach_m, self.options.search_m, self.seed,
            self._known_map,
        )  # fmt: skip

    def set_known_map(self, known_map: KnownMap | None) -> None:
        """Take a map that is known before the drive; another one than before: forget()."""
        if known_map is not self._known_map:
            self._known_map = known_map
            self.forget()

    def _circles(self, obs: Observation) -> Sequence[Circle]:
        """Circles at obs.pose_ns: given and remembered, tracked, or one for each set sector."""
        stamp_ns, pose = obs.sensed or (obs.stamp_ns, obs.pose)
        if obs.circles is not None:
            reach_m = self.sensor.sensing_range_m
            known = self._memory.update(stamp_ns, pose.position, reach_m, obs.circles)
            return predicted_circles(known, (obs.pose_ns - stamp_ns) * NANO)
        if obs.scan is not None:
            pose = obs.scan.taken_from(pose)
            self.tracker.update(stamp_ns, pose, obs.scan)
            self._coverage.update(stamp_ns, obs.scan)
            self._map_planning.update(stamp_ns, pose, self.tracker)
            return self.tracker.circles(obs.pose_ns, self.params.robot_radius_m)
        return circles_from_sectors(pose.position, obs.ranges_m, self.options.sector_radius_m)

    def _beside_the_scan(self, obs: Observation) -> Observation:
        """The observation with the pose beside a scan that is older (dead_reckoning.py)."""
        if obs.scan is None or obs.circles is not None or obs.sensed is None:
            return obs
        now = obs.pose_ns, obs.pose
        error, variance = self.tracker.pose_error, self._map_planning.pose_variance
        return replace(obs, pose=self._dead_reckoning.pose(obs.sensed, now, error, variance))

    def _drive_rollout(self, obs: Observation) -> DriveRollout | None:
        """The rollout of a differential drive from its present state; None for others."""
        if not self.params.turns:
            return None
        speed = self.params.speed_mps
        return DriveRollout(self.params, obs.pose.yaw, self._speeds, speed, self.tick_s)

    def _is_towards(self, to_goal: Point) -> bool:
        """Whether an observed heading leads nearer to the goal; if not, it would lead astray."""
        assert self._unobserved is not None
        angle = math.atan2(to_goal[1], to_goal[0])
        nearer = self._cos * math.cos(angle) + self._sin * math.sin(angle) > TOWARDS
        return bool((nearer & ~self._unobserved).any())

    def _gap(self, waypoint: Point) -> int:
        """Number (from 1) of the heading nearest to a waypoint; the last one is +x."""
        n = self.options.headings
        return (round(math.atan2(waypoint[1], waypoint[0]) * n / (2.0 * math.pi)) - 1) % n + 1

    def _waypoints(self, gaps: list[int], to_goal: Point, goal_distance: float) -> list[Candidate]:
        """Candidate waypoints, by their least possible cost (candidate_waypoints.py)."""
        speed, waiting = self.params.speed_mps, self.options.risk.waiting
        return self._candidates.of(gaps, to_goal, goal_distance, speed, waiting)

    def _refine(
        self, costs: TrajectoryCost, center: Point, to_goal: Point, bound: float, stamp_ns: int
    ) -> Found:
        """Search around the best waypoint; costs not below the bound are cut short."""
        params, speed, tick_s = self.params, self.params.speed_mps, self.tick_s
        if params.optimizer == NONE:
            return Found()

        def evaluate(points: list[Vector]) -> list[float]:
            nonlocal bound
            values = []
            for qx, qy in points:
                # At least one tick: the velocity is held that long and must not overshoot.
                t1 = max(math.sqrt(qx * qx + qy * qy) / speed, tick_s)
                if self._is_observed((qx, qy)):
                    values.append(costs.cost((qx, qy), t1, to_goal, speed, bound))
                else:
                    values.append(math.inf)
            bound = min(bound, *values)
            return values

        disc, generator = Disc(self.options.search_m, center), stream(self.seed, stamp_ns)
        return optimize(params.optimizer, params.bat, disc, generator, evaluate)
