# SPDX-License-Identifier: Apache-2.0
"""A robot's rectangle as circles: they cover it, reach little beyond, and make a scenario."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.scenarios.importers.imported import ImportOptions, Source
from mfba_planner.scenarios.importers.ir_sim import read_ir_sim
from mfba_planner.scenarios.importers.rectangle_circles import rectangle_circles
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.footprint import MOST_CIRCLES, inscribed_radius_m

SIDES = st.floats(0.05, 5.0)
SHARES = st.floats(0.0, 1.0)


@given(length_m=SIDES, width_m=SIDES, ahead_m=st.floats(-1.0, 1.0), s=SHARES, t=SHARES)
def test_every_point_of_the_rectangle_is_covered(
    length_m: float, width_m: float, ahead_m: float, s: float, t: float
) -> None:
    circles = rectangle_circles(length_m, width_m, ahead_m)
    assert 1 <= len(circles) <= MOST_CIRCLES
    x, y = ahead_m + (s - 0.5) * length_m, (t - 0.5) * width_m
    assert any(math.hypot(x - a, y - b) <= r for a, b, r in circles)


@given(length_m=SIDES, width_m=SIDES)
def test_little_more_than_the_rectangle_is_covered(length_m: float, width_m: float) -> None:
    circles = rectangle_circles(length_m, width_m)
    beyond = max(
        max(abs(x) + r - 0.5 * length_m, abs(y) + r - 0.5 * width_m) for x, y, r in circles
    )
    short, long = sorted((length_m, width_m))
    if long <= 4.0 * short:
        assert beyond <= 0.208 * short + 3e-6
    square = rectangle_circles(short, short)
    assert max(abs(x) + r for x, _, r in square) <= 0.552 * short + 3e-6


def world(robot: str) -> Source:
    return Source(f"robot: {{{robot}, state: [0, 0], goal: [5, 5]}}\n", "x", Path())


def test_a_rectangular_robot_is_imported() -> None:
    text = "kinematics: {name: diff}, shape: {name: rectangle, length: 1.0, width: 0.5}"
    found = read_ir_sim(world(text), ImportOptions())
    (plain,) = found.scenarios
    assert found.lost == []
    assert "robot_radius_m" not in plain
    scenario = parse_scenario(json.dumps(plain), "x")
    assert len(scenario.robot.footprint_m) == 8
    assert scenario.robot_radius_m == pytest.approx(math.hypot(0.375, 0.125) + 0.1768, abs=1e-4)
    assert inscribed_radius_m(scenario.robot.footprint_m) >= 0.25


def test_the_origin_of_an_ackermann_robot_is_its_rear_axle() -> None:
    shape = "shape: {name: rectangle, length: 4.0, width: 1.0, wheelbase: 3.0}"
    (plain,) = read_ir_sim(
        world(f"kinematics: {{name: acker}}, {shape}"), ImportOptions()
    ).scenarios
    xs = [x for x, _, _ in plain["robot"]["footprint_m"]]
    assert (min(xs), max(xs)) == (-0.25, 3.25)


def test_a_radius_of_ones_own_makes_it_a_disc() -> None:
    text = "shape: {name: rectangle, length: 1.0, width: 0.5}"
    (plain,) = read_ir_sim(world(text), ImportOptions(robot_radius_m=0.3)).scenarios
    assert plain["robot_radius_m"] == 0.3
    assert "footprint_m" not in plain["robot"]


@pytest.mark.parametrize("side", ["length: 0, width: 1", "length: -1, width: 1",
                                  "length: 1.0e+9, width: 1"])  # fmt: skip
def test_a_rectangle_without_area_is_refused(side: str) -> None:
    with pytest.raises(ConfigError, match=r"robot length=.*: out of range; give a number above 0"):
        read_ir_sim(world(f"shape: {{name: rectangle, {side}}}"), ImportOptions())
