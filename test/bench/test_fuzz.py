# SPDX-License-Identifier: Apache-2.0
"""bench/fuzz.py finds nothing in some cases of each door, and tells failures from refusals."""

import importlib
import time
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from project import ROOT

from mfba_planner.core.errors import MfbaError


@pytest.fixture
def fuzz(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    module = importlib.import_module("fuzz")
    monkeypatch.setattr("signal.alarm", lambda _: None)
    return module


@pytest.mark.parametrize(
    ("door", "cases"),
    [
        ("scenario", 60),
        ("map", 40),
        ("import", 60),
        ("parameters", 40),
        ("bag", 25),
        ("messages", 60),
    ],
)
def test_what_comes_in_is_accepted_or_refused(
    fuzz: ModuleType, door: str, cases: int, tmp_path: Path
) -> None:
    opened = fuzz.DOORS[door](tmp_path)
    with ExitStack() as stack:
        if door == "messages":
            stack.callback(opened.close)
        found = {number: fuzz.run_case(door, opened, number) for number in range(cases)}
    failed = {n: text for n, text in found.items() if text not in ("accepted", "refused")}
    assert failed == {}
    assert set(found.values()) == {"accepted", "refused"}


@pytest.mark.parametrize(
    ("error", "found"),
    [
        (MfbaError("x: bad; give another"), "refused"),
        (MfbaError("x:\nbad"), "two lines: "),
        (ValueError("a bug"), "ValueError: a bug"),
    ],
)
def test_a_failure_is_no_refusal(fuzz: ModuleType, error: Exception, found: str) -> None:
    def door(_rng: Any, _directory: Path) -> None:
        raise error

    assert found in fuzz.run_case("scenario", door, 0)


def test_a_case_that_takes_long_is_a_failure(
    fuzz: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    moments = iter([0.0, 2.5])
    monkeypatch.setattr(time, "process_time", lambda: next(moments))
    assert fuzz.run_case("scenario", lambda *_: None, 0) == "slow: 2.5 s, accepted"
