# SPDX-License-Identifier: Apache-2.0
"""An animation shows the run to scale and in time, in a file that fits and is always the same."""

import io
import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from PIL import Image
from trio_scenario import TRIO

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.geometry import Point, Pose2D
from mfba_planner.core.planner_types import Mode
from mfba_planner.report import style
from mfba_planner.report.animation import (
    LAST_FRAME_MS,
    SUFFIXES,
    animation_bytes,
)
from mfba_planner.report.animation_frames import FrameDrawer
from mfba_planner.report.animation_options import AnimationOptions
from mfba_planner.scenarios.scenario_files import load_scenario
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.fleet import run_fleet
from mfba_planner.simulation.obstacle_motion import Obstacle, center_at
from mfba_planner.simulation.run_episode import run
from mfba_planner.simulation.scenario import Scenario

SMALL = AnimationOptions(fps=5.0, speed=4.0, width_px=320)
HEAD, FOOT = 0.07, 0.08  # of a frame's height: words above the scene, the legend


@pytest.fixture(scope="module")
def episode() -> Episode:
    return run(load_scenario("case1"), seed=4)


def duration_s(episode: Episode) -> float:
    return episode.time_s(episode.ticks[-1].stamp_ns)


def made(episode: Episode, suffix: str = ".webp", options: AnimationOptions = SMALL) -> bytes:
    return animation_bytes([("", episode)], (), suffix, options)


def frames(data: bytes) -> list[np.ndarray]:
    """All frames as RGB arrays."""
    found = []
    with Image.open(io.BytesIO(data)) as image:
        for index in range(getattr(image, "n_frames", 1)):
            image.seek(index)
            found.append(np.array(image.convert("RGB")))
    return found


def durations_ms(data: bytes) -> list[int]:
    """How long Pillow shows each frame."""
    found = []
    with Image.open(io.BytesIO(data)) as image:
        for index in range(getattr(image, "n_frames", 1)):
            image.seek(index)
            image.load()
            found.append(int(image.info["duration"]))
    return found


def riff_chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of the chunks of a WebP file, read without Pillow."""
    kind, size, form = struct.unpack("<4sI4s", data[:12])
    assert (kind, size, form) == (b"RIFF", len(data) - 8, b"WEBP")
    at = 12
    while at < len(data):
        kind, size = struct.unpack("<4sI", data[at : at + 8])
        yield kind, data[at + 8 : at + 8 + size]
        at += 8 + size + size % 2


def near(frame: np.ndarray, colour: str, slack: int = 16) -> np.ndarray:
    """Which pixels have a colour."""
    wanted = np.array([round(255.0 * part) for part in to_rgb(colour)])
    mask: np.ndarray = np.abs(frame.astype(int) - wanted).max(axis=2) <= slack
    return mask


def scene(frame: np.ndarray) -> np.ndarray:
    """The frame without the head's words, which are painted white, and without the legend."""
    height = len(frame)
    kept = frame[: int((1.0 - FOOT) * height)].copy()
    kept[: int(HEAD * height)] = 255
    return kept


def spot(frame: np.ndarray, colour: str) -> Point:
    """The middle of what is filled with a colour in the scene, in pixels."""
    mask = np.pad(near(scene(frame), colour), 1)
    # The smooth edge of a line may have the colour, but not with all its neighbours.
    inside = mask[1:-1, 1:-1] & mask[:-2, 1:-1] & mask[2:, 1:-1] & mask[1:-1, :-2] & mask[1:-1, 2:]
    ys, xs = np.nonzero(inside)
    assert len(xs) > 5
    return float(np.median(xs)), float(np.median(ys))


def has(frame: np.ndarray, colour: str) -> bool:
    """Whether some of the scene has a colour."""
    return int(near(scene(frame), colour).sum()) > 10


def assert_to_scale(pixels: Sequence[Point], metres: Sequence[Point]) -> None:
    """One scale for both axes, y upwards, to a pixel and a half."""
    (x0, y0), (x1, y1) = pixels[0], pixels[-1]
    (u0, v0), (u1, v1) = metres[0], metres[-1]
    scale = math.dist((x0, y0), (x1, y1)) / math.dist((u0, v0), (u1, v1))
    for (x, y), (u, v) in zip(pixels, metres):
        assert x - x0 == pytest.approx(scale * (u - u0), abs=1.5)
        assert y0 - y == pytest.approx(scale * (v - v0), abs=1.5)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frames_are_evenly_apart_and_the_last_one_stays(episode: Episode, suffix: str) -> None:
    data = made(episode, suffix)
    step_s = SMALL.speed / SMALL.fps
    expected = math.ceil(duration_s(episode) / step_s) + 1
    shown = durations_ms(data)
    assert len(frames(data)) == len(shown) == expected
    assert shown[:-1] == [200] * (expected - 1)
    assert shown[-1] == LAST_FRAME_MS == 1500
    with Image.open(io.BytesIO(data)) as image:
        assert image.info["loop"] == 0
        assert image.width == 320


def test_durations_that_are_no_whole_milliseconds_do_not_drift(episode: Episode) -> None:
    for suffix, unit in ((".webp", 1), (".gif", 10)):
        options = replace(SMALL, fps=7.0, width_px=160)
        shown = durations_ms(made(episode, suffix, options))[:-1]
        assert sum(shown) == pytest.approx(len(shown) * 1000.0 / 7.0, abs=unit)
        assert {d % unit for d in shown} == {0}


def test_a_run_of_case_1_takes_six_to_eight_seconds(episode: Episode) -> None:
    assert 6.0 <= duration_s(episode) / AnimationOptions().speed <= 8.0


def test_another_reader_finds_the_same_frames(episode: Episode) -> None:
    data = made(episode)
    chunks = list(riff_chunks(data))
    (start,) = (content for kind, content in chunks if kind == b"ANIM")
    assert struct.unpack("<IH", start)[1] == 0  # for ever
    shown = [
        int.from_bytes(content[12:15], "little") for kind, content in chunks if kind == b"ANMF"
    ]
    assert shown == durations_ms(data)
    assert {kind for kind, _ in chunks} == {b"VP8X", b"ANIM", b"ANMF"}  # no date, no comment


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_robot_moves_from_start_to_goal_to_scale(episode: Episode, suffix: str) -> None:
    shown = frames(made(episode, suffix))
    step_s = SMALL.speed / SMALL.fps
    moments = range(2, len(shown) - 2, 4)  # before and after, marks lie on the robot
    pixels = [spot(shown[k], style.ROBOT["facecolor"]) for k in moments]
    poses: list[Point] = []
    times = [episode.time_s(tick.stamp_ns) for tick in episode.ticks]
    for k in moments:
        xs, ys = ([tick.pose[axis] for tick in episode.ticks] for axis in (0, 1))
        poses.append(
            (float(np.interp(k * step_s, times, xs)), float(np.interp(k * step_s, times, ys)))
        )
    pixels.append(spot(shown[0], style.GOAL["color"]))
    poses.append(episode.scenario.goal_m)
    assert_to_scale(pixels, poses)
    x, y = pixels[-1]
    x, y = (round(value) for value in pixels[-1])
    at_goal = [frame[y - 9 : y + 10, x - 9 : x + 10] for frame in (shown[0], shown[-1])]
    edges = [int(near(part, style.ROBOT["edgecolor"], 40).sum()) for part in at_goal]
    assert edges[0] == 0
    assert edges[1] > 5  # the robot's edge is around the star


def test_an_obstacle_moves_to_scale() -> None:
    mover = Obstacle(center_m=(1.0, 8.0), radius_m=0.8, speed_mps=0.2, heading_rad=0.3)
    scenario = replace(load_scenario("empty"), obstacles=(mover,))
    shown = frames(made(run(scenario)))
    step_s = SMALL.speed / SMALL.fps
    moments = range(0, len(shown) - 1, 3)
    pixels = [spot(shown[k], style.OBSTACLE["facecolor"]) for k in moments]
    # The number and the arrow hide the same part of it in every frame.
    assert_to_scale(pixels, [center_at(mover, k * step_s) for k in moments])


def test_the_path_has_the_colours_of_the_modes_so_far(episode: Episode) -> None:
    shown = frames(made(episode))
    first = next(t for t in episode.ticks if t.mode is Mode.OBSTACLE_AVOIDANCE)
    switch = episode.time_s(first.stamp_ns) * SMALL.fps / SMALL.speed
    avoidance, generation = (
        style.MODE_COLOURS[mode] for mode in (Mode.OBSTACLE_AVOIDANCE, Mode.PATH_GENERATION)
    )
    drawn = [has(frame, avoidance) for frame in shown]
    assert not any(drawn[: math.ceil(switch)])
    assert all(drawn[math.ceil(switch) + 1 :])
    assert all(has(frame, generation) for frame in shown[2:])


def test_the_ring_lights_up_where_sectors_are_set(episode: Episode) -> None:
    red, green, blue = (0.75 + 0.25 * part for part in to_rgb(style.ORANGE))
    amber = to_hex((red, green, blue))
    with style.context():
        drawer = FrameDrawer([("", episode)], (), 320)
        for tick in (t for t in episode.ticks[3:-3] if sum(t.vs) in (0, 3)):
            frame = drawer.draw(episode.time_s(tick.stamp_ns))
            assert (near(scene(frame), amber, 3).sum() > 20) == any(tick.vs)


def test_the_same_run_gives_the_same_bytes(episode: Episode) -> None:
    options = replace(SMALL, width_px=160)
    for suffix in SUFFIXES:
        assert made(episode, suffix, options) == made(episode, suffix, options)
    other = run(load_scenario("case1"), seed=5)
    assert made(episode, options=options) != made(other, options=options)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_smaller_limit_takes_colours_and_then_frames(episode: Episode, suffix: str) -> None:
    options = replace(SMALL, width_px=160)
    whole = made(episode, suffix, options)
    fewer_colours = made(episode, suffix, replace(options, max_bytes=len(whole) - 1))
    assert len(fewer_colours) < len(whole)
    assert durations_ms(fewer_colours) == durations_ms(whole)
    small = made(episode, suffix, replace(options, max_bytes=len(whole) // 3))
    assert len(small) <= len(whole) // 3
    shown = durations_ms(small)
    assert len(shown) < len(durations_ms(whole))
    assert sum(shown) == pytest.approx(sum(durations_ms(whole)), abs=800)
    assert np.abs(frames(small)[-1].astype(int) - frames(whole)[-1]).mean() < 4.0


def test_what_never_fits_is_refused(episode: Episode) -> None:
    with pytest.raises(ConfigError, match=r"^--max-bytes=1000: too few, \d+ bytes with fewest "):
        made(episode, options=replace(SMALL, max_bytes=1000, width_px=160))


def test_too_many_frames_are_refused_before_any_is_drawn(episode: Episode) -> None:
    options = AnimationOptions(fps=50.0, speed=0.01, width_px=1920)
    with pytest.raises(
        ConfigError, match=r"^\d+ frames of 1920 x \d+ pixels: at most \d+ .*give --speed=(\d+) "
    ) as refusal:
        made(episode, options=options)
    speed = int(str(refusal.value).partition("--speed=")[2].split()[0])

    def stop(done: int, total: int) -> None:
        raise InterruptedError(total)

    with pytest.raises(InterruptedError):  # it draws with the speed that was advised
        animation_bytes([("", episode)], (), ".webp", replace(options, speed=speed), stop)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"fps": 0.0}, "--fps=0: out of range; give a number from 1 to 50"),
        ({"fps": math.nan}, "--fps=nan: out of range; give a number from 1 to 50"),
        ({"speed": -1.0}, "--speed=-1: out of range; give a number from 0.01 to 1000"),
        ({"speed": math.inf}, "--speed=inf: out of range; give a number from 0.01 to 1000"),
        ({"width_px": 100}, "--width=100: out of range; give a number from 160 to 1920"),
        ({"max_bytes": 0}, "--max-bytes=0: out of range; give a number from 1000 to 1000000000"),
    ],
)
def test_numbers_out_of_range_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        AnimationOptions(**wrong)  # type: ignore[arg-type]
    assert str(refusal.value) == message


def test_progress_counts_the_frames(episode: Episode) -> None:
    counts: list[tuple[int, int]] = []
    data = animation_bytes(
        [("", episode)], (), ".webp", SMALL, lambda done, total: counts.append((done, total))
    )
    total = len(frames(data))
    assert counts == [(k, total) for k in range(1, total + 1)]


def test_a_fleet_is_drawn_whole_or_one_robot_among_the_others() -> None:
    names = TRIO.robot_names
    runs = list(zip(names, run_fleet(TRIO, seed=5)))
    ends = [duration_s(episode) for _, episode in runs]
    with style.context():
        whole = FrameDrawer(runs, names, 320)
        one = FrameDrawer(runs[:1], names, 320)
        shown = [whole.draw(t) for t in (0.5 * min(ends), max(ends))]
        alone = one.draw(0.5 * min(ends))
    blue, grey = style.ROBOT["facecolor"], style.OBSTACLE["facecolor"]

    def area(frame: np.ndarray, colour: str) -> int:
        return int(near(scene(frame), colour, 2).sum())

    # Three robots and an obstacle; or one robot and three obstacles.
    assert area(shown[0], blue) > 1.5 * area(shown[0], grey) > 0
    assert area(alone, grey) > 1.5 * area(alone, blue) > 0
    # b arrives first, and stays to be seen while the others go on.
    assert min(ends) < max(ends) - 1.0
    assert area(shown[1], blue) > 0
    data = animation_bytes(runs, names, ".webp", SMALL)
    assert len(frames(data)) == math.ceil(max(ends) * SMALL.fps / SMALL.speed) + 1


def test_a_run_of_one_tick_is_one_picture(episode: Episode) -> None:
    short = replace(episode, ticks=episode.ticks[:1], outcome=Outcome.INTERRUPTED)
    for suffix in SUFFIXES:
        assert len(frames(made(short, suffix))) == 1


def test_a_pose_that_is_none_and_a_long_name_do_no_harm(episode: Episode) -> None:
    ticks = episode.ticks
    lost = replace(ticks[11], mode=Mode.STOPPED, pose=Pose2D(math.nan, math.nan))
    odd = replace(
        episode,
        ticks=(*ticks[:11], lost, *ticks[12:]),
        scenario=replace(episode.scenario, name="a $corridor_$ of 走廊 " + "x" * 200),
    )
    assert len(frames(made(odd))) == len(frames(made(episode)))


def test_a_run_that_ends_elsewhere_says_so_at_the_end_only() -> None:
    cage = [
        Obstacle(center_m=(1.35 * math.cos(a), 1.35 * math.sin(a)), radius_m=0.4)
        for a in (k * math.pi / 3.0 for k in range(6))
    ]
    blocked = run(
        Scenario(
            name="blocked", start_m=(0.0, 0.0), goal_m=(5.0, 4.0), obstacles=tuple(cage),
            time_limit_s=4.0,
        )
    )  # fmt: skip
    *before, last = frames(made(blocked))
    head = int(HEAD * len(last))
    for frame in before:
        assert not np.array_equal(frame[:head], last[:head])
    assert blocked.outcome is Outcome.TIME_LIMIT
    assert near(last[:head], style.BAD).sum() > 50
