# SPDX-License-Identifier: Apache-2.0
"""Handmade runs: one point per second."""

from typing import Any

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

# One metre, one second per tick.
SECOND = PlannerParams(speed_mps=1.0, step_length_m=1.0)


def post(center: Point, radius: float = 0.5) -> Obstacle:
    """An obstacle that stands."""
    return Obstacle(center_m=center, radius_m=radius)


def trip(
    points: list[Point],
    modes: list[Mode] | None = None,
    obstacles: tuple[Obstacle, ...] = (),
    **changes: Any,
) -> Episode:
    """A run along these points; the robot's radius is 0.3 m."""
    stamps = [(k + 1) * SECOND.tick_ns for k in range(len(points))]
    ticks = tuple(
        Decision(
            stamp_ns=stamp,
            mode=mode,
            reason="",
            pose=Pose2D(*point),
            goal=None,
            ranges_m=(),
            vs=(),
            vg=(),
            gap=0,
            waypoint=point,
            velocity=(0.0, 0.0),
        )
        for stamp, mode, point in zip(
            stamps, modes or [Mode.PATH_GENERATION] * len(points), points
        )
    )
    plain: dict[str, Any] = {
        "scenario": Scenario(name="x", start_m=(9.0, 9.0), goal_m=(0.0, 9.0), obstacles=obstacles),
        "planner": SECOND,
        "seed": 0,
        "driver": "hand",
        "ticks": ticks,
        "outcome": Outcome.GOAL_REACHED,
    }
    return Episode(**{**plain, **changes})
