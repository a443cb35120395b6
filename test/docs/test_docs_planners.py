# SPDX-License-Identifier: Apache-2.0
"""docs/planners.md: its example planner works, and its table lists every planner."""

import re
from pathlib import Path

import pytest
import shown_commands
from project import ROOT

from mfba_planner import cli
from mfba_planner.planning.planner_registry import PLANNERS

PAGE = (ROOT / "docs/planners.md").read_text(encoding="utf-8")


def test_every_planner_has_a_row() -> None:
    named = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))
    assert named == set(PLANNERS) - {"mfba", "ba"}
    assert "`mfba` and `ba` are it" in PAGE


RUN, SIM, SWEEP = map(shown_commands.reduced, shown_commands.commands(PAGE))


def test_the_other_commands_run(tmp_path: Path) -> None:
    assert "goal reached" in shown_commands.mfba(RUN[1:], tmp_path)
    assert "3 of 3 at the goal without collision" in shown_commands.mfba(SIM[1:], tmp_path)


def test_the_example_planner_runs_in_a_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert len(code.splitlines()) <= 40
    (tmp_path / "skirt.py").write_text(code)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert cli.main(SWEEP[1:]) == 0
    # A cell that is too wide for the terminal goes on in a line of one word.
    found = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    rows = {words[0]: words[1] for words in found if len(words) == 2}
    assert (rows["runs"].split(), rows["failed"].split()) == (["4", "4"], ["0", "0"])
