# SPDX-License-Identifier: Apache-2.0
"""planner.optimizer: other optimisers in Algorithm 1 and in the predictive planner."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner.core.errors import ConfigError, OptimizerError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.core.option_specs import override
from mfba_planner.core.planner_types import Mode, Observation
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.sweep.single_run import generates_paths_together
from mfba_planner.evaluation.sweep.sweep_spec import Setting
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.algorithm_1 import MIN_BATCH, Algorithm1, generate_paths_together
from mfba_planner.planning.path_generation import StepInput, generate_step
from mfba_planner.planning.peers.ablation import NoBats
from mfba_planner.planning.planner_factory import make_planner, params_for_method
from mfba_planner.planning.planner_params import PlannerParams, Swarm
from mfba_planner.planning.predictive_planner import Predictive
from mfba_planner.scenarios.run_config import RunConfig, with_perception
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.lidar_perception import OWN_ROBOT, LidarPerception
from mfba_planner.simulation.run_episode import run, simulate
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams

OTHERS = ["random", "grid", "none", "scipy:differential_evolution", "faulty_optimizers:Sound"]
GOAL = (12.0, 12.0)


def params(method: str, optimizer: str) -> PlannerParams:
    chosen = params_for_method(method, PlannerParams(), algorithm_1=False)
    return replace(chosen, optimizer=optimizer)


def digest_of(method: str, optimizer: str, scenario: str = "case1", seed: int = 0) -> str:
    world, planner = with_perception(load_scenario(scenario), params(method, optimizer))
    episode = simulate(world, planner=planner, sensor=SensorParams(), seed=seed)
    assert evaluate(episode).success
    return digest(episode.ticks)


@pytest.mark.no_cover
@pytest.mark.parametrize("method", ["paper", "predictive"])
def test_each_optimizer_arrives_and_decides_differently(method: str) -> None:
    found = {name: digest_of(method, name) for name in ("bats", "ba", *OTHERS)}
    assert digest_of(method, "mfba") == found["bats"], "the default"
    assert digest_of(method, "random") == found["random"], "reproducible"
    if method == "paper":
        assert len(set(found.values())) == len(found)
        assert digest_of(method, "random", seed=1) != found["random"]


@pytest.mark.no_cover
def test_the_optimizer_refines_in_the_open_and_through_the_map() -> None:
    for scenario in ("case2", "rooms"):
        found = {
            name: digest_of("predictive", name, scenario) for name in ("bats", "random", "none")
        }
        assert len(set(found.values())) == 3, scenario


@pytest.mark.no_cover
def test_none_is_the_ablation_without_bats() -> None:
    world, planner = with_perception(load_scenario("rooms"), params("predictive", "none"))
    plain = replace(planner, optimizer="bats")
    paths = [
        [tick.waypoint for tick in run(
            world, planner=chosen, path_planner=kind(chosen, SensorParams(), 0),
            observe=LidarPerception(OWN_ROBOT),
        ).ticks]
        for kind, chosen in ((NoBats, plain), (Predictive, planner))
    ]  # fmt: skip
    assert paths[0] == paths[1]
    assert len(paths[0]) > 50


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_without_an_optimizer_a_step_goes_straight_to_the_goal(x: float, y: float) -> None:
    waypoint, candidates = generate_step(StepInput((x, y), GOAL, 0, 1), 0.3, BatParams(), "none")
    away = math.dist((x, y), GOAL)
    if away <= 0.3:
        assert waypoint == GOAL
    else:
        assert math.dist((x, y), waypoint) == pytest.approx(0.3)
        assert math.dist(waypoint, GOAL) == pytest.approx(away - 0.3)
    assert candidates == ()


@pytest.mark.parametrize("optimizer", [name for name in OTHERS if name != "none"])
def test_a_step_stays_in_its_disc(optimizer: str) -> None:
    for seed in range(5):
        step_input = StepInput((1.0, 2.0), GOAL, seed, 7)
        waypoint, candidates = generate_step(step_input, 0.3, BatParams(), optimizer)
        assert 0.0 < math.dist((1.0, 2.0), waypoint) <= 0.3 * (1.0 + 1e-9)
        assert candidates


def observation(k: int = 0) -> Observation:
    return Observation(
        stamp_ns=10**9, now_ns=10**9, pose=Pose2D(0.1 * k, 2.0), ranges_m=(math.inf,) * 12,
        goal=GOAL,
    )  # fmt: skip


def test_only_the_bats_are_computed_together() -> None:
    assert generates_paths_together("paper", Setting())
    for name in ("random", "ba"):
        chosen = PlannerParams(optimizer=name)
        assert not generates_paths_together("paper", Setting(params=chosen))
        planners = [Algorithm1(chosen, 0) for _ in range(MIN_BATCH)]
        observations = [observation(k) for k in range(MIN_BATCH)]
        alone = [Algorithm1(chosen, 0).plan(obs) for obs in observations]
        generate_paths_together(planners, observations)
        assert [p.plan(obs) for p, obs in zip(planners, observations)] == alone


def test_an_unknown_optimizer_is_refused_before_a_run() -> None:
    wrong = PlannerParams(optimizer="randon")
    message = r"optimizer 'randon': unknown; did you mean 'random'\?"
    for refuse in (
        lambda: Algorithm1(wrong, 0),
        lambda: Predictive(wrong, SensorParams(), 0),
        lambda: make_planner(wrong),
        lambda: RunConfig(scenario=load_scenario("case1"), planner=wrong),
    ):
        with pytest.raises(ConfigError, match=message):
            refuse()


def test_a_persistent_swarm_is_of_bats_only() -> None:
    assert PlannerParams(swarm=Swarm.PERSISTENT).optimizer == "bats"
    with pytest.raises(ConfigError, match="swarm=persistent: optimizer=random starts anew at"):
        override(PlannerParams(optimizer="random"), {"swarm": "persistent"})


def test_a_faulty_optimizer_ends_the_decision_with_its_name() -> None:
    broken = Algorithm1(PlannerParams(optimizer="faulty_optimizers:NotANumber"), 0)
    with pytest.raises(
        OptimizerError,
        match=r"^optimizer faulty_optimizers:NotANumber: the point \(nan, 0\) is outside the reg",
    ):
        broken.plan(observation())


def test_labels_name_the_optimizer() -> None:
    assert PlannerParams().label == "mfba"
    assert PlannerParams(bat=BatParams(algorithm=Algorithm.BA)).label == "ba"
    assert PlannerParams(optimizer="grid").label == "paper with grid"
    assert params("predictive", "grid").label == "predictive with grid"
    assert params("predictive", "bats").label == "predictive"


def test_a_blocked_or_arrived_robot_does_not_search() -> None:
    chosen = PlannerParams(optimizer="faulty_optimizers:RaisesInAsk")
    near = replace(observation(), pose=Pose2D(12.0, 12.001))
    assert Algorithm1(chosen, 0).plan(near).mode is Mode.ARRIVED
    closed = replace(observation(), ranges_m=(0.1,) * 12)
    assert Algorithm1(chosen, 0).plan(closed).mode is Mode.BLOCKED
