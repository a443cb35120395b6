# SPDX-License-Identifier: Apache-2.0
"""Read bags back into Episodes: missing and malformed content is named; cut runs are read."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from edited_bags import each_changed, record, rewrite, swapped
from recorded_bags import FOREIGN

from mfba_planner.core.errors import BagError
from mfba_planner.core.option_specs import flatten
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.read_episode import read_episode, summarize
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Outcome
from mfba_planner.simulation.run_episode import run

Change = Callable[[str, Any], Any]  # (topic, message) -> message, or None to remove it


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("episode") / "bag", "empty", 2)


def edited(
    bag: Path, out: Path, change: Change, configure: Callable[[Any], Any] = lambda content: content
) -> Path:
    """A copy with messages and configuration changed."""
    return rewrite(bag, out, each_changed(change), configure=configure)


def keep(_: str, message: Any) -> Any:
    return message


def without(topic: str) -> Change:
    return lambda name, message: None if name == topic else message


def with_value(key: str, value: str) -> Change:
    def change(name: str, message: Any) -> Any:
        if name == "/planner/decision":
            for item in message.status[0].values:
                if item.key == key:
                    item.value = value
        return message

    return change


def test_copy_is_the_same_episode(bag: Path, tmp_path: Path) -> None:
    episode = read_episode(edited(bag, tmp_path / "copy", keep))
    assert episode == read_episode(bag)
    assert episode.ticks == run(load_scenario("empty"), seed=2).ticks
    assert (episode.driver, episode.seed) == ("in-process", 2)


def test_foreign_bag_has_no_configuration() -> None:
    with pytest.raises(BagError, match=r"no mfba_planner/configuration\.json"):
        read_episode(FOREIGN)


@pytest.mark.parametrize("topic", ["/sectors", "/planner/decision"])
def test_a_topic_that_is_missing_is_named(bag: Path, tmp_path: Path, topic: str) -> None:
    with pytest.raises(BagError, match=f"holds no {topic}; give"):
        read_episode(edited(bag, tmp_path / "cut", without(topic)))


def test_a_decision_without_its_sectors_is_named(bag: Path, tmp_path: Path) -> None:
    def cut(name: str, message: Any) -> Any:
        return None if name == "/sectors" and message.header.stamp.sec == 3 else message

    with pytest.raises(BagError, match=r"no sectors at stamp 3\d{9} ns; was the bag edited"):
        read_episode(edited(bag, tmp_path / "cut", cut))


@pytest.mark.parametrize(
    ("key", "value"),
    [("mode", "flying"), ("gap", "x"), ("waypoint", "1,2,3"), ("pose", "1,2"), ("vs", "0a0")],
)
def test_a_malformed_decision_is_refused(bag: Path, tmp_path: Path, key: str, value: str) -> None:
    text = r": planner/decision: missing or malformed .*; was it edited|not a list of points"
    with pytest.raises(BagError, match=text):
        read_episode(edited(bag, tmp_path / "edited", with_value(key, value)))


# What the first bags held. An option that is added later is not in them: NEWER_OPTIONS.
FIRST_OPTIONS = {
    "drive", "max_speed_mps", "max_turn_radps", "max_accel_mps2", "max_turn_accel_radps2",
    "turn_first_rad", "reverse", "speed_mps", "step_length_m", "goal_tolerance_m",
    "input_timeout_s", "gap_heading", "swarm", "bat.algorithm", "bat.population",
    "bat.iterations", "bat.a0", "bat.r0", "bat.alpha", "bat.gamma", "bat.f_min", "bat.f_max",
    "bat.sigma", "bat.rho", "bat.velocity", "bat.schedule", "bat.bounds", "bat.epsilon",
    "bat.initial", "bat.walk", "bat.step", "bat.acceptance", "bat.update", "bat.inertia",
}  # fmt: skip


def test_a_bag_older_than_all_newer_options_was_made_with_their_defaults(
    bag: Path, tmp_path: Path
) -> None:
    def configure(content: Any) -> Any:
        content = json.loads(json.dumps(content))
        planner = content["nodes"]["planner"]
        for name in flatten(PlannerParams()).keys() - FIRST_OPTIONS:
            del planner[name]
        return content

    older, now = read_episode(edited(bag, tmp_path / "older", keep, configure)), read_episode(bag)
    assert older.planner.progress.time_allowance_s == 0.0, "it was off"
    assert replace(older, planner=replace(older.planner, progress=now.planner.progress)) == now


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda c: c["nodes"].pop("planner"), "lacks 'planner'"),
        (lambda c: c["nodes"]["planner"].pop("bat.rho"), "lacks 'bat.rho'"),
        (lambda c: c.pop("run"), "lacks 'run'"),
        (lambda c: c["nodes"]["planner"].update({"bat.population": 1}), "population=1"),
        (lambda c: c["nodes"]["world_sim"].update(scenario_json="{}"), "missing"),
    ],
)
def test_an_incomplete_configuration_is_refused(
    bag: Path, tmp_path: Path, change: Callable[[Any], Any], reason: str
) -> None:
    def configure(content: Any) -> Any:
        content = json.loads(json.dumps(content))
        change(content)
        return content

    with pytest.raises(BagError) as caught:
        read_episode(edited(bag, tmp_path / "odd", keep, configure))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_swapped_decisions_are_sorted(bag: Path, tmp_path: Path) -> None:
    """read_episode sorts them by stamp; summarize streams and refuses them."""
    odd = rewrite(bag, tmp_path / "odd", swapped("/planner/decision", 5))
    assert read_episode(odd).ticks == read_episode(bag).ticks
    with pytest.raises(BagError, match=r"the decision at stamp \d+ ns comes after that at \d+ ns"):
        summarize(odd)


def test_a_repeated_decision_counts_once(bag: Path, tmp_path: Path) -> None:
    def twice(messages: list[Any]) -> Any:
        for message in messages:
            yield from [message] * (2 if message.topic == "/planner/decision" else 1)

    copy = rewrite(bag, tmp_path / "twice", twice)
    assert read_episode(copy) == read_episode(bag)
    assert summarize(copy) == summarize(bag)


def test_the_summary_is_that_of_the_episode(bag: Path) -> None:
    episode, result, found, omitted = summarize(bag)
    whole = read_episode(bag)
    assert (result, found, omitted) == (evaluate(whole), digest(whole.ticks), "")
    assert (episode.outcome, episode.ticks) == (whole.outcome, whole.ticks[-1:])


def test_refused_sectors_give_empty_ranges(bag: Path, tmp_path: Path) -> None:
    """Sectors that the planner refused are not read as free space."""

    def blind(name: str, message: Any) -> Any:
        if name == "/sectors":
            message.ranges = [float("nan")] * 12
        return message

    episode = read_episode(edited(bag, tmp_path / "blind", blind))
    assert {tick.ranges_m for tick in episode.ticks} == {()}


def test_a_run_cut_short_is_interrupted_and_reads_with_salvage(bag: Path, tmp_path: Path) -> None:
    copy = edited(
        bag,
        tmp_path / "short",
        lambda _, m: m if not hasattr(m, "header") or m.header.stamp.sec < 9 else None,
    )
    assert read_episode(copy).outcome is Outcome.INTERRUPTED
    whole = (copy / "short_0.mcap").read_bytes()
    killed = tmp_path / "killed.mcap"
    killed.write_bytes(whole[:-200])
    with pytest.raises(BagError, match="mfba recover"):
        read_episode(killed)
    assert read_episode(killed, salvage=True).ticks == read_episode(copy).ticks


def test_in_real_time_a_run_is_judged_by_where_the_robot_was(bag: Path, tmp_path: Path) -> None:
    """A decision may be on the odometry before: the one at the goal, and any other."""
    episode = read_episode(bag)
    stamps = [tick.stamp_ns for tick in episode.ticks]
    late = (stamps[20], stamps[-1])

    def change(name: str, message: Any) -> Any:
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        if stamp_ns in late:
            before = episode.ticks[stamps.index(stamp_ns) - 1].pose
            values = {item.key: item for item in message.status[0].values}
            values["pose"].value = f"{before.x!r},{before.y!r},{before.yaw!r}"
        return message

    def in_real_time(content: Any) -> Any:
        content["nodes"]["planner"]["lockstep"] = False
        return content

    def of_decisions(name: str, message: Any) -> Any:
        return change(name, message) if name == "/planner/decision" else message

    copy = edited(bag, tmp_path / "late", of_decisions, in_real_time)
    found = read_episode(copy)
    assert found.ticks[20].pose == found.ticks[19].pose
    assert found.outcome is Outcome.GOAL_REACHED
    assert found.truth == tuple(tick.pose for tick in episode.ticks)
    assert evaluate(found).length_m == evaluate(episode).length_m
    summary = summarize(copy)
    assert (summary.episode.outcome, summary.result) == (found.outcome, evaluate(found))
    assert read_episode(bag).truth == (), "in lockstep a decision holds the pose of its stamp"
