# SPDX-License-Identifier: Apache-2.0
"""The data of an HTML page: runs as plain JSON values, one list per column of the ticks.

Lengths in metres, times in seconds; null stands for a number that is not finite. Values shown as
text are exact; values that are only drawn are rounded to 0.1 mm.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mfba_planner.core.geometry import wrap_angle
from mfba_planner.core.option_specs import walk
from mfba_planner.core.planner_types import Bits, Mode
from mfba_planner.evaluation.metrics import evaluate, tick_clearances, within_range
from mfba_planner.perception.sensory_vector import SensorParams
from mfba_planner.planning.odometry_jump import is_odometry_jump
from mfba_planner.planning.planner_params import PlannerParams
from mfba_planner.recording.local_maps import NO_MAPS, RobotMaps
from mfba_planner.recording.perceived import NOTHING_PERCEIVED, Perceived, RobotPerceived
from mfba_planner.report import format_values
from mfba_planner.report.draw_perceived import widened
from mfba_planner.report.html.map_data import map_data, perceived_data
from mfba_planner.report.result_table import result_rows
from mfba_planner.report.run_events import closest_passes
from mfba_planner.report.sector_ring import ring_of
from mfba_planner.report.view_bounds import View, choose_view
from mfba_planner.simulation.batched_motion import Motion
from mfba_planner.simulation.decision_digest import digest
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import velocity_at
from mfba_planner.simulation.triggers import before_triggers

MOST_RUNS = 6  # side by side
MOST_ROBOTS = 36  # of a fleet in one scene: colours and dashes distinguish 36 lines
MOST_TICKS = 20_000  # of all runs: with more a browser opens the page slowly

Plain = dict[str, Any]
_MODES = list(Mode)


def page_data(
    runs: Sequence[tuple[str, Episode]],
    version: str,
    roster: Sequence[str] = (),
    maps: RobotMaps = NO_MAPS,
    perceived: RobotPerceived = NOTHING_PERCEIVED,
) -> Plain:
    """The data of the page of some named runs; runs in equal worlds share one view.

    roster: the names of all robots of the fleet, if the runs are of one; they share a scene.
    """
    is_fleet = in_one_scene(runs, roster)
    views = [_view(episode, perceived.get(name, ())) for name, episode in runs]
    shared = [
        _union(
            view
            for view, (_, other) in zip(views, runs)
            if roster or before_triggers(other.scenario) == before_triggers(episode.scenario)
        )
        for _, episode in runs
    ]
    # In a fleet's scene the other robots continue after one has arrived.
    longest = max((episode for _, episode in runs), key=lambda episode: len(episode.ticks))
    times_s = [longest.time_s(tick.stamp_ns) for tick in longest.ticks] if is_fleet else None
    return {
        "version": version,
        "fleet": is_fleet,
        "modes": [{"key": mode.value, "label": format_values.MODES[mode]} for mode in _MODES],
        "runs": [
            run_data(name, episode, view, obstacle_names(name, episode, roster), times_s)
            | {
                "maps": map_data(episode, maps.get(name, ())),
                "perceived": perceived_data(episode, perceived.get(name, ())),
            }
            for (name, episode), view in zip(runs, shared)
        ],
    }


def _view(episode: Episode, perceived: Sequence[Perceived]) -> View:
    view, _ = choose_view(episode, closest_passes(episode))
    return widened(view, perceived)[0] if perceived else view


def in_one_scene(runs: Sequence[tuple[str, Episode]], roster: Sequence[str]) -> bool:
    """Whether the runs are those of all robots of a fleet, which share a world."""
    return len(runs) == len(roster) > 1


def world_name(name: str, episode: Episode, roster: Sequence[str]) -> str:
    """The world's name; of a fleet the common name, without the robot's."""
    scenario = episode.scenario.name
    return scenario.removesuffix(f".{name}") if roster else scenario


def obstacle_names(name: str, episode: Episode, roster: Sequence[str]) -> list[str]:
    """Names of a run's obstacles: numbers, then the names of the other robots of its fleet."""
    others = [other for other in roster if other != name]
    own = len(episode.scenario.obstacles) - len(others)
    return [*(str(number) for number in range(1, own + 1)), *others]


def run_data(
    name: str,
    episode: Episode,
    view: View,
    names: Sequence[str],
    times_s: Sequence[float] | None = None,
) -> Plain:
    """The data of one run in a view of its world; names: those of the obstacles.

    times_s: the times at which obstacles are shown, if not those of the run's ticks.
    """
    result = evaluate(episode)
    reasons = list(dict.fromkeys(tick.reason for tick in episode.ticks))
    number_of = {reason: number for number, reason in enumerate(reasons)}
    ring = ring_of(episode, next((tick.vs for tick in episode.ticks if tick.vs), ()))
    return {
        "name": name,
        "title": format_values.run_title(episode),
        "success": result.success,
        "outcome": format_values.outcome(result),
        "world": {
            "name": episode.scenario.name,
            "description": episode.scenario.description,
            "view": [view.left, view.bottom, view.right, view.top],
            "start": list(episode.scenario.start_m),
            "goal": list(episode.scenario.goal_m),
            "robot_radius": episode.scenario.robot_radius_m,
            "footprint": [list(circle) for circle in episode.scenario.robot.footprint_m],
            "walls": _walls(episode),
            "segments": [_drawn(segment) for segment in episode.scenario.segments_m],
            "times": times_s,
            "obstacles": _obstacles(episode, names, times_s),
        },
        "reach": episode.sensor.sensing_range_m,
        "wedges": [ring.wedge(i) for i in range(ring.count)],
        "gap_headings": ring.gaps,
        "bits": format_values.bits(ring.of_headings),
        "reasons": reasons,
        "ticks": {
            "time": [episode.time_s(tick.stamp_ns) for tick in episode.ticks],
            "x": _exact(tick.pose.x for tick in episode.ticks),
            "y": _exact(tick.pose.y for tick in episode.ticks),
            "yaw": _yaws(episode),
            "mode": [_MODES.index(tick.mode) for tick in episode.ticks],
            "reason": [number_of[tick.reason] for tick in episode.ticks],
            "vs": [_digits(tick.vs) for tick in episode.ticks],
            "vg": [_digits(tick.vg) for tick in episode.ticks],
            "gap": [tick.gap for tick in episode.ticks],
            "waypoint_x": _exact(tick.waypoint[0] for tick in episode.ticks),
            "waypoint_y": _exact(tick.waypoint[1] for tick in episode.ticks),
            "vx": _exact(tick.velocity[0] for tick in episode.ticks),
            "vy": _exact(tick.velocity[1] for tick in episode.ticks),
            "speed": _exact(speeds(episode)),
            "clearance": _exact(clearances(episode)),
            "near": [list(within_range(episode, tick)) for tick in episode.ticks],
            "bats": [_drawn(v for bat in tick.candidates for v in bat) for tick in episode.ticks],
        },
        "result": [list(row) for row in result_rows(episode, result, names=names)],
        "configuration": _configuration(episode),
        "digest": digest(episode.ticks),
    }


def _union(views: Iterable[View]) -> View:
    found = list(views)
    whole = found[0]
    for view in found[1:]:
        whole = whole.around((view.left, view.bottom)).around((view.right, view.top))
    return whole


def _walls(episode: Episode) -> list[float] | None:
    walls = episode.scenario.walls
    return [*walls.lower_m, *walls.upper_m] if walls else None


def _obstacles(
    episode: Episode, names: Sequence[str], times_s: Sequence[float] | None
) -> list[Plain]:
    """Each obstacle's name and radius, and its centre and velocity at every tick."""
    scenario = episode.scenario
    times_s = times_s or [episode.time_s(tick.stamp_ns) for tick in episode.ticks]
    xs, ys = Motion(scenario).centers(np.array(times_s))
    moves = (
        [velocity_at(obstacle, t, scenario.walls) for t in times_s]
        for obstacle in scenario.obstacles
    )
    return [
        {
            "name": name,
            "radius": obstacle.radius_m,
            "x": _drawn(x.tolist()),
            "y": _drawn(y.tolist()),
            "vx": _drawn(vx for vx, _ in velocities),
            "vy": _drawn(vy for _, vy in velocities),
        }
        for name, obstacle, x, y, velocities in zip(names, scenario.obstacles, xs.T, ys.T, moves)
    ]


def clearances(episode: Episode) -> list[float]:
    """The smallest clearance (m) from each tick to the next; their minimum is that of Result.

    inf after the last tick, and while the robot is carried off.
    """
    gaps = [min(row, default=math.inf) for row in tick_clearances(episode)]
    afterwards = episode.ticks[1:]
    driven = [math.inf if is_odometry_jump(b.reason) else gap for gap, b in zip(gaps, afterwards)]
    return [*driven, math.inf]


def speeds(episode: Episode) -> list[float]:
    """The speed (m/s) decided at each tick."""
    return [math.hypot(*tick.velocity) for tick in episode.ticks]


def _yaws(episode: Episode) -> list[float | None]:
    """The heading (rad) at each tick, without a jump by a full turn; empty for a disc."""
    if not episode.scenario.robot.footprint_m:
        return []
    found: list[float | None] = []
    last = 0.0
    for tick in episode.ticks:
        yaw = tick.pose.yaw
        if math.isfinite(yaw):
            last += wrap_angle(yaw - last)
        found.append(round(last, 4) if math.isfinite(yaw) else None)
    return found


def _configuration(episode: Episode) -> list[list[Any]]:
    """(name, value, unit, is the default) of every option, after seed, driver and tick."""
    rows: list[list[Any]] = [
        ["seed", str(episode.seed), "", True],
        ["driver", episode.driver, "", True],
        ["tick", f"{episode.planner.tick_ns * 1e-9:.6f}", "s", True],
    ]
    for group, given, default in (
        ("planner", episode.planner, PlannerParams()),
        ("sensor", episode.sensor, SensorParams()),
    ):
        for (name, value, item), (_, usual, _) in zip(walk(given), walk(default)):
            shown = str(getattr(value, "value", value))
            rows.append([f"{group}.{name}", shown, item.metadata["spec"].unit, value == usual])
    return rows


def _digits(bits: Bits) -> str:
    return "".join(map(str, bits))


def _exact(values: Iterable[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def _drawn(values: Iterable[float]) -> list[float | None]:
    return [round(value, 4) if math.isfinite(value) else None for value in values]
