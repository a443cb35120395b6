# SPDX-License-Identifier: Apache-2.0
"""The explanation of a run in words: a contact with a wall."""

import math
from dataclasses import replace

import pytest
from trip_samples import post, trip

from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.sweep.explain_run import explain
from mfba_planner.evaluation.sweep.single_run import CompletedRun
from mfba_planner.simulation.footprint import parse_footprint
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.simulation.scenario import Scenario


def test_a_contact_with_a_wall() -> None:
    """1 m per second towards a wall at 2.5 m: contact at 2.2 m, 0.2 s into the third step."""
    task = Scenario(
        name="x", start_m=(9.0, 9.0), goal_m=(0.0, 9.0),
        segments_m=((2.5, -1.0, 2.5, 1.0),), obstacles=(post((0.0, 5.0)),),
    )  # fmt: skip
    points = [(float(x), 0.0) for x in range(6)]
    episode = trip(points, [Mode.PATH_GENERATION] * 6, scenario=task)
    lines = explain(CompletedRun(episode=episode, fault=""))
    assert lines[0] == "the robot stood still and was hit by a wall at 2.00 s"
    assert lines[1] == (
        "contact: in the step after tick 2 (2.00 s), 0.20 s into it; gap at the tick 0.200 m"
    )
    assert lines[2] == "motion: robot 0.00 m/s"
    assert lines[-1].split()[:5] == ["2", "2.00s", "path_generation", "0.200m", "0.20s"]


@pytest.mark.parametrize("segments_m", [(), ((2.5, -1.0, 2.5, 1.0),)], ids=["obstacle", "wall"])
def test_a_contact_of_a_footprint(
    segments_m: tuple[tuple[float, float, float, float], ...],
) -> None:
    """Its tip, 0.5 m to the right of base_link, points ahead: contact at 1.9 m."""
    task = Scenario(
        name="x", start_m=(9.0, 9.0), goal_m=(0.0, 9.0), robot_radius_m=0.6,
        robot=Robot(footprint_m=parse_footprint([(0.0, -0.5, 0.1)])), segments_m=segments_m,
        obstacles=() if segments_m else (post((3.0, 0.0)),),
    )  # fmt: skip
    episode = trip([(float(x), 0.0) for x in range(4)], scenario=task)
    ahead = [
        replace(tick, pose=tick.pose._replace(yaw=0.5 * math.pi), velocity=(1.0, 0.0))
        for tick in episode.ticks
    ]
    lines = explain(CompletedRun(episode=replace(episode, ticks=tuple(ahead)), fault=""))
    assert lines[1] == (
        "contact: in the step after tick 1 (1.00 s), 0.90 s into it; gap at the tick 0.900 m"
    )
    assert lines[-1].split()[:5] == ["1", "1.00s", "path_generation", "0.900m", "0.90s"]
    turning = (*ahead[:2], replace(ahead[2], pose=ahead[2].pose._replace(yaw=1.5)), ahead[3])
    lines = explain(CompletedRun(episode=replace(episode, ticks=turning), fault=""))
    assert lines[1] == ("contact: in the step after tick 1 (1.00 s); gap at the tick 0.900 m"), (
        "its tip moves on a curve"
    )
