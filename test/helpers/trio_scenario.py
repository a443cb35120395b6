# SPDX-License-Identifier: Apache-2.0
"""A scenario with a fleet of three robots and odometry noise."""

from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Noise, Robot
from mfba_planner.simulation.scenario import FleetRobot, Scenario

# b arrives long before the others. Odometry has noise, so ground truth is recorded too.
TRIO = Scenario(
    name="trio",
    start_m=(-2.0, 0.0),
    goal_m=(2.0, 0.2),
    obstacles=(Obstacle(center_m=(0.0, 3.0), radius_m=0.3, speed_mps=0.1),),
    robots=(
        FleetRobot(name="a", start_m=(-2.0, 0.0), goal_m=(2.0, 0.2)),
        FleetRobot(name="b", start_m=(-1.0, -2.0), goal_m=(-1.0, -1.2)),
        FleetRobot(name="c", start_m=(2.0, -0.6), goal_m=(-2.0, -0.4)),
    ),
    robot=Robot(noise=Noise(odom_m=0.002)),
)
