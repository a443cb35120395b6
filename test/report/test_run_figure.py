# SPDX-License-Identifier: Apache-2.0
"""The picture of a run: its content, its layout, and the same bytes for the same episode."""

import math
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations, groupby, pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from walled_place import PLACE

from mfba_planner.core.errors import OutputError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Mode
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.report import style
from mfba_planner.report.run_events import closest_passes
from mfba_planner.report.run_figure import draw_run, png_bytes, run_figure
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, Walls, center_at
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario


def _still(x: float, y: float, radius: float = 0.3) -> Obstacle:
    return Obstacle(center_m=(x, y), radius_m=radius)


def _case(name: str) -> Callable[[], Episode]:
    return lambda: run(load_scenario(name))


def _blocked() -> Episode:
    angles = [k * math.pi / 3.0 for k in range(6)]
    cage = [_still(1.35 * math.cos(a), 1.35 * math.sin(a), 0.4) for a in angles]
    return run(
        Scenario(
            name="blocked", start_m=(0.0, 0.0), goal_m=(5.0, 4.0), obstacles=tuple(cage),
            time_limit_s=4.0,
        )
    )  # fmt: skip


def _thirty() -> Episode:
    rng = np.random.default_rng(5)
    obstacles = [
        Obstacle(
            center_m=(1.5 + 2.1 * (k % 5), 1.5 + 1.9 * (k // 5)),
            radius_m=0.1 + 0.01 * k,
            speed_mps=float(rng.uniform(0.1, 0.3)),
            heading_rad=float(rng.uniform(0.0, 6.28)),
        )
        for k in range(30)
    ]
    return run(
        Scenario(
            name="thirty", start_m=(0.5, 0.5), goal_m=(11.5, 11.5), obstacles=tuple(obstacles),
            walls=Walls(lower_m=(0.0, 0.0), upper_m=(12.0, 12.0)), description="many " * 60,
        )
    )  # fmt: skip


def _one_tick() -> Episode:
    episode = run(load_scenario("case2"))
    return replace(episode, ticks=episode.ticks[:1], outcome=Outcome.INTERRUPTED)


def _time_limit() -> Episode:
    return run(replace(load_scenario("case2"), time_limit_s=8.0))


def _stopped() -> Episode:
    """A run with unusable input at tick 10 and a pose that is NaN at tick 11."""
    ticks = run(load_scenario("case1")).ticks
    no_pose = replace(ticks[11], mode=Mode.STOPPED, pose=Pose2D(math.nan, math.nan))
    stopped = replace(ticks[10], mode=Mode.STOPPED)
    return replace(run(load_scenario("case1")), ticks=(*ticks[:10], stopped, no_pose, *ticks[12:]))


def _corridor() -> Episode:
    return run(
        Scenario(
            name="a $corridor_$ of 走廊 " + "x" * 200, start_m=(0.0, 0.0), goal_m=(40.0, 0.0),
            obstacles=(_still(10.0, 0.2), _still(20.0, -500.0)),
        ),
        seed=2**100,
    )  # fmt: skip


def _tower() -> Episode:
    return run(
        Scenario(
            name="tower", start_m=(1e5, 0.0), goal_m=(1e5, 30.0), obstacles=(_still(1e5, 9.0),)
        )
    )


def _small() -> Episode:
    params = PlannerParams(step_length_m=0.001, goal_tolerance_m=1e-6)
    return run(
        Scenario(name="small", start_m=(0.0, 0.0), goal_m=(0.01, 0.0), robot_radius_m=1e-4),
        planner=params,
    )


SAMPLES: dict[str, Callable[[], Episode]] = {
    **{name: _case(name) for name in ("case1", "case2", "walled", "empty")},
    "blocked": _blocked,
    "thirty": _thirty,
    "one_tick": _one_tick,
    "time_limit": _time_limit,
    "stopped": _stopped,
    "corridor": _corridor,
    "tower": _tower,
    "small": _small,
    "place": lambda: run(PLACE),
}


@cache
def episode_of(name: str) -> Episode:
    """Run a sample once for all tests."""
    return SAMPLES[name]()


@cache
def figure_of(name: str) -> Figure:
    """Draw a sample once for all tests."""
    return draw(episode_of(name))


@pytest.fixture(params=SAMPLES)
def name(request: pytest.FixtureRequest) -> str:
    """Return each sample's name in turn."""
    return str(request.param)


@pytest.fixture
def episode(name: str) -> Episode:
    """Return each sample in turn."""
    return episode_of(name)


@pytest.fixture
def figure(name: str) -> Figure:
    """Return the figure of each sample in turn."""
    return figure_of(name)


def draw(episode: Episode) -> Figure:
    """Return the figure as it is saved."""
    with style.context():
        figure = run_figure(episode)
        FigureCanvasAgg(figure).draw()
    return figure


def artists(figure: Figure, kind: str) -> list[Any]:
    """Return the artists of one kind in the sequence in which they were drawn."""
    return [
        artist
        for artist in figure.axes[0].get_children()
        if (artist.get_gid() or "").split(":")[0] == kind
    ]


def starts(episode: Episode, mode: Mode) -> list[int]:
    """Return the ticks at which a mode starts."""
    modes = [None, *(tick.mode for tick in episode.ticks)]
    return [i for i, (a, b) in enumerate(pairwise(modes)) if b is mode and a is not mode]


def test_each_stretch_of_a_mode_is_one_line(episode: Episode, figure: Figure) -> None:
    drawn = {a.get_gid(): len(a.get_paths()) for a in artists(figure, "path")}
    counts = {f"path:{mode.value}": len(starts(episode, mode)) for mode in Mode}
    assert drawn == {gid: count for gid, count in counts.items() if count}
    modes = [tick.mode for tick in episode.ticks]
    assert sum(drawn.values()) == len(list(groupby(modes)))


@pytest.mark.parametrize("name", ["case2", "blocked", "time_limit"])
def test_the_lines_together_are_the_robots_path(name: str) -> None:
    episode, figure = episode_of(name), figure_of(name)
    steps: set[tuple[Point, Point]] = set()
    for collection in artists(figure, "path"):
        for path in collection.get_paths():
            points = [(float(x), float(y)) for x, y in path.vertices]
            steps |= {(a, b) for a, b in pairwise(points) if a != b}
    poses = [tick.pose.position for tick in episode.ticks]
    assert steps == {(a, b) for a, b in pairwise(poses) if a != b}


def test_a_step_has_the_colour_of_the_mode_that_chose_it() -> None:
    episode, figure = episode_of("case1"), figure_of("case1")
    (avoidance,) = (a for a in artists(figure, "path") if a.get_gid() == "path:obstacle_avoidance")
    paths = avoidance.get_paths()
    assert len(paths) > 1
    for first, path in zip(starts(episode, Mode.OBSTACLE_AVOIDANCE), paths):
        assert tuple(path.vertices[0]) == episode.ticks[first].pose.position
        after = next(t for t in episode.ticks[first:] if t.mode is Mode.PATH_GENERATION)
        assert tuple(path.vertices[-1]) == after.pose.position


def test_a_mark_shows_where_the_robot_stands_still() -> None:
    for name, mode in (("blocked", Mode.BLOCKED), ("stopped", Mode.STOPPED)):
        (mark,) = artists(figure_of(name), "standing")
        (first,) = starts(episode_of(name), mode)
        assert mark.get_gid() == f"standing:{mode.value}"
        assert (*mark.get_xdata(), *mark.get_ydata()) == episode_of(name).ticks[first].pose[:2]


def test_each_encounter_has_one_ring_with_its_sectors(episode: Episode, figure: Figure) -> None:
    rings = artists(figure, "ring")
    met = [episode.ticks[i] for i in starts(episode, Mode.OBSTACLE_AVOIDANCE)]
    assert [ring.center for ring in rings] == [tick.pose.position for tick in met]
    assert {ring.radius for ring in rings} <= {episode.sensor.sensing_range_m}
    for index, tick in enumerate(met):
        wedges = [w for w in artists(figure, "sector") if w.get_gid() == f"sector:{index}"]
        width = 360.0 / len(tick.vs)
        set_bits = [
            any(w.theta1 < (i + 0.5) * width < w.theta2 for w in wedges) for i in range(12)
        ]
        assert set_bits == [bit == 1 for bit in tick.vs]


def test_sensed_obstacles_are_drawn_at_their_positions() -> None:
    episode, figure = episode_of("case1"), figure_of("case1")
    first, second = (episode.ticks[i] for i in starts(episode, Mode.OBSTACLE_AVOIDANCE))
    sensed = artists(figure, "sensed")
    t, later = (episode.time_s(tick.stamp_ns) for tick in (first, second))
    assert [circle.get_gid() for circle in sensed] == ["sensed:0", "sensed:1"]
    assert sensed[0].center == pytest.approx((1.0 + 0.3 * t, 4.5))
    assert sensed[1].center == pytest.approx((10.5 - 0.2 * later, 6.0))
    assert {circle.radius for circle in sensed} == {0.6}


def test_tracks_run_from_the_first_to_the_last_tick() -> None:
    episode, figure = episode_of("case1"), figure_of("case1")
    duration = (len(episode.ticks) - 1) * episode.planner.tick_ns * 1e-9
    ends = [
        ((1.0, 4.5), (1.0 + 0.3 * duration, 4.5)),
        ((10.5, 6.0), (10.5 - 0.2 * duration, 6.0)),
        ((6.0, 12.0), (6.0, 12.0 - 0.15 * duration)),
    ]
    tracks = artists(figure, "track")
    assert len(tracks) == len(ends)
    for line, (first, last) in zip(tracks, ends):
        assert line.get_xydata()[0] == pytest.approx(first)
        assert line.get_xydata()[-1] == pytest.approx(last)


def test_tracks_turn_at_the_walls() -> None:
    episode, figure = episode_of("thirty"), figure_of("thirty")
    duration = episode.time_s(episode.ticks[-1].stamp_ns)
    tracks = artists(figure, "track")
    assert len(tracks) == 30
    assert sum(len(line.get_xydata()) for line in tracks) > 60
    walls = episode.scenario.walls
    for line, obstacle in zip(tracks, episode.scenario.obstacles):
        points, r = line.get_xydata(), obstacle.radius_m
        assert points[-1] == pytest.approx(center_at(obstacle, duration, walls))
        for x, y in points[1:-1]:
            touching = min(abs(x - r), abs(12.0 - r - x), abs(y - r), abs(12.0 - r - y))
            assert touching == pytest.approx(0.0, abs=1e-9)


def test_a_long_run_between_walls_shows_tracks_near_the_passes_only() -> None:
    ticks = episode_of("one_tick").ticks
    late = replace(ticks[0], stamp_ns=ticks[0].stamp_ns + 3600 * 10**9)
    mover = Obstacle(center_m=(6.0, 6.0), radius_m=0.3, speed_mps=0.3, heading_rad=1.0)
    scenario = replace(
        load_scenario("empty"),
        obstacles=(mover,),
        walls=Walls(lower_m=(-1.0, -1.0), upper_m=(13.0, 13.0)),
    )
    figure = draw(replace(episode_of("one_tick"), scenario=scenario, ticks=(ticks[0], late)))
    (track,) = artists(figure, "track_near_pass")
    assert not artists(figure, "track")
    assert len(track.get_xydata()) < 10
    assert "obstacle's track near closest pass" in legend_labels(figure)


def test_obstacles_are_drawn_to_scale_at_their_closest_pass(
    episode: Episode, figure: Figure
) -> None:
    circles, edges = artists(figure, "obstacle"), artists(figure, "enlarged")
    passes = closest_passes(episode)
    assert [c.center for c in circles] == [p.center_m for p in passes]
    assert [c.radius for c in circles] == [o.radius_m for o in episode.scenario.obstacles]
    for circle, edge in zip(circles, edges):
        assert edge.center == circle.center
        assert edge.radius == circle.radius + episode.scenario.robot_radius_m


@pytest.mark.parametrize("name", ["case1", "case2", "walled", "thirty", "blocked", "one_tick"])
def test_the_closest_pass_is_the_smallest_clearance(name: str) -> None:
    smallest = min(p.gap_m for p in closest_passes(episode_of(name)))
    exact = evaluate(episode_of(name)).min_clearance_m
    assert exact - 1e-9 <= smallest <= exact + 0.003


@given(speed=st.floats(0.0, 3.0), heading=st.floats(0.0, 6.3), seed=st.integers(0, 20))
def test_a_pass_lies_on_the_run(speed: float, heading: float, seed: int) -> None:
    mover = Obstacle(center_m=(4.0, 4.0), radius_m=0.3, speed_mps=speed, heading_rad=heading)
    scenario = replace(load_scenario("empty"), obstacles=(mover,), time_limit_s=6.0)
    episode = run(scenario, seed=seed)
    (moment,) = closest_passes(episode)
    assert moment.center_m == center_at(mover, moment.time_s)
    before = [t for t in episode.ticks if episode.time_s(t.stamp_ns) <= moment.time_s + 1e-9]
    assert math.dist(before[-1].pose.position, moment.robot.position) <= 0.3 + 1e-9
    assert moment.gap_m >= evaluate(episode).min_clearance_m - 1e-9


def test_encountered_obstacles_only_have_a_line_as_long_as_the_clearance(
    episode: Episode, figure: Figure
) -> None:
    lines = artists(figure, "pass")
    met = evaluate(episode).encounters
    assert sorted(int(line.get_gid().split(":")[1]) for line in lines) == sorted(met)
    gaps = {p.number: p.gap_m for p in closest_passes(episode)}
    for line in lines:
        a, b = line.get_xydata()
        number = int(line.get_gid().split(":")[1])
        assert math.dist(a, b) == pytest.approx(max(0.0, gaps[number]), abs=1e-6)


def legend_labels(figure: Figure) -> list[str]:
    """Return the labels of the legend."""
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_legend_lists_what_is_drawn_and_nothing_else() -> None:
    assert legend_labels(figure_of("empty")) == ["start", "goal", "path generation"]
    walled = legend_labels(figure_of("walled"))
    assert {
        "wall for obstacles only",
        "obstacle's track",
        "sensing range SR at the switch",
    } <= set(walled)
    assert not {"end of the run", "blocked (every gap closed)"} & set(walled)
    blocked = legend_labels(figure_of("blocked"))
    assert {"end of the run", "blocked (every gap closed)"} <= set(blocked)
    assert not {"wall for obstacles only", "wall", "obstacle's track"} & set(blocked)
    place = legend_labels(figure_of("place"))
    assert "wall" in place
    assert "wall for obstacles only" not in place


def test_wall_segments_are_drawn_where_they_are_and_in_view() -> None:
    (walls,) = artists(figure_of("place"), "wall")
    drawn = tuple(tuple(line.ravel().tolist()) for line in walls.get_segments())
    assert drawn == PLACE.segments_m
    (left, right), (bottom, top) = (
        figure_of("place").axes[0].get_xlim(),
        figure_of("place").axes[0].get_ylim(),
    )
    for x0, y0, x1, y1 in PLACE.segments_m:
        assert left < min(x0, x1) <= max(x0, x1) < right
        assert bottom < min(y0, y1) <= max(y0, y1) < top


def texts(figure: Figure) -> list[Text]:
    """Return every visible text of the figure."""
    undrawn = {
        tick.label1
        for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis)
        for tick in axis.get_major_ticks()
        if not axis.get_view_interval()[0] <= tick.get_loc() <= axis.get_view_interval()[1]
    }
    found = figure.findobj(lambda artist: isinstance(artist, Text) and bool(artist.get_text()))
    return [t for t in found if isinstance(t, Text) and t.get_visible() and t not in undrawn]


def test_the_strip_shows_the_result(episode: Episode, figure: Figure) -> None:
    result = evaluate(episode)
    written = {text.get_text() for text in texts(figure)}
    assert result.outcome.value.replace("_", " ") in written
    assert {str(result.collisions), str(result.mode_switches), "mfba"} <= written
    if math.isfinite(result.length_m):
        assert f"{result.length_m:.3f} m" in written


def test_no_text_is_cut_and_none_overlap(episode: Episode, figure: Figure) -> None:
    ax = figure.axes[0]
    boxes = {text: text.get_window_extent() for text in texts(figure)}
    for text, box in boxes.items():
        sheet = ax.bbox if text in ax.texts else figure.bbox
        assert sheet.x0 - 1 <= box.x0 < box.x1 <= sheet.x1 + 1, text
        assert sheet.y0 - 1 <= box.y0 < box.y1 <= sheet.y1 + 1, text
    for (a, first), (b, second) in combinations(boxes.items(), 2):
        assert not first.padded(-1).overlaps(second.padded(-1)), (a, b)


def test_of_hundreds_of_obstacles_the_nearest_have_a_number() -> None:
    posts = tuple(_still(0.5 + 0.2 * (k % 50), 0.8 + 0.2 * (k // 50), 0.08) for k in range(200))
    episode = run(
        Scenario(name="posts", start_m=(0.0, 0.0), goal_m=(10.0, 0.0), obstacles=posts),
        planner=PlannerParams(speed_mps=1.0),
    )
    drawn = artists(draw(episode), "number")
    nearest = sorted(closest_passes(episode), key=lambda p: p.gap_m)[:40]
    assert 5 < len(drawn) <= 40
    assert {int(text.get_text()) for text in drawn} <= {p.number for p in nearest}
    places = [text.get_position() for text in drawn]
    assert min(math.dist(a, b) for a, b in combinations(places, 2)) > 0.1


def test_a_metre_is_as_long_along_both_axes(episode: Episode, figure: Figure) -> None:
    ax = figure.axes[0]
    (x0, y0), (x1, y1) = ax.transData.transform([(0.0, 0.0), (1.0, 1.0)])
    assert x1 - x0 == pytest.approx(y1 - y0, rel=1e-6)
    assert ax.get_xlabel() == "x (m)"
    assert ax.get_ylabel() == "y (m)"


def test_the_path_and_the_rings_are_inside_the_picture(episode: Episode, figure: Figure) -> None:
    ax = figure.axes[0]
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    points = [tick.pose.position for tick in episode.ticks if math.isfinite(tick.pose.x)]
    for x, y in [*points, episode.scenario.start_m, episode.scenario.goal_m]:
        assert left < x < right
        assert bottom < y < top
    for ring in artists(figure, "ring"):
        (x, y), r = ring.center, ring.radius
        assert left < x - r < x + r < right
        assert bottom < y - r < y + r < top


def test_distant_obstacles_are_listed_instead_of_shrinking_the_path() -> None:
    figure = figure_of("corridor")
    assert "outside the picture: 2" in {text.get_text() for text in texts(figure)}
    assert figure.axes[0].get_ylim()[0] > -20.0


def png_size(data: bytes) -> tuple[int, int]:
    """Return width and height of a PNG, after a check of all its chunks."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    kinds, offset = [], 8
    while offset < len(data):
        (length,) = struct.unpack(">I", data[offset : offset + 4])
        kinds.append(data[offset + 4 : offset + 8])
        offset += 12 + length
    assert kinds[0] == b"IHDR"
    assert kinds[-1] == b"IEND"
    assert b"tEXt" not in kinds  # where dates and versions would be
    assert b"tIME" not in kinds
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def test_a_png_of_reasonable_size_is_written(episode: Episode, tmp_path: Path) -> None:
    path = tmp_path / "run.png"
    draw_run(episode, path)
    assert os.listdir(tmp_path) == ["run.png"]
    width, height = png_size(path.read_bytes())
    assert 1000 <= width <= 2000
    assert 800 <= height <= 1500
    assert 20_000 < path.stat().st_size < 1_000_000


def test_the_same_episode_gives_the_same_bytes_for_any_user_settings() -> None:
    plain = png_bytes(run(load_scenario("case1")))
    with matplotlib.rc_context({"font.size": 20.0, "axes.facecolor": "red", "text.usetex": True}):
        before = dict(matplotlib.rcParams)
        assert png_bytes(run(load_scenario("case1"))) == plain
        assert dict(matplotlib.rcParams) == before
    assert png_bytes(run(load_scenario("case1"), seed=1)) != plain


def test_five_thousand_ticks_are_drawn() -> None:
    cage = episode_of("blocked").scenario
    limit = 5000 * 0.3 / 0.785 - 0.1
    episode = run(replace(cage, start_m=(5.0, 4.0), goal_m=(0.0, 0.0), time_limit_s=limit))
    assert len(episode.ticks) == 5001
    assert png_size(png_bytes(episode))[0] > 1000


def test_an_existing_file_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.png"
    path.write_bytes(b"mine")
    with pytest.raises(OutputError, match="already exists") as caught:
        draw_run(episode_of("empty"), path)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == b"mine"
    assert os.listdir(tmp_path) == ["run.png"]


def _modules_after(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    return set(done.stdout.split())


def test_matplotlib_is_imported_for_figures_only_and_pyplot_never() -> None:
    without = _modules_after(
        "import mfba_planner.report.result_json, mfba_planner.report.result_table"
    )
    assert "mfba_planner.report.result_table" in without
    assert "matplotlib" not in without
    with_figure = _modules_after(
        "from mfba_planner.report.run_figure import png_bytes\n"
        "from mfba_planner.simulation.run_episode import run\n"
        "from mfba_planner.scenarios.scenario_files import load_scenario\n"
        "png_bytes(run(load_scenario('case1')))"
    )
    assert "matplotlib.backends.backend_agg" in with_figure
    assert "matplotlib.pyplot" not in with_figure
