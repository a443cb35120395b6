# SPDX-License-Identifier: Apache-2.0
"""mfba view: a recording that Rerun itself verifies, and that holds what the bag does."""

import builtins
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import rerun
from edited_bags import record

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.recording.episode import read_episode


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("view") / "bag", "case2", 4)


def rrd(*words: str, home: Path) -> str:
    done = subprocess.run(
        [Path(sys.executable).parent / "rerun", "rrd", *words],
        env={"HOME": str(home)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_what_it_writes_is_sound_and_whole(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run.rrd"
    ticks = read_episode(bag).ticks
    assert cli.main(["view", str(bag), "--save", str(out)]) == 0
    assert capsys.readouterr().out == f"wrote {out}: {len(ticks)} ticks\n"
    assert "1 file verified without error" in rrd("verify", str(out), home=tmp_path)
    columns = rerun.recording.load_recording(out).schema().component_columns()
    shown = {column.entity_path for column in columns if not column.entity_path.startswith("/__")}
    world = ("obstacles", "robot", "way", "sectors", "candidates", "step", "places")
    assert shown == {"/reason", "/result", "/plots/speed", "/plots/range"} | {
        f"/world/{name}" for name in world
    } | {"/world"}
    printed = rrd("print", "-vvv", "--entity", "/plots/speed", str(out), home=tmp_path)
    rows = re.findall(r"PT([\d.]+)S\s+┆ \[([\d.e-]+)\]", printed)
    assert [float(speed) for _, speed in rows] == [math.hypot(*tick.velocity) for tick in ticks]
    assert [round(float(s) * 1e9) for s, _ in rows] == [tick.stamp_ns for tick in ticks]


def test_what_it_cannot_do_is_one_line(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = tmp_path / "there.rrd"
    there.write_text("mine")
    with pytest.raises(OutputError, match=r"there\.rrd"):
        cli.main(["view", str(bag), "--save", str(there)])
    assert there.read_text() == "mine"
    with pytest.raises(ConfigError, match=r"run\.mp4: unknown kind of recording"):
        cli.main(["view", str(bag), "--save", "run.mp4"])

    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "rerun":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ConfigError, match="rerun-sdk is not installed; pip install"):
        cli.main(["view", str(bag), "--save", str(tmp_path / "new.rrd")])
    assert not (tmp_path / "new.rrd").exists()
