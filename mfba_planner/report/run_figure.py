# SPDX-License-Identifier: Apache-2.0
"""A run as a picture in the style of Fig. 7, with legend and result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from mfba_planner.core.output_files import write_new
from mfba_planner.evaluation.metrics import Result, evaluate
from mfba_planner.recording.perceived import Perceived
from mfba_planner.simulation.episode import Episode

from . import format_values, legend, style
from .draw_perceived import draw_perceived, draw_wishes, widened
from .draw_scene import draw_recorded_path, draw_scene, label_numbers
from .figure_sheet import to_bytes
from .run_events import Pass, closest_passes
from .scene_layout import SceneLayout
from .view_bounds import choose_view


def draw_run(episode: Episode, path: Path, perceived: Sequence[Perceived] = ()) -> None:
    """Write the picture of a run as PNG; the same episode gives the same bytes.

    perceived: what a real robot perceived; it is drawn with what its planner wanted. Raises
    OutputError when path exists already or cannot be written.
    """
    write_new(path, png_bytes(episode, perceived))


def png_bytes(episode: Episode, perceived: Sequence[Perceived] = ()) -> bytes:
    """The picture of a run as PNG, without date or version inside."""
    with style.context():
        return to_bytes(run_figure(episode, perceived=perceived), "png")


def draw_what_if(recorded: Episode, episode: Episode, change: str, path: Path) -> None:
    """Write the picture of a run and, beneath it, the path of the recorded run, as PNG.

    Raises OutputError when path exists already or cannot be written.
    """
    with style.context():
        figure = run_figure(episode, recorded, f"what if {change}")
        write_new(path, to_bytes(figure, "png"))


def run_figure(
    episode: Episode,
    recorded: Episode | None = None,
    subtitle: str = "",
    perceived: Sequence[Perceived] = (),
) -> Figure:
    """Compose head, world, panel and strip; call and save within style.context().

    The path of `recorded`, another run of the same world, is drawn beneath.
    """
    result, passes = evaluate(episode), closest_passes(episode)
    view, scale = choose_view(episode, passes)
    if perceived:
        view, scale = widened(view, perceived)
    layout = SceneLayout(view, scale)
    if episode.start_ns is not None:  # a real robot, which did not follow the planner
        draw_perceived(layout.ax, perceived)
        draw_wishes(layout.ax, episode)
    if recorded:
        draw_recorded_path(layout.ax, recorded)
    draw_scene(layout.ax, episode, view, passes, result.encounters)
    label_numbers(layout.ax, episode, view, passes)
    about = episode.scenario.description or f"{episode.driver} driver"
    layout.head(episode.scenario.name, subtitle or about)
    layout.legend(legend.entries(layout.ax))
    layout.rows("Closest pass, edge to edge", _pass_rows(passes, result))
    hidden = [str(p.number) for p in passes if not view.holds(p.center_m)]
    layout.note(f"outside the picture: {', '.join(hidden)}" if hidden else "")
    layout.strip(_cells(episode, result))
    return layout.figure


def _pass_rows(passes: Sequence[Pass], result: Result) -> list[tuple[str, str, str]]:
    encountered = sorted(
        (p for p in passes if p.number in result.encounters), key=lambda p: p.gap_m
    )
    return [
        (
            f"obstacle {p.number}",
            format_values.number(p.gap_m, 2, "m"),
            f"at {format_values.number(p.time_s, 1, 's')}",
        )
        for p in encountered
    ]


def _cells(episode: Episode, result: Result) -> list[tuple[str, str, str]]:
    """(label, value, colour) of the result strip."""
    touched = style.BAD if result.collisions else style.INK
    clearance, collisions = format_values.clearance(result), str(result.collisions)
    ended = style.GOOD if result.success else style.BAD
    if episode.start_ns is not None:  # of a real robot they are not recorded
        clearance = collisions = format_values.UNKNOWN
        ended = style.INK
    return [
        ("outcome", format_values.outcome(result), ended),
        ("length", format_values.length(result), style.INK),
        ("time", format_values.time(result), style.INK),
        ("min clearance", clearance, touched),
        ("collisions", collisions, touched),
        ("mode switches", str(result.mode_switches), style.INK),
        ("algorithm", episode.label, style.INK),
        ("seed", format_values.one_line(str(episode.seed), 12), style.INK),
    ]
