# SPDX-License-Identifier: Apache-2.0
"""`mfba report`: a page from bags and results, or one line of error."""

import json
from pathlib import Path
from typing import Any

import pytest
from project import ROOT
from report_readers import data_of

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.report.result_json import result_to_dict, write_result
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import run

Capture = pytest.CaptureFixture[str]


def report(capture: Capture, *args: str | Path) -> tuple[int, str, str]:
    code = run_and_return_exit_code(lambda: cli.main(["report", *map(str, args)]), "mfba")
    return code, *capture.readouterr()


def refused(capture: Capture, *args: str | Path) -> str:
    """Run a command that fails; return its one line of error."""
    code, out, err = report(capture, *args)
    assert (code, out, err.count("\n")) == (1, "", 1)
    return err


@pytest.fixture(autouse=True)
def _in_tmp_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def episode() -> Episode:
    return run(load_scenario("case1"), seed=4)


@pytest.fixture
def kept(tmp_path: Path, episode: Episode) -> Path:
    """The directory of a run without a bag."""
    (tmp_path / "kept").mkdir()
    write_result(tmp_path / "kept/result.json", result_to_dict(episode))
    return tmp_path / "kept"


def changed(result: Path, **values: Any) -> Path:
    """A copy of the result with other values."""
    data = {**json.loads(result.read_text()), **values}
    path = result.with_name("changed.json")
    path.write_text(json.dumps({k: v for k, v in data.items() if v is not None}))
    return path


def test_a_result_is_simulated_again(capsys: Capture, kept: Path, episode: Episode) -> None:
    assert report(capsys, kept) == (0, "wrote report.html\n", "")
    assert report(capsys, kept / "result.json", "--out", "b.html") == (0, "wrote b.html\n", "")
    assert Path("report.html").read_bytes() == Path("b.html").read_bytes()
    (shown,) = data_of(Path("b.html"))["runs"]
    assert shown["name"] == "kept"
    assert shown["ticks"]["x"] == [tick.pose.x for tick in episode.ticks]
    assert shown["digest"] == result_to_dict(episode)["digest"]


def test_a_result_holds_its_world(capsys: Capture, tmp_path: Path) -> None:
    world = tmp_path / "mine.yaml"
    world.write_text("name: mine\nstart_m: [0.0, 0.0]\ngoal_m: [2.0, 0.0]\n")
    assert (
        run_and_return_exit_code(lambda: cli.main(["sim", str(world), "--out", "run"]), "mfba")
        == 0
    )
    world.unlink()
    capsys.readouterr()
    assert report(capsys, "run") == (0, "wrote report.html\n", "")
    assert data_of(Path("report.html"))["runs"][0]["world"]["goal"] == [2.0, 0.0]


def test_a_result_without_its_world_needs_a_shipped_one(capsys: Capture, kept: Path) -> None:
    result = kept / "result.json"
    assert report(capsys, changed(result, world=None)) == (0, "wrote report.html\n", "")
    err = refused(capsys, changed(result, world=None, scenario="mine"), "--out", "b.html")
    assert "its run cannot be simulated again (scenario mine is not shipped); give its bag" in err


def test_a_run_with_other_decisions_is_refused(capsys: Capture, kept: Path) -> None:
    err = refused(capsys, changed(kept / "result.json", seed=5))
    assert "simulated again, its run has other decisions (digest " in err
    assert err.endswith("; give its bag\n")
    assert not Path("report.html").exists()


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"world": {"name": "x"}}, "missing"),
        ({"parameters": {"planner": {}}}, "sensor"),
        ({"parameters": {"planner": {"no": 1}, "sensor": {}}}, "no: unknown option"),
        ({"seed": -1}, "negative"),
    ],
)
def test_an_invalid_result_is_refused(
    capsys: Capture, kept: Path, values: dict[str, Any], reason: str
) -> None:
    err = refused(capsys, changed(kept / "result.json", **values))
    assert "its run cannot be simulated again" in err
    assert reason in err


def test_mistakes_give_one_line(capsys: Capture, kept: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no bag")
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "empty").mkdir()
    assert "BAG|RESULT" in refused(capsys)
    assert "nowhere: does not exist" in refused(capsys, "nowhere")
    assert "nowhere.json: no such file" in refused(capsys, "nowhere.json")
    assert "notes.txt: " in refused(capsys, "notes.txt")
    assert "empty.mcap: " in refused(capsys, "empty.mcap")
    assert "empty: not a bag" in refused(capsys, "empty")
    foreign = refused(capsys, ROOT / "test/data/rosbag2_foreign_scan")
    assert "was not recorded by mfba" in foreign
    assert "7 runs: too many" in refused(capsys, *[kept] * 7)
    assert not Path("report.html").exists()


def test_existing_files_are_not_overwritten(capsys: Capture, kept: Path) -> None:
    Path("report.html").write_text("mine")
    assert "report.html: exists" in refused(capsys, kept)
    assert "cannot be written" in refused(capsys, kept, "--out", "no/where.html")
    assert Path("report.html").read_text() == "mine"


def test_several_runs_keep_their_sequence(capsys: Capture, kept: Path) -> None:
    assert (
        run_and_return_exit_code(lambda: cli.main(["sim", "case1", "--out", "other"]), "mfba") == 0
    )
    capsys.readouterr()
    assert report(capsys, "other", kept)[0] == 0
    assert [run["name"] for run in data_of(Path("report.html"))["runs"]] == ["other", "kept"]
