# SPDX-License-Identifier: Apache-2.0
"""A run for the Rerun viewer: world, decisions, and curves of clearance and speed.

Timelines are `sim_time` (s) and `tick`; lengths are in metres, z points up.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_left
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mfba_planner.core.errors import ConfigError
from mfba_planner.core.output_files import refuse_existing
from mfba_planner.core.planner_types import Decision, Mode
from mfba_planner.recording.local_maps import NO_MAPS, MapPoints, RobotMaps
from mfba_planner.simulation.batched_motion import Motion
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import velocity_at

from . import format_values, style
from .html.page_data import clearances, in_one_scene, obstacle_names, speeds
from .sector_ring import ring_of

_GREY, _DARK = style.FAINT, style.QUIET
_MAP_M = 0.025  # radius of the points of the local map
_AHEAD_S = 2.0  # arrows show the obstacles' motion over this time
_CIRCLE = np.linspace(0.0, 2.0 * math.pi, 49)


def save(
    runs: Sequence[tuple[str, Episode]],
    path: Path,
    roster: Sequence[str] = (),
    maps: RobotMaps = NO_MAPS,
) -> None:
    """Write a recording that `rerun FILE` opens. Raises OutputError where path exists.

    roster: the names of all robots of the fleet, if the runs are of one; they share a scene.
    maps: the local maps of each run, by its name.
    """
    refuse_existing(path)
    rerun, stream = _stream()
    stream.save(str(path), default_blueprint=_layout(rerun, runs, roster))
    _log_runs(rerun, stream, runs, roster, maps)


def show(
    runs: Sequence[tuple[str, Episode]], roster: Sequence[str] = (), maps: RobotMaps = NO_MAPS
) -> None:
    """Open the viewer's window on what save() would write; raises like require_viewer."""
    require_viewer()
    rerun, stream = _stream()
    stream.spawn(default_blueprint=_layout(rerun, runs, roster))
    _log_runs(rerun, stream, runs, roster, maps)


def require_viewer() -> None:
    """Raise ConfigError where there is no display, or no viewer is installed."""
    _stream()
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ConfigError(
            "no display (neither DISPLAY nor WAYLAND_DISPLAY is set); give --save FILE.rrd, or "
            "see `mfba report` for a page"
        )


def _stream() -> tuple[Any, Any]:
    try:
        import rerun
        import rerun.blueprint
    except ImportError:
        raise ConfigError(
            "viewer: rerun is not installed; pip install 'mfba_planner[view]', or see "
            "`mfba report` for a page"
        ) from None
    return rerun, rerun.RecordingStream("mfba_planner")


def _layout(rerun: Any, runs: Sequence[tuple[str, Episode]], roster: Sequence[str]) -> Any:
    """One column per run; a single column for a whole fleet."""
    view = rerun.blueprint
    groups = [runs] if in_one_scene(runs, roster) else [[run] for run in runs]
    columns = [
        view.Vertical(
            view.Spatial3DView(
                **_contents(group, "world"),
                name=", ".join(name for name, _ in group),
                overrides={f"{name}/world/trail": _since_the_start(view) for name, _ in group},
                eye_controls=_from_above(view, [episode for _, episode in group]),
            ),
            view.TextLogView(**_contents(group, "decision"), name="decisions"),
            view.TimeSeriesView(**_contents(group, "curves"), name="clearance (m), speed (m/s)"),
            row_shares=[6, 2, 2],
        )
        for group in groups
    ]
    return view.Blueprint(view.Horizontal(*columns), view.TimePanel(timeline="sim_time"))


def _contents(runs: Sequence[tuple[str, Episode]], entity: str) -> dict[str, Any]:
    """The entity paths that a view of some runs shows."""
    paths = [f"/{name}/{entity}" for name, _ in runs]
    return {"origin": paths[0]} if len(paths) == 1 else {"contents": [f"{p}/**" for p in paths]}


def _since_the_start(view: Any) -> Any:
    ranges = [
        view.VisibleTimeRange(
            timeline,
            start=view.TimeRangeBoundary.infinite(),
            end=view.TimeRangeBoundary.cursor_relative(),
        )
        for timeline in ("sim_time", "tick")
    ]
    return view.VisibleTimeRanges(ranges)


def _from_above(view: Any, episodes: Sequence[Episode]) -> Any:
    """A camera above the runs that has all paths in view, +y pointing away from it."""
    corners = [end for e in episodes for end in (e.scenario.start_m, e.scenario.goal_m)]
    corners += [tick.pose.position for episode in episodes for tick in episode.ticks]
    xs, ys = zip(*corners)
    x, y = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
    height_m = 1.2 * max(max(xs) - min(xs), max(ys) - min(ys)) + 2.0
    return view.EyeControls3D(
        position=(x, y - 0.3 * height_m, height_m), look_target=(x, y, 0.0), eye_up=(0.0, 0.0, 1.0)
    )


def _log_runs(
    rerun: Any,
    stream: Any,
    runs: Sequence[tuple[str, Episode]],
    roster: Sequence[str],
    maps: RobotMaps,
) -> None:
    is_fleet = in_one_scene(runs, roster)
    last, _ = max(runs, key=lambda run: len(run[1].ticks))
    for name, episode in runs:
        names = obstacle_names(name, episode, roster)
        if is_fleet:  # other robots are logged by their own run, common obstacles once
            names = [own for own in names if own not in roster and name == last]
        label = [name] if is_fleet else None
        logger = _RunLogger(rerun, stream, name, episode, names, label)
        logger.log_all()
        logger.log_maps(maps.get(name, ()))
    stream.flush()


class _RunLogger:
    """Log one run below the entity path of its name."""

    def __init__(
        self,
        rerun: Any,
        stream: Any,
        name: str,
        episode: Episode,
        names: Sequence[str],
        label: list[str] | None,
    ) -> None:
        """Log the first len(names) obstacles with these names, and the robot with this label."""
        self.rr, self.stream, self.name, self.episode = rerun, stream, name, episode
        self.names, self.label = names, label
        self.scenario = episode.scenario

    def log_all(self) -> None:
        """Log what never changes, then every tick."""
        self._log_static()
        times_s = [self.episode.time_s(tick.stamp_ns) for tick in self.episode.ticks]
        xs, ys = Motion(self.scenario).centers(np.array(times_s))
        curves = zip(clearances(self.episode), speeds(self.episode))
        for k, (tick, time_s, (gap_m, speed)) in enumerate(
            zip(self.episode.ticks, times_s, curves)
        ):
            self.stream.set_time("sim_time", duration=time_s)
            self.stream.set_time("tick", sequence=k)
            self._log_obstacles(xs[k], ys[k], time_s)
            self._log_robot(tick)
            self._log(
                "decision", self.rr.TextLog(f"{format_values.MODES[tick.mode]}: {tick.reason}")
            )
            if math.isfinite(gap_m):
                self._log("curves/clearance", self.rr.Scalars(gap_m))
            self._log("curves/speed", self.rr.Scalars(speed))

    def log_maps(self, maps: Sequence[MapPoints]) -> None:
        """Log each local map at its tick: it is shown until the next one."""
        stamps = [tick.stamp_ns for tick in self.episode.ticks]
        for found in maps:
            k = bisect_left(stamps, found.stamp_ns)
            if k == len(stamps):
                continue
            self.stream.set_time("sim_time", duration=self.episode.time_s(stamps[k]))
            self.stream.set_time("tick", sequence=k)
            flat = np.pad(found.points_m, ((0, 0), (0, 1)))
            self._log("world/map", self.rr.Points3D(flat, radii=_MAP_M, colors=_rgb(_GREY)))

    def _log(self, path: str, data: Any, *, static: bool = False) -> None:
        self.stream.log(f"{self.name}/{path}", data, static=static)

    def _log_static(self) -> None:
        rr, scenario = self.rr, self.scenario
        self._log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        ends = [_flat(scenario.start_m), _flat(scenario.goal_m)]
        marks = rr.Points3D(
            ends, radii=0.08, colors=[_rgb(_DARK), _rgb(style.GREEN)], labels=["start", "goal"]
        )
        self._log("world/task", marks, static=True)
        if scenario.walls:
            (left, low), (right, high) = scenario.walls.lower_m, scenario.walls.upper_m
            corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
            lines = rr.LineStrips3D([[_flat(corner) for corner in corners]], colors=_rgb(_DARK))
            self._log("world/walls", lines, static=True)

        if scenario.segments_m:
            strips = [[_flat(end[:2]), _flat(end[2:])] for end in scenario.segments_m]
            segments = rr.LineStrips3D(strips, colors=_rgb(_DARK), radii=0.03)
            self._log("world/segments", segments, static=True)

    def _log_obstacles(self, xs: Any, ys: Any, time_s: float) -> None:
        if not self.names:
            return
        rr, named = self.rr, zip(self.scenario.obstacles, self.names, xs.tolist(), ys.tolist())
        there = [entry for entry in named if not math.isnan(entry[2])]
        obstacles = [obstacle for obstacle, *_ in there]
        centers = [(x, y, 0.0) for _, _, x, y in there]
        radii, labels = [o.radius_m for o in obstacles], [name for _, name, *_ in there]
        self._log(
            "world/obstacles",
            rr.Points3D(centers, radii=radii, colors=_rgb(_GREY), labels=labels),
        )
        edges = [
            _ring(center, self.scenario.enlarged_radius(obstacle))
            for center, obstacle in zip(centers, obstacles)
        ]
        self._log("world/enlarged", rr.LineStrips3D(edges, colors=_rgb(_GREY)))
        moves = [velocity_at(obstacle, time_s, self.scenario.walls) for obstacle in obstacles]
        ahead = [(vx * _AHEAD_S, vy * _AHEAD_S, 0.0) for vx, vy in moves]
        self._log("world/moves", rr.Arrows3D(origins=centers, vectors=ahead, colors=_rgb(_GREY)))

    def _log_robot(self, tick: Decision) -> None:
        rr, position = self.rr, (tick.pose.x, tick.pose.y, 0.0)
        color = _rgb(style.MODE_COLOURS[tick.mode])
        circles = self.scenario.robot_circles(tick.pose)
        centers, radii = [_flat(center) for center, _ in circles], [r for _, r in circles]
        body = rr.Points3D(centers, radii=radii, colors=color, labels=[self.label])
        self._log("world/robot", body)
        reach = self.episode.sensor.sensing_range_m
        self._log(
            "world/sensor/ring",
            rr.LineStrips3D([_ring(position, reach)], colors=_rgb(style.ORANGE)),
        )
        ring = ring_of(self.episode, tick.vs)
        set_sectors = [
            _sector(position, reach, *ring.wedge(k)) for k, bit in enumerate(tick.vs) if bit
        ]
        self._log(
            "world/sensor/sectors",
            rr.LineStrips3D(set_sectors, colors=_rgb(style.ORANGE), radii=0.02),
        )
        bats = rr.Points3D([_flat(bat) for bat in tick.candidates], radii=0.02, colors=_rgb(_DARK))
        self._log("world/bats", bats)
        if tick.mode not in (Mode.STOPPED, Mode.IDLE):
            step = rr.LineStrips3D([[position, _flat(tick.waypoint)]], colors=color)
            self._log("world/waypoint", step)
        self._log("world/trail", rr.Points3D([position], radii=0.04, colors=color))


def _rgb(color: str) -> list[int]:
    return [int(color[k : k + 2], 16) for k in (1, 3, 5)]


def _flat(point: Sequence[float]) -> tuple[float, float, float]:
    return (point[0], point[1], 0.0)


def _ring(center: Sequence[float], radius_m: float) -> Any:
    x, y = center[0] + radius_m * np.cos(_CIRCLE), center[1] + radius_m * np.sin(_CIRCLE)
    return np.stack([x, y, np.zeros_like(x)], axis=1)


def _sector(center: Sequence[float], radius_m: float, start: float, end: float) -> Any:
    angles = np.linspace(start, end, 7)
    x = np.concatenate([[0.0], radius_m * np.cos(angles), [0.0]]) + center[0]
    y = np.concatenate([[0.0], radius_m * np.sin(angles), [0.0]]) + center[1]
    return np.stack([x, y, np.zeros_like(x)], axis=1)
