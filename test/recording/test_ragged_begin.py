# SPDX-License-Identifier: Apache-2.0
"""Recordings that begin while the graph runs: recorders find topics one after another."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from edited_bags import Edit, one_changed, record, rewrite
from recorded_bags import FOREIGN
from rosbags.rosbag2 import StoragePlugin, Writer
from test_decisions_without_inputs import DECISION, ODOM, SECTORS, STEP, TWIST, VECTOR

from mfba_planner import cli
from mfba_planner.core.errors import BagError
from mfba_planner.recording.bag_reader import BagReader
from mfba_planner.recording.read_episode import read_episode, summarize
from mfba_planner.verification.verify_bag import verify

Capture = pytest.CaptureFixture[str]
EARLY = (ODOM, DECISION, STEP, TWIST, VECTOR, "/obstacles", "/clock", "/plan", "/scan")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("ragged") / "bag", "case1", 2)


@pytest.fixture(scope="module")
def tracking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Decisions of a planner that remembers what it has perceived."""
    out = tmp_path_factory.mktemp("tracking") / "run"
    assert cli.main(["decide", str(FOREIGN), "--out", str(out)]) == 0
    return out / "bag"


def joined_late(first: int, later: Mapping[str, int]) -> Edit:
    """Without the first messages of each topic of ticks, and `later` more of some."""

    def edit(messages: list[Any]) -> list[Any]:
        counts: dict[str, int] = {}
        kept = []
        for message in messages:
            topic = message.topic
            counts[topic] = counts.get(topic, 0) + 1
            skipped = first + later.get(topic, 0) if topic in (*EARLY, SECTORS) else 0
            if counts[topic] > skipped:
                kept.append(message)
        return kept

    return edit


@pytest.mark.parametrize(
    ("later", "omitted", "vanished"),
    [
        ({}, 0, 0),
        ({SECTORS: 3, VECTOR: 3}, 3, 0),
        ({DECISION: 4, STEP: 4}, 0, 4),
        ({TWIST: 5}, 0, 0),
        ({STEP: 5}, 0, 0),
        ({ODOM: 2, SECTORS: 6, TWIST: 1, STEP: 4}, 6, 0),
    ],
)
def test_what_has_no_input_yet_is_left_out_and_named(
    later: dict[str, int], omitted: int, vanished: int, bag: Path, tmp_path: Path, capsys: Capture
) -> None:
    whole = read_episode(bag).ticks
    late = rewrite(bag, tmp_path / "late", joined_late(20, later))
    report = verify(late)
    assert report.is_identical, report.faults
    first = 20 + omitted + vanished
    assert report.recorded == whole[first:]
    assert any("not at tick 0" in note for note in report.notes)
    left_out = (
        f"left out the first {omitted} decisions, up to stamp {whole[first - 1].stamp_ns} ns"
    )
    assert any(note.startswith(left_out) for note in report.notes) == bool(omitted)
    assert read_episode(late).ticks == whole[first:]
    assert summarize(late).result.ticks == len(whole) - first
    table = tmp_path / "table.csv"
    assert cli.main(["export", str(late), str(table)]) == 0
    with table.open() as file:
        assert len(list(csv.DictReader(file))) == len(whole) - first
    note = capsys.readouterr().out
    assert ("left out the first" in note) == bool(omitted)
    assert (f"the first {vanished} sectors have no decision" in note) == bool(vanished)
    assert cli.main(["digest", str(late)]) == 0
    assert cli.main(["report", str(late), "--out", str(tmp_path / "page.html")]) == 0


def test_the_latched_parameters_are_the_configuration_of_a_bag_without_attachment(
    bag: Path, tmp_path: Path
) -> None:
    """As `ros2 bag record` and `ros2 bag convert` leave it; storage is sqlite3 in the second."""
    bare = rewrite(bag, tmp_path / "bare", lambda m: m, configure=lambda _: None)
    unnamed = rewrite(bag, tmp_path / "unnamed", lambda m: m, configure=without_nodes)
    converted = tmp_path / "converted"
    with (
        BagReader(bag) as reader,
        Writer(converted, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer,
    ):
        connections = {
            name: writer.add_connection(
                name,
                topic.type_name,
                msgdef=reader.definitions[topic.type_name].text,
                rihs01=topic.type_hash,
                serialization_format="cdr",
            )
            for name, topic in reader.topics.items()
        }
        for message in reader.messages():
            writer.write(connections[message.topic], message.log_time_ns, message.data)
    whole = verify(bag)
    for path in (bare, unnamed, converted):
        report = verify(path)
        assert report.is_identical
        assert report.digest == whole.digest
        assert report.setup.scenario == whole.setup.scenario
        assert report.setup.planner == whole.setup.planner


def without_nodes(content: Any) -> Any:
    """The configuration as a recorder writes it that was told of no node."""
    return {**content, "nodes": {}}


def test_commands_are_checked_where_all_was_recorded(bag: Path, tmp_path: Path) -> None:
    def faster(twist: Any) -> None:
        twist.linear.x += 0.1

    edits = joined_late(20, {}), one_changed(TWIST, 20, faster)
    late = rewrite(bag, tmp_path / "late", lambda messages: edits[1](list(edits[0](messages))))
    assert f"{TWIST} does not match the decision" in verify(late).faults[0]


def test_a_decision_that_was_changed_is_found_after_a_ragged_begin(
    bag: Path, tmp_path: Path
) -> None:
    def other(decision: Any) -> None:
        next(v for v in decision.status[0].values if v.key == "gap").value = "7"

    edits = joined_late(20, {SECTORS: 3}), one_changed(DECISION, 20, other)
    late = rewrite(bag, tmp_path / "late", lambda messages: edits[1](list(edits[0](messages))))
    report = verify(late)
    assert report.divergence
    assert report.divergence.differing == ("gap",)


def test_what_a_planner_perceived_before_is_not_in_the_bag(
    tracking: Path, tmp_path: Path, capsys: Capture
) -> None:
    assert verify(tracking).is_identical
    late = rewrite(tracking, tmp_path / "late", joined_late(5, {SECTORS: 2}))
    report = verify(late)
    assert report.is_identical
    assert any("before the recording began is not in the bag" in n for n in report.notes)
    assert 20 < len(report.recorded) < 126
    short = joined_late(40, {SECTORS: 2})
    mid = rewrite(tracking, tmp_path / "mid", lambda messages: list(short(messages))[:200])
    with pytest.raises(
        BagError, match="start the recorder before the planner, or send a new goal"
    ):
        cli.main(["verify", str(mid)])
    assert "first difference" not in capsys.readouterr().out
