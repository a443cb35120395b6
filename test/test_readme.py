# SPDX-License-Identifier: Apache-2.0
"""The README keeps its word: its commands run, its tables are those of the code."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import reference

from mfba_planner.core.options import walk
from mfba_planner.launcher.by_launch import ARGUMENTS
from mfba_planner.launcher.robot_by_launch import PLANNER_ARGUMENTS, REPLAY_ARGUMENTS
from mfba_planner.ros.replay_args import parse

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = [README, *(path.read_text(encoding="utf-8") for path in ROOT.glob("docs/*.md"))]


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def commands() -> list[list[str]]:
    lines = [line for block in blocks("sh") for line in block.splitlines() if line.strip()]
    words = [shlex.split(line, comments=True) for line in lines]
    return [part for line in words for part in split_at_and(line)]


def split_at_and(words: list[str]) -> list[list[str]]:
    parts: list[list[str]] = [[]]
    for word in words:
        if word == "&&":
            parts.append([])
        else:
            parts[-1].append(word)
    return parts


MFBA = [words[1:] for words in commands() if words[0] == ".venv/bin/mfba"]


def test_every_command_is_one_that_is_checked_here() -> None:
    checked = {".venv/bin/mfba", "make", "ros2", "colcon"}
    setting_up = {"pip", "cd", "ln", "source"}  # of a workspace; tools/colcon_check.sh does it
    assert {words[0] for words in commands()} <= checked | setting_up
    assert len(MFBA) > 8


def test_mfba_commands_run_in_order(tmp_path: Path) -> None:
    """All of them in one directory, as a reader would type them; then the Python blocks."""
    for name in ("config", "test"):
        (tmp_path / name).symlink_to(ROOT / name)
    mfba = Path(sys.executable).parent / "mfba"
    for words in MFBA:
        if words[0] == "sim" and "100" in words:
            words = ["3" if word == "100" else word for word in words]
        done = subprocess.run(
            [mfba, *words], cwd=tmp_path, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, f"mfba {words}\n{done.stdout}\n{done.stderr}"
    for code in blocks("python"):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0, done.stderr
        assert "arrived" in done.stdout


def test_make_targets_exist() -> None:
    wanted = {words[1] for words in commands() if words[0] == "make"}
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"demo", "test"} <= wanted <= targets


@pytest.mark.parametrize(
    "words", [w for w in commands() if w[:2] == ["ros2", "run"]], ids=lambda w: w[3]
)
def test_ros2_run_names_programs_and_parameters_that_exist(words: list[str]) -> None:
    _, _, package, program, *rest = words
    assert package == "mfba_planner"
    declared = {
        name for defaults in reference.NODES.get(program, ()) for name, _, _ in walk(defaults)
    }
    if program == "replay":  # it takes a command line
        assert parse(rest).inputs_of == ("planner",)
    given = {rest[i + 1].partition(":=")[0] for i, word in enumerate(rest) if word == "-p"}
    assert given <= declared


def test_ros2_launch_names_files_and_arguments_that_exist() -> None:
    launches = [w for w in commands() if w[:2] == ["ros2", "launch"]]
    assert launches
    for _, _, _, file, *arguments in launches:
        assert (ROOT / "launch" / file).is_file()
        offered = {"planner": PLANNER_ARGUMENTS, "replay": REPLAY_ARGUMENTS}
        known = offered.get(file.partition(".")[0], ARGUMENTS)
        assert {argument.partition(":=")[0] for argument in arguments} <= set(known)


def test_generated_tables_are_up_to_date() -> None:
    assert reference.updated(README) == README, "run `python tools/reference.py --write`"
    shipped = (ROOT / "config/planner.yaml").read_text(encoding="utf-8")
    assert reference.planner_yaml() == shipped, "run `python tools/reference.py --write`"


def test_files_named_in_the_docs_exist() -> None:
    named = re.compile(r"`((?:docs|config|test|tools|bench|launch)/[\w./-]+)`|\]\(([\w./-]+)\)")
    found = {a or b for text in DOCS for a, b in named.findall(text)}
    assert len(found) >= 5
    here = {name for name in found if any((ROOT / at / name).exists() for at in ("", "docs"))}
    missing = sorted(found - here)
    assert not missing, missing
    assert os.path.getsize(ROOT / "docs/images/case1.png") < 500_000
