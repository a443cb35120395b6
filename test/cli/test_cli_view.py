# SPDX-License-Identifier: Apache-2.0
"""`mfba view`: the file for Rerun's viewer, checked with Rerun's own reader."""

import math
import sys
from pathlib import Path

import pytest
from report_readers import rows_of
from walled_place import PLACE

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, MfbaError, OutputError
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.report.html.page_data import clearances
from mfba_planner.report.rerun_viewer import save
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import run


@pytest.fixture(scope="module")
def episode() -> Episode:
    return run(load_scenario("walled"), seed=1)


def test_every_tick_of_every_run_is_saved(episode: Episode, tmp_path: Path) -> None:
    other = run(load_scenario("empty"))
    place = run(PLACE)
    save([("a", episode), ("b", other), ("c", place)], tmp_path / "three.rrd")
    rows = rows_of(tmp_path / "three.rrd")
    for name, made in (("a", episode), ("b", other), ("c", place)):
        ticks = len(made.ticks)
        every_tick = ("decision", "curves/speed", "world/robot", "world/trail", "world/bats")
        assert {rows[f"/{name}/{path}"] for path in every_tick} == {ticks}
        assert rows[f"/{name}/world/sensor/ring"] == rows[f"/{name}/world/sensor/sectors"] == ticks
        gaps = sum(map(math.isfinite, clearances(made)))
        assert rows[f"/{name}/curves/clearance"] == gaps
        assert rows[f"/{name}/world/obstacles"] == (ticks if made.scenario.obstacles else 0)
        assert rows[f"/{name}/world/walls"] == bool(made.scenario.walls)
        assert rows[f"/{name}/world/segments"] == bool(made.scenario.segments_m)


def test_from_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["sim", "empty", "--planner", "paper", "--out", "made"]) == 0
    assert cli.main(["view", "made", "--save", "made.rrd"]) == 0
    assert rows_of(tmp_path / "made.rrd")["/made/decision"] == len(
        run(load_scenario("empty")).ticks
    )
    with pytest.raises(OutputError, match=r"^made.rrd: exists and is never overwritten"):
        cli.main(["view", "made", "--save", "made.rrd"])
    with pytest.raises(MfbaError, match="nowhere"):
        cli.main(["view", "nowhere", "--save", "no.rrd"])
    assert not Path("no.rrd").exists()


def test_without_a_display_or_a_viewer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert cli.main(["sim", "empty", "--out", "made"]) == 0
    with pytest.raises(ConfigError, match=r"^no display .*--save FILE.rrd"):
        cli.main(["view", "made"])
    with pytest.raises(ConfigError, match=r"^no display "):  # before anything is run
        read_request(["case1", "--view"], "mfba run")
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ConfigError, match=r"rerun is not installed; pip install 'mfba_planner\[v"):
        cli.main(["view", "made", "--save", "made.rrd"])
    assert not Path("made.rrd").exists()
