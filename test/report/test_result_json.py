# SPDX-License-Identifier: Apache-2.0
"""Result files: strict JSON, read back as written, never half-written or overwritten."""

import json
import math
import os
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import file_size_limit
from hypothesis import given
from hypothesis import strategies as st

from mfba_planner import __version__
from mfba_planner.core.errors import InputError, OutputError
from mfba_planner.core.option_specs import override
from mfba_planner.core.output_files import write_new
from mfba_planner.evaluation.metrics import Result, evaluate
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.report.result_json import read_result, result_to_dict, write_result
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.run_episode import run
from mfba_planner.swarm.bat_swarm import Algorithm, BatParams


@pytest.fixture(scope="module")
def episode() -> Episode:
    """Return a run with non-default planner, sensor and seed."""
    return run(
        load_scenario("case2"),
        planner=PlannerParams(speed_mps=0.8, bat=BatParams(algorithm=Algorithm.BA)),
        sensor=SensorParams(sectors=16),
        seed=7,
    )


def strict(text: str) -> Any:
    """Parse standard JSON: NaN and Infinity are refused."""

    def refuse(token: str) -> None:
        raise AssertionError(token)

    return json.loads(text, parse_constant=refuse)


def test_a_result_has_the_run_and_its_metrics(episode: Episode) -> None:
    data = result_to_dict(episode, {"wall_s": 1.5})
    assert data["schema_version"] == 1
    assert (data["scenario"], data["seed"], data["driver"]) == ("case2", 7, "core")
    assert data["algorithm"] == "ba"
    assert data["versions"]["mfba_planner"] == __version__
    assert data["extra"] == {"wall_s": 1.5}
    result = evaluate(episode)
    assert data["result"].keys() == {item.name for item in fields(Result)}
    assert data["result"]["outcome"] == "goal_reached"
    assert data["result"]["length_m"] == result.length_m
    assert data["result"]["encounters"] == list(result.encounters)


def test_the_parameters_give_the_same_planner_and_sensor(episode: Episode) -> None:
    parameters = strict(json.dumps(result_to_dict(episode)))["parameters"]
    assert override(PlannerParams(), parameters["planner"]) == episode.planner
    assert override(SensorParams(), parameters["sensor"]) == episode.sensor


def test_a_result_is_read_back_as_written(episode: Episode, tmp_path: Path) -> None:
    data = result_to_dict(episode, {"bag": "runs/ü.mcap", "ticks_per_s": 12.5})
    write_result(tmp_path / "result.json", data)
    assert os.listdir(tmp_path) == ["result.json"]
    assert read_result(tmp_path / "result.json") == data


def test_non_finite_numbers_are_null(tmp_path: Path) -> None:
    empty = run(load_scenario("empty"))
    unmoved = replace(empty, ticks=empty.ticks[:1], outcome=Outcome.INTERRUPTED)
    extra = {"nan": math.nan, "deep": [{"inf": -math.inf}], "numpy": np.float32("inf")}
    write_result(tmp_path / "result.json", result_to_dict(unmoved, extra))
    data = strict((tmp_path / "result.json").read_text())
    assert data["result"]["fitness"] is None
    assert data["result"]["min_clearance_m"] is None
    assert data["result"]["length_m"] == 0.0
    assert data["extra"] == {"nan": None, "deep": [{"inf": None}], "numpy": None}
    assert read_result(tmp_path / "result.json") == data


def test_extra_values_become_plain(episode: Episode) -> None:
    extra: dict[Any, Any] = {
        "path": Path("runs") / "a",
        "outcome": Outcome.TIME_LIMIT,
        "array": np.array([1, 2]),
        "tuple": (1, (2.5, None)),
        3: True,
    }
    assert result_to_dict(episode, extra)["extra"] == {
        "path": os.path.join("runs", "a"),
        "outcome": "time_limit",
        "array": [1, 2],
        "tuple": [1, [2.5, None]],
        "3": True,
    }


def test_an_existing_result_is_not_overwritten(episode: Episode, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_text("mine")
    with pytest.raises(OutputError, match="already exists"):
        write_result(path, result_to_dict(episode))
    assert path.read_text() == "mine"
    assert os.listdir(tmp_path) == ["result.json"]


def test_a_dangling_link_is_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match="already exists"):
        write_new(tmp_path / "link", b"data")
    assert os.listdir(tmp_path) == ["link"]


def test_a_file_that_appears_while_writing_is_not_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "result.json"
    monkeypatch.setattr(os, "fsync", lambda _: path.write_text("mine"))
    with pytest.raises(OutputError, match="already exists"):
        write_new(path, b"data")
    assert path.read_text() == "mine"
    assert os.listdir(tmp_path) == ["result.json"]


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing/result.json", "no such file or directory"),
        ("file/result.json", "not a directory"),
        ("x" * 300 + ".json", "file name too long"),
    ],
)
def test_a_write_failure_gives_one_line_with_the_reason(
    path: str, reason: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=reason) as caught:
        write_new(tmp_path / path, b"data")
    assert len(str(caught.value).splitlines()) == 1
    assert os.listdir(tmp_path) == ["file"]


def test_a_file_that_is_too_large_leaves_nothing_behind(tmp_path: Path) -> None:
    with file_size_limit(1000), pytest.raises(OutputError, match="file too large"):
        write_new(tmp_path / "result.json", b"x" * 100_000)
    assert os.listdir(tmp_path) == []


def test_a_new_file_has_ordinary_permissions(tmp_path: Path) -> None:
    (tmp_path / "ordinary").write_text("")
    write_new(tmp_path / "ours", b"data")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "ordinary").stat().st_mode


def refusal(path: Path) -> str:
    """Return the message (one line) with which a file is refused."""
    with pytest.raises(InputError) as caught:
        read_result(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line


@given(data=st.data())
def test_a_truncated_result_is_refused(
    data: st.DataObject, episode: Episode, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("cut") / "result.json"
    text = json.dumps(result_to_dict(episode))
    path.write_text(text[: data.draw(st.integers(0, len(text) - 1))])
    assert "not JSON, or cut short" in refusal(path)


@given(data=st.binary(max_size=60))
def test_any_bytes_are_refused_in_one_line(
    data: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("any") / "result.json"
    path.write_bytes(data)
    refusal(path)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[1]", "of type list, not a mapping"),
        ("{}", "schema_version=None is unknown"),
        ('{"schema_version": 99}', "schema_version=99 is unknown"),
        ('{"schema_version": NaN}', "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"schema_version": true}', "schema_version is of type bool, not int"),
    ],
)
def test_anything_but_a_result_is_refused(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "r.json").write_text(text)
    assert reason in refusal(tmp_path / "r.json")


def test_a_missing_file_and_a_directory_are_refused(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "r.json")
    assert "is a directory" in refusal(tmp_path)


def test_a_result_with_a_missing_or_wrong_key_is_refused(episode: Episode, tmp_path: Path) -> None:
    good = result_to_dict(episode)
    path = tmp_path / "r.json"
    for key in good.keys() - {"world"}:  # the oldest results have none
        path.write_text(json.dumps({k: v for k, v in good.items() if k != key}))
        assert key in refusal(path)
        path.write_text(json.dumps({**good, key: [1]}))
        assert key in refusal(path)
    for key in good["result"]:
        rest = {k: v for k, v in good["result"].items() if k != key}
        path.write_text(json.dumps({**good, "result": rest}))
        assert f"result.{key} is missing" in refusal(path)
        path.write_text(json.dumps({**good, "result": {**rest, key: "three"}}))
        assert f"result.{key}='three' makes no sense" in refusal(path)
