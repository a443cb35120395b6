# SPDX-License-Identifier: Apache-2.0
"""The oracle's independent check: shares no formula with simulation's motion or contact.

Obstacles are followed from event to event (a wall reverses a velocity, a turn or knot replaces
it); simulation folds coordinates and times. The distance is the minimum of a quadratic;
simulation projects onto a segment. The distance to a wall is that of its own frame, cut into
quadratics; simulation takes the least of four distances of ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from ...simulation.obstacle_motion import Obstacle, Walls
from ...simulation.scenario import Scenario
from .solution import Waypoint

Fault = str
Piece = tuple[float, float, float, float, float, float]  # start, end, x, y, vx, vy

SLACK = 1e-9


def pieces(obstacle: Obstacle, walls: Walls | None, until_s: float) -> Iterator[Piece]:
    """The obstacle's motion in [0, until_s] between events, while it is there; m, s."""
    begin = obstacle.appears_s
    end = until_s if obstacle.vanishes_s is None else min(until_s, obstacle.vanishes_s)
    found = _recorded(obstacle, until_s) if obstacle.trajectory else _moved(obstacle, walls, end)
    for since, until, x, y, vx, vy in found:
        a, b = max(since, begin), min(until, end)
        if a < b:
            yield a, b, x + vx * (a - since), y + vy * (a - since), vx, vy


def _recorded(obstacle: Obstacle, until_s: float) -> Iterator[Piece]:
    """From knot to knot; loops are laid out one lap after the other."""
    knots = list(obstacle.trajectory)
    if obstacle.stays:
        knots.insert(0, (min(0.0, knots[0][0]) - 1.0, *knots[0][1:]))
        knots.append((max(until_s, knots[-1][0]) + 1.0, *knots[-1][1:]))
    late = 0.0
    while True:
        for (t, x, y), (u, x1, y1) in pairwise(knots):
            start, end = max(0.0, t + late), min(until_s, u + late)
            if start < end:
                vx, vy = (x1 - x) / (u - t), (y1 - y) / (u - t)
                since = start - (t + late)
                yield start, end, x + vx * since, y + vy * since, vx, vy
        late += knots[-1][0] - knots[0][0]
        if not obstacle.loop or knots[0][0] + late >= until_s:
            return


def _moved(obstacle: Obstacle, walls: Walls | None, until_s: float) -> Iterator[Piece]:
    """From wall to wall and from turn to turn."""
    (x, y), (vx, vy) = obstacle.center_m, _polar(obstacle.speed_mps, obstacle.heading_rad)
    t = 0.0
    due = list(obstacle.turns)
    while t < until_s:
        if walls is not None:
            r = obstacle.radius_m
            x, vx = _inwards(x, vx, walls.lower_m[0] + r, walls.upper_m[0] - r)
            y, vy = _inwards(y, vy, walls.lower_m[1] + r, walls.upper_m[1] - r)
        end = min(until_s, due[0].at_s if due else math.inf)
        if walls is not None:
            end = min(
                end,
                t + _until_wall(x, vx, walls.lower_m[0] + r, walls.upper_m[0] - r),
                t + _until_wall(y, vy, walls.lower_m[1] + r, walls.upper_m[1] - r),
            )
        if end > t:
            yield t, end, x, y, vx, vy
        x, y, t = x + vx * (end - t), y + vy * (end - t), end
        while due and due[0].at_s <= t:
            turn = due.pop(0)
            vx, vy = _polar(turn.speed_mps, turn.heading_rad)


def _polar(speed: float, heading: float) -> tuple[float, float]:
    return speed * math.cos(heading), speed * math.sin(heading)


def _inwards(value: float, speed: float, low: float, high: float) -> tuple[float, float]:
    """At a wall the speed points away from it; without room there is no motion."""
    if high <= low:
        return low, 0.0
    if value <= low + SLACK * 1e-3:
        return max(value, low), abs(speed)
    if value >= high - SLACK * 1e-3:
        return min(value, high), -abs(speed)
    return value, speed


def _until_wall(value: float, speed: float, low: float, high: float) -> float:
    if speed == 0.0:
        return math.inf
    return ((high if speed > 0.0 else low) - value) / speed


def clearance(scenario: Scenario, waypoints: Sequence[Waypoint]) -> float:
    """Smallest gap (m) to any enlarged circle or wall along straight segments; < 0: contact."""
    smallest = wall_clearance(scenario, waypoints)
    for obstacle in scenario.obstacles:
        radius = obstacle.radius_m + scenario.robot_radius_m
        for piece in pieces(obstacle, scenario.walls, waypoints[-1].t_s):
            for a, b in pairwise(waypoints):
                start, end = max(piece[0], a.t_s), min(piece[1], b.t_s)
                if start <= end and a.t_s < b.t_s:
                    smallest = min(smallest, _smallest_distance(a, b, piece, start, end) - radius)
    return smallest


def _smallest_distance(a: Waypoint, b: Waypoint, piece: Piece, start: float, end: float) -> float:
    """Smallest distance in [start, end]: root of the minimum of A t^2 + B t + C."""
    since, _, x, y, vx, vy = piece
    ux, uy = (b.x - a.x) / (b.t_s - a.t_s), (b.y - a.y) / (b.t_s - a.t_s)
    gx = (a.x + ux * (start - a.t_s)) - (x + vx * (start - since))
    gy = (a.y + uy * (start - a.t_s)) - (y + vy * (start - since))
    A = (ux - vx) ** 2 + (uy - vy) ** 2
    B = 2.0 * (gx * (ux - vx) + gy * (uy - vy))
    C = gx * gx + gy * gy
    span = end - start
    least = min(C, (A * span + B) * span + C)
    if B < 0.0 and 2.0 * A * span > -B:
        least = C - B * B / (4.0 * A)
    return math.sqrt(max(0.0, least))


def wall_clearance(scenario: Scenario, waypoints: Sequence[Waypoint]) -> float:
    """Smallest gap (m) to any wall along straight segments; inf without walls."""
    smallest = math.inf
    for x0, y0, x1, y1 in scenario.segments_m:
        length = math.hypot(x1 - x0, y1 - y0)
        c, s = (x1 - x0) / length, (y1 - y0) / length
        # In the wall's own frame: it lies on the first axis from 0 to length.
        ends = [
            (c * (w.x - x0) + s * (w.y - y0), c * (w.y - y0) - s * (w.x - x0)) for w in waypoints
        ]
        for a, b in pairwise(ends):
            smallest = min(smallest, _distance_to_wall(a, b, length))
    return smallest - scenario.robot_radius_m


def _distance_to_wall(a: tuple[float, float], b: tuple[float, float], length: float) -> float:
    """Smallest distance of the way from a to b, in the wall's frame.

    Cut where it passes the ends of the wall: before the first, beside the wall and behind the
    last the square of the distance is a polynomial of degree two each.
    """
    (along, across), (ahead, aside) = a, (b[0] - a[0], b[1] - a[1])
    cuts = {0.0, 1.0}
    if ahead != 0.0:
        cuts |= {share for end in (0.0, length) if 0.0 < (share := (end - along) / ahead) < 1.0}
    least = math.inf
    for first, last in pairwise(sorted(cuts)):
        middle = along + 0.5 * (first + last) * ahead
        beyond = min(max(middle, 0.0), length)  # of the wall, the end that counts here
        is_beside = 0.0 < middle < length
        p, q = (0.0, 0.0) if is_beside else (along - beyond, ahead)
        A, B, C = q * q + aside * aside, 2.0 * (p * q + across * aside), p * p + across * across
        vertex = -B / (2.0 * A) if A > 0.0 else first
        for share in (first, last, min(max(vertex, first), last)):
            least = min(least, (A * share + B) * share + C)
    return math.sqrt(max(0.0, least))


def inspect(
    scenario: Scenario, waypoints: Sequence[Waypoint], speed_mps: float
) -> tuple[float, Fault]:
    """Smallest clearance (m) of a trajectory, and its fault ("" for none).

    It must start at start_m at t = 0, end at goal_m within the time limit, keep speed_mps on
    every segment (to 1e-6 of it) and have no contact.
    """
    if len(waypoints) < 2 or waypoints[0] != (0.0, *scenario.start_m):
        return -math.inf, "does not start at start_m at t = 0"
    if waypoints[-1].point != scenario.goal_m:
        return -math.inf, "does not end at goal_m"
    if waypoints[-1].t_s > scenario.time_limit_s:
        return -math.inf, f"ends after the time limit of {scenario.time_limit_s:g} s"
    for a, b in pairwise(waypoints):
        length_m, time_s = math.hypot(b.x - a.x, b.y - a.y), b.t_s - a.t_s
        if time_s < 0.0 or abs(length_m - speed_mps * time_s) > 1e-6 * speed_mps * time_s + SLACK:
            return -math.inf, f"moves {length_m:.9g} m in {time_s:.9g} s at t = {a.t_s:.9g} s"
    smallest = clearance(scenario, waypoints)
    if smallest < 0.0 and wall_clearance(scenario, waypoints) == smallest:
        return smallest, f"touches a wall ({-smallest:.3g} m inside)"
    if smallest < 0.0:
        return smallest, f"touches an enlarged circle ({-smallest:.3g} m inside)"
    return smallest, ""
