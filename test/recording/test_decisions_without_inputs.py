# SPDX-License-Identifier: Apache-2.0
"""Decisions whose last inputs are missing are omitted and noted; earlier gaps are refused."""

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from edited_bags import Edit, record, rewrite, swapped
from trio_scenario import TRIO

from mfba_planner import cli
from mfba_planner.core.errors import BagError
from mfba_planner.launcher.console import RunConsole
from mfba_planner.launcher.fleet_result import finish_fleet_run
from mfba_planner.launcher.run_arguments import read_request
from mfba_planner.launcher.run_directory import RunDirectory
from mfba_planner.launcher.run_result import finish_run
from mfba_planner.launcher.run_state import Run
from mfba_planner.launcher.stop_request import StopRequest
from mfba_planner.recording import decisions_with_sectors
from mfba_planner.recording.fleet_topics import NO_NAMESPACE
from mfba_planner.recording.read_episode import read_episode, read_recording, summaries, summarize
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.scenarios.scenario_json import scenario_to_json
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.robot_model import Lidar, Robot
from mfba_planner.verification.verify_bag import verify

SECTORS, VECTOR, ODOM, DECISION = "/sectors", "/sensory_vector", "/odom", "/planner/decision"
TWIST, STEP = "/cmd_vel", "/goal_step"
SENSOR = (SECTORS, VECTOR)  # what virtual_sensor publishes per tick
Capture = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("left_out") / "bag", "empty", 2)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("fleet") / "bag", scenario_to_json(TRIO), 5)


def without(topics: Iterable[str], *indices: int) -> Edit:
    """Remove these messages of each of the topics."""

    def edit(messages: list[Any]) -> list[Any]:
        removed = set()
        for topic in topics:
            positions = [k for k, message in enumerate(messages) if message.topic == topic]
            removed |= {positions[index] for index in indices}
        return [message for k, message in enumerate(messages) if k not in removed]

    return edit


def chained(*edits: Edit) -> Edit:
    def edit(messages: list[Any]) -> list[Any]:
        for next_edit in edits:
            messages = list(next_edit(messages))
        return messages

    return edit


def in_real_time(content: Any) -> Any:
    """The configuration of a run in real time, whose stamps are not checked for gaps."""
    content["nodes"]["planner"]["lockstep"] = False
    return content


def topics_of_c(topics: Iterable[str]) -> list[str]:
    return [f"/c{topic}" for topic in topics]


def expected_note(whole: Episode, count: int, topics: str = SECTORS) -> str:
    stamp = whole.ticks[-count].stamp_ns
    last = "decision" if count == 1 else f"{count} decisions"
    return (
        f"left out the last {last}, from stamp {stamp} ns on: {topics} ended before "
        "(was a node killed?)"
    )


@pytest.mark.parametrize("count", [1, 3])
def test_decisions_after_the_end_of_their_sectors_are_omitted(
    bag: Path, tmp_path: Path, count: int
) -> None:
    cut = rewrite(bag, tmp_path / "cut", without([SECTORS], *range(-count, 0)))
    whole, (_, _, episodes, omitted) = read_episode(bag), read_recording(cut)
    assert episodes[NO_NAMESPACE].ticks == whole.ticks[:-count]
    assert (whole.outcome, episodes[NO_NAMESPACE].outcome) == (
        Outcome.GOAL_REACHED,
        Outcome.INTERRUPTED,
    )
    assert omitted == {NO_NAMESPACE: expected_note(whole, count)}
    assert read_episode(cut) == episodes[NO_NAMESPACE]
    assert summarize(cut)[2:] == (digest(whole.ticks[:-count]), omitted[NO_NAMESPACE])


def test_the_other_robots_of_a_fleet_lose_no_decisions(fleet: Path, tmp_path: Path) -> None:
    cut = rewrite(fleet, tmp_path / "cut", without(topics_of_c([SECTORS]), -1))
    whole, (_, _, episodes, omitted) = read_recording(fleet).episodes, read_recording(cut)
    assert episodes["a"].ticks == whole["a"].ticks
    assert episodes["b"].ticks == whole["b"].ticks
    assert episodes["c"].ticks == whole["c"].ticks[:-1]
    assert episodes["c"].truth == whole["c"].truth[:-1]
    assert omitted == {"c": expected_note(whole["c"], 1)}
    assert [s.omitted for s in summaries(cut).values()] == ["", "", omitted["c"]]
    assert read_recording(cut, ["a"]).omitted == {}


def test_a_bag_that_was_never_closed_is_read_alike(bag: Path, tmp_path: Path) -> None:
    cut = rewrite(bag, tmp_path / "cut", without([SECTORS], -1))
    killed = tmp_path / "killed.mcap"
    killed.write_bytes((cut / "cut_0.mcap").read_bytes()[:-200])
    assert read_recording(killed, salvage=True).omitted == read_recording(cut).omitted != {}


@pytest.mark.parametrize("removed", [(5,), (5, -1), (-2,), tuple(range(1, 6))])
def test_a_gap_is_refused_for_any_missing_end(
    bag: Path, tmp_path: Path, removed: tuple[int, ...]
) -> None:
    cut = rewrite(bag, tmp_path / "cut", without([SECTORS], *removed))
    stamp = read_episode(bag).ticks[removed[0]].stamp_ns
    for read in (read_recording, summarize):
        with pytest.raises(BagError, match=f"cut: no sectors at stamp {stamp} ns; was the bag ed"):
            read(cut)


@pytest.mark.parametrize("from_end", [10, 2])
def test_swapped_sectors_are_no_gap(bag: Path, tmp_path: Path, from_end: int) -> None:
    whole = read_recording(bag)
    index = len(whole.episodes[NO_NAMESPACE].ticks) - from_end
    assert read_recording(rewrite(bag, tmp_path / "odd", swapped(SECTORS, index))) == whole


def test_the_end_is_the_latest_stamp_not_the_last_message(bag: Path, tmp_path: Path) -> None:
    """Of the last three sectors a, b, c the bag holds c, then a: b is missing between them."""
    ticks = read_episode(bag).ticks
    edit = chained(
        swapped(SECTORS, len(ticks) - 2), swapped(SECTORS, len(ticks) - 3), without([SECTORS], -1)
    )
    with pytest.raises(BagError, match=f"no sectors at stamp {ticks[-2].stamp_ns} ns"):
        read_recording(rewrite(bag, tmp_path / "cut", edit))


def test_a_gap_of_one_robot_is_refused_if_the_end_of_another_is_missing(
    fleet: Path, tmp_path: Path
) -> None:
    both = chained(without(["/a/sectors"], 3), without(topics_of_c([SECTORS]), -1))
    cut = rewrite(fleet, tmp_path / "cut", both)
    with pytest.raises(BagError, match=r"cut: a: no sectors at stamp \d+ ns; was the bag edited"):
        read_recording(cut)


def test_a_bag_without_any_pair_is_refused(bag: Path, tmp_path: Path) -> None:
    """The only sectors are of a tick whose decision is missing."""
    ticks = len(read_episode(bag).ticks)
    edit = chained(without(SENSOR, *range(1, ticks)), without([DECISION], 0))
    cut = rewrite(bag, tmp_path / "cut", edit, configure=in_real_time)
    for read in (read_recording, summarize):
        with pytest.raises(BagError, match="no sectors at stamp"):
            read(cut)
    assert len([fault for fault in verify(cut).faults if ": no /sectors" in fault]) == ticks - 1


def test_the_number_of_waiting_decisions_is_limited(
    bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cut = rewrite(bag, tmp_path / "cut", without([SECTORS], *range(-6, 0)))
    read_recording(cut)
    monkeypatch.setattr(decisions_with_sectors, "MAX_WAITING", 5)
    with pytest.raises(BagError, match="no sectors at stamp"):
        read_recording(cut)


@pytest.mark.parametrize(
    ("topics", "named"), [(SENSOR, SECTORS), ([ODOM], ODOM), ((ODOM, *SENSOR), "/sectors, /odom")]
)
@pytest.mark.parametrize("count", [1, 2])
def test_verify_checks_the_remaining_decisions(
    bag: Path, tmp_path: Path, topics: tuple[str, ...], named: str, count: int
) -> None:
    report = verify(rewrite(bag, tmp_path / "cut", without(topics, *range(-count, 0))))
    whole = read_episode(bag)
    assert (report.faults, report.divergence) == ((), None)
    assert report.recorded == whole.ticks[:-count]
    assert report.notes == (expected_note(whole, count, named),)


def test_verify_omits_decisions_on_a_lost_scan(tmp_path: Path) -> None:
    lidar = replace(load_scenario("empty"), robot=Robot(lidar=Lidar(beams=36)))
    whole = record(tmp_path / "bag", scenario_to_json(lidar), 2)

    def tracking(content: Any) -> Any:
        content["nodes"]["planner"] |= {"method": "predictive", "perception": "scan"}
        return content

    for index, noted in ((-1, True), (9, False)):
        cut = rewrite(
            whole, tmp_path / f"cut{index}", without(["/scan"], index), configure=tracking
        )
        report = verify(cut)
        assert any("left out the last decision," in note for note in report.notes) == noted
        assert any(": no /scan" in fault for fault in report.faults) != noted


def test_verify_of_a_run_in_real_time_names_a_gap(bag: Path, tmp_path: Path) -> None:
    with_gap = rewrite(bag, tmp_path / "gap", without(SENSOR, 9), configure=in_real_time)
    stamp = read_episode(bag).ticks[9].stamp_ns
    assert verify(with_gap).faults == (f"stamp {stamp} ns: no /sectors",)
    cut = rewrite(bag, tmp_path / "cut", without(SENSOR, -1), configure=in_real_time)
    report = verify(cut)
    assert report.is_identical
    assert report.notes == (expected_note(read_episode(bag), 1),)


def run_command(capsys: Capture, *args: str | Path) -> tuple[int, str, str]:
    code = cli.main([str(arg) for arg in args])
    return code, *capsys.readouterr()


def test_every_command_prints_the_note(bag: Path, tmp_path: Path, capsys: Capture) -> None:
    cut = rewrite(bag, tmp_path / "cut", without(SENSOR, -1))
    whole = read_episode(bag)
    rest, text = digest(whole.ticks[:-1]), expected_note(whole, 1)
    note, count = f"note: {cut}: {text}\n", len(whole.ticks) - 1
    assert run_command(capsys, "digest", cut) == (0, f"{rest}  {cut}\n", note)
    assert run_command(capsys, "verify", cut, "--closed-loop") == (
        0,
        f"note: {text}\nidentical, {count} decisions, digest {rest}\n"
        f"closed loop: identical, {count} ticks\n",
        "",
    )
    code, out, err = run_command(capsys, "info", cut)
    assert (code, out.endswith(f"digest {rest}\n{note}"), err) == (0, True, "")
    for command, file, more in (
        ("export", "run.csv", f": {count} rows"),
        ("picture", "run.png", ""),
    ):
        written = tmp_path / file
        assert run_command(capsys, command, cut, written) == (
            0,
            f"{note}wrote {written}{more}\n",
            "",
        )
    for command, option, file in (("report", "--out", "x.html"), ("view", "--save", "x.rrd")):
        code, out, err = run_command(capsys, command, cut, option, tmp_path / file)
        assert (code, out, err) == (0, f"{note}wrote {tmp_path / file}\n", "")


def test_commands_name_the_robot_of_a_fleet(fleet: Path, tmp_path: Path, capsys: Capture) -> None:
    cut = rewrite(fleet, tmp_path / "cut", without(topics_of_c(SENSOR), -1))
    whole = read_recording(fleet).episodes
    text = expected_note(whole["c"], 1)
    assert run_command(capsys, "digest", cut)[2] == f"note: {cut}: c: {text}\n"
    assert run_command(capsys, "digest", cut, "--robot", "a")[2] == ""
    code, out, _ = run_command(capsys, "verify", cut, "--closed-loop")
    assert code == 0
    assert f"c: note: {text}\n" in out
    assert f"c: closed loop: identical, {len(whole['c'].ticks) - 1} ticks\n" in out
    rows = sum(len(episode.ticks) for episode in whole.values()) - 1
    assert run_command(capsys, "export", cut, tmp_path / "all.csv")[1] == (
        f"note: {cut}: c: {text}\nwrote {tmp_path / 'all.csv'}: {rows} rows\n"
    )


def failed_run(out: Path, scenario: str) -> Run:
    """A failed run, complete except for its bag."""
    request = read_request([scenario, "--no-picture", "--out", str(out)], "launcher")
    return Run(request, RunDirectory(request.out), RunConsole(), StopRequest(1.0))


def test_a_failed_run_prints_the_note_and_stores_it_in_its_result(
    bag: Path, fleet: Path, tmp_path: Path, capsys: Capture
) -> None:
    single = failed_run(tmp_path / "single", "empty")
    rewrite(bag, single.directory.bag, without(SENSOR, -1))
    finish_run(single, None, "virtual_sensor ended")
    whole = read_episode(bag)
    assert f"note: {single.directory.bag}: {expected_note(whole, 1)}\n" in capsys.readouterr().out
    result = json.loads(single.directory.result.read_text())
    assert result["digest"] == digest(whole.ticks[:-1])
    assert result["extra"]["left_out"] == expected_note(whole, 1)

    (tmp_path / "trio.json").write_text(scenario_to_json(TRIO))
    fleet_run = failed_run(tmp_path / "three", str(tmp_path / "trio.json"))
    rewrite(fleet, fleet_run.directory.bag, without(topics_of_c(SENSOR), -1))
    finish_fleet_run(fleet_run, "c/virtual_sensor ended")
    text = expected_note(read_recording(fleet).episodes["c"], 1)
    assert f"note: {fleet_run.directory.bag}: c: {text}\n" in capsys.readouterr().out
    extras = {n: json.loads((fleet_run.directory.path / f"{n}.json").read_text()) for n in "abc"}
    assert extras["c"]["extra"]["left_out"] == text
    assert not {"left_out"} & (extras["a"]["extra"].keys() | extras["b"]["extra"].keys())


def test_diff_distinguishes_a_bag_with_omitted_decisions(
    bag: Path, tmp_path: Path, capsys: Capture
) -> None:
    """One run ended; the other continued, but its last decisions are unknown."""
    cut = rewrite(bag, tmp_path / "cut", without(SENSOR, -1))
    ended = rewrite(cut, tmp_path / "ended", without([DECISION], -1))
    count = len(read_episode(bag).ticks) - 1
    assert read_recording(ended).omitted == {}
    for left, right, code, how in (
        (cut, ended, 1, "identical but for what is left out"),
        (ended, cut, 1, "identical but for what is left out"),
        (cut, cut, 0, "identical"),
    ):
        found, out, _ = run_command(capsys, "diff", left, right)
        assert (found, f"\n{how}, {count} decisions, " in out) == (code, True)
        assert out.startswith(f"note: {cut}: left out the last decision,")
    code, out, _ = run_command(capsys, "diff", cut, bag)
    assert code == 1
    assert "(ended before)" in out


@pytest.mark.parametrize(
    ("topic", "counts"),
    [
        (VECTOR, f"{VECTOR}: 57 messages for 58 on {SECTORS}"),
        (SECTORS, f"{VECTOR}: 58 messages for 57 on {SECTORS}"),
        (TWIST, f"{TWIST}: 57 messages for 58 on {STEP}"),
        (STEP, f"{TWIST}: 58 messages for 57 on {STEP}"),
    ],
)
def test_verify_accepts_an_unpaired_message_at_the_end_of_a_bag(
    bag: Path, tmp_path: Path, topic: str, counts: str
) -> None:
    """Messages without stamp are paired by sequence: a gap would shift all later pairs."""
    report = verify(rewrite(bag, tmp_path / "cut", without([topic], -1)))
    assert report.is_identical
    assert f"{counts}, and the last one is unpaired (was a node killed?)" in report.notes
    for removed in ([-2], [-2, -1], [9], [9, -1]):
        edited = rewrite(bag, tmp_path / f"edited{removed}", without([topic], *removed))
        assert not verify(edited).is_identical


def test_verify_accepts_a_node_that_ended_before_the_last_tick(bag: Path, tmp_path: Path) -> None:
    planner = [DECISION, STEP, TWIST]
    cut = without(planner, -2, -1)
    assert verify(rewrite(bag, tmp_path / "cut", cut)).is_identical
    for number, index in enumerate((9, -3)):
        edit = without(planner, index, -1)
        faults = verify(rewrite(bag, tmp_path / f"gap{number}", edit)).faults
        assert [fault for fault in faults if "no /goal_step, /planner/decision, /cmd_vel" in fault]
