# SPDX-License-Identifier: Apache-2.0
"""Stopping distance against what is seen: the fault, and a remedy that is one."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import NANO, Mode, Observation, Scan
from mfba_planner.core.robot_base import Drive
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.differential_drive import Speeds, apply_command
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, preset
from mfba_planner.planning.stopping_distance import stopping_distance_m, too_fast_for_lidar

PARAMS = preset(PlannerParams(method=Method.PREDICTIVE))
GOAL = (5.0, 0.0)


def test_it_is_what_the_simulated_base_drives_until_it_rests() -> None:
    params = replace(PARAMS, drive=Drive.DIFFERENTIAL, max_speed_mps=0.6, max_accel_mps2=0.5)
    pose, speeds = Pose2D(0.0, 0.0), Speeds(v=0.6)
    for commanded in (0.6, *[0.0] * 30):
        pose, speeds = apply_command(pose, speeds, (commanded, 0.0), params, params.tick_ns)
    assert speeds.v == 0.0
    # Speeds change at the start of a subtick, so the base stops a little earlier.
    assert pose.x == pytest.approx(stopping_distance_m(params), abs=0.01)
    omnidirectional = replace(params, drive=Drive.OMNIDIRECTIONAL)
    assert stopping_distance_m(omnidirectional) == pytest.approx(params.step_length_m)


@given(
    drive=st.sampled_from(Drive),
    speed=st.floats(0.1, 5.0),
    limit=st.floats(0.1, 5.0),
    step=st.floats(0.02, 1.0),
    accel=st.floats(0.1, 5.0),
    observed_m=st.floats(0.1, 5.0),
)
@settings(max_examples=300)
def test_each_remedy_is_one(
    drive: Drive, speed: float, limit: float, step: float, accel: float, observed_m: float
) -> None:
    params = replace(
        PARAMS, drive=drive, speed_mps=speed, max_speed_mps=limit, step_length_m=step,
        max_accel_mps2=accel,
    )  # fmt: skip
    fault = too_fast_for_lidar(params, observed_m)
    assert bool(fault) == (stopping_distance_m(params) > observed_m - params.robot_radius_m + 1e-6)
    if not fault:
        return
    assert not too_fast_for_lidar(params, float(fault.split()[-2]))
    remedy = re.search(r"lower (speed_mps|step_length_m) to ([\d.]+)", fault)
    if remedy and (value := float(remedy[2])) >= 0.01:
        assert not too_fast_for_lidar(override(params, {remedy[1]: value}), observed_m)


def observation(range_max_m: float) -> Observation:
    scan = Scan(
        ranges_m=np.full(360, math.inf),
        angle_min_rad=0.0,
        angle_increment_rad=math.radians(1.0),
        range_min_m=0.1,
        range_max_m=range_max_m,
    )
    return Observation(
        stamp_ns=round(1.0 / NANO), pose=Pose2D(0.0, 0.0), ranges_m=(), goal=GOAL,
        now_ns=round(1.0 / NANO), scan=scan,
    )  # fmt: skip


def test_the_planner_does_not_drive_on_a_lidar_that_sees_less_far_than_it_stops() -> None:
    planner = Predictive(PARAMS, SensorParams(), 0)
    stopped = planner.plan(observation(0.35))
    assert (stopped.mode, stopped.velocity) == (Mode.STOPPED, (0.0, 0.0))
    assert stopped.reason == (
        "refused input: speed_mps=0.785: the robot stops within 0.08 m, but sees only 0.05 m "
        "ahead: the lidar's range of 0.35 m less robot_radius_m=0.3; lower step_length_m to 0.05, "
        "or give a lidar of 0.38 m"
    )
    planner = Predictive(PARAMS, SensorParams(), 0)
    assert planner.plan(observation(0.39)).velocity == pytest.approx((0.785, 0.0))
