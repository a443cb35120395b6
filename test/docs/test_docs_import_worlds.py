# SPDX-License-Identifier: Apache-2.0
"""docs/how-to/import-worlds.md: the day it shows, on small files of the test's own."""

import csv
from pathlib import Path

import numpy as np
import pytest
import shown_commands
from project import ROOT

from mfba_planner.scenarios.importers.import_files import FORMATS

PAGE = (ROOT / "docs/how-to/import-worlds.md").read_text(encoding="utf-8")


def write_world(path: Path, centers: list[tuple[float, float]]) -> None:
    """A Gazebo world of cylinders, laid out as in BARN's."""
    models = [
        f"<model name='unit_cylinder_{k}'><static>1</static>"
        f"<pose frame=''>{x} {y} 0.5 0 -0 0</pose>"
        "<link name='link'><collision name='collision'><geometry><cylinder><radius>0.075</radius>"
        "<length>1</length></cylinder></geometry></collision></link></model>"
        for k, (x, y) in enumerate(centers)
    ]
    world = f"<world name='default'>{''.join(models)}</world>"
    path.write_text(f"<sdf version='1.6'>{world}</sdf>", encoding="utf-8")


def write_people(path: Path) -> None:
    """Twenty people who cross 12 m in both directions, one every 2 s."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t_s", "person", "x_m", "y_m"])
        for person in range(20):
            sign, lane = (1.0 if person % 2 else -1.0), 1.0 + (person * 37 % 100) / 10.0
            for k in range(25):
                x = 6.0 + sign * (0.5 * k - 6.0)
                table.writerow([2.0 * person + 0.4 * k, person, x, lane])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three worlds of forty cylinders between start and goal, and a recording."""
    rng = np.random.default_rng(7)
    (tmp_path / "barn").mkdir()
    for number in (1, 2, 3):
        centers = [
            (round(float(x), 3), round(float(y), 3))
            for x, y in rng.uniform((-4.5, 5.0), (0.0, 9.5), (12 * number, 2))
        ]
        write_world(tmp_path / f"barn/world_{number}.world", centers)
    write_people(tmp_path / "people.csv")
    return tmp_path


def test_the_day_of_the_page(folder: Path) -> None:
    shown_commands.run_page(PAGE, folder)
    with (folder / "runs/barn/table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 4
    assert {row["scenario"] for row in rows} == {"world_1", "world_2", "world_3"}
    assert any(row["success"] == "true" for row in rows if row["planner"] == "predictive")
    assert len(list((folder / "crossings").iterdir())) == 2
    assert (folder / "runs/show-001/explanation.txt").is_file()


def test_the_table_names_every_format() -> None:
    for endings, _, _ in FORMATS.values():
        assert any(f"`{ending}`" in PAGE for ending in endings)
