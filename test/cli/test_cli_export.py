# SPDX-License-Identifier: Apache-2.0
"""`mfba export`: the table equals the episode, to the last bit, in both formats."""

import csv
import math
from pathlib import Path
from typing import Any

import pytest
from edited_bags import one_changed, record, rewrite
from pyarrow import parquet

from mfba_planner import cli
from mfba_planner.core.errors import BagError, ConfigError, OutputError
from mfba_planner.recording.tick_table import COLUMNS
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation import run_episode


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("export") / "bag", "case2", 4)


def expected_rows() -> list[dict[str, Any]]:
    """The table of the same run, from the core's episode."""
    ticks = run_episode.run(load_scenario("case2"), seed=4).ticks
    return [
        {
            "stamp_ns": t.stamp_ns,
            "time_s": (t.stamp_ns - ticks[0].stamp_ns) * 1e-9,
            "mode": t.mode.value,
            "reason": t.reason,
            "x": t.pose.x,
            "y": t.pose.y,
            "yaw": t.pose.yaw,
            "goal_x": 12.0,
            "goal_y": 12.0,
            "waypoint_x": t.waypoint[0],
            "waypoint_y": t.waypoint[1],
            "velocity_x": t.velocity[0],
            "velocity_y": t.velocity[1],
            "gap": t.gap,
            "vs": "".join(map(str, t.vs)),
            "vg": "".join(map(str, t.vg)),
            **{f"range_{k}": r for k, r in enumerate(t.ranges_m, start=1)},
        }
        for t in ticks
    ]


def test_csv_equals_the_episode(bag: Path, tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    assert cli.main(["export", str(bag), str(table)]) == 0
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    kinds = {name: kind for name, (kind, _) in COLUMNS.items()}
    read = [{name: kinds.get(name, float)(text) for name, text in row.items()} for row in rows]
    assert read == expected_rows()


def test_parquet_equals_the_episode(bag: Path, tmp_path: Path) -> None:
    table = tmp_path / "run.parquet"
    assert cli.main(["export", str(bag), str(table)]) == 0
    assert parquet.read_table(table).to_pylist() == expected_rows()


def blind(message: Any) -> None:
    message.ranges = [math.nan] * 12


def test_a_blind_sensor_leaves_nan_not_fewer_columns(bag: Path, tmp_path: Path) -> None:
    edited = rewrite(bag, tmp_path / "edited", one_changed("/sectors", 0, blind))
    table = tmp_path / "run.parquet"
    assert cli.main(["export", str(edited), str(table)]) == 0
    first, second = parquet.read_table(table).slice(0, 2).to_pylist()
    assert math.isnan(first["range_12"])
    assert second["range_12"] == math.inf


def test_mistakes_give_one_line_and_no_file(bag: Path, tmp_path: Path) -> None:
    for name in ("run.xlsx", "run"):
        with pytest.raises(
            ConfigError, match=r"unknown kind of table; give a name that ends in \.csv"
        ):
            cli.main(["export", str(bag), str(tmp_path / name)])
    with pytest.raises(OutputError, match="cannot be written"):
        cli.main(["export", str(bag), str(tmp_path / "no" / "run.csv")])
    with pytest.raises(BagError):
        cli.main(["export", str(tmp_path), str(tmp_path / "run.csv")])
    existing = tmp_path / "existing.csv"
    existing.write_text("mine")
    with pytest.raises(OutputError, match="already exists"):
        cli.main(["export", str(bag), str(existing)])
    assert [path.name for path in tmp_path.iterdir()] == ["existing.csv"]
    assert existing.read_text() == "mine"


def test_a_bag_whose_sectors_are_missing_leaves_no_half_table(bag: Path, tmp_path: Path) -> None:
    def without(messages: list[Any]) -> list[Any]:
        gone = [m for m in messages if m.topic == "/sectors"][40]
        return [m for m in messages if m is not gone]

    edited = rewrite(bag, tmp_path / "edited", without)
    with pytest.raises(BagError, match="no sectors at stamp"):
        cli.main(["export", str(edited), str(tmp_path / "run.csv")])
    assert not (tmp_path / "run.csv").exists()
