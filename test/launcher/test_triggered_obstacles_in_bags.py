# SPDX-License-Identifier: Apache-2.0
"""Obstacles that wait for a trigger: the same in every driver, bag, replay and picture."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from shown_commands import ROOT

from mfba_planner import cli
from mfba_planner.core.errors import ConfigError
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.launcher.in_process_driver import run_in_process
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode, read_recording, summaries, summarize
from mfba_planner.report.animation import animation_bytes
from mfba_planner.report.animation_options import AnimationOptions
from mfba_planner.report.html.page_data import page_data
from mfba_planner.report.run_figure import png_bytes
from mfba_planner.report.tick_figure import tick_png
from mfba_planner.ros.interface.episode_to_bag import write_episode_bag
from mfba_planner.scenarios.run_config import Driver, RunConfig, node_parameters, with_perception
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.robot_model import Noise
from mfba_planner.simulation.run_episode import simulate, simulate_fleet
from mfba_planner.simulation.scenario import FleetRobot, Scenario
from mfba_planner.simulation.triggers import before_triggers
from mfba_planner.verification.verify_bag import verify, verify_each

TEXT = """
name: ambush
start_m: [0, 0]
goal_m: [6, 0]
time_limit_s: 30
obstacles:
  - {center_m: [3, 1.2], radius_m: 0.3, speed_mps: 0.6, heading_deg: -90, trigger: {within_m: 2}}
  - radius_m: 0.3
    trajectory: [[0, 5, -2], [3, 5, 1], [5, 4, 2]]
    trigger: {within_m: 1, point_m: [2, 0]}
  - radius_m: 0.3
    center_m: [1, -0.8]
    trigger: {within_m: 3, point_m: [6, 0], absent_before: true}
  - {center_m: [4, 3], radius_m: 0.3, speed_mps: 1, trigger: {within_m: 1}}
"""
SCENARIO = parse_scenario(TEXT, "ambush.yaml")
EXACT = Noise()


def config(method: Method, noise: Noise = EXACT) -> RunConfig:
    params = PlannerParams()
    if method is Method.PREDICTIVE:
        params = preset(replace(params, method=method))
    scenario, params = with_perception(SCENARIO, params)
    scenario = replace(scenario, robot=replace(scenario.robot, noise=noise))
    return RunConfig(scenario=scenario, planner=params, driver=Driver.IN_PROCESS)


def core(one: RunConfig) -> Episode:
    return simulate(one.scenario, planner=one.planner, sensor=one.sensor, seed=0)


def times(episode: Episode) -> list[float | None]:
    return [o.trigger.at_s if o.trigger else None for o in episode.scenario.obstacles]


@pytest.fixture(scope="module")
def episode() -> Episode:
    return core(config(Method.PAPER))


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("noise", [EXACT, Noise(odom_m=0.02, odom_latency_s=0.5)])
def test_the_graph_decides_as_the_core_and_its_bag_is_verified(
    method: Method, noise: Noise, tmp_path: Path, domain_id: int
) -> None:
    one = config(method, noise)
    run_in_process(one, tmp_path / "bag", domain_id=domain_id)
    recorded, expected = read_episode(tmp_path / "bag"), core(one)
    assert digest(recorded.ticks) == digest(expected.ticks)
    assert recorded.ticks == expected.ticks
    assert recorded.scenario == expected.scenario
    assert [at is None for at in times(recorded)] == [False, False, False, True]
    assert before_triggers(recorded.scenario) == one.scenario
    assert verify(tmp_path / "bag").is_identical
    assert evaluate(recorded) == evaluate(expected)
    found = summarize(tmp_path / "bag")
    assert (found.result, found.digest) == (evaluate(expected), digest(expected.ticks))
    assert cli.main(["verify", str(tmp_path / "bag"), "--closed-loop"]) == 0


@pytest.mark.parametrize("noise", [EXACT, Noise(odom_m=0.02, odom_latency_s=0.5)])
def test_a_bag_in_real_time_gives_the_times_of_its_world(
    noise: Noise, tmp_path: Path, domain_id: int
) -> None:
    one = replace(config(Method.PAPER, noise), real_time=True, speed_factor=8.0)
    ended: list[Scenario] = []

    def keep(world: Any) -> bool:
        ended[:] = [world.scenario]
        return True

    run_in_process(one, tmp_path / "bag", domain_id=domain_id, on_turn=keep)
    assert [read_episode(tmp_path / "bag").scenario] == ended
    assert times(read_episode(tmp_path / "bag"))[0] is not None


def test_another_path_reaches_the_triggers_at_its_own_times(
    tmp_path: Path, domain_id: int, capsys: pytest.CaptureFixture[str]
) -> None:
    one = config(Method.PAPER)
    run_in_process(one, tmp_path / "bag", domain_id=domain_id)
    slower = replace(one.planner, speed_mps=0.4)
    wanted = evaluate(simulate(one.scenario, planner=slower, sensor=one.sensor, seed=0))
    arguments = ["verify", str(tmp_path / "bag"), "--set", "planner.speed_mps=0.4"]
    assert cli.main(arguments) == 0
    assert f"{wanted.min_clearance_m:.3f} m" in capsys.readouterr().out
    assert wanted.min_clearance_m != evaluate(core(one)).min_clearance_m


@pytest.mark.parametrize("method", list(Method))
def test_a_bag_written_without_ros_holds_the_task_and_the_same_run(
    method: Method, tmp_path: Path
) -> None:
    expected = core(config(method))
    write_episode_bag(expected, tmp_path / "bag")
    recorded = read_episode(tmp_path / "bag")
    assert (recorded.ticks, recorded.scenario) == (expected.ticks, expected.scenario)
    assert verify(tmp_path / "bag").is_identical
    assert read_recording(tmp_path / "bag").scenario == before_triggers(expected.scenario)


def test_a_fleet_in_one_bag(tmp_path: Path, domain_id: int) -> None:
    robots = (
        FleetRobot(name="a", start_m=(0.0, 0.0), goal_m=(6.0, 0.0)),
        FleetRobot(name="b", start_m=(5.0, -3.5), goal_m=(0.0, -3.5)),
    )
    one = replace(config(Method.PAPER), scenario=replace(SCENARIO, robots=robots))
    run_in_process(one, tmp_path / "bag", domain_id=domain_id)
    recorded = read_recording(tmp_path / "bag").episodes
    expected = simulate_fleet(one.scenario, planner=one.planner, sensor=one.sensor, seed=0)
    for found, wanted in zip(recorded.values(), expected, strict=True):
        assert (found.ticks, found.scenario) == (wanted.ticks, wanted.scenario)
    assert all(report.is_identical for report in verify_each(tmp_path / "bag").values())
    assert {n: s.result for n, s in summaries(tmp_path / "bag").items()} == {
        name: evaluate(wanted) for name, wanted in zip(recorded, expected)
    }


def test_pictures_and_page_show_each_obstacle_where_it_was(episode: Episode) -> None:
    assert png_bytes(episode)
    assert tick_png(episode, len(episode.ticks) // 2, "", [])
    assert animation_bytes([("", episode)], (), ".webp", AnimationOptions())
    (run,) = page_data([("", episode)], "0")["runs"]
    first, second, third, last = run["world"]["obstacles"]
    at_1, at_2, at_3, _ = times(episode)
    assert at_1 is not None
    assert at_2 is not None
    assert at_3 is not None
    for k, t in enumerate(run["ticks"]["time"]):
        fallen = max(0.0, t - at_1)
        assert first["y"][k] == pytest.approx(1.2 - 0.6 * fallen, abs=2e-3)
        assert (second["x"][k] is None) == (t > at_2 + 5.0 + 1e-9)
        if t <= at_2:
            assert (second["x"][k], second["y"][k]) == (5.0, -2.0)
        assert (third["x"][k] is None) == (t < at_3)
        assert (last["x"][k], last["y"][k]) == (4.0, 3.0)


def test_without_a_lidar_ros_needs_one_radius_where_some_are_absent_before() -> None:
    several = replace(
        SCENARIO, obstacles=(*SCENARIO.obstacles, replace(SCENARIO.obstacles[0], radius_m=0.2))
    )
    with pytest.raises(ConfigError, match="need a robot with a lidar in ROS 2"):
        node_parameters(replace(config(Method.PAPER), scenario=several), ())
    standing = replace(several, obstacles=(several.obstacles[0], several.obstacles[-1]))
    radii = node_parameters(replace(config(Method.PAPER), scenario=standing), ())
    assert radii["virtual_sensor"]["obstacle_radii_m"] == [0.3, 0.2]


@pytest.mark.parametrize("method", list(Method))
def test_each_obstacle_of_the_example_starts(method: Method) -> None:
    page = (ROOT / "docs/how-to/scenario.md").read_text(encoding="utf-8")
    text = next(part for part in page.split("```yaml\n") if "trigger:" in part)
    example = parse_scenario(text.partition("```")[0], "ambush.yaml")
    one = config(method)
    done = core(replace(one, scenario=replace(example, robot=one.scenario.robot)))
    started = [at for at in times(done) if at is not None]
    assert len(started) == 3
    assert min(started) > 1.0
    if method is Method.PREDICTIVE:
        assert evaluate(done).success
