# SPDX-License-Identifier: Apache-2.0
"""Pedestrians by the social force model, who do not see the robot; a stand-in for recordings.

Helbing, Molnar: Social force model for pedestrian dynamics, Phys. Rev. E 51 (1995) 4282, with its
constants. Trajectories are computed in advance and cut into pieces of constant velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.geometry import Point, bearing, distance
from ...core.option_specs import check, option
from ...simulation.obstacle_motion import Obstacle, Turn
from .task_geometry import GOAL_M, START_M, leaves_room

Array = np.ndarray

SPEED_MPS, SPEED_SD_MPS = 1.34, 0.26  # desired speed
FASTEST = 1.3  # times the desired speed
RELAXATION_S = 0.5  # tau
REPULSION_M2PS2, RANGE_M = 2.1, 0.3  # V0, sigma
STRIDE_S = 2.0  # delta t: the time for which the other's next step is anticipated
VIEW_RAD, BEHIND = math.radians(200.0), 0.5  # field of view; weight of what is outside of it
STEP_S = 0.1
# Rounding of the state in every step: sums and exponentials may differ in their last bits
# between processors, worlds must not.
DIGITS = 6
CUT_M = 0.02  # largest deviation of the pieces of constant velocity


@dataclass(frozen=True, slots=True, kw_only=True)
class PedestrianParams:
    """Two streams that cross where the robot crosses, in both directions each."""

    pedestrians: int = option(24, "number of pedestrians", minimum=0, maximum=200)
    radius_m: float = option(0.25, "radius of a person", unit="m", minimum=0.05, maximum=1.0)
    half_width_m: float = option(
        7.0, "half width of a stream", unit="m", minimum=0.5, maximum=50.0
    )
    until_s: float = option(
        40.0, "time until which they see each other; then they go on straight", unit="s",
        minimum=1.0, maximum=200.0,
    )  # fmt: skip
    margin_m: float = option(
        0.5, "free space around start and goal at t = 0", unit="m", minimum=0.0, maximum=3.0
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        check(self)


def pedestrian_obstacles(
    params: PedestrianParams, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """The pedestrians of a world; none is near start or goal at t = 0."""
    starts: list[Point] = []
    targets: list[Point] = []
    speeds: list[float] = []
    while len(starts) < params.pedestrians:
        start, target = _walk(params, rng)
        if leaves_room(start, params.radius_m, params.margin_m):
            starts.append(start)
            targets.append(target)
            # 1.34 + 0.26 N, cut at two deviations
            speeds.append(SPEED_MPS + SPEED_SD_MPS * min(max(rng.normal(), -2.0), 2.0))
    paths = trajectories(
        np.array(starts).reshape(-1, 2), np.array(targets).reshape(-1, 2), np.array(speeds),
        params.until_s,
    )  # fmt: skip
    return tuple(
        obstacle_of(path, STEP_S, params.radius_m) for path in np.moveaxis(paths, 1, 0).tolist()
    )


def _walk(params: PedestrianParams, rng: np.random.Generator) -> tuple[Point, Point]:
    """Start and target of a person: through the room, from one side towards the other.

    The start is up to 20 s of walking away, so that people come as long as the robot drives.
    """
    middle = 0.5 * (START_M[0] + GOAL_M[0]), 0.5 * (START_M[1] + GOAL_M[1])
    along_x, sign = rng.random() < 0.5, 1.0 if rng.random() < 0.5 else -1.0
    aside, beside = rng.uniform(-params.half_width_m, params.half_width_m, 2).tolist()
    away = rng.uniform(-4.0, 26.0)
    u, far = -sign * away, sign * 60.0
    if along_x:
        return (middle[0] + u, middle[1] + aside), (middle[0] + far, middle[1] + beside)
    return (middle[0] + aside, middle[1] + u), (middle[0] + beside, middle[1] + far)


def trajectories(starts: Array, targets: Array, speeds: Array, until_s: float) -> Array:
    """Positions (K, n, 2) at steps of STEP_S; starts and targets (n, 2), speeds (n,)."""
    position = np.round(starts, DIGITS)
    velocity = np.round(speeds[:, None] * _unit(targets - starts), DIGITS)
    found = [position]
    for _ in range(round(until_s / STEP_S)):
        force = desire(position, velocity, targets, speeds)
        velocity = next_velocity(velocity, force, speeds)
        position = np.round(position + STEP_S * velocity, DIGITS)
        found.append(position)
    return np.array(found)


def desire(position: Array, velocity: Array, targets: Array, speeds: Array) -> Array:
    """Acceleration (n, 2) towards the targets, and away from each other."""
    direction = _unit(targets - position)
    force: Array = (speeds[:, None] * direction - velocity) / RELAXATION_S
    force += repulsion(position, velocity, direction)
    return force


def next_velocity(velocity: Array, force: Array, speeds: Array) -> Array:
    """The velocity (n, 2) after a step, at most FASTEST times the desired speed, rounded."""
    velocity = velocity + STEP_S * force
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    velocity *= np.minimum(1.0, FASTEST * speeds / np.maximum(speed, 1e-9))[:, None]
    return np.round(velocity, DIGITS)


def repulsion(position: Array, velocity: Array, direction: Array) -> Array:
    """Eq. 3 to 9 of the paper: the sum over the others of -grad V0 exp(-b / sigma), (n, 2).

    b is the semi-minor axis of the ellipse 2 b = sqrt((|r| + |r - s|)^2 - |s|^2), r from the
    other to the person and s the other's next step; direction is where a person wants to go.
    """
    r = position[:, None] - position[None]  # from the other (second index)
    step = STRIDE_S * velocity[None]
    ahead = r - step
    near, far = (np.maximum(np.hypot(v[..., 0], v[..., 1]), 1e-6) for v in (r, ahead))
    stride = np.hypot(step[..., 0], step[..., 1])
    b = np.maximum(0.5 * np.sqrt(np.maximum((near + far) ** 2 - stride**2, 0.0)), 0.05)
    # grad b = (|r| + |r - s|) / (4 b) (r / |r| + (r - s) / |r - s|)
    slope = ((near + far) / (4.0 * b))[..., None] * (r / near[..., None] + ahead / far[..., None])
    force = (REPULSION_M2PS2 / RANGE_M * np.exp(-b / RANGE_M))[..., None] * slope
    along = np.einsum("ik,ijk->ij", direction, -force)
    strength = np.hypot(force[..., 0], force[..., 1])
    weight = np.where(along >= math.cos(0.5 * VIEW_RAD) * strength, 1.0, BEHIND)
    np.fill_diagonal(weight, 0.0)
    total: Array = (weight[..., None] * force).sum(axis=1)
    return total


def _unit(vectors: Array) -> Array:
    lengths = np.maximum(np.hypot(vectors[:, 0], vectors[:, 1]), 1e-9)
    scaled: Array = vectors / lengths[:, None]
    return scaled


def obstacle_of(path: Sequence[Sequence[float]], step_s: float, radius_m: float) -> Obstacle:
    """An obstacle that follows positions at equal steps of time to CUT_M, then goes on straight.

    At each end of a piece it is where the path is, and in between at most CUT_M from it at the
    same time.
    """
    kept = _corners(path, CUT_M)
    pieces = []
    for a, b in zip(kept, kept[1:]):
        p, q = (path[a][0], path[a][1]), (path[b][0], path[b][1])
        speed = distance(p, q) / (step_s * (b - a))
        heading = bearing(p, q) if speed else 0.0
        pieces.append(Turn(at_s=step_s * a, speed_mps=speed, heading_rad=heading))
    first = pieces[0]
    return Obstacle(
        center_m=(path[0][0], path[0][1]),
        radius_m=radius_m,
        speed_mps=first.speed_mps,
        heading_rad=first.heading_rad,
        turns=tuple(pieces[1:]),
    )


def _corners(path: Sequence[Sequence[float]], most_m: float) -> list[int]:
    """Indices kept by Douglas and Peucker's rule, distances taken at equal times."""
    kept, waiting = [0], [(0, len(path) - 1)]
    ends = []
    points = np.array(path)
    while waiting:
        a, b = waiting.pop()
        share = (np.arange(a, b + 1) - a)[:, None] / (b - a)
        off = points[a : b + 1] - (points[a] + share * (points[b] - points[a]))
        away = np.hypot(off[:, 0], off[:, 1])
        k = int(away.argmax())
        if away[k] > most_m:
            waiting += [(a, a + k), (a + k, b)]
        else:
            ends.append(b)
    return kept + sorted(ends)
