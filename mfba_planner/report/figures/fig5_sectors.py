# SPDX-License-Identifier: Apache-2.0
"""Fig. 5: sensing range, sectors, tangents, and the sensory vector of the paper's example."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mfba_planner.core.geometry import Point, bearing, distance, tangent_half_angle, towards
from mfba_planner.perception.sensory_vector import sense_circles, sensory_vector

from .. import legend, style
from ..draw_scene import Z_TRACK, line
from ..figure_sheet import EDGE, Sheet
from .sketch_elements import (
    EXAMPLE,
    ORIGIN,
    SENSOR,
    draw_obstacle,
    draw_ring,
    example_vs,
    hide_axes,
    write,
)

_SIDE, _PANEL = 5.8, 2.7  # inches
_REACH, _SPOKE, _BITS = 2.4, 2.05, 2.25  # metres


def draw() -> Figure:
    """Draw the ring of sectors and the example's obstacles."""
    sheet = Sheet(EDGE + _SIDE + _PANEL + EDGE, _SIDE + 1.0)
    bits = example_vs()
    sheet.head(
        "Fig. 5: detection by twelve sectors",
        f"Vs = {{{' '.join(map(str, bits))}}}, computed from the obstacles drawn here",
    )
    ax = sheet.axes(EDGE, EDGE / 2, _SIDE, _SIDE)
    hide_axes(ax, _REACH)
    draw_ring(ax, bits, _SPOKE, _BITS)
    for number, (center, radius) in enumerate(EXAMPLE.enlarged(0.0), start=1):
        sensed = distance(ORIGIN, center) - radius <= SENSOR.sensing_range_m
        body = EXAMPLE.obstacles[number - 1].radius_m
        draw_obstacle(ax, center, body, radius, sensed)
        write(ax, center, f"Obs{number}")
        if sensed:
            _tangents(ax, center, radius)
    x = EDGE + _SIDE + 0.1
    y = sheet.legend([*legend.entries(ax), *_more()], x, _SIDE - 0.2) - 0.4
    sheet.text(x, y, "Sectors set", fontsize=style.SMALL, fontweight="bold")
    for number in range(1, len(EXAMPLE.obstacles) + 1):
        y -= 0.2
        sheet.text(x, y, f"by obstacle {number}", fontsize=style.SMALL)
        sheet.text(x + 1.9, y, _set_by(number), fontsize=style.SMALL, ha="right")
    return sheet.figure


def _set_by(number: int) -> str:
    """The sectors that one obstacle of the example sets."""
    detections = sense_circles(ORIGIN, [EXAMPLE.enlarged(0.0)[number - 1]], SENSOR)
    names = [f"S{i}" for i, bit in enumerate(sensory_vector(detections), start=1) if bit]
    return ", ".join(names) or "none: out of range"


def _tangents(ax: Axes, center: Point, radius: float) -> None:
    """Both tangents from the robot, out to where they touch the enlarged circle."""
    d, heading = distance(ORIGIN, center), bearing(ORIGIN, center)
    half = tangent_half_angle(d, radius)
    reach = math.sqrt(d * d - radius * radius)
    for side in (-half, half):
        ends = [ORIGIN, towards(ORIGIN, heading + side, reach)]
        line(ax, ends, "tangent", zorder=Z_TRACK, **style.TANGENT)


def _more() -> list[legend.Entry]:
    return [
        (Line2D([], [], **style.TANGENT), "tangents (T_P1, T_P2)"),
        (Line2D([], [], **style.SPOKE), "sector boundary"),
    ]
