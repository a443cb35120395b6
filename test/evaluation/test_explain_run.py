# SPDX-License-Identifier: Apache-2.0
"""The explanation of a run in words: a contact with a wall."""

from trip_samples import post, trip

from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.sweep.explain_run import explain
from mfba_planner.evaluation.sweep.single_run import CompletedRun
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
