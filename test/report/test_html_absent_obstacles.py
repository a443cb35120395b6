# SPDX-License-Identifier: Apache-2.0
"""The page of a run shows an obstacle only while it is there."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Browser

from mfba_planner.report.html.page import write_page
from mfba_planner.scenarios.scenario_files import parse_scenario
from mfba_planner.simulation.run_episode import run

TEXT = """
name: recorded
start_m: [0, 0]
goal_m: [6, 0]
obstacles:
  - {radius_m: 0.3, trajectory: [[1, 2.5, -2], [4, 2.5, 2.5]]}
  - {radius_m: 0.3, center_m: [3, 2], vanishes_s: 2.0}
  - {radius_m: 0.3, center_m: [0, 0.2], appears_s: 50}
"""
SHOWN = """
    const slider = document.getElementById('time');
    slider.value = arguments[0];
    slider.dispatchEvent(new Event('input'));
    return [...document.querySelectorAll('g.obstacle')].map((group) =>
      getComputedStyle(group).visibility !== 'hidden');
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.driver.quit()


def test_an_obstacle_is_drawn_only_while_it_is_there(browser: Browser, tmp_path: Path) -> None:
    episode = run(parse_scenario(TEXT, "recorded"), seed=1)
    write_page([("", episode)], tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    for k, tick in enumerate(episode.ticks):
        t = episode.time_s(tick.stamp_ns)
        shown = browser.run(SHOWN, k)
        assert shown == [1.0 <= t <= 4.0, t <= 2.0, False], t
    assert browser.console_messages() == []
