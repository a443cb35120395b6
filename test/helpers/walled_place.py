# SPDX-License-Identifier: Apache-2.0
"""A small place with wall segments, which the paper's planner passes."""

from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

PLACE = Scenario(
    name="place",
    start_m=(0.0, 0.0),
    goal_m=(6.0, 0.3),
    segments_m=((2.0, -0.9, 2.0, 0.1), (4.0, 0.1, 5.0, 1.1)),
    obstacles=(Obstacle(center_m=(3.0, -1.5), radius_m=0.3, speed_mps=0.1, heading_rad=1.5),),
)
