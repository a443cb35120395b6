# SPDX-License-Identifier: Apache-2.0
"""The view of a picture: the rectangle of the world that it shows, and its scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from mfba_planner.core.geometry import Point
from mfba_planner.simulation.episode import Episode

from .run_events import Pass, encounter_ticks, is_finite

_NEAR = 0.35  # times the trip's extent: what is further away is left out, for a larger path
_MARGIN = 0.04
_WIDEST, _HIGHEST = 8.0, 6.4  # of the axes, inches
_SLIMMEST, _LOWEST = 4.6, 4.0


class View(NamedTuple):
    """A rectangle of the world, edges in metres."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def width(self) -> float:
        """Width in metres."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height in metres."""
        return self.top - self.bottom

    def around(self, center: Point, radius: float = 0.0) -> View:
        """The view extended to hold a circle, or a point."""
        (x, y), r = center, radius
        left, bottom = min(self.left, x - r), min(self.bottom, y - r)
        return View(left, bottom, max(self.right, x + r), max(self.top, y + r))

    def grown(self, dx: float, dy: float) -> View:
        """The view with a margin added on each side."""
        return View(self.left - dx, self.bottom - dy, self.right + dx, self.top + dy)

    def holds(self, point: Point, slack: float = 0.0) -> bool:
        """Whether a point is inside, or at most slack (m) outside."""
        x, y = point
        return (
            self.left - slack <= x <= self.right + slack
            and self.bottom - slack <= y <= self.top + slack
        )


def choose_view(episode: Episode, passes: Sequence[Pass]) -> tuple[View, float]:
    """The view of a run and its scale in inches per metre.

    It holds the whole path, and rings, walls and obstacles unless far away or too large.
    """
    scenario = episode.scenario
    trip = View(*scenario.start_m, *scenario.start_m).around(scenario.goal_m)
    for tick in episode.ticks:
        if is_finite(tick.pose.position):
            trip = trip.around(tick.pose.position)
    near = _NEAR * max(trip.width, trip.height)
    reach = episode.sensor.sensing_range_m
    circles = [(tick.pose.position, reach) for tick in encounter_ticks(episode)]
    circles += [
        (p.center_m, scenario.enlarged_radius(scenario.obstacles[p.number - 1])) for p in passes
    ]
    if scenario.walls:
        circles += [(scenario.walls.lower_m, 0.0), (scenario.walls.upper_m, 0.0)]
    for x0, y0, x1, y1 in scenario.segments_m:
        circles += [((x0, y0), 0.0), ((x1, y1), 0.0)]
    circles = [(center, radius) for center, radius in circles if radius <= near]
    view = _holding(trip, [c for c in circles if trip.holds(c[0], near)])
    margin = max(scenario.robot_radius_m, _MARGIN * max(view.width, view.height))
    view, _ = fitted(view.grown(margin, margin))
    # fitted() may have brought a circle partly into view: then show all of it.
    cut = [(c, 1.1 * r) for c, r in circles if view.holds(c, r)]
    return fitted(_holding(view, cut))


def _holding(view: View, circles: Sequence[tuple[Point, float]]) -> View:
    for center, radius in circles:
        view = view.around(center, radius)
    return view


def fitted(view: View) -> tuple[View, float]:
    """The view, extended to the minimum size of a figure, and its scale in inches per metre."""
    scale = min(_WIDEST / view.width, _HIGHEST / view.height)
    dx, dy = _SLIMMEST / scale - view.width, _LOWEST / scale - view.height
    return view.grown(max(0.0, dx) / 2.0, max(0.0, dy) / 2.0), scale
