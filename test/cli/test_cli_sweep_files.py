# SPDX-License-Identifier: Apache-2.0
"""`mfba sweep` and `mfba show` with the user's own scenario files."""

import csv
import re
import shutil
from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.recording.read_episode import read_episode

Capture = pytest.CaptureFixture[str]
OPEN = "name: open\nstart_m: [0, 0]\ngoal_m: [3, 0]\n"
BLOCKED = f"{OPEN.replace('open', 'blocked')}obstacles: [{{center_m: [1.5, 0], radius_m: 0.3}}]\n"


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


@pytest.fixture
def suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "1.yaml").write_text(OPEN, encoding="utf-8")
    (folder / "2.yaml").write_text(BLOCKED, encoding="utf-8")
    return folder


def test_the_robot_of_all_files_is_changed_and_the_rest_of_it_kept(
    suite: Path, capsys: Capture
) -> None:
    lidar = f"{OPEN}robot: {{lidar: {{beams: 90, range_min_m: 0.2}}}}\n"
    (suite / "1.yaml").write_text(lidar, encoding="utf-8")
    args = ("sweep", "mine", "--planner", "straight", "--workers", "1", "--no-oracle")
    change = ("--set", "robot.drive=differential", "--set", "robot.lidar.range_max_m=2.5")
    assert mfba(*args, *change, "--out", "out") == 0
    assert "--set robot.lidar.range_max_m=2.5`" in Path("out/report.md").read_text("utf-8")
    assert mfba("show", "out", "mine/0/straight/0", "--out", "why") == 0
    robot = read_episode(Path("why/bag")).scenario.robot
    assert (robot.drive.value, robot.lidar.beams) == ("differential", 90)
    assert (robot.lidar.range_min_m, robot.lidar.range_max_m) == (0.2, 2.5)
    capsys.readouterr()
    refused = ("--set", "robot.lidar.range_max_m=0.15")
    assert mfba(*args, *refused, "--out", "none") == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "below range_max_m=0.15" in error
    assert not Path("none").exists()


def test_a_directory_is_swept_resumed_and_explained(suite: Path, capsys: Capture) -> None:
    args = ("sweep", "mine", "--planner", "straight", "--workers", "1", "--out", "out")
    assert mfba(*args) == 0
    table = Path("out/table.csv").read_bytes()
    with open("out/table.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["scenario"], row["success"]) for row in rows] == [
        ("open", "true"), ("blocked", "false"),
    ]  # fmt: skip
    assert rows[0]["barn"] == "0.5"
    assert "`mfba sweep mine --planner straight`" in Path("out/report.md").read_text("utf-8")
    shutil.rmtree("out/chunks")  # as of an interrupted sweep
    for name in ("timings.csv", "report.md"):  # computing times differ
        Path("out", name).unlink()
    assert mfba(*args) == 0
    assert Path("out/table.csv").read_bytes() == table
    shutil.rmtree(suite)  # the sweep has the content
    capsys.readouterr()
    assert mfba("show", "out") == 0
    assert "1  mine/1/straight/0  blocked  goal_reached, 1 collisions" in capsys.readouterr().out
    assert mfba("show", "out", "1", "--out", "why") == 0
    shown = capsys.readouterr().out
    assert shown.startswith("mine/1/straight/0  blocked\nthe robot ran into obstacle 1")
    assert "oracle: feasible at 0.785 m/s" in shown
    assert read_episode(Path("why/bag")).scenario.name == "blocked"


def test_a_broken_file_is_named_and_the_others_are_swept(suite: Path, capsys: Capture) -> None:
    (suite / "0.yaml").write_text("name: [", encoding="utf-8")
    args = ("sweep", "mine", "--planner", "straight", "--workers", "1", "--out", "out")
    assert mfba(*args, "--no-oracle") == 1
    first, last = capsys.readouterr().err.splitlines()
    assert re.match(r"left out: mine/0\.yaml line 1: not YAML", first)
    assert last.startswith("mfba: 1 scenario file left out, see above; mend")
    assert len(Path("out/table.csv").read_text("utf-8").splitlines()) == 3


def test_a_list_of_files(suite: Path, capsys: Capture) -> None:
    args = ("sweep", "mine/2.yaml", "mine/1.yaml", "--planner", "straight", "--workers", "1")
    assert mfba(*args, "--first", "1", "--out", "out") == 0
    report = Path("out/report.md").read_text("utf-8")
    assert "`mfba sweep 2.yaml 1.yaml --planner straight --first 1`" in report
    assert "scenarios/1/straight" not in report
    assert len(Path("out/table.csv").read_text("utf-8").splitlines()) == 2


def test_a_changed_file_is_not_mixed_with_old_results(suite: Path, capsys: Capture) -> None:
    args = ("sweep", "mine", "--planner", "straight", "--no-oracle", "--out", "out")
    assert mfba(*args) == 0
    (suite / "1.yaml").write_text(OPEN.replace("[3, 0]", "[4, 0]"), encoding="utf-8")
    capsys.readouterr()
    assert mfba(*args) == 1
    assert "the scenario files have changed since" in capsys.readouterr().err


def test_what_the_oracle_decides_for_a_footprint_is_said(suite: Path, capsys: Capture) -> None:
    cart = "robot: {footprint_m: [[0.2, 0, 0.15], [0, 0, 0.15], [-0.2, 0, 0.15]]}\n"
    beside = "segments_m: [[-1, 0.3, 4, 0.3]]\n"  # free for the circles, not for the disc
    (suite / "1.yaml").write_text(OPEN + cart, encoding="utf-8")
    (suite / "2.yaml").write_text(f"{OPEN.replace('open', 'wall')}{cart}{beside}", "utf-8")
    args = ("sweep", "mine", "--planner", "straight", "--perception", "known")
    assert mfba(*args, "--workers", "1", "--out", "out") == 0
    with open("out/table.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["success"] for row in rows] == ["true", "true"]
    assert [float(row["min_clearance_m"]) for row in rows] == [float("inf"), pytest.approx(0.15)]
    capsys.readouterr()
    for number, said in (
        (0, "oracle: feasible at 0.785 m/s, 3.000 m (for the disc of 0.35 m around the "
            "footprint)"),
        (1, "oracle: undecided at 0.785 m/s (for the disc around the footprint, "
            "start_m=[0.0, 0.0]: 0.05 m inside a wall segment"),
    ):  # fmt: skip
        assert mfba("show", "out", f"mine/{number}/straight/0", "--out", f"why{number}") == 0
        assert said in capsys.readouterr().out
