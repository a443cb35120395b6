# SPDX-License-Identifier: Apache-2.0
"""The user's own suite: which files are its worlds, and that their content is what counts."""

import json
import pickle
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.evaluation.suites.scenario_suite import (
    ScenarioSet,
    are_files,
    from_facts,
    read_scenario_files,
)
from mfba_planner.evaluation.suites.survivability import area_of
from mfba_planner.evaluation.suites.task_geometry import ROOM
from mfba_planner.evaluation.sweep.read_sweep import read_sweep
from mfba_planner.evaluation.sweep.run_sweep import open_store, sweep
from mfba_planner.evaluation.sweep.single_run import run_one, run_together
from mfba_planner.evaluation.sweep.sweep_chunks import chunks_of
from mfba_planner.evaluation.sweep.sweep_spec import Run, Setting, SweepSpec, default_setting
from mfba_planner.planning.planner_factory import make_planner
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.simulation.lidar_perception import OWN_ROBOT
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

WORLD = """name: {name}
start_m: [0, 0]
goal_m: [3, 1]
robot_radius_m: 0.2
time_limit_s: {limit}
robot: {robot}
obstacles:
  - {{center_m: [1.5, {y}], radius_m: 0.3}}
"""


def write(folder: Path, file: str, name: str, y: float = 2.0, robot: str = "{}") -> Path:
    path = folder / file
    text = WORLD.format(name=name, y=y, robot=robot, limit=20 + 10 * y)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three worlds; in the order of the files, not of their making."""
    made = tmp_path / "my worlds"
    made.mkdir()
    write(made, "c.yaml", "third", 0.45, "{drive: differential, lidar: {beams: 90}}")
    write(made, "a.yaml", "first")
    write(made, "b.json", "second")
    return made


def spec_of(scenarios: ScenarioSet, *planners: str, **changes: object) -> SweepSpec:
    setting = default_setting(scenarios.name, scenarios)
    return SweepSpec(
        suite=scenarios.name, planners=planners, worlds=scenarios.count, setting=setting,
        **changes,  # type: ignore[arg-type]
    )  # fmt: skip


def test_worlds_are_numbered_by_sorted_file_name(folder: Path) -> None:
    scenarios, left_out = read_scenario_files([str(folder)])
    assert (scenarios.name, scenarios.count, left_out) == ("my-worlds", 3, [])
    assert scenarios.names == ("first", "second", "third")
    assert scenarios.suite().world(2).robot.lidar.beams == 90
    listed, _ = read_scenario_files([str(folder / "c.yaml"), str(folder / "a.yaml")])
    assert (listed.name, listed.names) == ("scenarios", ("first", "third"))


def test_what_is_no_world_is_left_out_and_named(folder: Path) -> None:
    (folder / "bad.yaml").write_text("name: bad\nstart_m: [0, 0]\n", encoding="utf-8")
    write(folder, "d.yaml", "second")
    robots = "robots: [{name: a, start_m: [0, 0], goal_m: [1, 0]}]"
    (folder / "fleet.yaml").write_text(f"name: fleet\n{robots}\n", encoding="utf-8")
    # A map and what is no YAML are no scenarios, and nobody says that they should be.
    (folder / "map.yaml").write_text("image: m.png\nresolution: 0.1\norigin: [0, 0, 0]\n")
    (folder / "m.png").write_bytes(b"\x89PNG")
    scenarios, left_out = read_scenario_files([str(folder)])
    assert scenarios.names == ("first", "second", "third")
    assert [line.partition(": ")[0] for line in left_out] == [
        str(folder / name) for name in ("bad.yaml", "d.yaml", "fleet.yaml")
    ]
    assert "goal_m: missing" in left_out[0]
    assert f"name 'second' is that of {folder / 'b.json'} as well" in left_out[1]
    assert "a sweep runs one" in left_out[2]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["{}"], "no scenario file in it"),
        (["{}/none/"], "no such directory"),
        (["{}/none.yaml"], "no scenario to sweep: .*No such file"),
        (["{}", "a.yaml"], "a directory among other arguments"),
        (["paper", "a.yaml"], "paper: not a scenario file"),
    ],
)
def test_arguments_without_scenarios_are_refused(
    arguments: list[str], reason: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=reason):
        read_scenario_files([argument.format(tmp_path) for argument in arguments])


def test_built_in_suites_keep_their_names(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("paper", "mine"):
        (tmp_path / name).mkdir()
    assert not are_files(["paper"])
    assert not are_files(["papre"])  # a misspelt suite, not a path
    assert are_files(["./paper"])
    assert are_files(["mine"])
    assert are_files(["a.yaml"])
    assert are_files(["paper", "random-3"])


def test_a_world_past_the_end_is_refused(folder: Path) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    with pytest.raises(ConfigError, match="world 3: my-worlds has 3 worlds; give 0 to 2"):
        scenarios.suite().world(3)
    with pytest.raises(ConfigError, match="--first=1 --worlds=3: my-worlds has 3 worlds"):
        spec_of(scenarios, "straight", first=1)
    setting = replace(default_setting("my-worlds", scenarios), suite_seed=1)
    with pytest.raises(ConfigError, match="not drawn from a seed"):
        SweepSpec(suite="my-worlds", planners=("straight",), worlds=1, setting=setting)


@pytest.mark.parametrize("method", list(Method))
def test_a_run_is_that_of_sim_with_the_robot_of_the_file(folder: Path, method: Method) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    params = PlannerParams()
    if method is Method.PREDICTIVE:
        params = preset(replace(params, method=method))
    setting = replace(default_setting(scenarios.name, scenarios), params=params)
    completed = run_one(Run("my-worlds", 2, method.value, 4), setting)
    scenario = scenarios.suite().world(2)
    own = scenario.planner_params(params)
    planner = make_planner(own, setting.sensor, 4)
    alone = run(scenario, planner=own, seed=4, path_planner=planner, observe=observe_scan)
    assert completed.episode.ticks == alone.ticks
    assert completed.episode.scenario.robot == scenario.robot


def test_a_robot_without_a_lidar_gets_the_default_one(folder: Path) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    setting = default_setting(scenarios.name, scenarios)
    assert setting.perception == OWN_ROBOT
    lidars = [setting.scenario(Run("my-worlds", k, "straight", 0)).robot.lidar for k in (0, 2)]
    assert [lidar.beams for lidar in lidars] == [360, 90]
    other = replace(setting, perception="lidar")
    assert other.scenario(Run("my-worlds", 2, "straight", 0)).robot.lidar.beams == 360


def test_worlds_of_different_robots_and_limits_together_are_the_single_runs(folder: Path) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    setting = replace(default_setting(scenarios.name, scenarios), perception="known")
    runs = [Run("my-worlds", world, "paper", seed) for world in range(3) for seed in range(4)]
    for one, together in zip(runs, run_together(runs, setting)):
        assert run_one(one, setting, whole=False).episode == together.episode


def test_rows_name_the_scenario_and_hold_the_oracle(folder: Path) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    rows = sweep(spec_of(scenarios, "straight", "orca")).rows
    assert [row["scenario"] for row in rows] == [
        name for name in scenarios.names for _ in range(2)
    ]
    assert {row["certificate"] for row in rows} == {"feasible"}
    row = rows[1]
    completed = run_one(Run("my-worlds", 0, "orca", 0), default_setting("x", scenarios))
    assert row["length_m"] == evaluate(completed.episode).length_m
    assert row["barn"] == 0.5
    assert row["survivability"] == 1.0  # nothing moves


def test_chunks_carry_their_own_worlds_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mfba_planner.evaluation.sweep.sweep_chunks.RUNS_AT_ONCE", 1)
    monkeypatch.setattr("mfba_planner.evaluation.sweep.sweep_chunks.WORLDS_AT_ONCE", 1)
    scenarios, _ = read_scenario_files([str(folder)])
    spec = spec_of(scenarios, "straight")
    held = []
    for chunk in chunks_of(spec):
        found = chunk.setting.scenarios if hasattr(chunk, "setting") else chunk.scenarios
        assert found is not None
        held.append(list(found.worlds))
    assert held == [[0], [1], [2]] * 2
    assert sweep(spec, workers=2).rows == sweep(spec).rows


def test_a_chunk_needs_no_file(folder: Path) -> None:
    """As on another machine, to which an executor such as dask sends it."""
    scenarios, _ = read_scenario_files([str(folder)])
    chunks = chunks_of(spec_of(scenarios, "straight"))
    sent = [pickle.dumps(chunk) for chunk in chunks]
    expected = [chunk.run() for chunk in chunks]
    shutil.rmtree(folder)
    for data, columns in zip(sent, expected, strict=True):
        found = pickle.loads(data).run()
        timings = ("decision_us", "decision_max_us", "wall_ms")
        assert {k: v for k, v in found.items() if k not in timings} == {
            k: v for k, v in columns.items() if k not in timings
        }


def test_a_changed_file_is_noticed_and_the_old_content_is_still_explained(
    folder: Path, tmp_path: Path
) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    spec = spec_of(scenarios, "straight", oracle=False)
    sweep(spec, store=open_store(tmp_path / "out", spec))
    write(folder, "a.yaml", "first", 0.4)
    changed, _ = read_scenario_files([str(folder)])
    with pytest.raises(OutputError, match="the scenario files have changed since"):
        open_store(tmp_path / "out", spec_of(changed, "straight", oracle=False))
    again = read_sweep(tmp_path / "out")
    assert again.spec == spec
    assert len(again.rows) == 3
    scenario = again.spec.setting.scenario(Run("my-worlds", 0, "straight", 0))
    assert scenario.obstacles[0].center_m == (1.5, 2.0)


def test_facts_are_plain_and_come_back(folder: Path) -> None:
    scenarios, _ = read_scenario_files([str(folder)])
    assert from_facts(json.loads(json.dumps(scenarios.facts()))) == scenarios
    assert scenarios.digest() != scenarios.only([0, 1]).digest()
    assert "scenarios" not in Setting().facts()  # of a built-in suite


def test_the_area_of_survivability_lies_around_the_trip() -> None:
    assert area_of(Scenario(name="a", start_m=(0.0, 0.0), goal_m=(12.0, 12.0))) == ROOM
    along = area_of(Scenario(name="b", start_m=(1.0, 3.0), goal_m=(1.0, -5.0)))
    assert (along.lower_m, along.upper_m) == ((-1.0, -5.0), (3.0, 3.0))
