# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/optimizer.md run and print correct results."""

import re
from typing import Any

import numpy as np
import pytest
from project import ROOT

from mfba_planner.paper.readings_of_paper import SWARMS

PAGE = (ROOT / "docs/optimizer.md").read_text(encoding="utf-8")


def test_the_examples_run_one_after_the_other(capsys: pytest.CaptureFixture[str]) -> None:
    space: dict[str, Any] = {}
    printed = []
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL):
        exec(block.replace("range(1000)", "range(20)"), space)
        printed.append(capsys.readouterr().out)
    assert len(printed) == 3
    assert printed[0].endswith("no failures\n")
    first = float(printed[0].split()[0])
    assert first < 0.1
    assert space["swarm"].best_value == first, "ask-and-tell gives the same run"
    assert space["result"].best_x.shape == (20, 2)
    assert np.median(space["result"].best_value) < 0.1


def test_every_preset_is_named() -> None:
    assert set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)) >= set(SWARMS)
