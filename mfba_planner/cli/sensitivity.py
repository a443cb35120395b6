# SPDX-License-Identifier: Apache-2.0
"""`mfba sensitivity`: what hangs on what the paper does not say; needs no ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.outputs import new_run_directory, write_same
from ..paper import sensitivity
from ..paper.study.run import open_store
from ..report.figures.paper_figures import FORMATS
from ..scenarios.scenario_files import load_scenario
from .study_progress import add_arguments, check, run_watched

_DESCRIPTION = """Change what section 6.2 leaves open, one thing at a time, and see what becomes of
the printed path lengths and of whom the robot meets: a table, CSV, Markdown and a heat-map.

The finished parts of the runs are kept too, so that an interrupted command goes on where it was
when called again with --out."""


def main(args: list[str]) -> int:
    """Run the study and show it."""
    parser = Parser(prog="mfba sensitivity", description=_DESCRIPTION)
    add_arguments(parser)
    found = parser.parse(args)
    check(found)
    directory = found.out or new_run_directory(stem="sensitivity")
    scenarios = {case: load_scenario(case) for case in sensitivity.CASES}
    chunks = sensitivity.plan(scenarios, found.quick, found.seed)
    facts = {"study": "sensitivity", "seed": found.seed, "quick": found.quick}
    store = open_store(directory, chunks, facts)
    rows = sensitivity.rows(run_watched(chunks, found.workers, store), found.quick)
    seeds = sensitivity.QUICK_SEEDS if found.quick else sensitivity.SEEDS
    names = _write(directory, rows)
    _show(rows, f"Readings of section 6.2, {seeds} seeds from {found.seed} on")
    print(f"wrote {directory}: {', '.join(names)}")
    return 0


def _write(directory: Path, rows: Sequence[sensitivity.Row]) -> list[str]:
    """CSV, Markdown and heat-map; what is there already must be the same."""
    from ..report import style
    from ..report.figure_sheet import to_bytes
    from ..report.figures.sensitivity import draw
    from ..report.sensitivity_table import to_csv, to_markdown

    files = {
        "sensitivity.csv": to_csv(rows).encode(),
        "sensitivity.md": to_markdown(rows).encode(),
    }
    with style.context():
        figure = draw(rows)
        files |= {f"sensitivity.{form}": to_bytes(figure, form) for form in FORMATS}
    for name, data in files.items():
        write_same(directory / name, data)
    return list(files)


def _show(rows: Sequence[sensitivity.Row], title: str) -> None:
    from rich.console import Console

    from ..report.sensitivity_table import to_table
    from ..report.terminal_output import print_encodable

    console = Console()
    table = to_table(rows, title, console.width)
    print_encodable(console, lambda encodable: encodable.print(table))
