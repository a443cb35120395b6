# SPDX-License-Identifier: Apache-2.0
"""A run's result as a table for terminals and logs."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from mfba_planner.evaluation.metrics import Result
from mfba_planner.simulation.episode import Episode, Outcome

from . import format_values

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

_ROOM_FOR_REMARKS = 60  # columns
_MARGIN = 2  # columns at the right of the last one
Row = tuple[str, str, str]


def result_rows(
    episode: Episode,
    result: Result,
    ticks_per_s: float | None = None,
    *,
    names: Sequence[str] = (),
) -> Iterator[Row]:
    """Yield (name, value, remark) for each line of the table; names: those of the obstacles."""
    yield "outcome", format_values.outcome(result), _why_no_success(result)
    yield "length", format_values.length(result), _excess(episode, result)
    is_real = episode.start_ns is not None  # a recorded drive of a robot
    yield "time", format_values.time(result), "recorded" if is_real else "simulated"
    yield "fitness", format_values.fitness(result), "1 / length"
    if is_real:
        for name in ("min clearance", "collisions", "encounters"):
            yield name, format_values.UNKNOWN, "not in the recording"
    else:
        between = "edge to edge" if math.isfinite(result.min_clearance_m) else ""
        yield "min clearance", format_values.clearance(result), between
        yield "collisions", str(result.collisions), ""
        yield "encounters", str(len(result.encounters)), _encountered(result, names)
    yield "mode switches", str(result.mode_switches), _ticks_by_mode(result)
    rate = "" if ticks_per_s is None else f"{format_values.number(ticks_per_s, 0)} ticks/s"
    yield "ticks", str(result.ticks), rate


def _why_no_success(result: Result) -> str:
    reached = result.outcome is Outcome.GOAL_REACHED
    return "but not without collision" if reached and not result.success else ""


def _excess(episode: Episode, result: Result) -> str:
    straight = format_values.straight_m(episode)
    line = f"straight line {format_values.number(straight, 3, 'm')}"
    if result.outcome is not Outcome.GOAL_REACHED:
        return line
    excess = 100.0 * (result.length_m / straight - 1.0)
    return f"{line} ({excess:+.1f} %)"


def _encountered(result: Result, names: Sequence[str] = ()) -> str:
    """What was encountered: obstacles by number, robots by name."""
    encountered = [names[number - 1] if names else str(number) for number in result.encounters]
    numbers = [name for name in encountered if name.isdecimal()]
    plural = "s" if len(numbers) > 1 else ""
    texts = [f"obstacle{plural} {', '.join(numbers)}"] if numbers else []
    return ", ".join(texts + [name for name in encountered if not name.isdecimal()])


def _ticks_by_mode(result: Result) -> str:
    counts = (
        (result.avoidance_ticks, "avoiding"),
        (result.blocked_ticks, "blocked"),
        (result.stopped_ticks, "stopped"),
    )
    texts = [f"{count} {name}" for count, name in counts if count]
    return f"ticks: {', '.join(texts)}" if texts else ""


def result_table(
    episode: Episode, result: Result, ticks_per_s: float | None = None, *, remarks: bool = True
) -> Table:
    """The result as a rich table, titled with scenario, algorithm, seed and driver."""
    from rich.table import Table
    from rich.text import Text

    title = Text(format_values.run_title(episode), style="bold")
    table = Table(title=title, title_justify="left", box=None, show_header=False, padding=(0, 2))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(no_wrap=True)
    if remarks:
        table.add_column(style="dim")
    good = {"outcome": result.success, "collisions": result.collisions == 0}
    for name, figure, remark in result_rows(episode, result, ticks_per_s):
        style = {True: "bold green", False: "bold red", None: ""}[good.get(name)]
        table.add_row(name, Text(figure, style=style), *([remark] if remarks else []))
    return table


def result_text(
    episode: Episode, result: Result, ticks_per_s: float | None = None, width: int = 80
) -> str:
    """The table as plain text without colour, for logs; at most width columns."""
    rows = [*result_rows(episode, result, ticks_per_s)]
    names, figures = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [format_values.run_title(episode)]
    lines += [f"  {name:<{names}}    {figure:<{figures}}    {note}" for name, figure, note in rows]
    plain = all(line.isascii() and line.isprintable() for line in lines)
    if plain and max(map(len, lines)) + _MARGIN <= width:
        return "".join(f"{line.rstrip()}\n" for line in lines)
    # Too narrow, or characters of other widths.
    from rich.console import Console

    sink = io.StringIO()
    console = Console(file=sink, width=width, color_system=None)
    print_result(console, episode, result, ticks_per_s)
    return "".join(f"{line.rstrip()}\n" for line in sink.getvalue().splitlines())


def print_result(
    console: Console, episode: Episode, result: Result, ticks_per_s: float | None = None
) -> None:
    """Print the table with the console's width, colours and encoding."""
    from .terminal_output import print_encodable

    remarks = console.width >= _ROOM_FOR_REMARKS
    table = result_table(episode, result, ticks_per_s, remarks=remarks)
    print_encodable(console, lambda encodable: encodable.print(table))


def comparison_text(left: tuple[str, Result], right: tuple[str, Result]) -> str:
    """Two results side by side as plain text; lines that differ are marked with >."""
    (left_name, a), (right_name, b) = left, right
    rows = [
        ("outcome", format_values.outcome(a), format_values.outcome(b)),
        ("length", format_values.length(a), format_values.length(b)),
        ("time", format_values.time(a), format_values.time(b)),
        ("min clearance", format_values.clearance(a), format_values.clearance(b)),
        ("collisions", str(a.collisions), str(b.collisions)),
        ("mode switches", str(a.mode_switches), str(b.mode_switches)),
        ("ticks", str(a.ticks), str(b.ticks)),
    ]
    width = max(len(left_name), *(len(row[1]) for row in rows))
    lines = [f"  {'':<14}{left_name:<{width}}  {right_name}"]
    for name, one, other in rows:
        lines.append(f"{' ' if one == other else '>'} {name:<14}{one:<{width}}  {other}")
    return "\n".join(lines)
