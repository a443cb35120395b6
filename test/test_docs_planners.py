# SPDX-License-Identifier: Apache-2.0
"""docs/planners.md keeps its word: its planner drives, its table names those there are."""

import re
import shlex
from pathlib import Path

import pytest

from mfba_planner import cli
from mfba_planner.planners.registry import PLANNERS

PAGE = (Path(__file__).parents[1] / "docs/planners.md").read_text(encoding="utf-8")


def test_every_planner_has_its_line() -> None:
    named = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))
    assert named == set(PLANNERS) - {"mfba", "ba"}
    assert "`mfba` and `ba` are it" in PAGE


def commands() -> list[str]:
    blocks = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return [line.removeprefix("mfba ") for block in blocks for line in block.splitlines()]


def test_the_other_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run, simulate, _ = commands()
    assert cli.main([*shlex.split(run), "--driver", "core"]) == 0
    assert cli.main(shlex.split(simulate.replace("100", "3"))) == 0


def test_the_planner_of_one_s_own_runs_in_a_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    command = commands()[-1]
    assert len(code.splitlines()) <= 40
    (tmp_path / "skirt.py").write_text(code)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    words = ["4" if word == "100" else word for word in shlex.split(command)]
    assert cli.main([*words, "--workers", "1"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if line)
    assert (rows["runs"].split(), rows["failed"].split()) == (["4", "4"], ["0", "0"])
