# SPDX-License-Identifier: Apache-2.0
"""docs/ros.md: parameters and files in it exist, and its bound for giving up is correct."""

import re

import pytest
from project import ROOT

from mfba_planner.core.option_specs import walk
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.recovery import RecoveryParams, longest_s
from mfba_planner.ros.node_settings import PlannerSettings, WorldSimSettings

PAGE = (ROOT / "docs/ros.md").read_text(encoding="utf-8")


def test_parameters_and_files_that_are_named_exist() -> None:
    declared = {
        name
        for defaults in (PlannerSettings(), PlannerParams(), WorldSimSettings())
        for name, _, _ in walk(defaults)
    }
    named = set(re.findall(r"`((?:speed_limit|recovery)\.\w+|\w+_(?:s|m|mps)|hardware_id)`", PAGE))
    shortened = {"wait_s", "slow_within_m"}
    assert len(named) > 8
    assert named - shortened <= declared
    for file in re.findall(r"(?:config|layout|test)/[\w./]+\w", PAGE):
        assert (ROOT / file).is_file(), file


def test_the_bound_for_giving_up_is_the_printed_one() -> None:
    params = RecoveryParams(wait_s=2.0, back_off_s=1.0, attempts=3)
    printed = (3 + 1) * (2 * 2.0 + 3 * 0.1) + 3 * (1.0 + 2 * 0.1)
    assert longest_s(params, 0.1) == pytest.approx(printed)
