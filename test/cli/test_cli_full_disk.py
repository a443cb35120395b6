# SPDX-License-Identifier: Apache-2.0
"""Results on a disk that fills up: what was computed is printed, and what was written is named."""

import json
import re
from pathlib import Path

import pytest
from full_disk import file_size_limit
from recorded_bags import FOREIGN

from mfba_planner import cli
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.launcher.execute_run import execute
from mfba_planner.launcher.run_arguments import read_request

Capture = pytest.CaptureFixture[str]
RESULT_ONLY = 20_000  # result.json has 4 kB, run.png 100
NOTHING = 500


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def on_full_disk(capture: Capture, size: int, *args: str) -> tuple[str, str]:
    """Output and the one line of error of a command that finds no room for larger files."""
    with file_size_limit(size):
        assert run_and_return_exit_code(lambda: cli.main([*args]), "mfba") == 1
    out, err = capture.readouterr()
    assert err.count("\n") == 1
    assert "cannot be written (file too large)" in err
    return out, err


@pytest.mark.parametrize(
    "command",
    [
        ("run", "empty", "--driver", "core", "--out", "r"),
        ("sim", "empty", "--out", "r"),
        ("sim", "empty", "--planner", "straight", "--out", "r"),
    ],
)
def test_a_run_prints_its_result_and_what_was_written(
    command: tuple[str, ...], capsys: Capture
) -> None:
    out, err = on_full_disk(capsys, RESULT_ONLY, *command)
    assert re.search(r"outcome +goal reached", out)
    assert out.endswith("\nwrote r: result.json\n")
    assert err.startswith("mfba: r/run.png: ")
    assert json.loads(Path("r/result.json").read_text("utf-8"))["result"]["outcome"]


@pytest.mark.parametrize(
    "command",
    [
        ("run", "empty", "--driver", "core", "--out", "r"),
        ("sim", "empty", "--planner", "straight", "--out", "r"),
        ("figures", "--only", "fig6", "--out", "r"),
        ("show", "random-3/0/straight/0", "--no-bag", "--out", "r"),
    ],
)
def test_a_directory_without_a_result_is_not_left(
    command: tuple[str, ...], capsys: Capture
) -> None:
    out, _ = on_full_disk(capsys, 50, *command)
    assert "wrote" not in out
    assert not any(Path().iterdir())
    cli.main([*command])  # the same name is free
    assert any(Path("r").iterdir())


def test_figures_are_all_or_none(capsys: Capture) -> None:
    assert cli.main(["figures", "--only", "fig6", "fig2", "--out", "whole"]) == 0
    sizes = sorted(path.stat().st_size for path in Path("whole").iterdir())
    on_full_disk(capsys, sizes[-1] - 1, "figures", "--only", "fig6", "fig2", "--out", "r")
    assert not Path("r").exists()


def test_decisions_on_a_recording(capsys: Capture) -> None:
    assert cli.main(["decide", str(FOREIGN), "--out", "whole"]) == 0
    printed = capsys.readouterr().out
    sizes = {path.name: path.stat().st_size for path in Path("whole").rglob("*")}
    largest = sizes.pop("run.png")
    assert largest > max(sizes.values())
    out, err = on_full_disk(capsys, largest - 1, "decide", str(FOREIGN), "--out", "r")
    assert err.startswith("mfba: r/run.png: ")
    assert printed.endswith("\nwrote whole: bag, result.json, run.png, report.html\n")
    assert out == printed.replace("wrote whole", "wrote r").replace(", run.png, report.html", "")


def test_a_failed_run_still_names_its_failure(capsys: Capture) -> None:
    """The error of the run is the one that counts; that of the disk is a note."""
    request = read_request(
        ["case2", "--driver", "core", "--out", "r", "--timeout", "0.01"], "launcher"
    )
    with file_size_limit(NOTHING), pytest.raises(Exception, match=r"timeout of 0\.01 s reached"):
        execute(request)
    assert "note: r/result.json: cannot be written (file too large)" in capsys.readouterr().out
