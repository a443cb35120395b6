# SPDX-License-Identifier: Apache-2.0
"""The legend of a scene: an entry for each kind of mark that is drawn."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mfba_planner.core.planner_types import Mode

from . import format_values, style
from .draw_scene import kinds

Entry = tuple[Line2D | Patch, str]


def entries(*axes: Axes) -> list[Entry]:
    """(handle, label) for each kind of mark that the axes hold."""
    drawn = kinds([artist for ax in axes for artist in ax.get_children()])
    return [entry for kind, entry in _all().items() if kind in drawn]


def _all() -> dict[str, Entry]:
    return {
        "start": (Line2D([], [], **style.START), "start"),
        "goal": (Line2D([], [], **style.GOAL), "goal"),
        "end": (Line2D([], [], **style.END), "end of the run"),
        **{f"path:{mode.value}": (_path(mode), format_values.MODES[mode]) for mode in _MODES},
        "recorded": (Line2D([], [], **style.RECORDED), "path of the recorded run"),
        "obstacle": (disc(style.OBSTACLE), "obstacle, at closest pass"),
        "enlarged": (Line2D([], [], **_edge(style.ENLARGED)), "enlarged by the robot's radius"),
        "pass": (Line2D([], [], **style.PASS), "clearance at closest pass"),
        "track": (_track(), "obstacle's track"),
        "track_near_pass": (_track(), "obstacle's track near closest pass"),
        "ring": (disc({**style.RING, "facecolor": "none"}), "sensing range SR at the switch"),
        "sector": (Patch(**style.SECTOR), "sectors set at the switch"),
        "heading": (Patch(**style.SECTOR), "headings to a contact, at the switch"),
        "sensed": (Line2D([], [], **_edge(style.SENSED)), "enlarged obstacle at the switch"),
        "particle": (Line2D([], [], **style.PARTICLE), "robot, a particle"),
        "outline": (disc(style.OBSTACLE), "obstacle"),
        "robot": (disc(style.ROBOT), "robot"),
        "body": (disc(style.OBSTACLE), "obstacle; the arrow: its next 4 s"),
        "past": (Line2D([], [], **style.TRACK), "obstacle's track so far"),
        "reach": (disc({**style.RING, "facecolor": "none"}), "sensing range SR"),
        "set": (Patch(**style.SECTOR), "sectors set"),
        "closing": (Patch(**style.SECTOR), "headings to a contact"),
        "in_range": (Line2D([], [], **_edge(style.SENSED)), "enlarged obstacle within SR"),
        "returns": (Line2D([], [], **style.RETURNS_MARK), "returns of the lidar"),
        "moving": (Line2D([], [], **_edge(style.MOVING_TRACK)), "tracked, moving; next 2 s"),
        "resting": (Line2D([], [], **_edge(style.STANDING_TRACK)), "tracked, at rest"),
        "wish": (Line2D([], [], color=style.WISH["color"]), "what the planner wanted, 1 s"),
        "wall": (Line2D([], [], **style.WALL), "wall"),
        "limit": (Line2D([], [], **_edge(style.LIMIT)), "wall for obstacles only"),
    }


_MODES = (
    Mode.PATH_GENERATION,
    Mode.OBSTACLE_AVOIDANCE,
    Mode.BLOCKED,
    Mode.STOPPED,
    Mode.IDLE,
)


def _path(mode: Mode) -> Line2D:
    looks: style.Looks = {"color": style.MODE_COLOURS[mode]}
    if mode in style.STANDING:
        looks |= {**style.STANDING[mode], "linestyle": "none", "markersize": 9.0}
    return Line2D([], [], linewidth=style.MODE_WIDTHS.get(mode, style.MODE_WIDTH), **looks)


def _track() -> Line2D:
    return Line2D([], [], marker=">", markersize=5.0, markeredgewidth=0.0, **style.TRACK)


def disc(looks: style.Looks) -> Line2D:
    """The handle of a circle with this face and edge."""
    return Line2D(
        [],
        [],
        linestyle="none",
        marker="o",
        markersize=10.0,
        markerfacecolor=looks["facecolor"],
        markeredgecolor=looks["edgecolor"],
        markeredgewidth=looks["linewidth"],
    )


def _edge(looks: style.Looks) -> style.Looks:
    return {("color" if key == "edgecolor" else key): value for key, value in looks.items()}
