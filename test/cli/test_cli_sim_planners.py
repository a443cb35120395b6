# SPDX-License-Identifier: Apache-2.0
"""`mfba sim --planner`: every planner by name, the same run as in a sweep of that file."""

import csv
import json
import re
from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.planning.planner_registry import PLANNERS

Capture = pytest.CaptureFixture[str]
OPEN = """name: open
start_m: [0, 0]
goal_m: [3, 0]
robot_radius_m: 0.2
robot: {lidar: {beams: 60}}
obstacles: [{center_m: [1.5, 0.6], radius_m: 0.3}]
"""
DEAF = """class Deaf:
    inputs = ("nothing",)
    def __init__(self, params, sensor, seed): pass
    def plan(self, obs): raise ValueError("no")
class Broken(Deaf):
    inputs = ()
"""


def mfba(*args: str) -> int:
    return run_and_return_exit_code(lambda: cli.main(list(args)), "mfba")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "open.yaml").write_text(OPEN, encoding="utf-8")
    (tmp_path / "deaf_planner.py").write_text(DEAF, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("planner", list(PLANNERS))
def test_every_planner_drives_as_in_a_sweep(planner: str, here: Path, capsys: Capture) -> None:
    mfba("sim", "open.yaml", "--planner", planner)  # apf stops before the goal
    out = capsys.readouterr().out
    assert out.startswith(f"open, {'mfba' if planner == 'paper' else planner}, seed 0, core")
    length = re.search(r"length +([\d.]+) m", out)
    args = ("open.yaml", "--planner", planner, "--no-oracle", "--workers", "1", "--out", "swept")
    assert mfba("sweep", *args) == 0
    with open("swept/table.csv", encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert length is not None
    assert length[1] == f"{float(row['length_m']):.3f}"


def test_seeds_settings_and_a_directory(here: Path, capsys: Capture) -> None:
    args = ("sim", "open.yaml", "--planner", "orca", "--set", "planner.speed_mps=1.5")
    assert mfba(*args, "--seeds", "2") == 0
    assert "2 of 2 at the goal without collision" in capsys.readouterr().out
    assert mfba(*args, "--seed", "4", "--out", "out") == 0
    assert "open, orca, seed 4" in capsys.readouterr().out
    assert sorted(path.name for path in Path("out").iterdir()) == ["result.json", "run.png"]
    result = json.loads(Path("out/result.json").read_text("utf-8"))
    assert result["algorithm"] == "orca"
    assert result["seed"] == 4


@pytest.mark.parametrize(
    ("args", "reason"),
    [
        (["--planner", "orcaa"], "planner 'orcaa': unknown; did you mean 'orca'?"),
        (["--planner", "orca", "--algorithm", "ba"], "--algorithm: of planner paper only"),
        (
            ["--planner", "orca", "--optimizer", "grid"],
            "--optimizer: of paper and predictive only",
        ),
        (["--planner", "none_here:X"], "planner none_here:X: cannot be imported"),
        (["--planner", "deaf_planner:Deaf"], "planner deaf_planner:Deaf uses none of it"),
        (["--planner", "deaf_planner:Broken"], "tick 0: raised ValueError: no"),
        (["--planner", "orca", "--out", "."], "exists and is never overwritten"),
    ],
)
def test_mistakes_give_one_line(args: list[str], reason: str, here: Path, capsys: Capture) -> None:
    assert mfba("sim", "open.yaml", *args) == 1
    err = capsys.readouterr().err
    assert reason in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("planner", "reason"),
    [
        ("os:system", "the factory raised TypeError (system() takes at most 1 argument"),
        ("math:hypot", "the factory raised TypeError (must be real number, not PlannerParams)"),
        ("os:sep", "the factory raised TypeError ('str' object is not callable)"),
        ("faulty_planners:TwoArguments", "the factory raised TypeError (TwoArguments.__init__()"),
        ("faulty_planners:makes_nothing", "the factory made NoneType, which has no method plan("),
        ("faulty_planners:makes_a_class", "the factory made the class Straight, which has no"),
        ("faulty_planners:WithoutPlan", "the factory made WithoutPlan, which has no method plan("),
        ("faulty_planners:PlanWithoutInput", "its method plan cannot be called with an observ"),
        ("faulty_planners:WrongInputs", "the factory raised TypeError ('int' object is not iter"),
        ("faulty_planners:WrongPreset", "the factory raised TypeError (object of type"),
    ],
)
@pytest.mark.parametrize(
    "command",
    [
        ("sim", "open.yaml"),
        ("sweep", "open.yaml", "--workers", "1"),
        ("sweep", "random-3", "--worlds", "1"),
        ("show", "random-3/0/NAME/0"),
    ],
)
def test_what_makes_no_planner_is_refused_before_a_run(
    command: tuple[str, ...], planner: str, reason: str, here: Path, capsys: Capture
) -> None:
    given = [*command, "--planner", planner]
    if command[0] == "show":
        given = ["show", command[1].replace("NAME", planner)]
    assert mfba(*given) == 1
    err = capsys.readouterr().err
    assert f"planner {planner}: {reason}" in err
    assert "; give MODULE:NAME of something that is called with PlannerParams, Sens" in err
    assert err.count("\n") == 1
    assert not Path("runs").exists()


def test_a_fleet_has_one_of_the_two_planners_of_the_graph(here: Path, capsys: Capture) -> None:
    assert mfba("sim", "swap", "--planner", "orca") == 1
    assert "--planner orca: of one robot" in capsys.readouterr().err
