# SPDX-License-Identifier: Apache-2.0
"""Circles for planners that need them: given, late, or tracked in scans."""

import math

import numpy as np
import pytest

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Circle, Observation, Scan
from mfba_planner.planning.circles_from_observation import CirclesFromObservation, circle_rows
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.simulation.simulated_lidar import cast_rays

PARAMS = PlannerParams()
CIRCLE = Circle(center_m=(2.0, 1.0), radius_m=0.6, velocity_mps=(0.5, -0.25))


def observation(stamp_ns: int, **inputs: object) -> Observation:
    return Observation(
        stamp_ns=stamp_ns,
        now_ns=stamp_ns,
        pose=Pose2D(1.0, 1.0),
        ranges_m=(),
        goal=(9.0, 1.0),
        **inputs,  # type: ignore[arg-type]
    )


def scan(center: tuple[float, float]) -> Scan:
    """360 beams from (1, 1) to a disc of 0.3 m."""
    increment = 2.0 * math.pi / 360
    return Scan(
        ranges_m=cast_rays((1.0, 1.0), [(*center, 0.3)], 360, 3.5),
        angle_min_rad=0.5 * increment,
        angle_increment_rad=increment,
        range_min_m=0.0,
        range_max_m=3.5,
    )


def test_given_circles_are_taken_as_they_are() -> None:
    assert list(CirclesFromObservation(PARAMS).update(observation(0, circles=(CIRCLE,)))) == [
        CIRCLE
    ]
    assert not CirclesFromObservation(PARAMS).update(observation(0))


def test_late_circles_are_brought_to_the_stamp_of_the_observation() -> None:
    late = observation(300_000_000, circles=(CIRCLE,), sensed=(100_000_000, Pose2D(0.5, 1.0)))
    (found,) = CirclesFromObservation(PARAMS).update(late)
    assert found.center_m == pytest.approx((2.1, 0.95))
    assert (found.radius_m, found.velocity_mps) == (0.6, (0.5, -0.25))


@pytest.mark.parametrize("age_ns", [0, 200_000_000])
def test_circles_in_scans_have_motion_and_are_enlarged_by_the_robot(age_ns: int) -> None:
    """Late scans too: the circle is where the disc is now, not where it was."""
    circles = CirclesFromObservation(PARAMS)
    for k in range(15):
        stamp_ns = k * 100_000_000
        measured = scan((2.5, 2.0 - 0.4 * stamp_ns * 1e-9))
        now_ns = stamp_ns + age_ns
        sensed = {"sensed": (stamp_ns, Pose2D(1.0, 1.0))} if age_ns else {}
        tracked = circles.update(observation(now_ns, scan=measured, **sensed))
    (found,) = tracked
    assert found.center_m == pytest.approx((2.5, 2.0 - 0.4 * now_ns * 1e-9), abs=0.06)
    assert found.velocity_mps == pytest.approx((0.0, -0.4), abs=0.1)
    assert 0.57 <= found.radius_m <= 0.85


def test_rows_are_relative_to_the_position() -> None:
    assert circle_rows([CIRCLE], (1.5, 1.5)).tolist() == [[0.5, -0.5, 0.5, -0.25, 0.6]]
    assert circle_rows([], (1.5, 1.5)).shape == (0, 5)
    assert circle_rows([CIRCLE], (1.5, 1.5)).dtype == np.float64
