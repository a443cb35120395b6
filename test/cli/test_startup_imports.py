# SPDX-License-Identifier: Apache-2.0
"""What a command imports before it works, and what it works with: start-up time is imports."""

import subprocess
import sys
from keyword import iskeyword
from pathlib import Path

import pytest

from mfba_planner.cli import COMMANDS

# From 10 ms (yaml) to 300 ms (matplotlib, rclpy) each.
HEAVY = {
    "PIL",
    "distributed",
    "eikonalfm",
    "launch",
    "matplotlib",
    "mcap",
    "mcap_ros2",
    "numpy",
    "pyarrow",
    "pydantic",
    "rclpy",
    "rerun",
    "rich",
    "scipy",
    "yaml",
}
BAG = {"mcap", "mcap_ros2", "numpy", "yaml"}
# Of the module of a command; those not named import numpy alone.
BEFORE = {
    "run": set[str](),
    "replay": set[str](),
    **dict.fromkeys(("decide", "info", "digest", "verify", "diff", "export"), BAG),
    **dict.fromkeys(("animate", "picture", "view", "report"), BAG),
    "recover": BAG - {"numpy"},
    "import": {"numpy", "yaml"},
}


def heavy_after(code: str, directory: Path) -> set[str]:
    """The heavy packages that a new interpreter has imported after code."""
    script = f"import sys\n{code}\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=directory,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return HEAVY.intersection(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_imports_little_before_it_works(command: str, tmp_path: Path) -> None:
    module = f"{command}_" if iskeyword(command) else command.replace("-", "_")
    code = f"import mfba_planner.cli.{module}"
    assert heavy_after(code, tmp_path) <= BEFORE.get(command, {"numpy"})


@pytest.mark.parametrize(
    ("args", "wanted"),
    [
        (["--help"], set()),
        (["--version"], set()),
        (["run", "--help"], {"numpy"}),
        (["sim", "case1", "--planner=paper"], {"numpy", "yaml"}),
        (["sim", "case1"], {"numpy", "yaml"}),
        (["sim", "case1", "--out=run"], {"PIL", "matplotlib", "numpy", "yaml"}),
        (["options"], {"numpy"}),
    ],
)
def test_a_command_works_with_what_it_needs(
    args: list[str], wanted: set[str], tmp_path: Path
) -> None:
    """Shipped scenarios in the usual form need no pydantic, tables in a pipe no rich."""
    code = f"from mfba_planner import cli\ntry: cli.main({args})\nexcept SystemExit: pass"
    assert heavy_after(code, tmp_path) <= wanted
