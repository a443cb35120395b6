# SPDX-License-Identifier: Apache-2.0
"""The study's runs: the same for any number of workers, resumable, other directories refused."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from project import ROOT

from mfba_planner.core.errors import ConfigError, MfbaError, OutputError
from mfba_planner.core.geometry import Pose2D
from mfba_planner.evaluation.metrics import evaluate, run_motion
from mfba_planner.evaluation.study import chunk_store as storing
from mfba_planner.paper.benchmark_functions import FUNCTIONS
from mfba_planner.paper.readings_of_paper import PLANNERS
from mfba_planner.paper.study.chunk import BENCHMARK_STREAM, Benchmark, SampleChunk, Trips, chunks
from mfba_planner.paper.study.plan import FULL, QUICK, benchmark_plan, trip_plan
from mfba_planner.paper.study.run import PACKAGES, open_store, run_plan
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams, minimize

NEAR = Scenario(name="near", start_m=(0.0, 0.0), goal_m=(1.5, 1.0))
SWARM = BatParams(population=6, iterations=10)


def a_plan(first: int = 3, size: int = 4) -> list[SampleChunk]:
    """Two samples of a few fast runs."""
    return [
        *chunks("a/F5/mfba", Benchmark(function="F5", bat=SWARM), first, 10, size),
        *chunks("b/near/mfba", Trips(scenario=NEAR, planner=PlannerParams()), first, 5, size),
    ]


def plain(samples: Any) -> dict[str, dict[str, list[float]]]:
    return {
        name: {column: values.tolist() for column, values in sample.items()}
        for name, sample in samples.items()
    }


def test_a_run_of_the_study_equals_a_single_run_of_minimize() -> None:
    for algorithm in Algorithm:
        params = replace(SWARM, algorithm=algorithm)
        key = (BENCHMARK_STREAM, 4, int.from_bytes(algorithm.value.encode(), "big"))
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(17, spawn_key=key)))
        single = minimize(FUNCTIONS["F4"], FUNCTIONS["F4"].box(2), params, rng).best_value
        work = Benchmark(function="F4", bat=params)
        assert work.run([16, 17])["best"][1] == single


def test_laws_functions_and_seeds_have_different_random_streams() -> None:
    no_motion = replace(SWARM, iterations=1, sigma=0.0, f_max=0.0)  # the best of the first bats
    found = [
        Benchmark(function=function, bat=replace(no_motion, algorithm=algorithm)).run([1, 2])[
            "best"
        ]
        for function in ("F1", "F5")
        for algorithm in Algorithm
    ]
    assert len({value for pair in found for value in pair}) == 8


def test_a_trip_of_the_study_equals_the_run_of_its_seed() -> None:
    found = Trips(scenario=NEAR, planner=PLANNERS["fig1"]).run([7, 8])
    episode = run(NEAR, planner=PLANNERS["fig1"], seed=8)
    result = evaluate(episode)
    assert found["length_m"][1] == result.length_m
    assert found["clearance_m"][1] == result.min_clearance_m
    assert found["reached"] == [1, 1]
    assert found["turning_rad"][1] == run_motion(episode).turning_rad > 0.0


def test_turning_is_the_sum_of_all_turns() -> None:
    episode = run(NEAR, seed=1)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 1.0), (0.0, 2.0)]
    ticks = tuple(replace(episode.ticks[0], pose=Pose2D(*corner)) for corner in corners)
    turned = run_motion(replace(episode, ticks=ticks)).turning_rad
    assert turned == pytest.approx(np.radians(90 + 45))


@pytest.mark.parametrize(("workers", "size"), [(1, 3), (2, 4), (3, 100)])
def test_samples_do_not_depend_on_workers_or_chunks(workers: int, size: int) -> None:
    whole = plain(run_plan(a_plan(size=10)))
    assert plain(run_plan(a_plan(size=size), workers=workers)) == whole
    assert len(whole["a/F5/mfba"]["best"]) == 10


def test_seeds_are_those_asked_for() -> None:
    later = plain(run_plan(a_plan(first=5)))["a/F5/mfba"]["best"]
    assert plain(run_plan(a_plan(first=3)))["a/F5/mfba"]["best"][2:] == later[:-2]


@pytest.mark.parametrize("workers", [0, -1, 257])
def test_impossible_numbers_of_workers_are_refused(workers: int) -> None:
    with pytest.raises(ConfigError, match=rf"--workers={workers}: out of range; give 1 to 256"):
        run_plan(a_plan(), workers=workers)


def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the chunks that are computed from now on."""
    names: list[str] = []
    compute = SampleChunk.run

    def recorded(chunk: SampleChunk) -> Any:
        names.append(chunk.name)
        return compute(chunk)

    monkeypatch.setattr(SampleChunk, "run", recorded)
    return names


def test_an_interrupted_study_is_resumed_with_the_same_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = a_plan()
    whole = plain(run_plan(plan))
    computed = counted(monkeypatch)
    finished: list[SampleChunk] = []

    def interrupt(chunk: SampleChunk) -> None:
        finished.append(chunk)
        if len(finished) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_plan(plan, store=open_store(tmp_path / "out", plan, {}), done=interrupt)
    kept, computed[:] = list(computed), []
    again = run_plan(plan, store=open_store(tmp_path / "out", plan, {}))
    assert plain(again) == whole
    assert len(kept) == 2
    assert sorted([*kept, *computed]) == sorted(chunk.name for chunk in plan)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[: len(text) // 2],
        lambda text: "",
        lambda text: text.replace('"best": [', '"best": [1'),
        lambda text: "[1, 2]",
    ],
    ids=["half-written", "empty", "altered", "something else"],
)
def test_a_damaged_chunk_is_computed_again(
    damage: Callable[[str], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = a_plan()
    whole = plain(run_plan(plan, store=open_store(tmp_path, plan, {})))
    path = tmp_path / "chunks" / f"{plan[1].name}.json"
    text = path.read_text()
    path.write_text(damage(text))
    computed = counted(monkeypatch)
    assert plain(run_plan(plan, store=open_store(tmp_path, plan, {}))) == whole
    assert computed == [plan[1].name]
    assert path.read_text() == text


def refusal(directory: Path, plan: list[SampleChunk], facts: dict[str, Any]) -> str:
    with pytest.raises(OutputError) as caught:
        open_store(directory, plan, facts)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{directory}: ")
    return line


def test_results_of_anything_else_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = a_plan()
    out = tmp_path / "out"
    open_store(out, plan, {"seed": 3})
    assert "(seed=3, now 4)" in refusal(out, plan, {"seed": 4})
    assert "(what is run differs)" in refusal(out, plan[:-1], {"seed": 3})
    other = [replace(c, work=Benchmark(function="F5", bat=replace(SWARM, rho=2.0))) for c in plan]
    assert "(what is run differs)" in refusal(out, other, {"seed": 3})
    with monkeypatch.context() as patch:
        patch.setattr(storing, "__version__", "9.9.9")
        assert "(mfba_planner='0.1.0', now '9.9.9')" in refusal(out, plan, {"seed": 3})
    with monkeypatch.context() as patch:
        patch.setattr(storing, "code_digest", lambda *_: "changed")
        assert "(the code has changed since)" in refusal(out, plan, {"seed": 3})
    (out / storing.MANIFEST).write_text('{"schema_version": 1, ')
    assert "cut short or not JSON; give another --out" in refusal(out, plan, {"seed": 3})
    (out / storing.MANIFEST).write_text("[]")
    assert "cut short or not JSON" in refusal(out, plan, {"seed": 3})


def test_the_code_that_decides_the_numbers_is_in_folders_that_exist() -> None:
    for name in PACKAGES:
        assert list((ROOT / "mfba_planner" / name).rglob("*.py")), name


def test_directories_of_other_files_are_left_unchanged(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    assert "not empty and no results of `mfba tables`" in refusal(tmp_path, a_plan(), {})
    assert os.listdir(tmp_path) == ["mine.txt"]
    assert "cannot be written (not a directory)" in refusal(tmp_path / "mine.txt/x", a_plan(), {})
    assert "cannot be written (not a directory)" in refusal(tmp_path / "mine.txt", a_plan(), {})


def test_the_manifest_lists_what_was_run(tmp_path: Path) -> None:
    open_store(tmp_path / "deep/out", a_plan(), {"seed": 3})
    found = json.loads((tmp_path / "deep/out/study.json").read_text())
    assert found["seed"] == 3
    assert found["numpy"] == np.__version__
    assert found["chunks"][0] == "a-F5-mfba-3-4"


@dataclass(frozen=True)
class ProcessKiller:
    """Work that ends its process, as the kernel does when memory runs out."""

    def facts(self) -> dict[str, Any]:
        return {}

    def run(self, seeds: Any) -> dict[str, list[float]]:
        os._exit(3)


@dataclass(frozen=True)
class ErrorRaiser(ProcessKiller):
    def run(self, seeds: Any) -> dict[str, list[float]]:
        raise ConfigError("x=1: out of range; give 2")


def test_a_worker_that_dies_gives_one_error_line() -> None:
    plan: Any = chunks("x", ProcessKiller(), 0, 4, 1)  # type: ignore[arg-type]
    with pytest.raises(MfbaError, match="a worker process died"):
        run_plan(plan, workers=2)


def test_an_error_inside_a_worker_is_raised_unchanged() -> None:
    plan: Any = chunks("x", ErrorRaiser(), 0, 4, 1)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="x=1: out of range; give 2"):
        run_plan(plan, workers=2)


def test_the_plans_have_the_samples_of_the_tables() -> None:
    for size in (QUICK, FULL):
        by_sample: dict[str, int] = {}
        for chunk in [*benchmark_plan(size, 0), *trip_plan("case1", NEAR, size, 0)]:
            by_sample[chunk.sample] = by_sample.get(chunk.sample, 0) + chunk.count
        assert len(by_sample) == 3 * 12 + 4 + 4
        assert min(by_sample.values()) >= 10
        assert by_sample["table3/F1/mfba"] == size.benchmarks["table3"] >= 15
        assert by_sample["robust/F4/ba"] == size.benchmark("robust", "F4")
        assert by_sample["section6/case1/ba"] == size.trips
    names = [chunk.name for chunk in benchmark_plan(FULL, 0)]
    assert len(set(names)) == len(names)
