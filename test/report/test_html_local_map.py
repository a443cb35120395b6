# SPDX-License-Identifier: Apache-2.0
"""The page of a run shows the last local map before each tick."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Browser

from mfba_planner.recording.local_maps import MapPoints
from mfba_planner.report.html.map_data import MOST_MAPS, map_data
from mfba_planner.report.html.page import write_page
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.run_episode import run

SHOWN = """
    const slider = document.getElementById('time');
    slider.value = arguments[0];
    slider.dispatchEvent(new Event('input'));
    return document.querySelector('.scene .map').getAttribute('d');
"""


@pytest.fixture(scope="module")
def episode() -> Episode:
    return run(load_scenario("empty"))


def points_of(*points: tuple[float, float]) -> np.ndarray:
    return np.array(points, dtype=np.float32).reshape(-1, 2)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.driver.quit()


def test_each_tick_shows_the_last_map_before_it(
    browser: Browser, episode: Episode, tmp_path: Path
) -> None:
    stamps = [tick.stamp_ns for tick in episode.ticks]
    maps = [
        MapPoints(stamps[3], points_of((1.25, -2.5), (-0.5, 3.0))),
        MapPoints(stamps[6], points_of((4.0, 0.0))),
        MapPoints(stamps[8], points_of()),
    ]
    write_page([("run", episode)], tmp_path / "page.html", maps={"run": maps})
    browser.open(tmp_path / "page.html")
    one, two = "M1.25 2.5h0M-0.5 -3h0", "M4 0h0"
    for tick, drawn in [(0, ""), (2, ""), (3, one), (5, one), (6, two), (8, ""), (4, one)]:
        assert browser.run(SHOWN, tick) == drawn, tick
    assert browser.console_messages() == []


def test_a_page_without_maps_has_none_in_its_key(
    browser: Browser, episode: Episode, tmp_path: Path
) -> None:
    write_page([("run", episode)], tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    assert browser.run(SHOWN, 5) == ""
    key = browser.run("return [...document.querySelectorAll('.legend')].map((e) => e.textContent)")
    assert key
    assert "local map" not in "".join(key)
    assert browser.console_messages() == []


def test_a_long_run_has_a_choice_of_its_maps_with_the_last(episode: Episode) -> None:
    stamps = [tick.stamp_ns for tick in episode.ticks]
    assert len(stamps) > 20
    step = (stamps[-1] - stamps[0]) // (4 * MOST_MAPS)
    maps = [
        MapPoints(stamps[0] + k * step, points_of((0.01 * k, 0.0))) for k in range(4 * MOST_MAPS)
    ]
    shown = map_data(episode, maps)
    assert 0.9 * MOST_MAPS <= len(shown) <= MOST_MAPS
    assert shown[-1]["points"] == [4 * MOST_MAPS - 1, 0]
    ticks = [found["tick"] for found in shown]
    assert ticks == sorted(ticks)
    late = MapPoints(stamps[-1] + 1, points_of((0.0, 0.0)))
    assert map_data(episode, [late]) == [], "no decision follows it"
    assert map_data(episode, []) == []
