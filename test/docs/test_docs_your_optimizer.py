# SPDX-License-Identifier: Apache-2.0
"""docs/how-to/your-optimizer.md: its example conforms, runs and is compared as shown."""

import csv
import re
from pathlib import Path

import pytest
import shown_commands
from project import ROOT

from mfba_planner.evaluation.optimizer_check import check
from mfba_planner.optimizers.registry import NAMES

PAGE = (ROOT / "docs/how-to/your-optimizer.md").read_text(encoding="utf-8")
CHECK, SIM, SWEEP, BATS, COMPARE = map(shown_commands.reduced, shown_commands.commands(PAGE))


@pytest.fixture
def here(tmp_path: Path) -> Path:
    (code,) = shown_commands.blocks(PAGE, "python")
    assert len(code.splitlines()) <= 40
    (tmp_path / "my_swarm.py").write_text(code, encoding="utf-8")
    return tmp_path


def test_the_example_conforms_and_runs_in_an_empty_directory(here: Path) -> None:
    out = shown_commands.mfba(CHECK[1:], here)
    assert out.count("  ok  ") == 10
    out = shown_commands.mfba(SIM[1:], here)
    # The terminal may break a line.
    assert " ".join(out.split()).startswith("case1, paper with my_swarm:ParticleSwarm, seed 0")
    assert "goal reached" in out


def test_it_is_judged_beside_the_bats(here: Path) -> None:
    lengths = []
    for command in (SWEEP, BATS):
        shown_commands.mfba(command[1:], here)
        directory = here / command[command.index("--out") + 1]
        with open(directory / "table.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert [row["success"] for row in rows] == ["true"] * 4
        lengths.append([float(row["length_m"]) for row in rows])
    assert lengths[0] != lengths[1]
    assert "planner.optimizer=my_swarm:ParticleSwarm" in (here / "runs/mine/report.md").read_text()


def test_it_appears_in_the_report_of_a_comparison(here: Path) -> None:
    shown_commands.mfba(COMPARE[1:], here)
    report = (here / "runs/compared/report.md").read_text(encoding="utf-8")
    name = "my_swarm:ParticleSwarm"
    assert f"| {name} | 6 | 100.00 % [60.97, 100.00] |" in report
    assert report.count(f"| {name} | 6 |") == 2
    assert "F5, 25 evaluations: " in report


def test_every_property_and_every_name_has_a_row() -> None:
    first_column = re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE)
    named = set(re.findall(r"`([^`]+)`", " ".join(first_column)))
    assert {found.name for found in check("random")} <= named
    assert set(NAMES) <= named
