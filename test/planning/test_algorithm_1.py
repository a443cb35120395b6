# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1: mode table, decision of every event, random streams, persistent swarm, readings."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Decision, Mode, Observation
from mfba_planner.core.random_streams import stream
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.paper import readings_of_paper
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.algorithm_1 import Algorithm1, decide
from mfba_planner.planning.mode_transitions import Event, transition
from mfba_planner.planning.planner_params import PlannerParams, Swarm
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.planner_observations import sense
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.simulation.world import World
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams, Bounds, Schedule

FREE = (math.inf,) * 12
GOAL = (12.0, 12.0)
PARAMS = PlannerParams()


def ranges(vs: str) -> tuple[float, ...]:
    return tuple(0.5 if bit == "1" else math.inf for bit in vs)


def observe(**changes: Any) -> Observation:
    plain: dict[str, Any] = {
        "stamp_ns": 5_000_000_000,
        "now_ns": 5_000_000_000,
        "pose": Pose2D(1.0, 2.0, 0.5),
        "ranges_m": FREE,
        "goal": GOAL,
    }
    return Observation(**{**plain, **changes})


def no_bats_expected(position: Point, goal: Point) -> tuple[Point, tuple[Point, ...]]:
    raise AssertionError("the bats were called")


def decide_without_bats(
    mode: Mode = Mode.IDLE, params: PlannerParams = PARAMS, **changes: Any
) -> Decision:
    """The decision on an observation that needs no bats."""
    return decide(observe(**changes), mode, params, no_bats_expected)


# --- the table ------------------------------------------------------------------------------

NOT_ARRIVED = {
    Event.NO_GOAL: Mode.IDLE,
    Event.NEW_GOAL: Mode.IDLE,
    Event.INVALID: Mode.STOPPED,
    Event.STALE: Mode.STOPPED,
    Event.AT_GOAL: Mode.ARRIVED,
    Event.CLEAR: Mode.PATH_GENERATION,
    Event.OBSTACLE: Mode.OBSTACLE_AVOIDANCE,
    Event.NO_GAP: Mode.BLOCKED,
}
ARRIVED = dict.fromkeys(Event, Mode.ARRIVED) | {
    Event.NO_GOAL: Mode.IDLE,
    Event.NEW_GOAL: Mode.IDLE,
}
TABLE = {mode: ARRIVED if mode is Mode.ARRIVED else NOT_ARRIVED for mode in Mode}


@pytest.mark.parametrize("event", Event)
@pytest.mark.parametrize("mode", Mode)
def test_transition(mode: Mode, event: Event) -> None:
    assert transition(mode, event) is TABLE[mode][event]


# --- one decision per event -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "mode", "reason"),
    [
        ({"refused": "odom holds nan"}, Mode.STOPPED, "refused input: odom holds nan"),
        ({"now_ns": 6_000_000_001}, Mode.STOPPED, "input is 1.000 s old"),
        ({"now_ns": 7_500_000_000}, Mode.STOPPED, "input is 2.500 s old"),
        ({"goal": None}, Mode.IDLE, "no goal given"),
        ({"goal": (1.0, 2.0199)}, Mode.ARRIVED, "goal reached"),
        ({"ranges_m": ranges("1" * 12)}, Mode.BLOCKED,
         "sectors 1+2+3+4+5+6+7+8+9+10+11+12 set: every gap is closed"),
        ({"ranges_m": ranges("101010101010")}, Mode.BLOCKED,
         "sectors 1+3+5+7+9+11 set: every gap is closed"),
        ({"pose": Pose2D(math.nan, 2.0)}, Mode.STOPPED,
         "refused input: pose (nan, 2.0, 0.0) is not finite"),
        ({"pose": Pose2D(1.0, 2.0, math.inf)}, Mode.STOPPED,
         "refused input: pose (1.0, 2.0, inf) is not finite"),
        ({"goal": (math.inf, 0.0)}, Mode.STOPPED,
         "refused input: goal (inf, 0.0) is not finite"),
        ({"ranges_m": ()}, Mode.STOPPED, "refused input: 0 sectors are fewer than 3"),
        ({"ranges_m": FREE[:2]}, Mode.STOPPED, "refused input: 2 sectors are fewer than 3"),
        ({"ranges_m": (*FREE, math.nan)}, Mode.STOPPED,
         "refused input: a sector's range is NaN"),
        ({"stamp_ns": -1}, Mode.STOPPED, "refused input: stamp -1 ns is negative"),
    ],
)  # fmt: skip
def test_the_robot_stops_in_every_mode_that_does_not_move(
    changes: dict[str, Any], mode: Mode, reason: str
) -> None:
    decision = decide_without_bats(**changes)
    assert (decision.mode, decision.reason) == (mode, reason)
    assert decision.velocity == (0.0, 0.0)
    assert decision.gap == 0
    assert decision.candidates == ()
    pose = changes.get("pose", Pose2D(1.0, 2.0))
    assert repr(decision.waypoint) == repr(pose.position)


ALL_AT_ONCE = {
    "refused": "x",
    "now_ns": 10**12,
    "goal": None,
    "ranges_m": ranges("1" * 12),
}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, "refused input: x"),
        ({"refused": ""}, "input is 995.000 s old"),
        ({"refused": "", "now_ns": 0}, "no goal given"),
        ({"refused": "", "now_ns": 0, "goal": (1.0, 2.0)}, "goal reached"),
        ({"refused": "", "now_ns": 0, "goal": (1.0, 2.0), "stamp_ns": -5},
         "refused input: stamp -5 ns is negative"),
    ],
)  # fmt: skip
def test_of_several_events_the_most_severe_counts(changes: dict[str, Any], reason: str) -> None:
    assert decide_without_bats(**{**ALL_AT_ONCE, **changes}).reason == reason


def test_input_as_old_as_the_timeout_is_not_stale() -> None:
    gap: dict[str, Any] = {"ranges_m": ranges("110000000000")}
    assert decide_without_bats(now_ns=6_000_000_000, **gap).mode is Mode.OBSTACLE_AVOIDANCE
    slow = replace(PARAMS, input_timeout_s=3.0)
    assert (
        decide_without_bats(params=slow, now_ns=8_000_000_000, **gap).mode
        is Mode.OBSTACLE_AVOIDANCE
    )
    assert decide_without_bats(params=slow, now_ns=8_000_000_001, **gap).mode is Mode.STOPPED


def test_the_goal_tolerance_includes_its_edge() -> None:
    near: dict[str, Any] = {"pose": Pose2D(0.0, 0.0), "ranges_m": ranges("1" * 12)}
    params = replace(PARAMS, goal_tolerance_m=0.25)
    assert decide_without_bats(params=params, goal=(0.0, -0.25), **near).mode is Mode.ARRIVED
    assert decide_without_bats(params=params, goal=(0.0, -0.2500001), **near).mode is Mode.BLOCKED


def test_obstacle_avoidance_takes_the_gap_nearest_to_the_goal() -> None:
    # Fig. 5, goal at 45 degrees
    decision = decide_without_bats(
        pose=Pose2D(1.0, 2.0, 0.5), goal=(5.0, 6.0), ranges_m=ranges("110000111000")
    )
    assert decision.mode is Mode.OBSTACLE_AVOIDANCE
    assert decision.reason == "sectors 1+2+7+8+9 set: gap 3 is nearest to the goal"
    assert "".join(map(str, decision.vs)) == "110000111000"
    assert "".join(map(str, decision.vg)) == "110001111001"
    assert decision.gap == 3
    assert decision.waypoint == pytest.approx((1.0, 2.3)), "gap 3 is 90 degrees for any yaw"
    dt = PARAMS.tick_ns * 1e-9
    assert decision.velocity == pytest.approx((0.0, 0.3 / dt))
    assert math.hypot(*decision.velocity) == pytest.approx(0.785)
    assert decision.candidates == ()


def test_obstacle_avoidance_never_moves_farther_than_the_goal_is() -> None:
    decision = decide_without_bats(goal=(1.0, 2.125), ranges_m=ranges("110000111000"))
    assert decision.waypoint == pytest.approx((1.0, 2.125))


def test_a_decision_contains_its_inputs() -> None:
    obs = observe(ranges_m=ranges("010000000000"))
    decision = decide(obs, Mode.IDLE, PARAMS, no_bats_expected)
    for name in ("stamp_ns", "pose", "goal", "ranges_m"):
        assert getattr(decision, name) == getattr(obs, name)


def test_path_generation_calls_the_bats() -> None:
    calls: list[tuple[Point, Point]] = []

    def generate(position: Point, goal: Point) -> tuple[Point, tuple[Point, ...]]:
        calls.append((position, goal))
        return (1.1, 2.2), ((7.0, 8.0),)

    decision = decide(observe(), Mode.BLOCKED, PARAMS, generate)
    assert calls == [((1.0, 2.0), GOAL)]
    assert (decision.mode, decision.gap) == (Mode.PATH_GENERATION, 0)
    assert decision.reason == "no obstacle within SR"
    assert decision.waypoint == (1.1, 2.2)
    assert decision.candidates == ((7.0, 8.0),)
    dt = PARAMS.tick_ns * 1e-9
    assert decision.velocity == pytest.approx((0.1 / dt, 0.2 / dt))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, "goal was reached before; no obstacle within SR"),
        ({"ranges_m": ranges("110000000000")},
         "goal was reached before; sectors 1+2 set: gap 3 is nearest to the goal"),
        ({"refused": "x"}, "goal was reached before; refused input: x"),
        ({"goal": (1.0, 2.0)}, "goal reached"),
    ],
)  # fmt: skip
def test_after_arrival_the_mode_stays_arrived(changes: dict[str, Any], reason: str) -> None:
    decision = decide_without_bats(Mode.ARRIVED, **changes)
    assert (decision.mode, decision.reason) == (Mode.ARRIVED, reason)
    assert (decision.velocity, decision.gap) == ((0.0, 0.0), 0)


def test_a_tick_lasts_as_long_as_a_step_at_full_speed() -> None:
    assert PARAMS.tick_ns == 382_165_605
    assert PlannerParams(step_length_m=0.08, speed_mps=0.8).tick_ns == 100_000_000
    assert PlannerParams(step_length_m=0.001, speed_mps=100.0).tick_ns == 10_000


@given(
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.sampled_from([FREE, ranges("100000000001"), ranges("001100000000")]),
    st.floats(0.05, 3.0),
    st.floats(0.01, 1.0),
    st.sampled_from(Bounds),
    st.sampled_from(Swarm),
    st.integers(0, 2**63),
)
def test_the_velocity_reaches_the_waypoint_within_the_speed_limit(
    x: float,
    y: float,
    gx: float,
    gy: float,
    ring: tuple[float, ...],
    speed: float,
    step: float,
    bounds: Bounds,
    swarm: Swarm,
    seed: int,
) -> None:
    assume(math.hypot(gx - x, gy - y) > 0.05)
    bat = BatParams(bounds=bounds, schedule=Schedule.RAW)
    params = PlannerParams(speed_mps=speed, step_length_m=step, swarm=swarm, bat=bat)
    planner = Algorithm1(params, seed)
    decision = planner.plan(observe(pose=Pose2D(x, y), goal=(gx, gy), ranges_m=ring))
    assert decision.mode in (Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE)
    dt = params.tick_ns * 1e-9
    reached = (x + decision.velocity[0] * dt, y + decision.velocity[1] * dt)
    assert reached == pytest.approx(decision.waypoint, abs=1e-12)
    assert math.dist((x, y), decision.waypoint) <= step * (1.0 + 1e-9) + 1e-12
    assert math.hypot(*decision.velocity) <= speed * (1.0 + 1e-4)


# --- path generation ------------------------------------------------------------------------


@pytest.mark.parametrize("kind", Swarm)
def test_the_last_step_is_cut_to_the_goal(kind: Swarm) -> None:
    params = PlannerParams(step_length_m=0.25, swarm=kind)
    for goal, exact in (((1.25, 2.0), True), ((1.1, 2.1), True), ((1.2500001, 2.0), False)):
        decision = Algorithm1(params, 0).plan(observe(goal=goal))
        assert decision.mode is Mode.PATH_GENERATION
        assert (decision.waypoint == goal) is exact
        assert bool(decision.candidates) is not exact


NUMBERS = st.one_of(
    st.integers(0, 2**72), st.sampled_from([0, 1, 2**32 - 1, 2**32, 2**64 - 1, 2**64])
)


@given(NUMBERS, NUMBERS)
def test_stream_equals_seed_sequence_with_spawn_key(seed: int, stamp: int) -> None:
    sequence = np.random.SeedSequence(seed, spawn_key=(1, stamp))
    expected = np.random.Generator(np.random.PCG64(sequence))
    assert stream(seed, stamp).random(8).tolist() == expected.random(8).tolist()


def test_the_stream_of_a_decision_depends_on_seed_purpose_and_stamp() -> None:
    expected = np.random.Generator(
        np.random.PCG64(np.random.SeedSequence(4, spawn_key=(1, 123456789012)))
    )
    assert stream(4, 123456789012).random() == expected.random()
    draws = {stream(seed, stamp).random() for seed in range(9) for stamp in range(9)}
    assert len(draws) == 81


def test_negative_seeds_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"^seed=-1: negative; give a whole number from 0 up$"):
        Algorithm1(PARAMS, -1)
    assert Algorithm1(PARAMS, 0).mode is Mode.IDLE


# --- state ----------------------------------------------------------------------------------


def drive(planner: Algorithm1, scenario: Scenario, ticks: int) -> list[Decision]:
    """The decisions of the first ticks, as simulation.run_episode makes them."""
    world = World(scenario, planner.params.tick_ns, planner.params.goal_tolerance_m)
    decisions = []
    for _ in range(ticks):
        obs = observe(
            stamp_ns=world.stamp_ns,
            now_ns=world.stamp_ns,
            pose=world.pose,
            ranges_m=sense(world, SensorParams()),
            goal=scenario.goal_m,
        )
        decisions.append(planner.plan(obs))
        world.step(decisions[-1].velocity)
    return decisions


@pytest.mark.parametrize("name", ["case1", "case2"])
def test_a_restarted_planner_makes_the_same_decisions(name: str) -> None:
    episode = run(load_scenario(name), seed=5)
    for k in (1, 7, 20, len(episode.ticks) - 1):
        restarted = Algorithm1(PARAMS, 5)
        for tick in episode.ticks[k:]:
            again = restarted.plan(
                observe(
                    stamp_ns=tick.stamp_ns,
                    now_ns=tick.stamp_ns,
                    pose=tick.pose,
                    ranges_m=tick.ranges_m,
                    goal=tick.goal,
                )
            )
            assert again == tick


def test_decisions_depend_on_the_seed_and_on_the_stamp() -> None:
    waypoints = {
        Algorithm1(PARAMS, seed).plan(observe(stamp_ns=stamp, now_ns=stamp)).waypoint
        for seed in range(5)
        for stamp in (1, 2, 10**18)
    }
    assert len(waypoints) == 15


def test_the_mode_arrived_lasts_until_the_goal_changes() -> None:
    planner = Algorithm1(PARAMS, 0)
    assert planner.plan(observe(goal=(1.0, 2.0))).mode is Mode.ARRIVED
    away = {"pose": Pose2D(5.0, 5.0)}
    assert planner.plan(observe(goal=(1.0, 2.0), **away)).mode is Mode.ARRIVED
    assert planner.mode is Mode.ARRIVED
    assert planner.plan(observe(goal=(1.0, 2.5), **away)).mode is Mode.PATH_GENERATION
    assert planner.plan(observe(goal=(5.0, 5.0), **away)).mode is Mode.ARRIVED
    assert planner.plan(observe(goal=None, **away)).mode is Mode.IDLE
    assert planner.plan(observe(goal=(1.0, 2.0), **away)).mode is Mode.PATH_GENERATION


def test_reset_ends_the_mode_arrived() -> None:
    planner = Algorithm1(PARAMS, 0)
    planner.plan(observe(goal=(1.0, 2.0)))
    planner.reset()
    assert planner.mode is Mode.IDLE
    away = observe(goal=(1.0, 2.0), pose=Pose2D(5.0, 5.0))
    assert planner.plan(away).mode is Mode.PATH_GENERATION


# --- the persistent swarm of Fig. 1 ---------------------------------------------------------

FIG1 = readings_of_paper.planner("fig1")


def test_fig_1_keeps_its_swarm_over_the_trip() -> None:
    scenario = load_scenario("empty")
    fresh, kept = Algorithm1(FIG1, 3), Algorithm1(FIG1, 3)
    trip = drive(kept, scenario, 10)
    assert drive(fresh, scenario, 10) == trip
    tick = trip[5]
    obs = observe(
        stamp_ns=tick.stamp_ns, now_ns=tick.stamp_ns, pose=tick.pose, goal=scenario.goal_m
    )
    assert Algorithm1(FIG1, 3).plan(obs).candidates != tick.candidates, "the swarm is kept"
    for restart in (fresh.reset, lambda: fresh.plan(replace(obs, goal=(0.0, 9.0)))):
        restart()
        assert fresh.plan(obs) == Algorithm1(FIG1, 3).plan(obs)


def test_fig_1_moves_to_the_best_point_after_each_bat_iteration() -> None:
    planner = Algorithm1(FIG1, 3)
    best = math.inf
    for decision in drive(planner, load_scenario("empty"), 12):
        assert len(decision.candidates) == 5
        reach = [math.dist(decision.pose.position, c) for c in decision.candidates]
        assert max(reach) <= 0.1 + 1e-9
        distance_m = math.dist(decision.pose.position, GOAL)
        best = min([distance_m, *(math.dist(c, GOAL) for c in decision.candidates)])
        assert math.dist(decision.waypoint, GOAL) <= best + 1e-9


def test_fig_1_with_more_iterations_gives_shorter_paths() -> None:
    def length(iterations: int) -> float:
        params = replace(FIG1, bat=BatParams(iterations=iterations))
        return evaluate(run(load_scenario("empty"), planner=params)).length_m

    assert math.dist((0.0, 0.0), GOAL) < length(20) < length(1)


def test_fig_1_spreads_the_schedule_of_eq_10_over_the_trip() -> None:
    """With f = f_max beta and no walk, the second step of a bat depends on T."""
    bat = BatParams(iterations=1, population=2, r0=1.0, rho=0.0, f_max=1.0, bounds=Bounds.NONE)
    params = replace(FIG1, bat=bat)
    # 0.95 m to go in steps of 0.1 m: T = 10
    planner, goal = Algorithm1(params, 1), (1.95, 2.0)
    first = planner.plan(observe(goal=goal))
    second = planner.plan(observe(goal=goal))
    best = min(first.candidates, key=lambda c: math.dist(c, goal))
    for old, new in zip(first.candidates, second.candidates):
        expected = [o + (b - o) * 0.1 for o, b in zip(old, best)]
        assert list(new) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("algorithm", Algorithm)
@pytest.mark.parametrize("name", ["case1", "case2"])
def test_fig_1_runs_both_case_studies(name: str, algorithm: Algorithm) -> None:
    params = replace(FIG1, bat=replace(FIG1.bat, algorithm=algorithm))
    for seed in range(10):
        episode = run(load_scenario(name), planner=params, seed=seed)
        result = evaluate(episode)
        assert episode.outcome is Outcome.GOAL_REACHED
        assert result.success
        assert 16.97 < result.length_m < 21.0


# --- the named readings ---------------------------------------------------------------------


def test_readings_by_name() -> None:
    assert readings_of_paper.swarm("robust") == BatParams()
    assert readings_of_paper.planner("section6") == PlannerParams()
    assert readings_of_paper.swarm("table3").bounds is Bounds.NONE
    assert readings_of_paper.swarm("literal").rho == 0.01
    assert FIG1.swarm is Swarm.PERSISTENT


@pytest.mark.parametrize(
    ("look_up", "name", "message"),
    [
        (
            readings_of_paper.swarm,
            "tabel3",
            "'tabel3': unknown swarm reading; did you mean 'table3'?",
        ),
        (
            readings_of_paper.planner,
            "fig2",
            "'fig2': unknown planner reading; did you mean 'fig1'?",
        ),
        (readings_of_paper.planner, "?", "'?': unknown planner reading; known: fig1, section6"),
    ],
)
def test_unknown_readings(look_up: Any, name: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        look_up(name)
    assert str(caught.value) == message


@pytest.mark.parametrize("name", sorted(readings_of_paper.SWARMS))
def test_every_swarm_reading_can_plan(name: str) -> None:
    bat = replace(readings_of_paper.swarm(name), population=5, iterations=5)
    result = evaluate(run(load_scenario("empty"), planner=PlannerParams(bat=bat)))
    assert result.outcome in (Outcome.GOAL_REACHED, Outcome.TIME_LIMIT)
    if name != "literal":  # its bats move away from the best
        assert result.success
