# SPDX-License-Identifier: Apache-2.0
"""Sweeps: rows equal the metrics of their runs, on any executor and after any failure."""

import csv
import io
import math
import os
import signal
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

from mfba_planner.core.errors import ConfigError, OutputError
from mfba_planner.core.planner_types import Observation
from mfba_planner.evaluation.metrics import assess
from mfba_planner.evaluation.oracle import solve
from mfba_planner.evaluation.study.chunk_store import code_digest
from mfba_planner.evaluation.suites import suite
from mfba_planner.evaluation.suites.survivability import survivability
from mfba_planner.evaluation.sweep import single_run, sweep_chunks, worker
from mfba_planner.evaluation.sweep.run_sweep import (
    PACKAGES,
    SweepResult,
    dask_executor,
    open_store,
    sweep,
)
from mfba_planner.evaluation.sweep.single_run import (
    generates_paths_together,
    run_one,
    run_together,
)
from mfba_planner.evaluation.sweep.summary import comparisons, planner_summaries, versus
from mfba_planner.evaluation.sweep.sweep_chunks import chunks_of, make
from mfba_planner.evaluation.sweep.sweep_spec import (
    Run,
    Setting,
    SweepSpec,
    default_setting,
    own_preset,
    read_run,
)
from mfba_planner.evaluation.sweep.table import sorted_hash, to_csv, to_parquet, write
from mfba_planner.evaluation.sweep.table_columns import COLUMNS, TIMINGS, Row
from mfba_planner.evaluation.sweep.worker import Lost, Worker, run_in_worker
from mfba_planner.planning.algorithm_1 import Algorithm1
from mfba_planner.planning.planner_factory import make_planner as planner_of_sim
from mfba_planner.planning.planner_params import Method, PlannerParams, Swarm
from mfba_planner.planning.recovery import RecoveryParams
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.planner_observations import observe_scan
from mfba_planner.simulation.robot_model import Lidar
from mfba_planner.simulation.run_episode import run


def spec_of(**changes: Any) -> SweepSpec:
    plain: dict[str, Any] = {
        "suite": "random-3", "planners": ("paper", "straight"), "worlds": 5, "oracle": False,
    }  # fmt: skip
    return SweepSpec(**{**plain, **changes})


@pytest.fixture(scope="module")
def small() -> SweepResult:
    """Ten runs, with the oracle."""
    return sweep(spec_of(oracle=True))


@pytest.fixture
def tiny_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many chunks of few runs; they are made in the parent process."""
    monkeypatch.setattr(sweep_chunks, "RUNS_AT_ONCE", 2)
    monkeypatch.setattr(sweep_chunks, "WORLDS_AT_ONCE", 2)


def test_every_run_has_one_row_and_rows_are_sorted(small: SweepResult) -> None:
    keys = [tuple(row[name] for name in Run._fields) for row in small.rows]
    assert keys == [
        ("random-3", world, planner, 0) for world in range(5) for planner in ("paper", "straight")
    ]
    assert all(list(row) == list(COLUMNS) for row in small.rows)
    assert all(list(row) == list(TIMINGS) for row in small.timings)
    assert [tuple(row[name] for name in Run._fields) for row in small.timings] == keys


def test_a_row_equals_the_metrics_of_the_run(small: SweepResult) -> None:
    row = next(row for row in small.rows if (row["world"], row["planner"]) == (3, "paper"))
    scenario = suite("random-3").world(3)
    params = PlannerParams(speed_mps=0.8)
    result, run_motion = assess(run(scenario, planner=params, seed=0))
    for name in ("length_m", "time_s", "collisions", "min_clearance_m", "ticks", "success"):
        assert row[name] == getattr(result, name), name
    for name in run_motion.__slots__:
        assert row[name] == getattr(run_motion, name), name
    optimum = solve(scenario, 0.8)
    assert row["optimum_m"] == round(optimum.length_m, 6)
    assert row["certificate"] == optimum.certificate.value
    assert row["survivability"] == survivability(scenario, 0.8).share
    assert row["gap"] == result.length_m / row["optimum_m"] - 1.0
    assert row["spl"] == pytest.approx(1.0 / (1.0 + row["gap"]))
    assert row["barn"] == 0.5
    assert (row["obstacles"], row["encounters"]) == (3, len(result.encounters))


def test_only_decisions_of_single_runs_are_timed(small: SweepResult) -> None:
    for row in small.timings:
        assert row["wall_ms"] > 0.0
        if row["planner"] == "paper" and row["world"] > 0:  # computed together
            assert math.isnan(row["decision_us"])
            assert math.isnan(row["decision_max_us"])
        else:
            assert 0.0 < row["decision_us"] <= row["decision_max_us"] < 1e3 * row["wall_ms"]


@pytest.mark.parametrize("planner", ["paper", "ba", "mfba"])
def test_runs_computed_together_equal_single_runs(planner: str) -> None:
    runs = [Run("dense", world, planner, seed) for world in range(6) for seed in range(3)]
    setting = Setting(perception="scan-12", noise_m=0.01)
    assert generates_paths_together(planner, setting)
    for each_run, together in zip(runs, run_together(runs, setting)):
        completed = run_one(each_run, setting, whole=False)
        assert completed.episode == together.episode
        assert (together.fault, together.times_ns) == ("", ())
        assert len(completed.times_ns) == len(completed.episode.ticks)


def test_runs_with_many_ticks_are_batched_in_few(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [Run("random-3", world, "paper", 0) for world in range(7)]
    running: list[int] = []

    def noted(planners: Sequence[Algorithm1], observations: Sequence[Observation]) -> None:
        running.append(len(planners))

    monkeypatch.setattr(single_run, "generate_paths_together", noted)
    # Of 120 s in ticks of 0.375 s, 320 each.
    monkeypatch.setattr(single_run, "TICKS_HELD", 1000)
    found = list(run_together(runs, Setting()))
    assert max(running) == 3
    assert [completed.episode for completed in found] == [
        run_one(run, Setting()).episode for run in runs
    ]
    assert len(list(run_together(runs, Setting(params=PlannerParams(step_length_m=2.0))))) == 7
    assert max(running) == 7


def test_only_algorithm_1_with_fresh_swarms_is_batched() -> None:
    persistent = Setting(params=PlannerParams(swarm=Swarm.PERSISTENT))
    assert not generates_paths_together("paper", persistent)
    assert not generates_paths_together("predictive", Setting())
    assert not generates_paths_together("mfba_planner.planning.planner_registry:make", Setting())


def dies_among_others(runs: tuple[Run, ...], setting: Setting) -> list[Row]:
    """As make(), but the process dies when runs are computed together."""
    if len(runs) > 1:
        os._exit(7)
    return make(runs, setting)


def hangs_among_others(runs: tuple[Run, ...], setting: Setting) -> list[Row]:
    """As make(), but hangs when runs are computed together."""
    if len(runs) > 1:
        signal.pause()
    return make(runs, setting)


@pytest.mark.parametrize("lost", [dies_among_others, hangs_among_others])
def test_runs_of_a_lost_batch_are_run_one_by_one(
    monkeypatch: pytest.MonkeyPatch, lost: Any
) -> None:
    plain = sweep(spec_of(planners=("paper",)))
    monkeypatch.setattr(sweep_chunks, "make", lost)
    again = sweep(spec_of(planners=("paper",), setting=Setting(patience_s=4.0)))
    assert again.hash == plain.hash
    assert all(row["decision_us"] > 0.0 for row in again.timings), "each was a single run"


@pytest.mark.usefixtures("tiny_chunks")
@pytest.mark.parametrize("workers", [2, 4])
def test_processes_change_nothing(small: SweepResult, workers: int) -> None:
    again = sweep(spec_of(oracle=True), workers=workers)
    assert again.hash == small.hash
    assert again.rows == small.rows or repr(again.rows) == repr(small.rows)


@pytest.mark.usefixtures("tiny_chunks")
@pytest.mark.filterwarnings("default")  # warnings of dask itself
def test_dask_changes_nothing(small: SweepResult, scheduler: str) -> None:
    with dask_executor(scheduler) as executor:
        assert sweep(spec_of(oracle=True), executor=executor).hash == small.hash


def test_the_hash_covers_every_bit_but_not_the_sequence(small: SweepResult) -> None:
    rows = small.rows
    assert sorted_hash(rows[::-1]) == small.hash
    last = {**rows[-1], "length_m": np.nextafter(rows[-1]["length_m"], 99.0).item()}
    assert sorted_hash([*rows[:-1], last]) != small.hash
    assert sorted_hash(rows[:-1]) != small.hash


def test_worlds_and_seeds_of_a_sweep() -> None:
    found = sweep(spec_of(planners=("paper",), first=2, worlds=2, seeds=3))
    assert [(row["world"], row["seed"]) for row in found.rows] == [
        (world, seed) for world in (2, 3) for seed in (0, 1, 2)
    ]
    whole = sweep(spec_of(planners=("paper",), worlds=4, seeds=3))
    assert repr(whole.rows[6:]) == repr(found.rows)


def test_a_suite_that_repeats_its_worlds_changes_the_seed() -> None:
    found = sweep(spec_of(suite="paper", planners=("paper",), worlds=4))
    assert [(row["world"], row["seed"]) for row in found.rows] == [(0, 0), (1, 0), (2, 1), (3, 1)]
    assert found.rows[0]["length_m"] != found.rows[2]["length_m"]
    with pytest.raises(ConfigError, match="--seeds=2: paper has 2 worlds, which --worlds repeats"):
        spec_of(suite="paper", seeds=2)
    with_oracle = sweep(spec_of(suite="paper", planners=("paper",), worlds=4, oracle=True)).rows
    assert (
        with_oracle[0]["optimum_m"] == with_oracle[2]["optimum_m"] != with_oracle[1]["optimum_m"]
    )


# --- planners that go wrong -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("planner", "failure"),
    [
        ("Raises", "tick 5: raised ValueError: no idea what to do"),
        ("NotANumber", "tick 5: velocity (nan, 0.0) is not finite"),
        ("TooFast", "tick 5: speed 0.808 m/s exceeds the limit of 0.8 m/s"),
        ("Nothing", "tick 5: returned NoneType, not a Decision"),
        ("OldStamp", "tick 5: answered stamp 1 instead of 2250000000"),
        ("OneNumber", "tick 5: velocity 3.0 is not two numbers"),
    ],
)
def test_a_faulty_planner_fails_and_the_sweep_goes_on(planner: str, failure: str) -> None:
    faulty = f"faulty_planners:{planner}"
    found = sweep(spec_of(planners=(faulty, "straight"), worlds=2))
    assert [row["outcome"] == "failed" for row in found.rows] == [True, False, True, False]
    assert [row["failure"] for row in found.rows] == [failure, "", failure, ""]
    assert {row["success"] for row in found.rows[::2]} == {False}
    assert found.rows[0]["ticks"] == 5, "decisions before the fault are counted"
    assert found.rows[0]["length_m"] == pytest.approx(4 * 0.3)
    assert found.rows[0]["time_to_goal_s"] == math.inf


def test_a_planner_that_cannot_be_made_fails() -> None:
    faulty = "faulty_planners:Unmakeable"
    found = sweep(spec_of(planners=(faulty,), worlds=1, seeds=2))
    assert [row["failure"] for row in found.rows] == ["", "tick 0: raised KeyError: 'seed'"]
    assert found.rows[1]["ticks"] == 0


@pytest.mark.parametrize(
    ("planner", "failure"),
    [
        ("Hangs", "hung: no end after 4 s of wall time"),
        ("Dies", "its process died (exit code 7)"),
    ],
)
@pytest.mark.parametrize("workers", [1, 2])
def test_a_planner_that_hangs_or_dies_loses_only_its_run(
    planner: str, failure: str, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep_chunks, "RUNS_AT_ONCE", 4)
    spec = spec_of(
        planners=(f"faulty_planners:{planner}",),
        worlds=2,
        seeds=3,
        setting=Setting(patience_s=4.0),
    )
    found = sweep(spec, workers=workers)
    assert [row["failure"] for row in found.rows] == ["", failure, ""] * 2
    assert [row["outcome"] for row in found.rows] == ["goal_reached", "failed", "goal_reached"] * 2
    lost = found.rows[1]
    assert (lost["length_m"], lost["collisions"], lost["success"]) == (None, None, False)
    rows = found.rows
    plain = sweep(spec_of(planners=("straight",), worlds=2, seeds=3)).rows
    for k in (0, 2, 3, 5):
        assert rows[k]["length_m"] == plain[k]["length_m"], "the other runs are unchanged"


def test_errors_outside_the_planner_are_raised() -> None:
    run_of_no_suite = Run("random-4", 0, "straight", 0)
    with pytest.raises(ConfigError, match="no such suite"):
        list(run_in_worker(make, [(run_of_no_suite,)], Setting(), 60.0))
    (rows,) = run_in_worker(make, [(Run("random-3", 0, "straight", 0),)], Setting(), 60.0)
    assert not isinstance(rows, Lost)
    (row,) = rows
    assert row["outcome"] == "goal_reached", "the next run is not affected"


# --- table and summary ------------------------------------------------------------------------


def test_the_table_as_text_and_as_parquet(small: SweepResult, tmp_path: Path) -> None:
    text = list(csv.DictReader(io.StringIO(to_csv(small.rows, COLUMNS).decode())))
    (tmp_path / "t.parquet").write_bytes(to_parquet(small.rows, COLUMNS))
    table = parquet.read_table(tmp_path / "t.parquet")
    assert repr(table.to_pylist()) == repr(small.rows)
    assert table.schema.field("gap").metadata[b"meaning"].startswith(b"length / optimum")
    for line, row in zip(text, small.rows):
        for name, (kind, _) in COLUMNS.items():
            value = row[name]
            if value is None:
                assert line[name] == ""
            elif kind is bool:
                assert line[name] == str(value).lower()
            else:
                assert kind(line[name]) == value


def test_a_table_that_was_cut_short_is_left_and_refused(
    small: SweepResult, tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    write(path, small.rows, COLUMNS)
    whole = path.read_bytes()
    write(path, small.rows, COLUMNS)
    assert path.read_bytes() == whole
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(OutputError, match=r"table.csv: differs from the finished runs"):
        write(path, small.rows, COLUMNS)
    assert path.read_bytes() == whole[: len(whole) // 2]


def test_summary_of_each_planner(small: SweepResult) -> None:
    paper, straight = planner_summaries(small.rows, small.timings)
    assert (paper.planner, straight.planner) == ("paper", "straight")
    successes = [row for row in small.rows if row["planner"] == "paper" and row["success"]]
    assert paper.success.middle == len(successes) / 5
    assert paper.gap is not None
    assert paper.gap.middle == pytest.approx(sum(row["gap"] for row in successes) / len(successes))
    assert paper.gap.low <= paper.gap.middle <= paper.gap.high
    assert paper.certified_runs == 5
    hit = [row for row in small.rows if row["planner"] == "straight" and row["collisions"]]
    assert straight.collisions == len(hit)
    assert straight.hits_moving + straight.hits_standing == sum(r["collisions"] for r in hit)


def row_of(planner: str, world: int, success: bool, gap: float | None, seed: int = 0) -> Any:
    return {"planner": planner, "world": world, "seed": seed, "success": success, "gap": gap}


def test_a_pair_on_the_same_worlds() -> None:
    rows = [
        row_of("a", 0, True, 0.3), row_of("b", 0, True, 0.1),
        row_of("a", 1, True, 0.2), row_of("b", 1, False, 0.0),
        row_of("a", 2, False, None), row_of("b", 2, True, 0.1),
        row_of("a", 3, False, None), row_of("b", 3, True, 0.1),
        row_of("a", 4, True, 0.2), row_of("b", 4, True, 0.2),
        row_of("a", 5, True, 0.2),
    ]  # fmt: skip
    found = versus(rows, "b", "a")
    assert (found.wins, found.losses) == (2, 1)
    assert found.p == 1.0
    assert found.gap is not None
    assert (found.gap.n, found.gap.wins, found.gap.ties) == (2, 1, 1)
    assert found.gap.difference.middle == pytest.approx(-0.1)
    assert [(v.planner, v.other) for v in comparisons(rows)] == [("b", "a")]


def test_seeds_of_a_world_are_a_single_case() -> None:
    rows = [row_of("a", 0, True, 0.1, seed) for seed in range(9)]
    rows += [row_of("b", 0, True, 0.2, seed) for seed in range(9)]
    found = versus(rows, "b", "a")
    assert found.gap is not None
    assert found.gap.n == 1


# --- specifications ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"suite": "random-11"}, "'random-11': no such suite; did you mean 'random-1"),
        ({"planners": ("papre",)}, "planner 'papre': unknown; did you mean 'paper'?"),
        ({"planners": ("nowhere:Mine",)}, "planner nowhere:Mine: cannot be imported"),
        ({"planners": ("math:Mine",)}, "planner math:Mine: cannot be imported"),
        ({"planners": ()}, "--planner: none given"),
        ({"planners": ("paper", "paper")}, "--planner paper: given twice"),
        (
            {"planners": ("orca",), "setting": Setting(perception="sectors")},
            "--perception sectors: planner orca uses none of it; give --perception lidar or ",
        ),
        (
            {"planners": ("paper", "dwa"), "setting": Setting(perception="sectors")},
            "--perception sectors: planner dwa uses none of it; "
            "give --perception lidar or lidar-differential or lidar-realistic or scenario or "
            "known or scan-12 or scan-360",
        ),
        ({"worlds": 0}, "--worlds=0: out of range; give 1 to 2147483647"),
        ({"first": -1}, "--first=-1: out of range; give 0 to 2147483647"),
        ({"first": 10**20}, f"--first={10**20}: out of range; give 0 to 2147483647"),
        ({"seeds": 0}, "--seeds=0: out of range; give 1 to 2147483647"),
    ],
)
def test_invalid_specs_are_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigError) as caught:
        spec_of(**changes)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"perception": "scan-13"}, "did you mean 'scan-12'?"),
        ({"perception": "lidar-realistc"}, "did you mean 'lidar-realistic'?"),
        ({"perception": "lidar", "noise_m": -0.1}, "noise_m=-0.1"),
        ({"perception": "lidar", "latency_ticks": -1}, "latency_ticks=-1"),
        ({"noise_m": math.nan}, "noise_m=nan"),
        ({"latency_ticks": -1}, "latency_ticks=-1"),
        ({"patience_s": 0.0}, "--patience=0: out of range; give more than 0, at most 86400 s"),
        ({"patience_s": math.inf}, "--patience=inf: out of range"),
    ],
)
def test_invalid_settings_are_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Setting(**changes)
    assert reason in str(caught.value)


@pytest.mark.parametrize("text", ["", "a/b/c/d", "random-3/1/paper", "random-3/-1/paper/0"])
def test_texts_that_are_no_run(text: str) -> None:
    with pytest.raises(ConfigError, match="no run; give SUITE/WORLD/PLANNER/SEED"):
        read_run(text)
    assert read_run("random-3/1/paper/0") == Run("random-3", 1, "paper", 0)


def test_perception_reaches_the_planner() -> None:
    known = sweep(spec_of(planners=("paper",), worlds=3)).rows
    scan = sweep(
        spec_of(planners=("paper",), worlds=3, setting=Setting(perception="scan-12"))
    ).rows
    assert [row["length_m"] for row in known] != [row["length_m"] for row in scan]


@pytest.mark.parametrize("method", [Method.PAPER, Method.PREDICTIVE])
def test_by_default_a_run_is_that_of_sim_with_a_lidar(method: Method) -> None:
    """Decision by decision: supervised, and the robot sees nothing but its scan."""
    scenario = suite("random-10").world(3)
    robot = replace(scenario.robot, lidar=Lidar(beams=360))
    usual = PlannerParams(speed_mps=0.8, method=method, recovery=RecoveryParams(enabled=True))
    setting = Setting(params=own_preset(method.value, usual))
    run_of_sweep = run_one(Run("random-10", 3, method.value, 5), setting)
    episode = run(
        replace(scenario, robot=robot),
        planner=setting.params,
        path_planner=planner_of_sim(setting.params, setting.sensor, 5),
        observe=observe_scan,
        seed=5,
    )
    assert digest(run_of_sweep.episode.ticks) == digest(episode.ticks)
    assert run_of_sweep.episode.scenario == episode.scenario
    blind = run_one(Run("random-10", 3, "straight", 5), setting)
    assert digest(blind.episode.ticks) != digest(episode.ticks)


def test_runs_from_a_lidar_together_are_the_single_ones() -> None:
    """Supervised ones too; some are blocked in this suite, and recover."""
    params = PlannerParams(speed_mps=0.8, recovery=RecoveryParams(enabled=True))
    setting = Setting(params=params)
    runs = [Run("dense", world, "paper", 0) for world in range(4)]
    assert generates_paths_together("paper", setting)
    single = [run_one(one, setting, whole=False).episode for one in runs]
    together = [completed.episode for completed in run_together(runs, setting)]
    assert [digest(e.ticks) for e in together] == [digest(e.ticks) for e in single]
    assert any("waiting for" in tick.reason for e in single for tick in e.ticks)


def test_the_realistic_robot_is_judged_by_its_true_path() -> None:
    setting = Setting(perception="lidar-realistic")
    completed = run_one(Run("random-3", 0, "predictive", 0), setting)
    episode = completed.episode
    assert episode.scenario.robot.turns
    assert len(episode.truth) == len(episode.ticks)
    row = sweep(spec_of(planners=("predictive",), worlds=1, setting=setting)).rows[0]
    true_m = [math.dist(a.position, b.position) for a, b in pairwise(episode.truth)]
    assert row["length_m"] == pytest.approx(math.fsum(true_m))
    assert row["outcome"] == "goal_reached"


@pytest.mark.parametrize("planner", ["paper", "straight"])
def test_a_suite_s_own_speed_is_the_default(planner: str) -> None:
    setting = default_setting("fast-10")
    assert setting.params.speed_mps == suite("fast-10").speed_mps == 1.0
    rows = sweep(spec_of(suite="fast-10", planners=(planner,), worlds=1, setting=setting)).rows
    assert rows[0]["length_m"] / rows[0]["time_s"] == pytest.approx(1.0, rel=0.05)


def test_a_directory_belongs_to_one_spec(tmp_path: Path) -> None:
    spec = spec_of()
    open_store(tmp_path / "out", spec)
    open_store(tmp_path / "out", spec_of())
    for other, what in (
        (replace(spec, worlds=6), "worlds=5, now 6"),
        (replace(spec, planners=("paper",)), "planners=['paper', 'straight'], now ['paper']"),
        (replace(spec, oracle=True), "oracle=False, now True"),
        (replace(spec, setting=Setting(noise_m=0.1)), "setting="),
    ):
        with pytest.raises(OutputError) as caught:
            open_store(tmp_path / "out", other)
        assert what in str(caught.value)


@pytest.mark.parametrize("folder", PACKAGES)
def test_the_code_digest_covers_every_folder(folder: str) -> None:
    assert code_digest(folder) != code_digest(), "no sources found"


def test_names_of_the_chunks() -> None:
    names = [chunk.name for chunk in chunks_of(spec_of(worlds=250, oracle=True))]
    assert len(set(names)) == len(names)
    assert names[0] == "random-3-oracle-0-20"
    assert names[-3:] == [
        "random-3-straight-0-100", "random-3-straight-100-100", "random-3-straight-200-50",
    ]  # fmt: skip


def environment(name: str, _: None) -> str | None:
    """An environment variable in the worker process."""
    return os.environ.get(name)


def test_workers_compute_with_one_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Several threads would change the sequence of sums; only dask limits its workers to one."""
    names = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"]
    for name in names:
        monkeypatch.setenv(name, "2")
    child = Worker()
    try:
        assert list(child.run(environment, tuple(names), None, 60.0)) == ["1", "1", "1"]
    finally:
        child.end()


def test_a_worker_computes_several_chunks() -> None:
    first, second = chunks_of(spec_of())
    first.run()
    child = worker._LOCAL.worker
    second.run()
    assert worker._LOCAL.worker is child
    assert child.is_alive


def test_a_planner_on_a_path_added_after_the_first_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "found_later.py").write_text(
        "from mfba_planner.planning.peers.straight_line import Straight as Later\n"
    )
    before = sweep(spec_of(planners=("straight",)))
    monkeypatch.syspath_prepend(str(tmp_path))
    after = sweep(spec_of(planners=("found_later:Later",)))
    same = [{**row, "planner": "straight"} for row in after.rows]
    assert sorted_hash(same) == sorted_hash(before.rows)
