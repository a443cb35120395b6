# SPDX-License-Identifier: Apache-2.0
"""ObstacleMemory: circles out of range are predicted, dropped in time and never doubled."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point
from mfba_planner.core.planner_types import Circle
from mfba_planner.perception.obstacle_memory import ObstacleMemory, ObstacleMemoryParams

SECOND = 10**9
RANGE_M = 0.8
ORIGIN = (0.0, 0.0)


def circle(x: float, y: float = 0.0, velocity: Point = (0.0, 0.0)) -> Circle:
    return Circle(center_m=(x, y), radius_m=0.6, velocity_mps=velocity)


def observe_sectors(
    memory: ObstacleMemory, at_s: float, *observed: Circle, position: Point = ORIGIN
) -> list[Circle]:
    return memory.update(round(at_s * SECOND), position, RANGE_M, observed)


def test_a_circle_out_of_range_is_predicted() -> None:
    memory = ObstacleMemory()
    observe_sectors(memory, 0.0, circle(1.39, velocity=(0.3, -0.1)))
    (hidden,) = observe_sectors(memory, 0.5)
    assert hidden.center_m == pytest.approx((1.54, -0.05))
    (hidden,) = observe_sectors(memory, 1.5)
    assert hidden.center_m == pytest.approx((1.84, -0.15))


def test_a_remembered_circle_in_range_but_not_observed_is_dropped() -> None:
    memory = ObstacleMemory()
    observe_sectors(memory, 0.0, circle(1.3))
    assert observe_sectors(memory, 0.1) == []
    assert observe_sectors(memory, 0.2, position=(-5.0, 0.0)) == []


def test_an_observed_circle_is_not_remembered_as_well() -> None:
    memory = ObstacleMemory()
    observe_sectors(memory, 0.0, circle(1.39, velocity=(0.2, 0.0)))
    turned = circle(1.39, velocity=(0.0, 0.2))  # without turning it would be out of range
    assert observe_sectors(memory, 0.1, turned) == [turned]


def test_circles_observed_beyond_the_range_are_not_doubled() -> None:
    memory = ObstacleMemory()
    for tick in range(10):
        observed = [circle(5.0 + 0.02 * tick, velocity=(0.2, 0.0)), circle(3.0)]
        assert observe_sectors(memory, 0.1 * tick, *observed) == observed


@pytest.mark.parametrize(("speed_mps", "until_s"), [(0.3, 2.0), (0.1, 6.0), (0.0, 10.0)])
def test_faster_circles_are_dropped_sooner(speed_mps: float, until_s: float) -> None:
    memory = ObstacleMemory(ObstacleMemoryParams(path_m=0.6, longest_s=10.0))
    observe_sectors(memory, 0.0, circle(1.4, velocity=(speed_mps, 0.0)))
    assert len(observe_sectors(memory, until_s - 0.01, position=(-1.0, 0.0))) == 1
    assert observe_sectors(memory, until_s + 0.01, position=(-1.0, 0.0)) == []


def test_a_stamp_that_does_not_rise_clears_the_memory() -> None:
    memory = ObstacleMemory()
    observe_sectors(memory, 1.0, circle(1.39, velocity=(0.3, 0.0)))
    assert observe_sectors(memory, 1.0) == []


def test_longest_s_0_remembers_nothing() -> None:
    memory = ObstacleMemory(ObstacleMemoryParams(longest_s=0.0))
    observe_sectors(memory, 0.0, circle(1.39, velocity=(0.3, 0.0)))
    assert observe_sectors(memory, 0.1) == []


@given(
    x=st.floats(0.7, 1.4), vx=st.floats(-0.5, 0.5), vy=st.floats(-0.5, 0.5),
    ticks=st.lists(st.floats(0.05, 0.5), min_size=1, max_size=8),
)  # fmt: skip
@settings(max_examples=100)
def test_a_circle_at_constant_velocity_is_remembered_once_at_its_true_position(
    x: float, vx: float, vy: float, ticks: list[float]
) -> None:
    memory, t = ObstacleMemory(), 0.0
    for dt in (0.0, *ticks):
        t += dt
        true = circle(x + vx * t, vy * t, (vx, vy))
        in_range = true.center_m[0] ** 2 + true.center_m[1] ** 2 <= 1.4**2
        kept = observe_sectors(memory, t, *([true] if in_range else []))
        assert len(kept) <= 1
        if in_range:
            assert kept == [true]
        elif kept:
            assert kept[0].center_m == pytest.approx(true.center_m, abs=1e-6)
