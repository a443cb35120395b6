# SPDX-License-Identifier: Apache-2.0
"""A fleet's run as one picture: all paths, and the smallest clearance of each robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure

from mfba_planner.core.output_files import write_new
from mfba_planner.evaluation.metrics import evaluate
from mfba_planner.simulation.episode import Episode
from mfba_planner.simulation.scenario import Scenario

from . import format_values, legend, style
from .draw_scene import draw_ends, draw_path, draw_walls
from .figure_sheet import to_bytes
from .run_events import is_finite
from .scene_layout import SceneLayout
from .view_bounds import View, fitted


def draw_fleet(scenario: Scenario, seed: int, runs: Mapping[str, Episode], path: Path) -> None:
    """Write the picture of a fleet's run as PNG; OutputError when path exists already.

    runs: {robot name: Episode}, for all robots of the fleet or some of them.
    """
    with style.context():
        write_new(path, to_bytes(_fleet_figure(scenario, seed, runs), "png"))


def _fleet_figure(scenario: Scenario, seed: int, runs: Mapping[str, Episode]) -> Figure:
    """Compose head, paths, panel and strip; call and save within style.context()."""
    names, episodes = list(runs), list(runs.values())
    results = [evaluate(episode) for episode in episodes]
    first = episodes[0].scenario
    view = View(*first.start_m, *first.start_m)
    for episode in episodes:
        view = view.around(episode.scenario.start_m, first.robot_radius_m)
        view = view.around(episode.scenario.goal_m, first.robot_radius_m)
        for tick in episode.ticks:
            if is_finite(tick.pose.position):
                view = view.around(tick.pose.position, first.robot_radius_m)
    layout = SceneLayout(*fitted(view.grown(first.robot_radius_m, first.robot_radius_m)))
    draw_walls(layout.ax, episodes[0])
    for name, episode in zip(names, episodes):
        draw_path(layout.ax, episode)
        draw_ends(layout.ax, episode, style.SMALL_START)
        x, y = episode.scenario.start_m
        layout.ax.text(x, y + 1.2 * first.robot_radius_m, name, **style.NUMBER)
    good = sum(result.success for result in results)
    layout.head(scenario.description or scenario.name, f"{len(episodes)} robots in one world")
    layout.legend(legend.entries(layout.ax))
    layout.rows(
        "Closest pass, edge to edge",
        [
            (
                name,
                format_values.number(result.min_clearance_m, 2, "m"),
                "" if result.success else format_values.outcome(result),
            )
            for name, result in zip(names, results)
        ],
    )
    layout.strip(
        [
            (
                "at the goal, untouched",
                f"{good} of {len(results)}",
                style.GOOD if good == len(results) else style.BAD,
            ),
            ("longest", f"{max(r.length_m for r in results):.2f} m", style.INK),
            ("last", f"{max(r.time_s for r in results):.1f} s", style.INK),
            ("min clearance", f"{min(r.min_clearance_m for r in results):.2f} m", style.INK),
            ("collisions", str(sum(r.collisions for r in results)), style.INK),
            ("algorithm", episodes[0].label, style.INK),
            ("seed", str(seed), style.INK),
        ]
    )
    return layout.figure
