# SPDX-License-Identifier: Apache-2.0
"""Shared by the sketches of Fig. 4 to 6: the ring of sectors, and the paper's example of Vs."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from mfba_planner.core.geometry import Point, towards
from mfba_planner.core.planner_types import Bits
from mfba_planner.perception.sensory_vector import SensorParams, sense_circles, sensory_vector
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

from .. import style
from ..draw_scene import Z_MARK, Z_OBSTACLE, Z_RING, draw_sectors, line, patch
from ..sector_ring import Ring

SENSOR = SensorParams()
ORIGIN: Point = (0.0, 0.0)


def _at(heading_deg: float, distance_m: float) -> Obstacle:
    center = towards(ORIGIN, math.radians(heading_deg), distance_m)
    return Obstacle(center_m=center, radius_m=0.3)


# Fig. 5: obstacle 1 sets sectors 1 and 2, obstacles 3 and 4 set 7, 8 and 9; 2 is out of range.
EXAMPLE = Scenario(
    name="Fig. 5",
    start_m=ORIGIN,
    goal_m=(3.0, 3.0),
    obstacles=(_at(30.0, 1.30), _at(118.0, 1.6), _at(207.0, 1.35), _at(242.0, 1.35)),
)


def example_vs() -> Bits:
    """Vs of the example, by perception.sensory_vector."""
    return sensory_vector(sense_circles(ORIGIN, EXAMPLE.enlarged(0.0), SENSOR))


def hide_axes(ax: Axes, reach: float) -> None:
    """Make the axes a square view without frame or grid, from -reach to reach (m)."""
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_axis_off()


def draw_ring(ax: Axes, bits: Bits, spoke_m: float, bits_m: float | None = None) -> None:
    """Draw named sectors around the robot, a particle; their bits at a distance of bits_m."""
    n = len(bits)
    sr = SENSOR.sensing_range_m
    draw_sectors(ax, ORIGIN, sr, bits, "set", Ring(n))
    patch(ax, Circle(ORIGIN, sr, fill=False, zorder=Z_RING, **style.RING), "reach")
    for sector, bit in enumerate(bits, start=1):
        spoke = [ORIGIN, towards(ORIGIN, 2.0 * math.pi * sector / n, spoke_m)]
        line(ax, spoke, "spoke", zorder=1.5, **style.SPOKE)
        middle = 2.0 * math.pi * (sector - 0.5) / n
        write(ax, towards(ORIGIN, middle, 0.78 * sr), f"S{sector}", color=style.INK)
        if bits_m is not None:
            looks = style.BITS[bit]
            write(ax, towards(ORIGIN, middle, bits_m), str(bit), **looks)
    line(ax, [ORIGIN], "particle", zorder=Z_MARK, **style.PARTICLE)


def draw_obstacle(ax: Axes, center: Point, radius: float, enlarged: float, sensed: bool) -> None:
    """Draw an obstacle and its enlarged edge."""
    edge, kind = (style.SENSED, "in_range") if sensed else (style.ENLARGED, "enlarged")
    patch(ax, Circle(center, radius, zorder=Z_OBSTACLE - 0.15, **style.OBSTACLE), "outline")
    patch(ax, Circle(center, enlarged, fill=False, zorder=Z_OBSTACLE, **edge), kind)


def write(ax: Axes, at: Point, text: str, **looks: object) -> None:
    """Write a small text with a halo, readable on any background."""
    wanted: style.Looks = {"ha": "center", "va": "center", "fontsize": style.SMALL, **looks}
    label = ax.text(*at, text, zorder=Z_MARK, **wanted)
    label.set_path_effects([withStroke(**style.HALO)])
