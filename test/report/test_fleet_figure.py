# SPDX-License-Identifier: Apache-2.0
"""The picture of a fleet's run: the walls of its place."""

from mfba_planner.report import style
from mfba_planner.report.draw_scene import kinds
from mfba_planner.report.fleet_figure import _fleet_figure
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.scenario import FleetRobot, Scenario


def test_it_shows_the_walls() -> None:
    members = tuple(
        FleetRobot(name=name, start_m=(0.0, y), goal_m=(3.0, y))
        for name, y in (("a", 0.0), ("b", 2.0))
    )
    task = Scenario(
        name="pair", start_m=(0.0, 0.0), goal_m=(3.0, 0.0), robots=members,
        segments_m=((0.0, 1.0, 3.0, 1.0),),
    )  # fmt: skip
    runs = dict(zip(("a", "b"), run_fleet(task, seed=1)))
    with style.context():
        figure = _fleet_figure(task, 1, runs)
    assert "wall" in kinds(figure.axes[0].get_children())
    assert "wall" in [text.get_text() for text in figure.legends[0].get_texts()]
