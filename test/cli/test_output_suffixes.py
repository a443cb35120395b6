# SPDX-License-Identifier: Apache-2.0
"""The suffix of a file to create says what is written in it; any other is refused first."""

import ast
from pathlib import Path

import pytest
from project import ROOT

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError
from mfba_planner.entry_points import run_and_return_exit_code
from mfba_planner.report.animation import SUFFIXES

Capture = pytest.CaptureFixture[str]
# A command without the name of the file it creates, and how these names may end.
CREATING = [
    (["picture", "bag"], [".png"]),
    (["verify", "bag", "--set", "planner.speed_mps=1", "--picture"], [".png"]),
    (["report", "bag", "--out"], [".html"]),
    (["view", "bag", "--save"], [".rrd"]),
    (["export", "bag"], [".csv", ".parquet"]),
    (["animate", "bag"], list(SUFFIXES)),
]


def error_of(capture: Capture, *args: str) -> str:
    assert run_and_return_exit_code(lambda: cli.main([*args]), "mfba") == 1
    err = capture.readouterr().err
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize(("command", "suffixes"), CREATING)
def test_another_suffix_is_refused_before_the_bag_is_read(
    command: list[str], suffixes: list[str], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: Capture,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for name in ("x.jpg", "x.pdf", "x", ".png", f"x{suffixes[0]}.txt"):
        err = error_of(capsys, *command, name)
        assert f"{name}: unknown kind of " in err
        assert f"; give a name that ends in {' or '.join(suffixes)}\n" in err
    for suffix in suffixes:
        for name in (f"x{suffix}", f"X{suffix.upper()}"):
            assert "bag: does not exist" in error_of(capsys, *command, name)
    assert not any(tmp_path.iterdir())


def test_no_command_takes_a_file_to_create_as_any_path() -> None:
    """A path that a command writes is a directory (DIR), a bag (OUT) or of file_type()."""
    metavars = set()
    for path in sorted((ROOT / "mfba_planner/cli").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            words = {word.arg: word.value for word in node.keywords}
            kind, metavar = words.get("type"), words.get("metavar")
            if isinstance(kind, ast.Name) and isinstance(metavar, ast.Constant):
                metavars |= {metavar.value} if kind.id == "Path" else set()
    read = {"BAG|RESULT", "FILE | DIR", "PAGE", "YAML"}
    assert metavars - read == {"DIR", "OUT"}


def test_the_error_is_a_configuration_error() -> None:
    with pytest.raises(ConfigError, match=r"^x\.svg: unknown kind of picture; give"):
        cli.main(["picture", "bag", "x.svg"])
