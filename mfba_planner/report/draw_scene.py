# SPDX-License-Identifier: Apache-2.0
"""Draw the world of a run to scale: path, obstacles and tracks, sensing rings, walls.

The gid of every artist names its kind: `path:blocked`, `track:3`, `ring:0`, `goal`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import groupby

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle, Wedge
from matplotlib.patheffects import withStroke

from mfba_planner.core.geometry import Point, bearing, distance, towards
from mfba_planner.core.planner_types import Bits, Decision, Mode
from mfba_planner.simulation.episode import Episode, Outcome
from mfba_planner.simulation.obstacle_motion import Obstacle, center_at
from mfba_planner.simulation.recorded_motion import is_present

from . import style
from .run_events import Pass, encounter_ticks, is_finite, span_s, stretches, track
from .sector_ring import Ring, ring_of
from .view_bounds import View

Z_SECTOR, Z_TRACK, Z_OBSTACLE, Z_RING, Z_PATH, Z_MARK = (2.0 + 0.1 * i for i in range(6))
MOST_NUMBERS = 40  # of obstacles; more would cover the picture
_LONG = 0.75  # times (width + height of the view): longer tracks would cover the picture
_ARROW_M = 1e-3  # length of track before an arrow's tip that gives its direction
_ARROW_TRIES = 400  # positions tried for an arrow, from the end of the track backwards


def draw_scene(
    ax: Axes, episode: Episode, view: View, passes: Sequence[Pass], encountered: Collection[int]
) -> None:
    """Draw a run into axes; encountered: numbers of the obstacles that came within SR."""
    draw_walls(ax, episode)
    for moment in passes:
        obstacle = episode.scenario.obstacles[moment.number - 1]
        _track(ax, episode, view, obstacle, moment)
        _obstacle(ax, episode, obstacle, moment)
        if moment.number in encountered:
            _connect(ax, episode, moment)
    for index, tick in enumerate(encounter_ticks(episode)):
        if is_finite(tick.pose.position):
            _ring(ax, episode, index, tick)
    draw_path(ax, episode)
    draw_ends(ax, episode)


def patch(ax: Axes, shape: Circle | Wedge | Rectangle | FancyArrowPatch, gid: str) -> None:
    """Add a shape with a gid."""
    shape.set_gid(gid)
    ax.add_patch(shape)


def line(ax: Axes, points: Sequence[Point], gid: str, **looks: object) -> None:
    """Add a line with a gid."""
    xs, ys = zip(*points)
    drawn = Line2D(xs, ys, **looks)  # type: ignore[arg-type]
    drawn.set_gid(gid)
    ax.add_line(drawn)


def draw_walls(ax: Axes, episode: Episode) -> None:
    """Draw the wall segments and the rectangle that obstacles bounce from, if there are any."""
    walls = episode.scenario.walls
    if walls:
        (left, bottom), (right, top) = walls.lower_m, walls.upper_m
        room = Rectangle((left, bottom), right - left, top - bottom, fill=False, **style.LIMIT)
        patch(ax, room, "limit")
    if episode.scenario.segments_m:
        lines = [[(x0, y0), (x1, y1)] for x0, y0, x1, y1 in episode.scenario.segments_m]
        drawn = LineCollection(lines, capstyle="round", zorder=Z_OBSTACLE, **style.WALL)
        drawn.set_gid("wall")
        ax.add_collection(drawn, autolim=False)


def _track(ax: Axes, episode: Episode, view: View, obstacle: Obstacle, moment: Pass) -> None:
    """The obstacle's track over the run; if that is long, only the track around its pass."""
    walls = episode.scenario.walls
    t0, t1 = span_s(episode)
    kind, longest = "track", _LONG * (view.width + view.height)
    if (walls or obstacle.trajectory) and obstacle.top_speed_mps * (t1 - t0) > longest:
        reach = 0.5 * longest / obstacle.top_speed_mps
        t0, t1 = max(t0, moment.time_s - reach), min(t1, moment.time_s + reach)
        kind = "track_near_pass"
    if obstacle.top_speed_mps * (t1 - t0) <= 0.0:
        return
    points = track(obstacle, walls, t0, t1)
    if not points:
        return
    line(ax, points, f"{kind}:{moment.number}", zorder=Z_TRACK, **style.TRACK)
    for t in np.linspace(t1, t0, _ARROW_TRIES, endpoint=False).tolist():
        tip = center_at(obstacle, t, walls)
        if not is_present(obstacle, t):
            continue
        if view.holds(tip) and distance(tip, moment.center_m) > obstacle.radius_m:
            tail = center_at(obstacle, t - _ARROW_M / obstacle.top_speed_mps, walls)
            if tail == tip:  # the obstacle stands still at that time
                continue
            arrow = FancyArrowPatch(tail, tip, zorder=Z_TRACK, **style.ARROW)
            patch(ax, arrow, f"arrow:{moment.number}")
            break


def _obstacle(ax: Axes, episode: Episode, obstacle: Obstacle, moment: Pass) -> None:
    enlarged = episode.scenario.enlarged_radius(obstacle)
    body = Circle(moment.center_m, obstacle.radius_m, zorder=Z_OBSTACLE, **style.OBSTACLE)
    edge = Circle(moment.center_m, enlarged, fill=False, zorder=Z_OBSTACLE, **style.ENLARGED)
    patch(ax, body, f"obstacle:{moment.number}")
    patch(ax, edge, f"enlarged:{moment.number}")


def _connect(ax: Axes, episode: Episode, moment: Pass) -> None:
    """A line from the robot's centre to the enlarged edge; a point if they touch.

    With a footprint its circles, and a line from the edge of the nearest one to the obstacle's.
    """
    center, reach_m = moment.robot.position, 0.0
    if episode.scenario.robot.footprint_m:
        circles = episode.scenario.robot_circles(moment.robot)
        for own, radius in circles:
            body = Circle(own, radius, zorder=Z_OBSTACLE, **style.ROBOT)
            patch(ax, body, f"robot:{moment.number}")
        center, reach_m = min(circles, key=lambda c: distance(c[0], moment.center_m) - c[1])
    heading = bearing(center, moment.center_m)
    ends = [towards(center, heading, far) for far in (reach_m, reach_m + max(0.0, moment.gap_m))]
    line(ax, ends, f"pass:{moment.number}", zorder=Z_MARK, markevery=[0], **style.PASS)


def _ring(ax: Axes, episode: Episode, index: int, tick: Decision) -> None:
    """SR around the robot, the sectors that are set, and the enlarged obstacles within SR."""
    position, reach = tick.pose.position, episode.sensor.sensing_range_m
    bits = ring_of(episode, tick.vs)
    kind = "heading" if bits.of_headings else "sector"
    draw_sectors(ax, position, reach, tick.vs, f"{kind}:{index}", bits)
    circles = episode.scenario.enlarged(episode.time_s(tick.stamp_ns))
    for center, radius in circles:
        if distance(position, center) - radius <= reach:
            sensed = Circle(center, radius, fill=False, zorder=Z_RING, **style.SENSED)
            patch(ax, sensed, f"sensed:{index}")
    ring = Circle(position, reach, fill=False, zorder=Z_RING, **style.RING)
    patch(ax, ring, f"ring:{index}")


def draw_sectors(ax: Axes, center: Point, reach: float, bits: Bits, gid: str, ring: Ring) -> None:
    """Fill the sectors (or headings) that are set, out to reach (m)."""
    for first, count in _runs(bits):
        start, end = map(math.degrees, ring.wedge(first, count))
        patch(ax, Wedge(center, reach, start, end, zorder=Z_SECTOR, **style.SECTOR), gid)


def _runs(bits: Bits) -> Iterator[tuple[int, int]]:
    """Yield (first, count) of neighbouring sectors that are set."""
    first = 0
    for bit, group in groupby(bits):
        count = len(list(group))
        if bit:
            yield first, count
        first += count


def draw_recorded_path(ax: Axes, episode: Episode) -> None:
    """Draw the path of another run, for comparison."""
    points = [tick.pose.position for tick in episode.ticks if is_finite(tick.pose.position)]
    line(ax, points, "recorded", zorder=Z_TRACK, **style.RECORDED)


def draw_path(ax: Axes, episode: Episode) -> None:
    """Draw one line per stretch of a mode, and a mark where the robot stands still."""
    runs_of_modes = stretches(episode)
    for mode in Mode:
        # A single point would draw nothing: the last point is repeated.
        lines = [[*s.points_m, s.points_m[-1]] for s in runs_of_modes if s.mode is mode]
        if not lines:
            continue
        collection = LineCollection(
            lines,
            colors=style.MODE_COLOURS[mode],
            linewidths=style.MODE_WIDTHS.get(mode, style.MODE_WIDTH),
            capstyle="round",
            joinstyle="round",
            zorder=Z_PATH,
        )
        collection.set_gid(f"path:{mode.value}")
        ax.add_collection(collection, autolim=False)
        if mode in style.STANDING:
            looks = {"color": style.MODE_COLOURS[mode], "linestyle": "none", "zorder": Z_MARK}
            positions = [line[0] for line in lines]
            line(ax, positions, f"standing:{mode.value}", **looks, **style.STANDING[mode])


def draw_ends(ax: Axes, episode: Episode, start: style.Looks = style.START) -> None:
    """Mark start, goal, and the end of a run that did not reach the goal."""
    # Above the goal: where a start is another robot's goal too, the star's tips stay visible.
    line(ax, [episode.scenario.start_m], "start", zorder=Z_MARK + 0.05, **start)
    line(ax, [episode.scenario.goal_m], "goal", zorder=Z_MARK, **style.GOAL)
    if episode.outcome is not Outcome.GOAL_REACHED:
        last = episode.ticks[-1].pose.position
        line(ax, [last], "end", zorder=Z_MARK, **style.END)


def label_numbers(ax: Axes, episode: Episode, view: View, passes: Sequence[Pass]) -> None:
    """Write each visible obstacle's number into its circle, or at a free position beside it.

    Of more than MOST_NUMBERS obstacles only the nearest passes get one, where there is room.
    """
    points_per_m = ax.bbox.width / ax.figure.dpi * 72.0 / view.width
    size = 1.35 * style.SMALL / points_per_m  # of a number, in metres
    bodies = [(p.center_m, episode.scenario.obstacles[p.number - 1].radius_m) for p in passes]
    taken: list[Point] = []

    def is_free(spot: Point, own: Point) -> bool:
        apart = all(distance(spot, other) > size for other in taken)
        return apart and all(distance(spot, c) > r + 0.3 * size for c, r in bodies if c != own)

    numbered, crowded = list(zip(passes, bodies)), len(passes) > MOST_NUMBERS
    if crowded:
        numbered = sorted(numbered, key=lambda pair: pair[0].gap_m)[:MOST_NUMBERS]
    for moment, (center, radius) in numbered:
        if not view.holds(center):
            continue
        reach = max(radius, 0.3 * size) + 0.6 * size
        spots = [center] if radius > 0.5 * size else []
        spots += [
            towards(center, math.radians(45.0 * turn), reach * far)
            for far in (1.0, 1.8)
            for turn in range(1, 9)
        ]
        spots = [spot for spot in spots if view.holds(spot, -0.5 * size)] or spots
        found = next((spot for spot in spots if is_free(spot, center)), None)
        if found is None and crowded:
            continue
        spot = found or spots[0]
        taken.append(spot)
        text = ax.text(*spot, str(moment.number), zorder=Z_MARK, **style.NUMBER)
        text.set_gid(f"number:{moment.number}")
        if spot != center:
            text.set_path_effects([withStroke(**style.HALO)])


def kinds(artists: Collection[Artist]) -> set[str]:
    """The kinds of artists: their gids without obstacle numbers."""
    gids = {artist.get_gid() or "" for artist in artists}
    return {gid if gid.startswith(("path", "standing")) else gid.split(":")[0] for gid in gids}
