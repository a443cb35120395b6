# SPDX-License-Identifier: Apache-2.0
"""Pictures, page and markers show the circles of a footprint where the robot has them."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from trip_samples import trip

from mfba_planner.report import legend
from mfba_planner.report.draw_tick import draw_snapshot
from mfba_planner.report.html.page import write_page
from mfba_planner.report.html.page_data import page_data
from mfba_planner.report.run_events import closest_passes
from mfba_planner.report.run_figure import run_figure
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.footprint import parse_footprint
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.robot_model import Robot
from mfba_planner.simulation.scenario import Scenario

TIP, BODY = (0.4, 0.0, 0.1), (0.0, 0.0, 0.3)
DRAWN = """
    const slider = document.getElementById('time');
    slider.value = arguments[0];
    slider.dispatchEvent(new Event('input'));
    const svg = document.querySelector('g.robot').ownerSVGElement;
    return [...document.querySelectorAll('g.robot .outline')].map((circle) => {
      const [x, y, r] = ['cx', 'cy', 'r'].map((name) => circle[name].baseVal.value);
      const at = new DOMPoint(x, y).matrixTransform(
        circle.parentNode.transform.baseVal.consolidate().matrix);
      return [at.x, -at.y, r].map((value) => Math.round(1000 * value) / 1000);
    });
"""


@pytest.fixture
def episode() -> Episode:
    """Along x, the heading 3.0 rad and more, past an obstacle on the left."""
    scenario = Scenario(
        name="x",
        start_m=(0.0, 0.0),
        goal_m=(0.0, 9.0),
        robot_radius_m=0.5,
        robot=Robot(footprint_m=parse_footprint([TIP, BODY])),
        obstacles=(Obstacle(center_m=(1.0, -0.8), radius_m=0.2),),
    )
    found = trip([(float(k), 0.0) for k in range(4)])
    turned = [replace(t, pose=t.pose._replace(yaw=yaw)) for t, yaw in zip(found.ticks, YAWS)]
    return replace(found, scenario=scenario, ticks=tuple(turned))


YAWS = (3.0, -0.5 * math.pi, -3.0, 3.0)


def circles(figure: Figure) -> list[tuple[float, float, float]]:
    shapes = [p for p in figure.axes[0].patches if (p.get_gid() or "").split(":")[0] == "robot"]
    return [(*p.center, p.radius) for p in shapes if isinstance(p, Circle)]  # type: ignore[misc]


def test_a_tick_shows_the_circles(episode: Episode) -> None:
    figure = Figure()
    draw_snapshot(figure.add_subplot(), episode, 1)
    expected = [(1.0, -0.4, 0.1), (1.0, 0.0, 0.3)]
    assert [pytest.approx(circle, abs=1e-9) for circle in expected] == circles(figure)


def test_the_picture_shows_them_at_the_closest_pass(episode: Episode) -> None:
    (moment,) = closest_passes(episode)
    assert moment.gap_m == pytest.approx(0.1, abs=1e-6)
    assert moment.robot == pytest.approx((1.0, 0.0, -0.5 * math.pi))
    figure = run_figure(episode)
    assert len(circles(figure)) == 2
    assert "robot" in [label for _, label in legend.entries(figure.axes[0])]
    (line,) = [a for a in figure.axes[0].lines if a.get_gid() == "pass:1"]
    assert np.ravel(line.get_xydata()).tolist() == pytest.approx([1.0, -0.5, 1.0, -0.6], abs=1e-6)
    disc = replace(episode, scenario=replace(episode.scenario, robot=Robot()))
    assert circles(run_figure(disc)) == []


def test_the_page_holds_circles_and_headings(episode: Episode) -> None:
    (run,) = page_data([("", episode)], "0")["runs"]
    assert run["world"]["footprint"] == [list(TIP), list(BODY)]
    yaws = run["ticks"]["yaw"]
    assert [round(math.remainder(a - b, math.tau), 3) for a, b in zip(yaws, YAWS)] == [0.0] * 4
    assert max(abs(b - a) for a, b in zip(yaws, yaws[1:])) < math.pi, "no turn of a full circle"
    lost = replace(episode.ticks[1], pose=episode.ticks[1].pose._replace(yaw=math.inf))
    refused = replace(episode, ticks=(episode.ticks[0], lost, *episode.ticks[2:]))
    assert page_data([("", refused)], "0")["runs"][0]["ticks"]["yaw"][1] is None
    disc = replace(episode, scenario=replace(episode.scenario, robot=Robot()))
    (run,) = page_data([("", disc)], "0")["runs"]
    assert (run["world"]["footprint"], run["ticks"]["yaw"]) == ([], [])


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.driver.quit()


def test_the_page_draws_them(browser: Browser, episode: Episode, tmp_path: Path) -> None:
    write_page([("", episode)], tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    assert browser.run(DRAWN, 1) == [[1.0, -0.4, 0.1], [1.0, 0.0, 0.3]]
    assert browser.console_messages() == []
