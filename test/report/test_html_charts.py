# SPDX-License-Identifier: Apache-2.0
"""The charts of the page say where no clearance is known."""

import pytest

from mfba_planner.report.html.charts import charts
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import run


def drive(obstacles: str) -> Episode:
    text = f"name: world\nstart_m: [0, 0]\ngoal_m: [6, 0]\nobstacles: {obstacles}\n"
    return run(parse_scenario(text, "world"), seed=1)


@pytest.mark.parametrize(
    ("obstacles", "title"),
    [
        ("[]", "Clearance: no obstacle is known"),
        ("[{radius_m: 0.3, center_m: [3, 2]}]", "Clearance, edge to edge (m)"),
    ],
)
def test_clearance_without_obstacles_is_not_known(obstacles: str, title: str) -> None:
    for drawing in charts([drive(obstacles)]):
        assert f">{title}<" in drawing["svg"]
        assert "1e" not in "".join(part.partition("<")[0] for part in drawing["svg"].split(">"))


def test_one_run_with_obstacles_is_enough() -> None:
    runs = [drive("[]"), drive("[{radius_m: 0.3, center_m: [3, 2]}]")]
    for drawing in charts(runs):
        assert ">Clearance, edge to edge (m)<" in drawing["svg"]
