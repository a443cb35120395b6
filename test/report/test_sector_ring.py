# SPDX-License-Identifier: Apache-2.0
"""The ring of sectors or headings around the robot, and its drawing."""

import math
from dataclasses import replace

import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.gap_vector import GapHeading
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.report.draw_tick import draw_snapshot
from mfba_planner.report.legend import entries
from mfba_planner.report.sector_ring import ring_of
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.run_episode import run, simulate


def degrees(*angles: float) -> list[float]:
    return [math.degrees(angle) for angle in angles]


def test_sectors_start_at_plus_x_and_gap_headings_follow_the_rule() -> None:
    episode = run(load_scenario("case2"), seed=2)
    ring = ring_of(episode)
    assert (ring.count, ring.of_headings) == (12, False)
    assert degrees(*ring.wedge(0)) == pytest.approx([0.0, 30.0])
    assert degrees(*ring.wedge(10, 2)) == pytest.approx([300.0, 360.0])
    assert degrees(ring.gaps[0]) == pytest.approx([30.0])
    middle = replace(episode, planner=PlannerParams(gap_heading=GapHeading.MIDDLE))
    assert degrees(ring_of(middle).gaps[0]) == pytest.approx([15.0])
    assert ring_of(replace(episode, ticks=())) == ring


def test_a_heading_is_the_middle_of_its_wedge() -> None:
    ring = ring_of(run(load_scenario("empty"), seed=0), (1,) * 72)
    assert (ring.count, ring.of_headings) == (72, True)
    assert degrees(*ring.wedge(0)) == pytest.approx([2.5, 7.5])
    assert degrees(ring.gaps[0], ring.gaps[1]) == pytest.approx([5.0, 10.0])


def test_pictures_show_headings_and_label_them() -> None:
    planner = preset(PlannerParams(method=Method.PREDICTIVE))
    episode = simulate(load_scenario("case2"), planner=planner, sensor=SensorParams(), seed=2)
    index = next(i for i, tick in enumerate(episode.ticks) if 0 < sum(tick.vs) < 72)
    axes = Figure().add_subplot()
    draw_snapshot(axes, episode, index)
    wedges = [patch for patch in axes.patches if isinstance(patch, Wedge)]
    assert {wedge.get_gid() for wedge in wedges} == {"closing"}
    set_bits = [
        any(
            wedge.theta1 < turned < wedge.theta2
            for wedge in wedges
            for turned in (angle, angle + 360)
        )
        for angle in range(5, 361, 5)
    ]
    assert set_bits == [bit == 1 for bit in episode.ticks[index].vs]
    assert "headings to a contact" in [label for _, label in entries(axes)]
