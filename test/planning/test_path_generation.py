# SPDX-License-Identifier: Apache-2.0
"""Goal steps of path generation, computed one by one and for many planners at once."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from any_bat_params import ANY_READING
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Observation
from mfba_planner.core.random_streams import stream
from mfba_planner.planning import algorithm_1 as module
from mfba_planner.planning.algorithm_1 import MIN_BATCH, Algorithm1, generate_paths_together
from mfba_planner.planning.path_generation import (
    GoalStep,
    StepInput,
    generate_step,
    generate_steps,
)
from mfba_planner.planning.planner_params import PlannerParams, Swarm
from mfba_planner.swarm.bat_swarm import BatParams, Bounds, Disc, Schedule, minimize

FREE = (math.inf,) * 12
GOAL = (12.0, 12.0)
STEP_M = 0.3
METRES = st.floats(-100.0, 100.0)
STARTS = st.builds(
    StepInput,
    st.tuples(METRES, METRES),
    st.tuples(METRES, METRES),
    st.integers(0, 2),
    st.sampled_from([382_165_605, 2**33]),
)


def test_a_fresh_swarm_searches_the_disc_of_one_step() -> None:
    bat = BatParams(population=7, iterations=3)
    waypoint, candidates = generate_step(StepInput((1.0, 2.0), (4.0, 6.0), 3, 77), STEP_M, bat)

    def cost(x: list[float]) -> float:
        return math.hypot(x[0] - 3.0, x[1] - 4.0)

    swarm = minimize(cost, Disc(STEP_M), bat, stream(3, 77))
    assert waypoint == pytest.approx((1.0 + swarm.best_x[0], 2.0 + swarm.best_x[1]))
    assert len(candidates) == 7
    for candidate, x in zip(candidates, swarm.candidates):
        assert candidate == pytest.approx((1.0 + x[0], 2.0 + x[1]))
    assert math.dist(waypoint, (4.0, 6.0)) < 4.8, "nearly a whole step nearer to the goal"


def test_unbounded_bats_may_leave_the_disc_but_the_robot_may_not() -> None:
    bat = BatParams(bounds=Bounds.NONE, schedule=Schedule.RAW)
    waypoint, candidates = generate_step(StepInput((1.0, 2.0), GOAL, 0, 1), STEP_M, bat)
    assert max(math.dist((1.0, 2.0), c) for c in candidates) > STEP_M
    assert math.dist((1.0, 2.0), waypoint) == pytest.approx(STEP_M)
    swarm = minimize(
        lambda x: math.hypot(x[0] - 11.0, x[1] - 10.0), Disc(STEP_M), bat, stream(0, 1)
    )
    heading = math.atan2(waypoint[1] - 2.0, waypoint[0] - 1.0)
    assert heading == pytest.approx(math.atan2(swarm.best_x[1], swarm.best_x[0]))


@given(st.lists(STARTS, max_size=6), ANY_READING, st.floats(0.001, 3.0))
def test_many_steps_at_once_are_the_same_steps(
    starts: list[StepInput], bat: BatParams, step_m: float
) -> None:
    starts.append(
        StepInput((1.0, 2.0), (1.0 + 0.9 * step_m, 2.0), 0, 1)
    )  # the last step to its goal
    assert generate_steps(starts, step_m, bat) == [generate_step(s, step_m, bat) for s in starts]


def test_many_steps_of_one_seed_are_the_same_steps() -> None:
    starts = [StepInput((0.1 * k, 2.0), GOAL, 5, 2**33) for k in range(20)]
    assert generate_steps(starts, STEP_M, BatParams()) == [
        generate_step(s, STEP_M, BatParams()) for s in starts
    ]


# --- steps of many planners at once ---------------------------------------------------------


def observed(k: int, ranges_m: tuple[float, ...] = FREE, goal: Point | None = GOAL) -> Observation:
    stamp_ns = 382_165_605
    return Observation(
        stamp_ns=stamp_ns, now_ns=stamp_ns, pose=Pose2D(0.1 * k, 2.0), ranges_m=ranges_m, goal=goal
    )


@pytest.fixture
def single(monkeypatch: pytest.MonkeyPatch) -> list[StepInput]:
    """The inputs of the steps that were computed one by one."""
    made: list[StepInput] = []

    def recorded(
        start: StepInput, step_length_m: float, bat: BatParams, optimizer: str
    ) -> GoalStep:
        made.append(start)
        return generate_step(start, step_length_m, bat, optimizer)

    monkeypatch.setattr(module, "generate_step", recorded)
    return made


def planners(seeds: Sequence[int], params: PlannerParams | None = None) -> list[Algorithm1]:
    return [Algorithm1(params or PlannerParams(), seed) for seed in seeds]


def test_planners_use_their_batched_steps_and_decide_the_same(single: list[StepInput]) -> None:
    seeds = [k % 3 for k in range(MIN_BATCH + 3)]
    observations = [observed(k) for k in range(len(seeds))]
    blocked = (0.5, *FREE[1:])
    observations[1], observations[2] = observed(1, blocked), observed(2, goal=None)
    ours, theirs = planners(seeds), planners(seeds)
    generate_paths_together(ours, observations)
    decided = [planner.plan(obs) for planner, obs in zip(ours, observations)]
    assert single == []
    assert decided == [planner.plan(obs) for planner, obs in zip(theirs, observations)]
    assert len(single) == len(seeds) - 2
    later = [
        replace(obs, stamp_ns=2 * obs.stamp_ns, now_ns=2 * obs.now_ns) for obs in observations
    ]
    for planner, other, obs in zip(ours, theirs, later):
        assert planner.plan(obs) == other.plan(obs), "a batched step is used only once"


def test_few_planners_are_not_batched(single: list[StepInput]) -> None:
    ours = planners(range(MIN_BATCH - 1))
    observations = [observed(k) for k in range(MIN_BATCH - 1)]
    generate_paths_together(ours, observations)
    for planner, obs in zip(ours, observations):
        planner.plan(obs)
    assert len(single) == MIN_BATCH - 1


def test_a_batched_step_of_another_input_or_other_options_is_not_used(
    single: list[StepInput],
) -> None:
    ours = planners(range(MIN_BATCH))
    observations = [observed(k) for k in range(MIN_BATCH)]
    generate_paths_together(ours, observations)
    ours[1].params = replace(ours[1].params, step_length_m=0.2)
    ours[2].params = replace(ours[2].params, bat=BatParams())  # an equal one
    ours[3].seed = 77
    observations[4] = observed(44)
    observations[5] = replace(observations[5], goal=(3.0, 3.0))
    observations[6] = replace(observations[6], stamp_ns=7, now_ns=7)
    decided = [planner.plan(obs) for planner, obs in zip(ours, observations)]
    assert [start.seed for start in single] == [1, 77, 4, 5, 6]
    for mine, planner, obs in zip(decided, ours, observations):
        assert mine == Algorithm1(planner.params, planner.seed).plan(obs)


def test_persistent_swarms_are_not_batched(single: list[StepInput]) -> None:
    params = PlannerParams(swarm=Swarm.PERSISTENT)
    ours, theirs = planners(range(MIN_BATCH), params), planners(range(MIN_BATCH), params)
    observations = [observed(k) for k in range(MIN_BATCH)]
    generate_paths_together(ours, observations)
    assert [p.plan(o) for p, o in zip(ours, observations)] == [
        p.plan(o) for p, o in zip(theirs, observations)
    ]
    assert [planner.step_input(obs) for planner, obs in zip(ours, observations)] == [
        None
    ] * MIN_BATCH
    assert single == []
