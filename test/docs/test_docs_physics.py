# SPDX-License-Identifier: Apache-2.0
"""docs/how-to/physics.md: its commands, as one directory after the other would see them."""

import os
import re
import subprocess
import sys
from pathlib import Path

import shown_commands
from project import ROOT

PAGE = (ROOT / "docs/how-to/physics.md").read_text(encoding="utf-8")
RUN, MANY = (words for words in shown_commands.commands(PAGE) if words[0] == "python")


def test_a_run_is_verified_shown_and_simulated_again(tmp_path: Path) -> None:
    # Reduced to 2 s, so that the robot does not arrive: the exit code is 1.
    printed = shown_commands.script(shown_commands.reduced(RUN), tmp_path, code=1)
    assert printed.startswith("did not arrive after 2.")
    verified = re.search(r"^verified (\d+) of (\d+) decisions of runs/physics/bag$", printed, re.M)
    assert verified
    assert int(verified[1]) == int(verified[2]) >= 20
    output = ""
    for words in shown_commands.commands(PAGE):
        arguments = shown_commands.mfba_arguments(words)
        if arguments is not None:
            output += shown_commands.mfba(arguments, tmp_path)
    assert f"identical, {verified[1]} decisions" in output
    assert (tmp_path / "runs/physics.html").stat().st_size > 50_000


def test_many_worlds_make_a_table(tmp_path: Path) -> None:
    table = shown_commands.script(shown_commands.reduced(MANY), tmp_path)
    header, _, row, turned = table.splitlines()
    assert header in PAGE.splitlines()
    assert row.startswith("| MuJoCo | 1 of 1 [20.7, 100.0] % |")
    assert re.match(r"MuJoCo: \d of \d first contacts with a person who had turned ", turned)


def test_a_missing_engine_costs_one_line(tmp_path: Path) -> None:
    (tmp_path / "mujoco.py").write_text("raise ImportError('no engine')\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, ROOT / RUN[1]],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr == "mujoco is not installed; run: pip install 'mujoco>=3.2,<4'\n"
