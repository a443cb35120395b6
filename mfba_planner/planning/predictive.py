# SPDX-License-Identifier: Apache-2.0
"""The paper's architecture with prediction: bits, gaps, the nearest ones, bats for the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.geometry import Point, distance
from ..core.options import check, option
from ..core.random_streams import stream
from ..core.types import NANO, ROBOT_RADIUS_M, Bits, Circle, Observation
from ..perception.obstacle_memory import ObstacleMemory, ObstacleMemoryParams
from ..perception.obstacle_tracker import Tracker, TrackingParams
from ..perception.sensory_vector import SensorParams
from ..swarm.bat_swarm import BatSwarm
from ..swarm.search_region import Disc
from .base_planner import BasePlanner, Move
from .mode_transitions import Event
from .planner_params import PlannerParams
from .trajectory_cost import RiskParams, TrajectoryCost, Way, from_sectors, moved

LENGTHS = (0.25, 0.5, 0.75, 1.0)  # of a gap's waypoints, in reaches
WAITS_S = (0.4, 0.8, 1.4, 2.0, 3.0)
SPEEDS = (1e-6, 0.5)  # while waiting, in full speeds; not 0, so that it has a direction
SHUT = 12  # headings weighed when every one is closed
_FREE_M = 1e-9
_BEFORE = -1  # the last waypoint's number


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictiveParams:
    """What the predictive planner has beside the paper's options."""

    headings: int = option(72, "headings, one bit each", minimum=12, maximum=3600)
    reach_m: float = option(2.5, "farthest waypoint", unit="m", minimum=0.01, maximum=100.0)
    search_m: float = option(
        0.3, "radius of the disc the bats search", unit="m", minimum=0.001, maximum=100.0
    )
    robot_radius_m: float = option(
        ROBOT_RADIUS_M,
        "radius of the robot, which enlarges what scans show",
        unit="m",
        minimum=0.0,
        maximum=10.0,
    )
    sector_radius_m: float = option(
        0.3, "radius of what stands for a set sector", unit="m", minimum=0.01, maximum=10.0
    )
    memory: ObstacleMemoryParams = field(default_factory=ObstacleMemoryParams)
    tracking: TrackingParams = field(default_factory=TrackingParams)
    risk: RiskParams = field(default_factory=RiskParams)

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


def preset(params: PlannerParams | None = None) -> PlannerParams:
    """The given options with the step and the swarm that the predictive planner is made for.

    A step of 0.08 m is 0.1 s at 0.8 m/s: what an obstacle may do unseen stays small. One
    iteration of five bats per tick is enough, since the next tick goes on from their best.
    """
    params = params or PlannerParams()
    bat = replace(params.bat, population=5, iterations=1)
    return replace(params, step_length_m=0.08, bat=bat)


class Predictive(BasePlanner):
    """Straight while that is free; else the best of the nearest gaps, refined by bats.

    A heading's bit is set when it leads too close to a circle within tau at full speed. The
    waypoints weighed lie in the nearest free gaps on either side of the goal's direction (in
    every sixth heading when all are closed: the least risk), and straight on after waiting at
    rest or at half speed. The bats then search a disc around the best. All are measured by
    Prediction.cost: eq. 1 through the waypoint, plus waiting, plus risk. The last waypoint is
    weighed again at every tick, so that the bats' search goes on from tick to tick.
    """

    reads_sectors = False
    preset = staticmethod(preset)

    def __init__(
        self,
        params: PlannerParams,
        sensor: SensorParams,
        seed: int,
        options: PredictiveParams | None = None,
    ) -> None:
        """Start idle; ConfigError for a negative seed."""
        self.options = options or PredictiveParams()
        n = self.options.headings
        angles = 2.0 * math.pi / n * np.arange(1, n + 1)
        self._cos, self._sin = np.cos(angles), np.sin(angles)
        lengths = [share * self.options.reach_m for share in LENGTHS]
        self._rays = [
            [((c * first, s * first), first) for first in lengths]
            for c, s in zip(self._cos.tolist(), self._sin.tolist())
        ]
        self._waypoint: Point | None = None
        self._memory = ObstacleMemory(self.options.memory)
        self._tracker = Tracker(self.options.tracking)
        super().__init__(params, sensor, seed)

    def move(self, obs: Observation, goal: Point) -> Move:
        """Choose waypoint and speed; nothing is searched while the straight way is free."""
        here, speed = obs.pose.position, self.params.speed_mps
        straight = self.straight(here, goal, speed)
        before, self._waypoint = self._waypoint, None
        circles = self._circles(obs)
        if not circles:
            return Move(velocity=straight, reason="no obstacle within SR")
        tick_s = self.tick_s
        (x, y), (gx, gy) = here, goal
        to_goal, left = (gx - x, gy - y), distance(here, goal)
        world = TrajectoryCost(here, circles, self.options.risk, tick_s, speed)
        share = min(1.0, speed * tick_s / left)
        ahead, t_ahead = (to_goal[0] * share, to_goal[1] * share), share * left / speed
        direct = world.cost(ahead, t_ahead, to_goal, speed)
        if direct <= left + _FREE_M:
            return Move(velocity=straight, reason="the straight way is free")
        vs: Bits = tuple(world.closed(self._cos * speed, self._sin * speed).tolist())
        gaps = self._nearest(vs, to_goal)
        way, lasts, least = ahead, t_ahead, direct
        ways = self._waypoints(gaps, to_goal, left)
        if before is not None:  # likely to be the best still: it spares the others most
            q = (before[0] - x, before[1] - y)
            ways.insert(0, (-math.inf, q, max(distance((0.0, 0.0), q) / speed, tick_s), _BEFORE))
        found = world.cheapest(ways, to_goal, speed, direct)
        if found is not None:
            way, lasts, least = found
        swarm = self._fly(world, way, to_goal, least, obs.stamp_ns)
        if swarm.best_value < least:
            (qx, qy), least = swarm.best_x, swarm.best_value
            way = (qx, qy)
            lasts = max(math.sqrt(qx * qx + qy * qy) / speed, tick_s)
        if distance((0.0, 0.0), way) > 0.999 * lasts * speed:
            self._waypoint = (x + way[0], y + way[1])
        scale = 1.0 / max(lasts, distance((0.0, 0.0), way) / speed)
        u = (way[0] * scale, way[1] * scale)
        gap = self._gap(way)
        why = f"the straight way closes; {least - left:.3g} m longer"
        if all(vs):
            why, gap = f"every heading closes; the least risk costs {least - left:.3g} m", 0
        elif vs[gap - 1]:
            gap = 0
        return Move(
            velocity=u,
            reason=f"{why}, at {1e2 * distance((0.0, 0.0), u) / speed:.0f} % speed",
            event=Event.OBSTACLE,
            vs=vs,
            vg=vs,  # a heading is as narrow as a gap: it stands for both
            gap=gap,
            waypoint=(x + way[0], y + way[1]),
            candidates=tuple((x + dx, y + dy) for dx, dy in swarm.candidates),
        )

    def forget(self) -> None:
        """Drop the last waypoint, all tracks and all that is out of sight."""
        self._waypoint = None
        self._memory = ObstacleMemory(self.options.memory)
        self._tracker = Tracker(self.options.tracking)

    def _circles(self, obs: Observation) -> Sequence[Circle]:
        """The circles as they are now: told or remembered, tracked, or a stand-in per sector."""
        stamp_ns, pose = obs.sensed or (obs.stamp_ns, obs.pose)
        if obs.circles is not None:
            reach_m = self.sensor.sensing_range_m
            known = self._memory.update(stamp_ns, pose.position, reach_m, obs.circles)
            return moved(known, (obs.stamp_ns - stamp_ns) * NANO)
        if obs.scan is not None:
            self._tracker.update(stamp_ns, pose, obs.scan)
            radius_m = self.params.scan_radius_m or self.options.robot_radius_m
            return self._tracker.circles(obs.stamp_ns, radius_m)
        return from_sectors(pose.position, obs.ranges_m, self.options.sector_radius_m)

    def _nearest(self, closed: Bits, to_goal: Point) -> list[int]:
        """The free headings nearest to the goal's on either side; a few when none is free."""
        n = len(closed)
        if 0 not in closed:
            return list(range(0, n, n // SHUT))
        above = math.floor(math.atan2(to_goal[1], to_goal[0]) * n / (2.0 * math.pi)) % n
        around = closed[above:] + closed[:above]
        left, right = around.index(0), n - 1 - around[::-1].index(0)
        return [(above + k) % n for k in sorted({left, right})]

    def _gap(self, way: Point) -> int:
        """Number (from 1) of the heading nearest to a waypoint; the last one is +x."""
        n = self.options.headings
        return (round(math.atan2(way[1], way[0]) * n / (2.0 * math.pi)) - 1) % n + 1

    def _waypoints(self, gaps: list[int], to_goal: Point, left: float) -> list[Way]:
        """Waypoints to be weighed, numbered by heading, or from n on where they are waited for.

        The cheapest come first: most of the others need not be weighed then.
        """
        speed, (gx, gy), ways = self.params.speed_mps, to_goal, []
        for k in gaps:
            for q, first in self._rays[k]:
                rx, ry = gx - q[0], gy - q[1]
                ways.append((first + math.sqrt(rx * rx + ry * ry), q, first / speed, k))
        ex, ey = gx / left * speed, gy / left * speed
        waiting = self.options.risk.waiting * speed
        for number, share in enumerate(SPEEDS, self.options.headings):
            for t in WAITS_S:
                lower = left + waiting * t * (1.0 - share)
                ways.append((lower - _FREE_M, (ex * share * t, ey * share * t), t, number))
        ways.sort()
        return ways

    def _fly(
        self, world: TrajectoryCost, center: Point, to_goal: Point, bound: float, stamp_ns: int
    ) -> BatSwarm:
        """Bats around the best waypoint so far; what cannot be below the bound is not weighed."""
        bat, speed, tick_s = self.params.bat, self.params.speed_mps, self.tick_s
        disc = Disc(self.options.search_m, center)
        swarm = BatSwarm(bat, disc, stream(self.seed, stamp_ns), ahead=bat.iterations)
        for _ in range(bat.iterations + 1):
            values = []
            for qx, qy in swarm.ask():
                # A velocity is held for a tick: who is there sooner would drive beyond it.
                t1 = max(math.sqrt(qx * qx + qy * qy) / speed, tick_s)
                values.append(world.cost((qx, qy), t1, to_goal, speed, bound))
            swarm.tell(values)
            bound = min(bound, swarm.best_value)
        return swarm
