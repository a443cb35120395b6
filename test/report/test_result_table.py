# SPDX-License-Identifier: Apache-2.0
"""The result table: values and remarks; in terminals, logs, narrow, without colour or UTF-8."""

import io
import math
import re
from dataclasses import replace

import pytest
from rich.console import Console

from mfba_planner.evaluation.metrics import Result, evaluate
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.report.result_table import print_result, result_rows, result_text
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

Rows = dict[str, tuple[str, str]]


@pytest.fixture(scope="module")
def episode() -> Episode:
    """Return case study 2."""
    return run(load_scenario("case2"))


def rows(episode: Episode, result: Result | None = None, rate: float | None = None) -> Rows:
    """Return {name: (value, remark)}."""
    found = result_rows(episode, result or evaluate(episode), rate)
    return {name: (value, remark) for name, value, remark in found}


def test_every_value_has_its_line(episode: Episode) -> None:
    result = evaluate(episode)
    table = rows(episode, result, rate=1234.5)
    straight = math.sqrt(288.0)
    excess = 100.0 * (result.length_m / straight - 1.0)
    assert table == {
        "outcome": ("goal reached", ""),
        "length": (f"{result.length_m:.3f} m", f"straight line 16.971 m ({excess:+.1f} %)"),
        "time": (f"{result.time_s:.2f} s", "simulated"),
        "fitness": (f"{1.0 / result.length_m:.6f} 1/m", "1 / length"),
        "min clearance": (f"{result.min_clearance_m:.3f} m", "edge to edge"),
        "collisions": ("0", ""),
        "encounters": ("3", "obstacles 1, 2, 5"),
        "mode switches": (str(result.mode_switches), f"ticks: {result.avoidance_ticks} avoiding"),
        "ticks": (str(len(episode.ticks)), "1234 ticks/s"),
    }


def test_the_rate_is_shown_only_if_known(episode: Episode) -> None:
    assert rows(episode)["ticks"] == (str(len(episode.ticks)), "")


def test_an_unfinished_run_is_not_compared_with_the_straight_line() -> None:
    stopped = run(replace(load_scenario("case2"), time_limit_s=5.0))
    table = rows(stopped)
    assert table["outcome"] == ("time limit", "")
    assert table["length"][1] == "straight line 16.971 m"


def test_a_collision_before_the_goal_is_reported() -> None:
    bullet = Obstacle(center_m=(11.0, 0.0), radius_m=0.3, speed_mps=1.5, heading_rad=math.pi)
    scenario = Scenario(name="hit", start_m=(0.0, 0.0), goal_m=(12.0, 0.0), obstacles=(bullet,))
    table = rows(run(scenario))
    assert table["outcome"] == ("goal reached", "but not without collision")
    assert table["collisions"][0] == "1"
    assert table["min clearance"][0].startswith("-")


def test_values_that_do_not_exist_are_words() -> None:
    empty = run(load_scenario("empty"))
    table = rows(replace(empty, ticks=empty.ticks[:1], outcome=Outcome.INTERRUPTED))
    assert table["min clearance"] == ("no obstacle", "")
    assert table["fitness"][0] == "never moved"
    assert table["encounters"] == ("0", "")
    assert table["mode switches"] == ("0", "")


@pytest.mark.parametrize("width", [40, 60, 80, 200])
def test_plain_text_fits_and_has_every_value(episode: Episode, width: int) -> None:
    text = result_text(episode, evaluate(episode), 1234.5, width=width)
    assert text.isascii()
    assert text.replace("\n", "").isprintable()
    lines = text.splitlines()
    assert lines[0] == "case2, mfba, seed 0, core driver"
    assert max(map(len, lines)) <= width
    assert [line for line in lines if line != line.rstrip()] == []
    for name, (value, _) in rows(episode).items():
        assert re.search(rf"^ +{name} +{re.escape(value)}( |$)", text, re.MULTILINE)


def printed(episode: Episode, *, encoding: str = "utf-8", terminal: bool = False) -> str:
    """Print to a stream of this encoding, with colours or without, and return the text."""
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    console = Console(
        file=stream,
        width=80,
        force_terminal=terminal,
        color_system="standard" if terminal else None,
    )
    print_result(console, episode, evaluate(episode))
    return raw.getvalue().decode(encoding)


def test_success_is_green_and_failure_red_in_a_terminal_only(episode: Episode) -> None:
    green, red = "\x1b[1;32mgoal reached", "\x1b[1;31mtime limit"
    assert green in printed(episode, terminal=True)
    assert red in printed(replace(episode, outcome=Outcome.TIME_LIMIT), terminal=True)
    assert "\x1b" not in printed(episode)


def test_a_name_is_printed_as_text_in_any_encoding() -> None:
    name = "f\u00e4ll [red]\x1b[31m\nzwei \u8d70"
    episode = replace(
        run(load_scenario("empty")), scenario=replace(load_scenario("empty"), name=name)
    )
    assert printed(episode).startswith("fäll [red] [31m zwei 走, mfba, seed 0")
    assert printed(episode, encoding="ascii").startswith("f?ll [red] [31m zwei ?, mfba, seed 0")
    assert "\x1b" not in printed(episode)


def test_long_names_and_seeds_are_cut() -> None:
    scenario = replace(load_scenario("empty"), name="n" * 100)
    episode = run(scenario, planner=PlannerParams(), seed=10**60)
    title, _, _ = result_text(episode, evaluate(episode), width=200).partition("outcome")
    words = title.split()
    assert words[0] == "n" * 37 + "...,"
    assert words[1:4] == ["mfba,", "seed", "1" + "0" * 20 + "...,"]


def test_of_a_recorded_drive_contacts_are_unknown(episode: Episode) -> None:
    """Where the obstacles were is not recorded, so that there were none must not be said."""
    table = rows(replace(episode, start_ns=1))
    assert table["time"][1] == "recorded"
    for name in ("min clearance", "collisions", "encounters"):
        assert table[name] == ("unknown", "not in the recording")
