# SPDX-License-Identifier: Apache-2.0
"""The planners for comparison: APF, VFH, DWA, ORCA."""

import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Circle, Mode, Observation, Scan
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.base_planner import BasePlanner
from mfba_planner.planning.peers import apf
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.planner_registry import make
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.planner_observations import Perception
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.simulated_lidar import cast_rays

PEERS = ("apf", "vfh", "dwa", "orca")
PARAMS = PlannerParams(speed_mps=0.8)
FREE = (math.inf,) * 12
OBSERVATION = Observation(
    stamp_ns=PARAMS.tick_ns,
    now_ns=PARAMS.tick_ns,
    pose=Pose2D(1.0, 1.0),
    ranges_m=FREE,
    goal=(9.0, 1.0),
    circles=(),
)


def circle(x: float, y: float, vx: float = 0.0, vy: float = 0.0, radius_m: float = 0.6) -> Circle:
    """A circle at (x, y) relative to the robot."""
    return Circle(center_m=(1.0 + x, 1.0 + y), radius_m=radius_m, velocity_mps=(vx, vy))


def velocity(name: str, *circles: Circle) -> tuple[float, float]:
    return make(name, PARAMS).plan(replace(OBSERVATION, circles=circles)).velocity


@pytest.mark.parametrize("name", PEERS)
def test_without_obstacles_they_drive_straight(name: str) -> None:
    assert velocity(name) == pytest.approx((0.8, 0.0))


@pytest.mark.parametrize("name", PEERS)
def test_the_last_step_ends_at_the_goal(name: str) -> None:
    near = replace(OBSERVATION, goal=(1.1, 1.0))
    decision = make(name, PARAMS).plan(near)
    assert decision.waypoint == pytest.approx((1.1, 1.0))


NEAR = st.builds(
    circle,
    x=st.floats(-1.4, 1.4),
    y=st.floats(-1.4, 1.4),
    vx=st.floats(-0.5, 0.5),
    vy=st.floats(-0.5, 0.5),
    radius_m=st.floats(0.1, 0.7),
)


@pytest.mark.parametrize("name", PEERS)
@settings(max_examples=60, deadline=None)
@given(circles=st.lists(NEAR, max_size=5))
def test_none_exceeds_the_speed(name: str, circles: list[Circle]) -> None:
    vx, vy = velocity(name, *circles)
    assert math.hypot(vx, vy) <= 0.8 * (1.0 + 1e-6)


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("speed_mps", [0.0, 0.2])
def test_an_obstacle_on_the_path_is_passed(name: str, speed_mps: float) -> None:
    """Slightly off the straight line; exactly on it a potential field may stop."""
    obstacle = Obstacle(
        center_m=(5.0, 5.2), radius_m=0.3, speed_mps=speed_mps, heading_rad=-0.75 * math.pi
    )
    world = Scenario(
        name="one", start_m=(0.0, 0.0), goal_m=(9.0, 9.0), obstacles=(obstacle,), time_limit_s=60.0
    )
    straight = run(world, planner=PARAMS, path_planner=make("straight", PARAMS))
    assert evaluate(straight).collisions == 1
    episode = run(
        world, planner=PARAMS, path_planner=make(name, PARAMS), observe=Perception("known")
    )
    result = evaluate(episode)
    assert result.success, result
    assert result.length_m < 1.25 * math.dist(world.start_m, world.goal_m)


def test_dwa_and_orca_do_not_evade_an_obstacle_that_moves_away() -> None:
    leaving, staying = circle(1.3, 0.0, vx=0.79), circle(1.3, 0.0)
    for name in ("dwa", "orca"):
        assert velocity(name, leaving) == pytest.approx((0.8, 0.0), abs=0.03)
        assert velocity(name, staying) != pytest.approx((0.8, 0.0), abs=0.1)


def test_a_potential_field_repels_more_at_a_smaller_distance() -> None:
    vy = [velocity("apf", circle(0.0, -0.6 - gap))[1] for gap in (0.7, 0.4, 0.2, 0.1)]
    assert vy == sorted(vy)
    assert vy[0] > 0.0
    assert velocity("apf", circle(0.0, -0.6 - 0.8)) == pytest.approx((0.8, 0.0))


def test_vfh_takes_the_free_heading_nearest_to_the_goal_and_keeps_its_side() -> None:
    planner = make("vfh", PARAMS)
    above = planner.plan(replace(OBSERVATION, circles=(circle(1.0, -0.1),)))
    assert above.velocity[1] > 0.0, "the side with the smaller turn"
    after = planner.plan(
        replace(OBSERVATION, stamp_ns=2 * PARAMS.tick_ns, circles=(circle(1.0, 0.1),))
    )
    assert after.velocity[1] > 0.0, "the last heading counts"
    assert velocity("vfh", circle(1.0, 0.1))[1] < 0.0


def test_enclosed_they_report_blocked() -> None:
    ring = [circle(math.cos(a), math.sin(a), radius_m=0.97) for a in np.linspace(0.0, 6.0, 24)]
    for name in ("vfh", "dwa"):
        decision = make(name, PARAMS).plan(replace(OBSERVATION, circles=tuple(ring)))
        assert decision.mode is Mode.BLOCKED, name
    assert velocity("vfh", *ring) == (0.0, 0.0)


def test_forces_that_cancel_stop_the_robot_with_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apf, "REPULSION", 0.4**2 / (1.0 / 0.4 - 1.0 / 0.8))
    decision = make("apf", PARAMS).plan(replace(OBSERVATION, circles=(circle(1.0, 0.0),)))
    assert (decision.mode, decision.velocity) == (Mode.BLOCKED, (0.0, 0.0))
    assert decision.reason == "1 repelling: forces cancel"


def crowd_scan(time_s: float) -> tuple[Scan, tuple[Circle, ...]]:
    """Two obstacles near the robot at (1, 1): one at rest ahead, one that crosses."""
    surfaces = [(2.0, 1.1, 0.3), (1.6, 2.4 - 0.4 * time_s, 0.3)]
    ranges = cast_rays((1.0, 1.0), surfaces, 360, 3.5)
    circles = tuple(
        Circle(center_m=(x, y), radius_m=r + 0.3, velocity_mps=velocity)
        for (x, y, r), velocity in zip(surfaces, ((0.0, 0.0), (0.0, -0.4)))
    )
    increment = 2.0 * math.pi / 360
    return (
        Scan(
            ranges_m=ranges,
            angle_min_rad=0.5 * increment,
            angle_increment_rad=increment,
            range_min_m=0.0,
            range_max_m=3.5,
        ),
        circles,
    )


def observed(time_s: float, **inputs: Any) -> Observation:
    stamp_ns = round(time_s * 1e9)
    return replace(OBSERVATION, stamp_ns=stamp_ns, now_ns=stamp_ns, **{"circles": None, **inputs})


@pytest.mark.parametrize("name", PEERS)
def test_after_some_scans_a_peer_decides_nearly_as_with_known_circles(name: str) -> None:
    by_scan, by_circles = make(name, PARAMS), make(name, PARAMS)
    for k in range(11):
        scan, circles = crowd_scan(0.1 * k)
        decision = by_scan.plan(observed(0.1 * k, scan=scan))
        expected = by_circles.plan(observed(0.1 * k, circles=circles))
    assert expected.velocity != pytest.approx((0.8, 0.0), abs=0.1)
    assert math.dist(decision.velocity, expected.velocity) < 0.3
    assert decision.mode is expected.mode


@pytest.mark.parametrize("name", PEERS)
def test_a_new_trip_begins_without_tracks(name: str) -> None:
    used = make(name, PARAMS)
    for k in range(11):
        used.plan(observed(0.1 * k, scan=crowd_scan(0.1 * k)[0]))
    assert isinstance(used, BasePlanner)
    used.reset()
    scan = crowd_scan(0.0)[0]
    assert used.plan(observed(2.0, scan=scan)) == make(name, PARAMS).plan(observed(2.0, scan=scan))


@pytest.mark.parametrize("name", PEERS)
def test_without_an_input_that_it_uses_a_planner_stops(name: str) -> None:
    """Sectors are given: unknown is not free."""
    blind = replace(OBSERVATION, circles=None)
    decision = make(name, PARAMS).plan(blind)
    assert (decision.mode, decision.velocity) == (Mode.STOPPED, (0.0, 0.0))
    assert decision.reason == "refused input: none of circles, scan"
    assert make("straight", PARAMS).plan(blind).velocity == pytest.approx((0.8, 0.0))


def test_vfh_masks_no_heading_for_a_circle_beyond_its_active_window() -> None:
    assert velocity("vfh", circle(0.6 + 0.81, 0.0)) == pytest.approx((0.8, 0.0))
    assert velocity("vfh", circle(0.6 + 0.79, 0.0)) != pytest.approx((0.8, 0.0), abs=0.1)


def test_the_error_without_pyrvo_names_the_package_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "pyrvo", None)
    with pytest.raises(ConfigError, match="needs pyrvo; pip install"):
        make("orca", PARAMS, SensorParams())
