# SPDX-License-Identifier: Apache-2.0
"""Pictures of docs/benchmark.md."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmark_costs import NAMES, STEPWISE, Costs
from benchmark_runs import (
    DWA,
    INGREDIENTS,
    ORCA,
    PAPER,
    PREDICTIVE,
    PREDICTIVE_KNOWN,
    STRIPPED,
    Counts,
    Entry,
    Results,
)
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

from mfba_planner.evaluation.statistics import Interval
from mfba_planner.evaluation.sweep.explain_run import contact_index, explain
from mfba_planner.evaluation.sweep.single_run import run_one
from mfba_planner.evaluation.sweep.sweep_spec import Run
from mfba_planner.evaluation.sweep.table_columns import Row
from mfba_planner.report import style
from mfba_planner.report.figure_sheet import EDGE, Sheet, to_bytes
from mfba_planner.report.run_figure import run_figure
from mfba_planner.report.tick_figure import tick_png

DRAWN = (PAPER, PREDICTIVE, PREDICTIVE_KNOWN, ORCA, DWA)
LOOKS: dict[str, dict[str, Any]] = {
    "paper": {"color": style.ORANGE, "marker": "s"},
    "predictive": {"color": style.BLUE, "marker": "o"},
    "predictive, known": {"color": style.SKY, "marker": "P"},
    "orca": {"color": style.VERMILLION, "marker": "^"},
    "dwa": {"color": style.GREEN, "marker": "D"},
    STEPWISE: {"color": style.PURPLE, "marker": "v"},
}
# where wins are looked for first: many obstacles make telling pictures
CLEAR = ("adversarial",)  # with few obstacles, so that whole paths are visible
EXAMPLES = ("random-20", "random-30", "random-10", "adversarial", "fast-10", "fast-20", "dense")
_SUCCESS, _LONGER = "reached without collision (%)", "longer than the optimum (%)"
_W, _H, _AXIS, _HEAD, _LEGEND = 3.4, 2.6, 0.6, 0.55, 1.2  # inches


@dataclass(frozen=True, slots=True)
class Example:
    """A picture of a run, and how it is shown."""

    words: str
    command: str
    file: str


def write_pictures(
    results: Results, suites: Sequence[str], counts: Counts, costs: Costs, images: Path
) -> list[Example]:
    """Write all of them; those of examples are returned."""
    with style.context():
        _write(images / "benchmark.png", _headline(results, suites, counts))
        stripped = [suite for suite in suites if suite in STRIPPED]
        if stripped:
            _write(images / "benchmark-ablation.png", _ablation(results, stripped, counts))
        _write(images / "benchmark-cost.png", _cost(costs))
        return [
            example
            for winner, loser in ((PREDICTIVE, ORCA), (ORCA, PREDICTIVE))
            for example in _example(results, suites, counts, winner, loser, images)
        ]


def _write(path: Path, figure: Figure) -> None:
    path.write_bytes(to_bytes(figure, "png"))


def _panels(
    count: int, title: str, subtitle: str, left: float, right: float
) -> tuple[Sheet, list[Axes]]:
    width = left + count * (_W + _AXIS) + right
    sheet = Sheet(width, _AXIS + _H + _HEAD + EDGE)
    sheet.head(title, subtitle)
    axes = [sheet.axes(left + k * (_W + _AXIS), _AXIS, _W, _H) for k in range(count)]
    return sheet, axes


def _legend(sheet: Sheet, ax: Axes, width: float) -> None:
    handles, labels = ax.get_legend_handles_labels()
    entries: list[Any] = list(zip(handles, labels))
    sheet.legend(entries, sheet.width - width, _AXIS + _H)


def _headline(results: Results, suites: Sequence[str], counts: Counts) -> Figure:
    crowds = [suite for suite in suites if suite.startswith("random-")]
    worlds = sorted({counts.lead(suite) for suite in crowds})
    sheet, axes = _panels(
        3,
        "Success, length and time by number of obstacles",
        f"random worlds of 12 x 12 m, {' or '.join(map(str, worlds))} each, from a lidar; "
        "known: told the truth within SR; 95 % intervals",
        EDGE + _AXIS,
        _LEGEND + 0.5,
    )
    x = [int(suite.partition("-")[2]) for suite in crowds]
    for entry in DRAWN:
        each = [(suite, entry, counts.lead(suite)) for suite in crowds]
        found = [results.standing(*one) for one in each]
        _line(axes[0], x, [s.success for s in found], entry.label)
        _line(axes[1], x, [s.gap for s in found], entry.label)
        _line(axes[2], x, [results.standing(*one, timed=True).gap for one in each], entry.label)
    labels = (_SUCCESS, _LONGER, "later than the optimum (%)")
    for ax, label in zip(axes, labels):
        ax.set_xlabel("obstacles")
        ax.set_ylabel(label)
        ax.set_xlim(left=0)
        ax.set_xticks(x)
    for ax in axes[1:]:
        ax.set_yscale("symlog", linthresh=1.0)
        ax.set_ylim(bottom=-0.1)
        _percents(ax.yaxis)
    _legend(sheet, axes[0], _LEGEND + 0.5)
    return sheet.figure


def _percents(axis: Any) -> None:
    """Straight up to 1 %, beyond that logarithmic."""
    _plain(axis)
    axis.set_major_locator(FixedLocator([0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]))


def _plain(axis: Any) -> None:
    """Logarithms with ordinary numbers: the house style knows no formulas."""
    axis.set_major_locator(LogLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _line(ax: Axes, x: Sequence[float], y: Sequence[Interval | None], label: str) -> None:
    some = [(k, i) for k, i in zip(x, y) if i is not None]
    _bars(
        ax, [k for k, _ in some], [i for _, i in some], vertical=True, label=label, **LOOKS[label]
    )


def _bars(
    ax: Axes,
    positions: Sequence[float],
    found: Sequence[Interval],
    *,
    vertical: bool,
    **looks: Any,
) -> None:
    middle = [100.0 * i.middle for i in found]
    error = [
        [100.0 * (i.middle - i.low) for i in found], [100.0 * (i.high - i.middle) for i in found]
    ]  # fmt: skip
    more: dict[str, Any] = {"markersize": 5.0, "linewidth": 1.4, "capsize": 2.0}
    if vertical:
        ax.errorbar(positions, middle, yerr=error, **looks, **more)
    else:
        ax.errorbar(middle, positions, xerr=error, linestyle="none", **looks, **more)


def _ablation(results: Results, suites: Sequence[str], counts: Counts) -> Figure:
    sheet, axes = _panels(
        2,
        "What each ingredient buys",
        f"{counts.rest(suites[0])} worlds of each suite; 95 % intervals",
        2.6,
        _LEGEND,
    )
    shades = ((style.SKY, "o"), (style.BLUE, "s"), (style.PURPLE, "^"))
    for k, suite in enumerate(suites):
        found = [results.standing(suite, entry, counts.rest(suite)) for entry in INGREDIENTS]
        colour, marker = shades[k]
        looks: dict[str, Any] = {"color": colour, "marker": marker, "label": suite}
        judged: list[list[Interval | None]] = [[s.success for s in found], [s.gap for s in found]]
        for ax, intervals in zip(axes, judged):
            some = [(n + 0.2 * (k - 1), i) for n, i in enumerate(intervals) if i is not None]
            positions, shown = [n for n, _ in some], [i for _, i in some]
            _bars(ax, positions, shown, vertical=False, **looks)
    for ax, what in zip(axes, (_SUCCESS, _LONGER)):
        ax.set_xlabel(what)
        ax.set_ylim(len(INGREDIENTS) - 0.5, -0.5)
        ax.set_yticks(range(len(INGREDIENTS)), [entry.label for entry in INGREDIENTS])
    axes[1].set_xscale("symlog", linthresh=1.0)
    axes[1].set_xlim(left=-0.1)
    _percents(axes[1].xaxis)
    axes[1].set_yticklabels([])
    _legend(sheet, axes[1], _LEGEND)
    return sheet.figure


def _cost(costs: Costs) -> Figure:
    names, nearer = _LEGEND + 0.7, 0.4  # no other panel's axis comes in between
    sheet, (ax,) = _panels(1, "One decision", "median, all in turn", EDGE + _AXIS, names)
    for name in NAMES:
        label = f"{name}: count^{costs.slope(name):.2f}"
        ax.loglog(costs.counts, costs.median_us[name], label=label, markersize=5.0, **LOOKS[name])
    ax.set_xlabel("obstacles in range")
    for axis in (ax.xaxis, ax.yaxis):
        _plain(axis)
    ax.set_ylabel("us")
    _legend(sheet, ax, names + nearer)
    return sheet.figure


def _example(
    results: Results,
    suites: Sequence[str],
    counts: Counts,
    winner: Entry,
    loser: Entry,
    images: Path,
) -> Iterator[Example]:
    found = [
        (suite, world)
        for suite in EXAMPLES
        if suite in suites
        for world in _won(results, suite, winner, loser, counts.lead(suite))
    ]
    if not found:
        yield from _shorter(results, suites, counts, winner, loser, images)
        return
    suite, world = found[0]
    run = Run(suite, world, loser.planner, 0)
    rerun = run_one(run, loser.at(suite))
    headline = explain(rerun)[0]
    index = contact_index(rerun.episode)
    assert index is not None, "it collided in the sweep"
    file = f"benchmark-{winner.label}-wins.png"
    (images / file).write_bytes(tick_png(rerun.episode, index, str(run), [headline]))
    directory = results.directories[suite, loser.planner, loser.setting]
    words = f"Worlds where {winner.label} arrives and {loser.label} collides: {len(found)}"
    yield Example(f"{words}. The first: {headline}", f"mfba show {directory} {run}", file)


def _shorter(
    results: Results,
    suites: Sequence[str],
    counts: Counts,
    winner: Entry,
    loser: Entry,
    images: Path,
) -> Iterator[Example]:
    """Where the winner never wins by arriving: the world in which its path is shorter by most."""
    found: list[tuple[float, str, int]] = [
        (100.0 * (b["gap"] - a["gap"]), suite, a["world"])
        for suite in [name for name in CLEAR if name in suites][:1]
        for a, b in zip(*(results.of(0, suite, e, counts.lead(suite)) for e in (winner, loser)))
        if a["success"] and b["success"] and a["gap"] is not None
    ]
    if not found or max(found)[0] <= 0.0:
        return
    points, suite, world = max(found)
    run = Run(suite, world, loser.planner, 0)
    episodes = [
        run_one(Run(suite, world, e.planner, 0), e.at(suite)).episode for e in (winner, loser)
    ]
    file = f"benchmark-{winner.label}-wins.png"
    legend = f"dash-dotted: {loser.label}, {points:.0f} points longer"
    figure = run_figure(episodes[0], episodes[1], f"{winner.label}; {legend}")
    figure.set_dpi(80)
    _write(images / file, figure)
    directory = results.directories[suite, loser.planner, loser.setting]
    yield Example(
        f"Worlds where {winner.label} arrives and {loser.label} collides: none. Its way in "
        f"{suite} is shorter by most, {points:.0f} points of gap, in world {world} (dash-dotted: "
        f"{loser.label})",
        f"mfba show {directory} {run}",
        file,
    )


def _won(results: Results, suite: str, winner: Entry, loser: Entry, worlds: int) -> Iterator[int]:
    lost: dict[int, Row] = {
        row["world"]: row for row in results.of(0, suite, loser, worlds) if row["collisions"]
    }
    for row in results.of(0, suite, winner, worlds):
        if row["success"] and row["world"] in lost:
            yield row["world"]
