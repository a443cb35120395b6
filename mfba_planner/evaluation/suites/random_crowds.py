# SPDX-License-Identifier: Apache-2.0
"""Random crowds: obstacles with random positions, radii, headings, speeds and turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...core.errors import ConfigError
from ...core.option_specs import check, option
from ...simulation.obstacle_motion import Obstacle, Turn
from .task_geometry import OBSTACLE_RADIUS_M, ROOM, leaves_room

_TRIES = 10_000


class Motion(Enum):
    """How the obstacles of a crowd move."""

    STATIC = "static"
    UNIFORM = "uniform"  # constant velocity, bouncing between walls
    PIECEWISE = "piecewise"  # new heading and speed every few seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class CrowdParams:
    """A crowd in the paper's 12 x 12 m; the defaults are those of the random suites."""

    obstacles: int = option(10, "number of obstacles", minimum=0, maximum=1000)
    radius_min_m: float = option(
        OBSTACLE_RADIUS_M, "smallest radius", unit="m", minimum=0.01, maximum=3.0
    )
    radius_max_m: float = option(
        OBSTACLE_RADIUS_M, "largest radius", unit="m", minimum=0.01, maximum=3.0
    )
    speed_min_mps: float = option(0.1, "lowest speed", unit="m/s", minimum=0.0, maximum=100.0)
    speed_max_mps: float = option(0.3, "highest speed", unit="m/s", minimum=0.0, maximum=100.0)
    motion: Motion = option(Motion.UNIFORM, "how the obstacles move")
    static_share: float = option(0.0, "share of obstacles at rest", minimum=0.0, maximum=1.0)
    walled: bool = option(True, "whether walls reflect the obstacles")
    margin_m: float = option(
        0.1, "free space around start and goal at t = 0", unit="m", minimum=0.0, maximum=3.0
    )
    turn_every_s: float = option(
        3.0, "mean time between two turns", unit="s", minimum=0.1, maximum=1000.0
    )
    turn_max_rad: float = option(
        math.pi, "largest change of heading at a turn", unit="rad", minimum=0.0, maximum=math.pi
    )
    turns_until_s: float = option(
        120.0, "time after which no obstacle turns", unit="s", minimum=0.0, maximum=1e4
    )

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range, or a maximum below its minimum."""
        check(self)
        for low, high in (("radius_min_m", "radius_max_m"), ("speed_min_mps", "speed_max_mps")):
            if getattr(self, low) > getattr(self, high):
                raise ConfigError(
                    f"{low}={getattr(self, low):g}: above {high}={getattr(self, high):g}; "
                    "give the smaller one first"
                )

    @property
    def density(self) -> float:
        """Obstacles per square metre of the room."""
        (x0, y0), (x1, y1) = ROOM.lower_m, ROOM.upper_m
        return self.obstacles / ((x1 - x0) * (y1 - y0))


def crowd(params: CrowdParams, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Draw a crowd; obstacles may overlap each other, but not start or goal at t = 0.

    Raises ConfigError when there is no space left for an obstacle.
    """
    return tuple(_random_obstacle(params, rng) for _ in range(params.obstacles))


def _random_obstacle(params: CrowdParams, rng: np.random.Generator) -> Obstacle:
    radius = rng.uniform(params.radius_min_m, params.radius_max_m)
    center = _free_center(params, radius, rng)
    heading = rng.uniform(-math.pi, math.pi)
    still = params.motion is Motion.STATIC or rng.random() < params.static_share
    speed = 0.0 if still else rng.uniform(params.speed_min_mps, params.speed_max_mps)
    turns: tuple[Turn, ...] = ()
    if params.motion is Motion.PIECEWISE and not still:
        turns = _turns(params, heading, rng)
    return Obstacle(
        center_m=center, radius_m=radius, speed_mps=speed, heading_rad=heading, turns=turns
    )


def _free_center(
    params: CrowdParams, radius_m: float, rng: np.random.Generator
) -> tuple[float, float]:
    (x0, y0), (x1, y1) = ROOM.lower_m, ROOM.upper_m
    for _ in range(_TRIES):
        x = rng.uniform(x0 + radius_m, x1 - radius_m)
        y = rng.uniform(y0 + radius_m, y1 - radius_m)
        if leaves_room((x, y), radius_m, params.margin_m):
            return (x, y)
    raise ConfigError(
        f"radius_max_m={params.radius_max_m:g}: no space left beside start and goal; lower it"
    )


def _turns(params: CrowdParams, heading_rad: float, rng: np.random.Generator) -> tuple[Turn, ...]:
    turns: list[Turn] = []
    t = 0.0
    while True:
        t += params.turn_every_s * rng.uniform(0.5, 1.5)
        if t >= params.turns_until_s:
            return tuple(turns)
        heading_rad += rng.uniform(-params.turn_max_rad, params.turn_max_rad)
        speed = rng.uniform(params.speed_min_mps, params.speed_max_mps)
        turns.append(
            Turn(at_s=t, speed_mps=speed, heading_rad=math.remainder(heading_rad, math.tau))
        )
