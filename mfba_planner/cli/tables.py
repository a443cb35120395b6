# SPDX-License-Identifier: Apache-2.0
"""`mfba tables`: reproduce the paper's tables beside the printed values; needs no ROS."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import new_run_directory, write_same
from ..paper.study.plan import FULL, QUICK
from ..paper.study.run import open_store
from ..paper.tables.build_tables import SECTIONS, build, check_sections, plan
from ..paper.tables.table_entries import Section
from ..report.figures.paper_figures import FIGURES, render
from ..report.tables import html, json_and_csv, markdown
from ..report.tables.text import Origin
from ..scenarios.scenario_files import load_scenario
from .support.page_blocks import read_page, replace_file
from .support.study_progress import add_arguments, check, run_with_progress

_DESCRIPTION = """Reproduce Tables 1 to 7 and compare each printed number with ours.

Writes a directory: Markdown, CSV, JSON, one HTML page, and the finished chunks of the runs: an
interrupted command continues with --out DIR."""


def main(args: list[str]) -> int:
    """Compute and write the tables."""
    parser = Parser(prog="mfba tables", description=_DESCRIPTION)
    parser.add_argument(
        "tables", nargs="*", metavar="TABLE", help=f"one of {', '.join(SECTIONS)} (default: all)"
    )
    add_arguments(parser)
    parser.add_argument(
        "--update",
        type=Path,
        metavar="PAGE",
        help="also fill the generated blocks of this Markdown page",
    )
    parsed = parser.parse(args)
    sections = check_sections(parsed.tables)
    check(parsed)
    page = (
        None if parsed.update is None else read_page(parsed.update, markdown.block_names(sections))
    )
    directory = parsed.out or new_run_directory(stem="tables")
    arguments = ["mfba", "tables", *parsed.tables, *(["--quick"] if parsed.quick else [])]
    origin = Origin(
        command=shlex.join(arguments + (["--seed", str(parsed.seed)] if parsed.seed else [])),
        seed=parsed.seed,
        quick=parsed.quick,
    )
    computed = _compute_tables(sections, parsed.quick, parsed.seed, parsed.workers, directory)
    _write_forms(directory, computed, origin)
    if page is not None:
        filled = markdown.fill(page, markdown.blocks(computed, origin))
        replace_file(parsed.update, filled.encode())
    _print_table(computed, origin)
    print(f"wrote {directory}: tables.html, tables.md, tables.csv, tables.json")
    return 0


def _compute_tables(
    sections: Sequence[str], quick: bool, seed: int, workers: int, directory: Path
) -> list[Section]:
    scenarios = {name: load_scenario(name) for name in ("case1", "case2")}
    chunks = plan(sections, scenarios, QUICK if quick else FULL, seed)
    store = open_store(
        directory, chunks, {"sections": list(sections), "seed": seed, "quick": quick}
    )
    samples = run_with_progress(chunks, workers, store)
    return build(sections, scenarios, samples, seed)


def _write_forms(directory: Path, sections: Sequence[Section], origin: Origin) -> None:
    """Write each format; existing files must be the same. All tables: HTML with figures."""
    has_all = len(sections) == len(SECTIONS)
    pictures = _figures(origin.quick) if has_all else []
    forms = {
        "tables.md": markdown.page(sections, origin),
        "tables.csv": json_and_csv.to_csv(sections),
        "tables.json": json_and_csv.to_json(sections, origin),
        "tables.html": html.page(sections, origin, pictures),
    }
    for name, content in forms.items():
        write_same(directory / name, content.encode())


def _figures(quick: bool) -> list[html.Picture]:
    """The figures of `mfba figures`; --quick leaves out the slowest one."""
    return [
        html.Picture(title=f"{name}: {what}", svg=render(name, ("svg",))["svg"].decode())
        for name, what in FIGURES.items()
        if not (quick and name == "convergence")
    ]


def _print_table(sections: Sequence[Section], origin: Origin) -> None:
    from rich.console import Console

    from ..report.tables.terminal import show

    show(Console(), sections, origin)
