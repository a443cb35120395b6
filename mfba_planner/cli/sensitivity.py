# SPDX-License-Identifier: Apache-2.0
"""`mfba sensitivity`: vary what the paper leaves open, compare results; needs no ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import new_run_directory, write_same
from ..paper import sensitivity
from ..paper.study.run import open_store
from ..report.figures.paper_figures import FORMATS
from ..scenarios.scenario_files import load_scenario
from .support.study_progress import add_arguments, check, run_with_progress

_DESCRIPTION = """Vary what section 6.2 leaves open, one parameter at a time, and compare path
lengths and encountered obstacles with the printed ones: a table, CSV, Markdown and a heat map.

Finished chunks of the runs are stored too: an interrupted command continues with --out DIR."""


def main(args: list[str]) -> int:
    """Run the study and print its table."""
    parser = Parser(prog="mfba sensitivity", description=_DESCRIPTION)
    add_arguments(parser)
    parsed = parser.parse(args)
    check(parsed)
    directory = parsed.out or new_run_directory(stem="sensitivity")
    scenarios = {case: load_scenario(case) for case in sensitivity.CASES}
    chunks = sensitivity.plan(scenarios, parsed.quick, parsed.seed)
    facts = {"study": "sensitivity", "seed": parsed.seed, "quick": parsed.quick}
    store = open_store(directory, chunks, facts)
    rows = sensitivity.rows(run_with_progress(chunks, parsed.workers, store), parsed.quick)
    seeds = sensitivity.QUICK_SEEDS if parsed.quick else sensitivity.SEEDS
    names = _write(directory, rows)
    _print_table(rows, f"Readings of section 6.2, {seeds} seeds from {parsed.seed} on")
    print(f"wrote {directory}: {', '.join(names)}")
    return 0


def _write(directory: Path, rows: Sequence[sensitivity.Row]) -> list[str]:
    """Write CSV, Markdown and heat map; existing files must have the same content."""
    from ..report import style
    from ..report.figure_sheet import to_bytes
    from ..report.figures.sensitivity_heat_map import draw
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


def _print_table(rows: Sequence[sensitivity.Row], title: str) -> None:
    from rich.console import Console

    from ..report.sensitivity_table import to_table
    from ..report.terminal_output import print_encodable

    console = Console()
    table = to_table(rows, title, console.width)
    print_encodable(console, lambda encodable: encodable.print(table))
