# SPDX-License-Identifier: Apache-2.0
"""Commands that take long show what they do and the time left, on a terminal only."""

from pathlib import Path

import pytest
from edited_bags import record

from mfba_planner import cli
from mfba_planner.cli.support import progress_bar

FLEET = """\
name: side by side
robots:
  - {name: a, start_m: [0, 0], goal_m: [2, 0]}
  - {name: b, start_m: [0, 3], goal_m: [2, 3]}
"""


@pytest.mark.parametrize(
    ("args", "what"),
    [
        (["sim", "case1", "--planner=paper"], "simulating"),
        (["sim", "fleet.yaml", "--planner=paper"], "simulating"),
        (["figures", "--only", "fig4", "--format", "svg", "--out", "drawn"], "drawing"),
        (["verify", "bag"], "deciding again"),
    ],
)
def test_a_bar_appears_when_it_takes_long(
    args: list[str],
    what: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("fleet.yaml").write_text(FLEET)
    if args[0] == "verify":
        record(Path("bag"), "empty", 1)
    monkeypatch.setenv("FORCE_COLOR", "1")  # what rich takes for a terminal
    monkeypatch.setattr(progress_bar, "QUIET_S", 0.0)
    capsys.readouterr()
    assert cli.main(args) == 0
    shown = capsys.readouterr()
    assert what in shown.err
    assert what not in shown.out
    monkeypatch.delenv("FORCE_COLOR")
    if args[0] != "figures":
        assert cli.main(args) == 0
        assert capsys.readouterr().err == ""


def test_a_quick_command_shows_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setattr(progress_bar, "QUIET_S", 1e9)
    assert cli.main(["sim", "case1", "--planner=paper"]) == 0
    assert capsys.readouterr().err == ""
