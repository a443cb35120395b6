# SPDX-License-Identifier: Apache-2.0
"""Two discs for a robot with a footprint: that around it to find paths, one within it for proofs.

A path of the disc of robot_radius_m is free for the footprint with any heading, so it is an upper
bound of the shortest one. Where not even a disc within the footprint arrives, the robot does not.
"""

from __future__ import annotations

from dataclasses import replace

from ...simulation.footprint import inscribed_radius_m
from ...simulation.scenario import Scenario


def disc_around(scenario: Scenario) -> Scenario:
    """The same task for the disc of robot_radius_m.

    Raises ConfigError where that is in contact at the start, or with a wall at the goal.
    """
    return replace(scenario, robot=replace(scenario.robot, footprint_m=()))


def disc_within(scenario: Scenario) -> Scenario | None:
    """The same task for a disc around base_link that the footprint covers; None: there is none."""
    radius_m = inscribed_radius_m(scenario.robot.footprint_m)
    if radius_m <= 0.0:
        return None
    robot = replace(scenario.robot, footprint_m=())
    return replace(scenario, robot=robot, robot_radius_m=radius_m)
