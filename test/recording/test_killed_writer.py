# SPDX-License-Identifier: Apache-2.0
"""A writer that is killed loses at most one second of its bag."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT

import mfba_planner

SCRIPT = ROOT / "bench" / "recording_kill.py"


@pytest.mark.parametrize("rate", ["500", "5000"])
def test_kill_9_loses_at_most_a_second(rate: str) -> None:
    """Chunks end by age at the low rate, by size at the high one (4 MB/s)."""
    source = str(Path(mfba_planner.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--kills", "2", "--rate", rate, "--longest", "1.5"],
        env={**os.environ, "PYTHONPATH": source},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1].startswith("2 of 2 within 1.0 s")
