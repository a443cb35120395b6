# SPDX-License-Identifier: Apache-2.0
"""Draw one tick of a run to scale: robot, path so far, obstacles, sectors that are set."""

from __future__ import annotations

from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch

from mfba_planner.evaluation.metrics import within_range
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.obstacle_motion import bounce_times, center_at
from mfba_planner.simulation.recorded_motion import is_present

from . import style
from .draw_scene import (
    Z_MARK,
    Z_OBSTACLE,
    Z_PATH,
    Z_RING,
    Z_TRACK,
    draw_ends,
    draw_path,
    draw_sectors,
    draw_walls,
    line,
    patch,
)
from .run_events import span_s, track
from .sector_ring import ring_of

AHEAD_S = 4.0  # an arrow shows the motion over this time

Z_ROBOT = 0.5 * (Z_PATH + Z_MARK)  # below the goal, which stays visible


def draw_snapshot(ax: Axes, episode: Episode, index: int) -> None:
    """Draw tick number index (from 0) of a run, with the obstacles at that time."""
    draw_walls(ax, episode)
    for number in range(1, len(episode.scenario.obstacles) + 1):
        draw_track(ax, episode, index, number)
        draw_obstacle(ax, episode, index, number, str(number))
    draw_robot(ax, episode, index)
    draw_ends(ax, episode)


def draw_robot(ax: Axes, episode: Episode, index: int) -> None:
    """Draw the robot at a tick: path so far, sensing range, sectors (headings) set, body."""
    tick = episode.ticks[index]
    position, reach = tick.pose.position, episode.sensor.sensing_range_m
    ring = ring_of(episode, tick.vs)
    draw_sectors(ax, position, reach, tick.vs, "closing" if ring.of_headings else "set", ring)
    patch(ax, Circle(position, reach, fill=False, zorder=Z_RING, **style.RING), "reach")
    draw_path(ax, replace(episode, ticks=episode.ticks[: index + 1]))
    for center, radius in episode.scenario.robot_circles(tick.pose):
        patch(ax, Circle(center, radius, zorder=Z_ROBOT, **style.ROBOT), "robot")


def draw_track(ax: Axes, episode: Episode, index: int, number: int) -> None:
    """Draw the path of obstacle `number` (from 1) from the first tick to this one."""
    scenario, time_s = episode.scenario, episode.time_s(episode.ticks[index].stamp_ns)
    obstacle, start_s = scenario.obstacles[number - 1], span_s(episode)[0]
    if obstacle.top_speed_mps > 0.0 and time_s > start_s:
        points = track(obstacle, scenario.walls, start_s, time_s)
        if points:
            line(ax, points, f"past:{number}", zorder=Z_TRACK, **style.TRACK)


def draw_obstacle(ax: Axes, episode: Episode, index: int, number: int, label: str) -> None:
    """Draw obstacle `number` (from 1), if it is there at a tick.

    Its body, the enlarged edge, and an arrow of its next 4 s.
    """
    scenario, tick = episode.scenario, episode.ticks[index]
    obstacle = scenario.obstacles[number - 1]
    time_s = episode.time_s(tick.stamp_ns)
    if not is_present(obstacle, time_s):
        return
    center = center_at(obstacle, time_s, scenario.walls)
    sensed = number in within_range(episode, tick)
    edge = style.SENSED if sensed else style.ENLARGED
    enlarged = Circle(
        center, scenario.enlarged_radius(obstacle), fill=False, zorder=Z_OBSTACLE, **edge
    )
    patch(ax, enlarged, f"{'in_range' if sensed else 'enlarged'}:{number}")
    if obstacle.top_speed_mps > 0.0:
        bounces = bounce_times(obstacle, time_s, time_s + AHEAD_S, scenario.walls)
        tip = center_at(obstacle, min([time_s + AHEAD_S, *bounces]), scenario.walls)
        if tip != center:  # not if the obstacle stands still for now
            arrow = FancyArrowPatch(center, tip, zorder=Z_OBSTACLE, **style.MOTION)
            patch(ax, arrow, f"motion:{number}")
    body = Circle(center, obstacle.radius_m, zorder=Z_OBSTACLE, **style.OBSTACLE)
    patch(ax, body, f"body:{number}")
    text = ax.text(*center, label, zorder=Z_MARK, clip_on=True, **style.NUMBER)
    text.set_gid(f"number:{number}")
