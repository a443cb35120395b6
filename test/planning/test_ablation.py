# SPDX-License-Identifier: Apache-2.0
"""Ablations of the predictive planner: each lacks the named component, and arrives."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.planner_types import Circle, Mode, Observation
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.suites.scenario_suite import single_scenario
from mfba_planner.evaluation.sweep.single_run import run_one
from mfba_planner.evaluation.sweep.sweep_spec import Run, Setting, default_setting
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.peers import ablation
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.planning.predictive_planner import Predictive, preset
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

SETTING = Setting(params=preset(PlannerParams(speed_mps=0.8)))
NAMES = (
    "BitsOnly",
    "NoBats",
    "NoLastWaypoint",
    "NoVelocities",
    "NoWaiting",
    "no_margins",
    "no_memory",
)


@cache
def drive(name: str) -> Episode:
    planner = name if name == "predictive" else f"{ablation.__name__}:{name}"
    outcome = run_one(Run("random-30", 0, planner, 0), SETTING)
    assert outcome.fault == ""
    return outcome.episode


def decide(name: str, *circles: Circle) -> Any:
    planner = getattr(ablation, name)(SETTING.params, SensorParams(), 0)
    return planner.plan(
        Observation(
            stamp_ns=100_000_000, now_ns=100_000_000, pose=Pose2D(0.0, 0.0), ranges_m=(),
            goal=(10.0, 0.0), circles=circles,
        )
    )  # fmt: skip


@pytest.mark.no_cover
@pytest.mark.parametrize("name", NAMES)
def test_every_ablation_arrives_by_another_path_than_the_full_planner(name: str) -> None:
    result = evaluate(drive(name))
    assert result.outcome is Outcome.GOAL_REACHED
    if name != "no_memory":  # with so few obstacles it may not matter
        assert result.length_m != evaluate(drive("predictive")).length_m


def test_without_bats_no_candidates() -> None:
    assert not any(tick.candidates for tick in drive("NoBats").ticks)
    assert any(tick.candidates for tick in drive("NoWaiting").ticks)


@pytest.mark.parametrize("name", ["NoWaiting", "BitsOnly"])
def test_full_speed_unless_blocked_or_near_the_goal(name: str) -> None:
    for tick in drive(name).ticks:
        left = math.dist(tick.waypoint, tick.pose.position)
        if left > 0.08 * (1.0 + 1e-6):  # farther than one tick
            assert math.hypot(*tick.velocity) == pytest.approx(0.8)


def test_bits_only_takes_the_nearest_free_heading_and_stops_without_one() -> None:
    ahead = Circle(center_m=(1.0, 0.1), radius_m=0.6)
    decision = decide("BitsOnly", ahead)
    assert decision.mode is Mode.OBSTACLE_AVOIDANCE
    k = decision.gap - 1
    assert decision.vs[k] == 0
    angle = (k + 1) * 2.0 * math.pi / 72
    assert math.atan2(decision.velocity[1], decision.velocity[0]) == pytest.approx(
        math.remainder(angle, 2.0 * math.pi)
    )
    away = {
        abs(math.remainder((n + 1) * 2.0 * math.pi / 72, 2.0 * math.pi))
        for n, bit in enumerate(decision.vs)
        if not bit
    }
    assert abs(math.remainder(angle, 2.0 * math.pi)) == pytest.approx(min(away))
    ring = [
        Circle(center_m=(0.7 * math.cos(a), 0.7 * math.sin(a)), radius_m=0.6)
        for a in (k * math.pi / 6 for k in range(12))
    ]
    enclosed = decide("BitsOnly", *ring)
    assert enclosed.velocity == (0.0, 0.0)
    assert enclosed.mode is Mode.BLOCKED


def test_without_velocities_a_crossing_obstacle_is_not_avoided() -> None:
    across = Circle(center_m=(1.2, 1.2), radius_m=0.6, velocity_mps=(0.0, -0.8))
    assert decide("NoVelocities", across).velocity == pytest.approx((0.8, 0.0))
    assert decide("NoBats", across).velocity != pytest.approx((0.8, 0.0))


def test_without_margins_a_close_pass_costs_nothing() -> None:
    beside = Circle(center_m=(1.0, 0.6 + 1e-4), radius_m=0.6)
    assert decide("no_margins", beside).velocity == pytest.approx((0.8, 0.0))
    assert decide("NoBats", beside).velocity != pytest.approx((0.8, 0.0))


def test_without_memory_a_circle_out_of_range_is_ignored() -> None:
    ahead = Circle(center_m=(1.35, 0.0), radius_m=0.6)
    velocities = {}
    for make in (Predictive, ablation.no_memory):
        planner = make(SETTING.params, SensorParams(), 0)
        for stamp, x, circles in ((1, 0.0, (ahead,)), (2, -0.1, ())):
            stamp_ns = 100_000_000 * stamp
            decision = planner.plan(
                Observation(
                    stamp_ns=stamp_ns, now_ns=stamp_ns, pose=Pose2D(x, 0.0), ranges_m=(),
                    goal=(10.0, 0.0), circles=circles,
                )
            )  # fmt: skip
        velocities[make] = decision.velocity
    assert velocities[ablation.no_memory] == pytest.approx((0.8, 0.0))
    assert velocities[Predictive] != pytest.approx((0.8, 0.0), abs=0.01)


U = ((1.5, 0.9, 3.0, 0.9), (3.0, 0.9, 3.0, -0.9), (3.0, -0.9, 1.5, -0.9))
PERSON = Obstacle(center_m=(4.0, 0.0), radius_m=0.3, speed_mps=1.0, heading_rad=math.pi)


def driven(name: str, **world: Any) -> Any:
    """The result in a world, from a lidar."""
    scenario = Scenario(
        name="one", start_m=(0.0, 0.0), goal_m=(5.0, 0.0), time_limit_s=20.0, **world
    )
    scenarios = single_scenario(scenario)
    setting = replace(default_setting(scenarios.name, scenarios), params=SETTING.params)
    planner = name if name == "predictive" else f"{ablation.__name__}:{name}"
    outcome = run_one(Run(scenarios.name, 0, planner, 0), setting)
    assert outcome.fault == ""
    return evaluate(outcome.episode)


@pytest.mark.parametrize("name", ["predictive", "NoBats", "NoTracker"])
def test_a_dead_end_takes_map_and_distance_to_go(name: str) -> None:
    assert driven(name, segments_m=U).success


@pytest.mark.parametrize("name", ["NoMap", "NoDistanceToGo"])
def test_a_dead_end_holds_what_lacks_map_or_distance_to_go(name: str) -> None:
    result = driven(name, segments_m=U)
    assert not result.success
    assert result.collisions == 0


@pytest.mark.parametrize(
    ("name", "evades"),
    [("predictive", True), ("NoMap", True), ("NoDistanceToGo", True), ("NoTracker", False)],
)
def test_a_person_is_evaded_by_what_tracks(name: str, evades: bool) -> None:
    assert driven(name, obstacles=(PERSON,)).success == evades
