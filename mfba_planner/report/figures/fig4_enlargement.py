# SPDX-License-Identifier: Apache-2.0
"""Fig. 4: obstacles grow by the robot's radius, and the robot becomes a particle."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mfba_planner.core.geometry import Point
from mfba_planner.simulation.obstacle_motion import Obstacle
from mfba_planner.simulation.scenario import Scenario

from .. import style
from ..draw_scene import Z_MARK, line, patch
from ..figure_sheet import EDGE, Sheet
from .sketch_elements import draw_obstacle, write

WORLD = Scenario(
    name="Fig. 4",
    start_m=(-0.75, 0.0),
    goal_m=(3.0, 0.0),
    obstacles=(Obstacle(center_m=(0.55, 0.0), radius_m=0.3),),
)
_WIDTH, _HEIGHT, _GAP = 4.0, 2.5, 0.5  # inches


def draw() -> Figure:
    """Draw the world, and the enlarged obstacles that the planner gets."""
    sheet = Sheet(2 * EDGE + 2 * _WIDTH + _GAP, _HEIGHT + 1.45)
    (obstacle,) = WORLD.obstacles
    sheet.head(
        "Fig. 4: enlarging the obstacles",
        "the robot's radius is added to every obstacle's; the robot itself becomes a point",
    )
    captions = ("the world", "the planner's input")
    axes = []
    for column, caption in enumerate(captions):
        x = EDGE + column * (_WIDTH + _GAP)
        axes.append(sheet.axes(x, EDGE, _WIDTH, _HEIGHT))
        sheet.text(x, EDGE + _HEIGHT + 0.1, f"({'ab'[column]})", fontweight="bold")
        sheet.text(x + 0.28, EDGE + _HEIGHT + 0.1, caption)
        _frame(axes[-1])
    robot, center = WORLD.start_m, obstacle.center_m
    r_mr, r_obs = WORLD.robot_radius_m, obstacle.radius_m
    enlarged = WORLD.enlarged_radius(obstacle)
    patch(axes[0], Circle(robot, r_mr, zorder=2.0, **style.ROBOT), "robot")
    patch(axes[0], Circle(center, r_obs, zorder=2.0, **style.OBSTACLE), "body")
    _radius(axes[0], robot, r_mr, f"r_MR = {r_mr:g} m")
    _radius(axes[0], center, r_obs, f"obstacle {r_obs:g} m")
    draw_obstacle(axes[1], center, r_obs, enlarged, sensed=False)
    line(axes[1], [robot], "particle", zorder=Z_MARK, **style.PARTICLE)
    write(axes[1], (robot[0], robot[1] - 0.2), "robot: a particle")
    _radius(axes[1], center, enlarged, f"r_Obs = {r_obs:g} + {r_mr:g} = {enlarged:g} m")
    return sheet.figure


def _frame(ax: Axes) -> None:
    reach = 1.3
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach * _HEIGHT / _WIDTH, reach * _HEIGHT / _WIDTH)
    ax.set_xticks([])
    ax.set_yticks([])


def _radius(ax: Axes, center: Point, radius: float, label: str) -> None:
    """A measuring arrow from the centre upwards, with its label above the circle."""
    x, y = center
    ax.annotate("", (x, y + radius), (x, y), zorder=Z_MARK,
                arrowprops={**style.MEASURE, "shrinkA": 0.0, "shrinkB": 0.0})  # fmt: skip
    write(ax, (x, y + radius + 0.1), label)
