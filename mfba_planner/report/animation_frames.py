# SPDX-License-Identifier: Apache-2.0
"""The frames of an animation: a run, or a fleet, drawn to scale at any time of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator, MultipleLocator

from mfba_planner.core.geometry import Pose2D
from mfba_planner.evaluation.metrics import evaluate, within_range
from mfba_planner.simulation.episode import Episode, Outcome

from . import format_values, legend, style
from .draw_scene import draw_ends, draw_walls
from .draw_tick import draw_obstacle, draw_robot
from .figure_sheet import Sheet
from .html.page_data import obstacle_names, world_name
from .run_events import closest_passes, is_finite
from .view_bounds import View, choose_view, fitted

Runs = Sequence[tuple[str, Episode]]

# inches; a wider picture has more pixels per inch, and the same proportions
_WIDTH = 640 / style.DPI
_EDGE, _HEAD, _FOOT = 0.09, 0.36, 0.28
_TEXT = 11.0  # font size of time and mode: points
_SMALL = 0.2  # of the view: a larger sensing range may be cut at its edge
_CELLS = 8  # of the grid, along the longer axis


class FrameDrawer:
    """Draws frames of one size; to be made and used within style.context()."""

    def __init__(self, runs: Runs, roster: Sequence[str], width_px: int) -> None:
        """Draw what all frames share: names, axes, grid, walls, legend."""
        self._runs = [_Run(name, episode, roster) for name, episode in runs]
        view = _view(runs)
        width = _WIDTH - 2.0 * _EDGE
        height = width * view.height / view.width
        self._sheet = Sheet(_WIDTH, _FOOT + height + _HEAD)
        self._figure = self._sheet.figure
        self._figure.set_dpi(style.DPI * width_px / 640)
        self._ax = self._sheet.axes(_EDGE, _FOOT, width, height)
        self._ax.set_xlim(view.left, view.right)
        self._ax.set_ylim(view.bottom, view.top)
        draw_walls(self._ax, runs[0][1])
        self._write_foot(self._draw_grid(max(view.width, view.height)))
        self._time, self._state = self._write_head(*runs[0], roster)
        self._canvas = FigureCanvasAgg(self._figure)
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of a frame."""
        width, height = self._canvas.get_width_height()
        return int(width), int(height)

    def draw(self, time_s: float) -> np.ndarray:
        """The frame of a simulated time: uint8, (height, width, 3)."""
        ax = self._ax
        shared = set(ax.get_children())
        moments = [run.until(time_s) for run in self._runs]
        self._draw_obstacles(moments)
        for moment, run in zip(moments, self._runs):
            draw_robot(ax, moment, len(moment.ticks) - 1)
            # Only the last frame marks where a run ended short of the goal.
            outcome = moment.outcome if time_s >= run.end_s else Outcome.GOAL_REACHED
            draw_ends(ax, replace(moment, outcome=outcome), style.SMALL_START)
        self._time.set_text(_clock(time_s))
        text, colour = self._state_at(time_s, moments)
        self._state.set(text=text, color=colour)
        self._canvas.restore_region(self._background)  # type: ignore[no-untyped-call]
        drawn = [artist for artist in ax.get_children() if artist not in shared]
        for artist in sorted(drawn, key=lambda artist: artist.get_zorder()):
            ax.draw_artist(artist)
            artist.remove()
        self._figure.draw_artist(self._time)
        self._figure.draw_artist(self._state)
        return np.array(self._canvas.buffer_rgba())[:, :, :3]

    def _draw_obstacles(self, moments: Sequence[Episode]) -> None:
        """Draw the obstacles that are not drawn as robots, each as a robot senses it."""
        robots = {run.name for run in self._runs}
        for label in self._runs[0].obstacles:
            if label in robots:
                continue
            numbers = [run.obstacles.index(label) + 1 for run in self._runs]
            pairs = list(zip(moments, numbers))
            moment, number = next(
                (pair for pair in pairs if pair[1] in within_range(pair[0], pair[0].ticks[-1])),
                pairs[0],
            )
            draw_obstacle(self._ax, moment, len(moment.ticks) - 1, number, label)

    def _state_at(self, time_s: float, moments: Sequence[Episode]) -> tuple[str, str]:
        """What the robots are doing, and at the end what became of them; with its colour."""
        is_over = all(time_s >= run.end_s for run in self._runs)
        results = [evaluate(run.episode) for run in self._runs] if is_over else []
        if len(moments) == 1:
            if results:
                colour = style.GOOD if results[0].success else style.BAD
                return format_values.outcome(results[0]), colour
            mode = moments[0].ticks[-1].mode
            return mode.value.replace("_", " "), style.MODE_COLOURS[mode]
        if results:
            good = sum(result.success for result in results)
            colour = style.GOOD if good == len(results) else style.BAD
            return f"{good} of {len(results)} succeeded", colour
        return f"{len(moments)} robots", style.INK

    def _draw_grid(self, longest_m: float) -> float:
        """Draw grid lines without numbers; return their distance in metres."""
        values = MaxNLocator(_CELLS, steps=[1, 2, 5, 10]).tick_values(0.0, longest_m)
        grid_m = float(values[1] - values[0])
        for axis in (self._ax.xaxis, self._ax.yaxis):
            axis.set_major_locator(MultipleLocator(grid_m))
        self._ax.grid(color=style.FAINT, linewidth=0.5)
        self._ax.tick_params(length=0.0, labelleft=False, labelbottom=False)
        return grid_m

    def _write_head(self, name: str, episode: Episode, roster: Sequence[str]) -> tuple[Text, Text]:
        """Write world and planner; return the texts of time and state, still empty."""
        y = self._sheet.height - 0.52 * _HEAD
        end_s = max(run.end_s for run in self._runs)
        world = format_values.one_line(world_name(name, episode, roster), 16)
        about = f"{world}, {format_values.one_line(episode.label, 12)}"
        looks = {"fontsize": style.NORMAL, "color": style.QUIET, "va": "center"}
        self._sheet.text(_WIDTH - _EDGE, y, about, ha="right", **looks)
        bold = {"fontsize": _TEXT, "fontweight": "bold", "va": "center"}
        time = self._sheet.text(0.0, y, _clock(end_s), ha="right", **bold)
        x = _EDGE + time.get_window_extent(self._sheet.renderer).width / self._figure.dpi
        time.set(x=x / _WIDTH, text="")
        return time, self._sheet.text(x + 0.13, y, "", **bold)

    def _write_foot(self, grid_m: float) -> None:
        """Explain the marks in one line."""
        entries = [(legend.disc(style.ROBOT), "robot")]
        if self._runs[0].obstacles and len(self._runs) == 1:
            entries.append((legend.disc(style.OBSTACLE), "obstacle"))
        entries.append((legend.disc({**style.RING, "facecolor": "#F8E6BF"}), "sensing range"))
        entries.append((Line2D([], [], **{**style.GOAL, "markersize": 12.0}), "goal"))
        self._sheet.legend(
            entries, _EDGE, _FOOT - 0.06, ncols=len(entries), handlelength=1.0,
            handletextpad=0.6, columnspacing=1.3,
        )  # fmt: skip
        looks = {"fontsize": style.SMALL, "color": style.QUIET, "va": "center", "ha": "right"}
        self._sheet.text(_WIDTH - _EDGE, 0.52 * _FOOT, f"grid {grid_m:g} m", **looks)


class _Run:
    """A run by name, and what it was at a time between its ticks."""

    def __init__(self, name: str, episode: Episode, roster: Sequence[str]) -> None:
        self.name, self.episode = name, episode
        self.obstacles = obstacle_names(name, episode, roster)
        self._times_s = [episode.time_s(tick.stamp_ns) for tick in episode.ticks]

    @property
    def end_s(self) -> float:
        """Time of the last tick."""
        return self._times_s[-1]

    def until(self, time_s: float) -> Episode:
        """The run cut at a time; a last tick there holds the pose between the two around it."""
        episode, ticks = self.episode, self.episode.ticks
        index = max(0, bisect_right(self._times_s, time_s) - 1)
        tick, late_s = ticks[index], time_s - self._times_s[index]
        if late_s <= 0.0:
            return replace(episode, ticks=ticks[: index + 1])
        pose = tick.pose
        if index + 1 < len(ticks):
            after = ticks[index + 1].pose
            share = late_s / (self._times_s[index + 1] - self._times_s[index])
            if is_finite(after.position):
                x = pose.x + share * (after.x - pose.x)
                y = pose.y + share * (after.y - pose.y)
                pose = Pose2D(x, y, pose.yaw)
        stamp_ns = tick.stamp_ns + round(late_s * 1e9)
        moment = replace(tick, stamp_ns=stamp_ns, pose=pose)
        return replace(episode, ticks=(*ticks[: index + 1], moment))


def _clock(time_s: float) -> str:
    return f"{time_s:.1f} s"


def _view(runs: Runs) -> View:
    """The part of the world that holds all runs; and their sensing ranges, unless large."""
    views = [choose_view(episode, closest_passes(episode))[0] for _, episode in runs]
    view = views[0]
    for other in views[1:]:
        view = view.around((other.left, other.bottom)).around((other.right, other.top))
    for _, episode in runs:
        reach = episode.sensor.sensing_range_m
        if reach <= _SMALL * max(view.width, view.height):
            for tick in episode.ticks:
                if is_finite(tick.pose.position):
                    view = view.around(tick.pose.position, 1.1 * reach)
    return fitted(view)[0]
