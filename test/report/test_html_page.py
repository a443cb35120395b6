# SPDX-License-Identifier: Apache-2.0
"""The HTML page of runs in a real browser: content, replay, keyboard, themes, safety."""

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from browser import Browser
from launched_programs import complete
from project import ROOT
from selenium.webdriver.common.keys import Keys
from waiting import wait_until
from walled_place import PLACE

from mfba_planner.core.errors import InputError, OutputError
from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.metrics import evaluate, tick_clearances
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.gap_vector import gap_heading
from mfba_planner.planning.planner_params import Method, PlannerParams
from mfba_planner.planning.predictive_planner import preset
from mfba_planner.recording.read_episode import read_episode
from mfba_planner.report import format_values
from mfba_planner.report.html.charts import look
from mfba_planner.report.html.page import as_json, page, write_page
from mfba_planner.report.html.page_data import MOST_ROBOTS, MOST_RUNS, clearances
from mfba_planner.report.result_table import result_rows
from mfba_planner.report.run_events import closest_passes
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.robot_model import Noise
from mfba_planner.simulation.run_episode import run, simulate


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    opened = Browser(tmp_path_factory.mktemp("profile"))
    yield opened
    opened.driver.quit()


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a recorded run of case 2."""
    directory = tmp_path_factory.mktemp("recorded")
    done = complete(
        "mfba",
        "run",
        "case2",
        "--seed=2",
        "--planner=paper",
        "--driver=in-process",
        "--no-picture",
        cwd=directory,
    )
    assert (done.process.returncode, done.stderr) == (0, "")
    return directory / "runs/run-001"


@pytest.fixture(scope="module")
def episode(bag: Path) -> Episode:
    return read_episode(bag / "bag")


@pytest.fixture(scope="module")
def single(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of that run, made by `mfba report`."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    done = complete("mfba", "report", str(bag), "--out", str(path), cwd=path.parent)
    assert (done.process.returncode, done.stdout, done.stderr) == (0, f"wrote {path}\n", "")
    return path


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Episode]]:
    """Two runs of unequal length, one of them in a world with walls."""
    runs = [run(load_scenario("walled"), seed=1), run(load_scenario("case1"), seed=3)]
    path = tmp_path_factory.mktemp("pair") / "page.html"
    write_page([("walled run", runs[0]), ("other run", runs[1])], path)
    return path, runs


def field(browser: Browser, name: str, number: int = 1) -> str:
    selector = f'.card[data-run="{number}"] [data-field="{name}"]'
    return str(browser.run("return document.querySelector(arguments[0]).textContent", selector))


def bits(browser: Browser, name: str, number: int = 1) -> str:
    selector = f'.card[data-run="{number}"] [data-field="{name}"]'
    return str(browser.run("return document.querySelector(arguments[0]).dataset.bits", selector))


def tick(browser: Browser, number: int = 1) -> int:
    return int(field(browser, "tick", number).split()[0])


def scrub(browser: Browser, value: int) -> None:
    browser.run(
        "const slider = document.getElementById('time'); slider.value = arguments[0];"
        "slider.dispatchEvent(new Event('input'))",
        value,
    )


def press(browser: Browser, *keys: str) -> None:
    browser.driver.switch_to.active_element.send_keys(*keys)


def test_it_opens_fast_without_requests_or_console_messages(
    browser: Browser, single: Path
) -> None:
    assert single.stat().st_size < 6_000_000
    browser.open(single)
    assert browser.console_messages() == []
    asked = {url for url in browser.requested() if not url.startswith("data:")}
    assert asked - {"about:blank"} == {single.as_uri()}
    ready_ms = browser.run("return performance.getEntriesByName('mfba-ready')[0].startTime")
    assert ready_ms < 2000.0
    assert browser.run("return document.title") == "case2"


def test_it_has_no_links_and_no_local_paths(single: Path, bag: Path) -> None:
    text = single.read_text(encoding="utf-8")
    addresses = set(re.findall(r"https?://[^\s\"'<>)\\]*", text))
    assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert "default-src 'none'" in text
    assert str(bag.parent) not in text
    assert str(ROOT) not in text


def test_every_tick_shows_the_decision_in_the_bag(
    browser: Browser, single: Path, episode: Episode
) -> None:
    browser.open(single)
    gaps = clearances(episode)
    modes = set()
    for k, decision in enumerate(episode.ticks):
        scrub(browser, k)
        modes.add(decision.mode)
        assert field(browser, "tick") == f"{k} of {len(episode.ticks) - 1}"
        assert field(browser, "mode") == format_values.MODES[decision.mode]
        assert field(browser, "reason") == decision.reason
        assert bits(browser, "vs") == "".join(map(str, decision.vs))
        assert bits(browser, "vg") == "".join(map(str, decision.vg))
        x, y = decision.pose.position
        assert field(browser, "position") == f"({x:.3f}, {y:.3f}) m"
        assert field(browser, "time") == f"{episode.time_s(decision.stamp_ns):.3f} s"
        last = k == len(episode.ticks) - 1
        assert field(browser, "clearance") == ("–" if last else f"{gaps[k]:.3f} m")
    assert {Mode.PATH_GENERATION, Mode.OBSTACLE_AVOIDANCE, Mode.ARRIVED} <= modes
    assert min(gaps) == evaluate(episode).min_clearance_m


def test_the_world_is_drawn_as_at_the_tick(
    browser: Browser, single: Path, episode: Episode
) -> None:
    browser.open(single)
    k = next(i for i, t in enumerate(episode.ticks) if t.mode is Mode.OBSTACLE_AVOIDANCE)
    scrub(browser, k)
    decision = episode.ticks[k]
    drawn = browser.run(
        """
        const one = (name) => document.querySelector(`.scene ${name}`);
        const all = (name) => [...document.querySelectorAll(`.scene ${name}`)];
        const position = (element) =>
          element.getAttribute("transform").match(/-?[\\d.]+(e-\\d+)?/g).slice(0, 2).map(Number);
        return {
          robot: position(one(".robot")),
          set: all(".sector").map((s) => Number(s.classList.contains("set"))),
          closed: all(".gap").map((g) => Number(g.classList.contains("closed"))),
          chosen: one(".chosen-gap").getAttribute("d"),
          inside: all(".sector").map((sector, i, { length }) => {
            const middle = (2 * Math.PI * (i + 0.5)) / length;
            return sector.isPointInFill(
              new DOMPoint(0.5 * Math.cos(middle), -0.5 * Math.sin(middle)));
          }),
          motions: all(".obstacle .motion").map((m) => m.getAttribute("d")),
          obstacles: all(".obstacle").map(position),
          radii: all(".obstacle .body").map((c) => Number(c.getAttribute("r"))),
          enlarged: all(".obstacle .enlarged").map((c) => Number(c.getAttribute("r"))),
          ring: Number(one(".ring").getAttribute("r")),
          bats: all(".bats circle").length,
        };
        """
    )
    assert drawn["robot"] == pytest.approx([decision.pose.x, -decision.pose.y])
    assert tuple(drawn["set"]) == decision.vs
    assert tuple(drawn["closed"]) == decision.vg
    heading = gap_heading(decision.gap, len(decision.vg), episode.planner.gap_heading)
    tip = [float(word) for word in drawn["chosen"].removeprefix("M0 0L").split()]
    reach = episode.sensor.sensing_range_m
    assert tip == pytest.approx([reach * math.cos(heading), -reach * math.sin(heading)])
    assert drawn["inside"] == [True] * len(decision.vs)
    for obstacle, arrow in zip(episode.scenario.obstacles, drawn["motions"], strict=True):
        x0, y0, x1, y1 = map(float, arrow[1:].split("M")[0].replace("L", " ").split())
        vx, vy = obstacle.velocity  # in case 2 no obstacle bounces or turns
        assert [x1 - x0, y0 - y1] == pytest.approx([2.0 * vx, 2.0 * vy], abs=1e-3)
    centers = episode.scenario.centers(episode.time_s(decision.stamp_ns))
    assert drawn["obstacles"] == [pytest.approx([x, -y], abs=1e-3) for x, y in centers]
    assert drawn["radii"] == [o.radius_m for o in episode.scenario.obstacles]
    assert drawn["enlarged"] == pytest.approx(
        [episode.scenario.enlarged_radius(o) for o in episode.scenario.obstacles]
    )
    assert drawn["ring"] == episode.sensor.sensing_range_m
    assert drawn["bats"] == len(decision.candidates)


def test_bits_of_headings_are_drawn_at_their_headings(browser: Browser, tmp_path: Path) -> None:
    planner = preset(PlannerParams(method=Method.PREDICTIVE))
    episode = simulate(load_scenario("case2"), planner=planner, sensor=SensorParams(), seed=2)
    write_page([("run", episode)], tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    k = next(i for i, tick in enumerate(episode.ticks) if tick.gap > 12)
    scrub(browser, k)
    decision = episode.ticks[k]
    n = len(decision.vs)
    assert n == 72
    assert browser.console_messages() == []
    assert bits(browser, "vs") == "".join(map(str, decision.vs))
    assert field(browser, "vs").replace(" ", "") == "".join(map(str, decision.vs))
    drawn = browser.run(
        """
        const all = [...document.querySelectorAll(".scene .sector")];
        const inside = (wedge, angle) => wedge.isPointInFill(
          new DOMPoint(0.5 * Math.cos(angle), -0.5 * Math.sin(angle)));
        const heading = (i) => (2 * Math.PI * (i + 1)) / all.length;
        const quarter = Math.PI / 2 / all.length;
        return {
          set: all.map((wedge) => Number(wedge.classList.contains("set"))),
          middle: all.every((wedge, i) => inside(wedge, heading(i) - quarter)
            && inside(wedge, heading(i) + quarter)),
          chosen: document.querySelector(".scene .chosen-gap").getAttribute("d"),
        };
        """
    )
    assert tuple(drawn["set"]) == decision.vs
    assert drawn["middle"]
    heading, reach = 2.0 * math.pi * decision.gap / n, episode.sensor.sensing_range_m
    tip = [float(word) for word in drawn["chosen"].removeprefix("M0 0L").split()]
    assert tip == pytest.approx([reach * math.cos(heading), -reach * math.sin(heading)])


def test_replay_plays_and_pauses(browser: Browser, single: Path) -> None:
    browser.open(single)
    browser.run("document.getElementById('speed').value = '16'")
    browser.run("document.getElementById('speed').dispatchEvent(new Event('change'))")
    play = browser.driver.find_element("id", "play")
    assert play.get_attribute("aria-label") == "Play"
    play.click()
    assert play.get_attribute("aria-label") == "Pause"
    wait_until(lambda: tick(browser) > 3, 20.0)
    play.click()
    held = tick(browser)
    browser.driver.execute_async_script(
        "let left = 5; const done = arguments[0];"
        "const turn = () => (left-- ? requestAnimationFrame(turn) : done()); turn()"
    )
    assert tick(browser) == held
    play.click()
    wait_until(lambda: play.get_attribute("aria-label") == "Play", 30.0)
    assert field(browser, "tick").split()[0] == field(browser, "tick").split()[-1]
    assert field(browser, "mode") == "arrived"


POSITIONS = """
const done = arguments[0];
const positions = [];
const robot = document.querySelector(".scene .robot");
const turn = () => {
  positions.push(robot.getAttribute("transform").slice(10, -1).split(" ").map(Number));
  const isOver = document.getElementById("play").dataset.icon === "play";
  if (isOver || positions.length > 400) done(positions); else requestAnimationFrame(turn);
};
document.getElementById("play").click();
turn();
"""


@pytest.mark.parametrize("reduced_motion", [False, True], ids=["smooth", "reduced"])
def test_positions_are_interpolated_unless_motion_is_reduced(
    browser: Browser, single: Path, episode: Episode, reduced_motion: bool
) -> None:
    browser.open(single, reduced_motion=reduced_motion)
    scrub(browser, len(episode.ticks) - 4)
    positions = {(x, y) for x, y in browser.driver.execute_async_script(POSITIONS)}
    at_ticks = {(t.pose.x, -t.pose.y) for t in episode.ticks}
    assert (positions <= at_ticks) == reduced_motion
    assert len(positions) >= 4


def test_it_is_controlled_by_keyboard(browser: Browser, single: Path, episode: Episode) -> None:
    browser.open(single)
    last = len(episode.ticks) - 1
    press(browser, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert tick(browser) == 2
    press(browser, Keys.ARROW_LEFT)
    assert tick(browser) == 1
    press(browser, Keys.END)
    assert tick(browser) == last
    press(browser, Keys.ARROW_RIGHT)
    assert tick(browser) == last
    press(browser, Keys.HOME)
    assert tick(browser) == 0
    press(browser, "+", "+", "-", "+")
    assert browser.run("return document.getElementById('speed').value") == "4"
    press(browser, Keys.SPACE)
    wait_until(lambda: tick(browser) > 1, 20.0)
    press(browser, Keys.SPACE)
    held = tick(browser)
    press(browser, Keys.ARROW_RIGHT)
    assert tick(browser) == held + 1
    # With the slider focused each key acts once, as without focus.
    browser.run("document.getElementById('time').focus()")
    press(browser, Keys.ARROW_LEFT)
    assert tick(browser) == held
    announced = browser.run(
        "return document.getElementById('time').getAttribute('aria-valuetext')"
    )
    assert announced.endswith(episode.ticks[held].reason)


def test_every_control_has_a_name_and_can_be_focused(browser: Browser, single: Path) -> None:
    browser.open(single)
    browser.run("document.querySelector('details').open = true")
    names = browser.run(
        """
        const all = "button, input, select, summary, [tabindex]";
        return [...document.querySelectorAll(all)].map((e) => {
          e.focus();
          return document.activeElement === e && (e.getAttribute("aria-label") || e.textContent);
        });
        """
    )
    assert len(names) >= 10
    assert all(names)


def test_the_charts_show_and_set_the_time(
    browser: Browser, single: Path, episode: Episode
) -> None:
    browser.open(single)
    cursor = "return document.querySelector('#charts .cursor').getAttribute('d')"
    at_start = browser.run(cursor)
    press(browser, Keys.END)
    assert browser.run(cursor) != at_start
    browser.run(
        """
        const chart = document.getElementById("charts");
        chart.scrollIntoView({ block: "center" });
        const sheet = shownSheet();
        function shownSheet() {
          const all = JSON.parse(document.getElementById("data").textContent).charts;
          return all.filter((sheet) => sheet.from_px <= chart.clientWidth).pop();
        }
        const box = chart.getBoundingClientRect();
        const fraction = sheet.left + 0.5 * (sheet.right - sheet.left);
        chart.dispatchEvent(new PointerEvent("pointerdown",
          { clientX: box.left + fraction * box.width, clientY: box.top + 50, buttons: 1 }));
        """
    )
    times = [episode.time_s(t.stamp_ns) for t in episode.ticks]
    middle = 0.5 * (times[0] + times[-1])
    assert tick(browser) == min(range(len(times)), key=lambda k: abs(times[k] - middle))


def test_the_result_is_that_of_result_rows(
    browser: Browser, single: Path, episode: Episode
) -> None:
    browser.open(single)
    shown = browser.run(
        """
        return [...document.querySelectorAll('[aria-label="Result"] tr')].map((row) =>
          [row.querySelector("th"), row.querySelector("td span"), row.querySelector("td small")]
            .map((cell) => (cell ? cell.textContent : "")));
        """
    )
    assert [tuple(row) for row in shown] == list(result_rows(episode, evaluate(episode)))
    text = browser.run("return document.body.textContent")
    assert digest(episode.ticks) in text
    assert "planner.speed_mps" in text


def luminance(colour: str) -> float:
    """WCAG 2's relative luminance of a computed colour, 'rgb(r, g, b)'."""
    channels = [int(number) / 255.0 for number in re.findall(r"\d+", colour)[:3]]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


TEXTS = """
const behind = (element) => {
  for (let e = element; e; e = e.parentElement) {
    const colour = getComputedStyle(e).backgroundColor;
    if (!/, 0\\)$/.test(colour) && colour !== "transparent") return colour;
  }
};
const texts = [];
for (const element of document.querySelectorAll("body *")) {
  const hasText = [...element.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
  const isHidden = element.closest(".visually-hidden") || !element.getClientRects().length;
  if (!hasText || isHidden) continue;
  const style = getComputedStyle(element);
  const isDrawn = element instanceof SVGElement;
  const ink = isDrawn ? style.fill : style.color;
  texts.push([element.textContent.trim().slice(0, 30), ink,
    behind(isDrawn ? element.closest("svg").parentElement : element)]);
}
return texts;
"""


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_every_text_has_contrast(browser: Browser, single: Path, dark: bool) -> None:
    browser.open(single, dark=dark)
    assert browser.run("return document.documentElement.dataset.theme") == (
        "dark" if dark else "light"
    )
    browser.run("document.querySelector('details').open = true")
    texts = browser.run(TEXTS)
    assert len(texts) > 80
    paper = {luminance(paper) < 0.2 for _, _, paper in texts if paper.startswith("rgb")}
    assert dark in paper
    for text, ink, behind in texts:
        light, dim = sorted((luminance(ink), luminance(behind)), reverse=True)
        assert (light + 0.05) / (dim + 0.05) >= 4.5, (text, ink, behind)


def test_the_theme_can_be_switched(browser: Browser, single: Path) -> None:
    browser.open(single)
    paper = "return getComputedStyle(document.body).backgroundColor"
    before = luminance(browser.run(paper))
    browser.driver.find_element("id", "theme").click()
    assert luminance(browser.run(paper)) < 0.1 < before


@pytest.mark.parametrize("width", [320, 390, 768, 1400])
def test_nothing_overflows_sideways(
    browser: Browser, single: Path, pair: tuple[Path, list[Episode]], width: int
) -> None:
    for path in (single, pair[0]):
        browser.open(path, width=width, height=844)
        browser.run("document.querySelector('details').open = true")
        assert browser.run("return document.documentElement.scrollWidth") <= width
        small = browser.run(
            """
            return [...document.querySelectorAll("button, select")].filter((e) => {
              const box = e.getBoundingClientRect();
              return box.right > innerWidth || box.width < 24 || box.height < 24;
            }).length;
            """
        )
        assert small == 0


def test_two_runs_are_side_by_side_with_one_clock(
    browser: Browser, pair: tuple[Path, list[Episode]]
) -> None:
    path, runs = pair
    browser.open(path)
    boxes = browser.run(
        "return [...document.querySelectorAll('.card')].map((e) => e.getBoundingClientRect().top)"
    )
    assert len(boxes) == 2
    assert boxes[0] == boxes[1]
    for number in (1, 2):
        assert tick(browser, number) == 0
    lengths = [len(episode.ticks) for episode in runs]
    assert lengths[0] != lengths[1]
    scrub(browser, 10)
    for number, episode in enumerate(runs, start=1):
        decision = episode.ticks[10]
        assert field(browser, "reason", number) == decision.reason
    press(browser, Keys.END)
    assert [tick(browser, number) for number in (1, 2)] == [n - 1 for n in lengths]
    columns = browser.run(
        """
        return [...document.querySelectorAll('[aria-label="Result"] tbody tr')].map((row) =>
          [...row.querySelectorAll("td span")].map((cell) => cell.textContent));
        """
    )
    for column, episode in enumerate(runs):
        rows = result_rows(episode, evaluate(episode))
        assert [cells[column] for cells in columns] == [value for _, value, _ in rows]


def test_a_fleet_is_one_scene_of_the_chosen_robot(browser: Browser, tmp_path: Path) -> None:
    whole = load_scenario("swap")
    names = [member.name for member in whole.robots[:8]]
    runs = list(zip(names, run_fleet(replace(whole, robots=whole.robots[:8]), seed=1)))
    write_page(runs, tmp_path / "fleet.html", names)
    browser.open(tmp_path / "fleet.html")
    assert browser.console_messages() == []
    heading = browser.run("return document.querySelector('h1').textContent")
    assert heading == "swap"
    assert shown_cards(browser) == ["1"]
    assert browser.run("return document.getElementById('robot').value") == "0"
    first = min(range(8), key=lambda number: len(runs[number][1].ticks))
    longest = max((episode for _, episode in runs), key=lambda episode: len(episode.ticks))
    assert len(longest.ticks) > len(runs[first][1].ticks) + 2
    browser.run(
        "const list = document.getElementById('robot'); list.value = arguments[0];"
        "list.dispatchEvent(new Event('change'))",
        first,
    )
    assert shown_cards(browser) == [str(first + 1)]
    assert highlighted_lines(browser) == {f"line-{first + 1}"}
    # This robot has arrived, the slowest has not: each is shown at its position at that time.
    scrub(browser, len(longest.ticks) - 2)
    assert tick(browser, first + 1) == len(runs[first][1].ticks) - 1
    selector = f'.card[data-run="{first + 1}"] .other[data-name="{{}}"]'
    for name, episode in runs:
        if name != names[first]:
            moved = browser.run(
                "return document.querySelector(arguments[0]).getAttribute('transform')",
                selector.format(name),
            )
            x, y = map(float, re.findall(r"-?[\d.]+(?:e-?\d+)?", moved))
            at = episode.ticks[min(len(longest.ticks) - 2, len(episode.ticks) - 1)].pose
            assert (x, -y) == pytest.approx(at.position, abs=1e-3)
    # A press on another robot chooses that robot.
    other = (first + 3) % 8
    browser.run(
        "document.querySelector(arguments[0]).querySelector('.body').dispatchEvent("
        "new MouseEvent('click', {bubbles: true}))",
        selector.format(names[other]),
    )
    assert shown_cards(browser) == [str(other + 1)]
    assert browser.run("return document.getElementById('robot').value") == str(other)
    last = runs[other][1].ticks[min(len(longest.ticks) - 2, len(runs[other][1].ticks) - 1)]
    assert field(browser, "reason", other + 1) == last.reason
    press(browser, Keys.HOME)
    assert tick(browser, other + 1) == 0
    assert field(browser, "near", other + 1) == "nothing"
    columns = browser.run(
        "return document.querySelectorAll('[aria-label=\"Result\"] thead th').length"
    )
    assert columns == 8
    assert browser.console_messages() == []


def shown_cards(browser: Browser) -> list[str]:
    """The run numbers of the cards that are not hidden."""
    return list(
        browser.run(
            "return [...document.querySelectorAll('.card')].filter((card) => !card.hidden)"
            ".map((card) => card.dataset.run)"
        )
    )


def highlighted_lines(browser: Browser) -> set[str]:
    """The ids of the chart lines that are not faded."""
    return set(
        browser.run(
            "return [...document.querySelectorAll('#charts [id^=line-]:not(.aside)')]"
            ".map((line) => line.id)"
        )
    )


def test_thirty_six_lines_are_different(tmp_path: Path) -> None:
    assert len({look(number) for number in range(MOST_ROBOTS)}) == MOST_ROBOTS
    episode = run(load_scenario("empty"))
    names = [f"r{number}" for number in range(MOST_ROBOTS + 1)]
    with pytest.raises(InputError, match=r"37 robots: too many .* name up to 6 with --robot"):
        write_page([(name, episode) for name in names], tmp_path / "no.html", names)


def test_names_are_text_and_never_markup(browser: Browser, tmp_path: Path) -> None:
    hostile = "</script><script>document.title='owned'</script><img src=x onerror=alert(1)>$title"
    scenario = replace(load_scenario("case1"), name=hostile, description=hostile)
    episode = run(scenario, seed=1)
    ticks = (replace(episode.ticks[0], reason=hostile), *episode.ticks[1:])
    path = tmp_path / "hostile.html"
    write_page([(hostile, replace(episode, ticks=ticks))], path)
    browser.open(path)
    assert browser.console_messages() == []
    assert browser.run("return document.title") == format_values.one_line(hostile, 80)
    assert browser.run("return document.querySelectorAll('img').length") == 0
    assert field(browser, "reason") == hostile
    assert browser.run("return document.querySelector('.card .run').textContent") == hostile


def test_the_policy_blocks_other_scripts_and_requests(browser: Browser, single: Path) -> None:
    browser.open(single)
    browser.run(
        "const s = document.createElement('script'); s.textContent = 'window.owned = 1';"
        "document.head.append(s); fetch('file:///etc/hostname').catch(() => {})"
    )
    assert browser.run("return window.owned") is None
    assert "Content Security Policy" in browser.console_messages()[0]


def test_json_cannot_end_its_script_element() -> None:
    data = {"name": "</script><!--<script>&\u2028'\"\\"}
    text = as_json(data)
    assert not set("<>&") & set(text)
    assert text.isascii()
    assert json.loads(text) == data


def test_the_same_runs_give_the_same_bytes(episode: Episode, single: Path, bag: Path) -> None:
    assert page([(bag.name, episode)]) == single.read_text(encoding="utf-8")


def test_a_run_of_one_tick_without_obstacles_has_a_page(browser: Browser, tmp_path: Path) -> None:
    episode = run(load_scenario("empty"), go_on=lambda _: False)
    path = tmp_path / "page.html"
    write_page([("one", episode)], path)
    browser.open(path)
    assert browser.console_messages() == []
    assert field(browser, "tick") == "0 of 0"
    assert field(browser, "clearance") == "–"


def test_walls_are_drawn_and_count_as_clearance(browser: Browser, tmp_path: Path) -> None:
    episode = run(PLACE)
    write_page([("place", episode)], tmp_path / "page.html")
    browser.open(tmp_path / "page.html")
    assert browser.console_messages() == []
    path = browser.run("return document.querySelector('.scene .segments').getAttribute('d')")
    assert path == "M2 0.9L2 -0.1M4 -0.1L5 -1.1"
    assert field(browser, "clearance") == f"{clearances(episode)[0]:.3f} m"
    assert clearances(episode)[0] < 1.71, "that of the wall, not of the obstacle"


def test_too_many_runs_or_ticks_are_refused(episode: Episode, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"^{MOST_RUNS + 1} runs: too many.*; give"):
        page([("run", episode)] * (MOST_RUNS + 1))
    long = replace(episode, ticks=episode.ticks * 400)
    with pytest.raises(InputError, match="ticks: too many for a page; give 20000 at most"):
        page([("run", long)])
    (tmp_path / "page.html").write_text("mine")
    with pytest.raises(OutputError, match="already exists"):
        write_page([("run", episode)], tmp_path / "page.html")


def test_without_chromium_one_line_names_what_to_install(tmp_path: Path) -> None:
    for name in ("bash", "env"):
        (tmp_path / name).symlink_to(str(shutil.which(name)))
    done = subprocess.run(
        [ROOT / "tools/chromium.sh"],
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("no Chromium with chromedriver on PATH: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "noise"), [("case2", Noise()), ("case2", Noise(odom_m=0.05)), ("kidnapped", Noise())]
)
def test_the_smallest_clearance_is_that_of_the_result(name: str, noise: Noise) -> None:
    """At the robot's true position, and without the time in which it is carried off."""
    scenario = load_scenario(name)
    scenario = replace(scenario, robot=replace(scenario.robot, noise=noise))
    episode = run(scenario, planner=PlannerParams(goal_tolerance_m=0.1), seed=1)
    assert min(clearances(episode)) == evaluate(episode).min_clearance_m
    least = min(closest_passes(episode), key=lambda found: found.gap_m)
    assert least.gap_m == pytest.approx(min(map(min, tick_clearances(episode))), abs=1e-3)
