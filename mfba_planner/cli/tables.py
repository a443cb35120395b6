# SPDX-License-Identifier: Apache-2.0
"""`mfba tables`: the paper's tables again, ours beside the printed; needs no ROS."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import InputError, OutputError
from ..core.outputs import new_run_directory, write_new, write_same
from ..paper.study.plan import FULL, QUICK
from ..paper.study.run import open_store
from ..paper.tables.build import SECTIONS, build, check_sections, plan
from ..paper.tables.model import Section
from ..report.figures.paper_figures import FIGURES, render
from ..report.tables import data, html, markdown
from ..report.tables.text import Origin
from ..scenarios.scenario_files import load_scenario
from .study_progress import add_arguments, check, run_watched

_DESCRIPTION = """Run what Tables 1 to 7 need and hold each printed number against ours.

Everything goes into a directory: Markdown, CSV, JSON, one HTML page, and the finished parts of
the runs, so that an interrupted command goes on where it was when called again with --out."""


def main(args: list[str]) -> int:
    """Make the tables."""
    parser = Parser(prog="mfba tables", description=_DESCRIPTION)
    parser.add_argument(
        "tables", nargs="*", metavar="TABLE", help=f"which: {', '.join(SECTIONS)} (default: all)"
    )
    add_arguments(parser)
    parser.add_argument(
        "--update", type=Path, metavar="PAGE", help="fill the generated blocks of this page too"
    )
    found = parser.parse(args)
    sections = check_sections(found.tables)
    check(found)
    page = None if found.update is None else _page(found.update, sections)
    directory = found.out or new_run_directory(stem="tables")
    words = ["mfba", "tables", *found.tables, *(["--quick"] if found.quick else [])]
    origin = Origin(
        command=shlex.join(words + (["--seed", str(found.seed)] if found.seed else [])),
        seed=found.seed,
        quick=found.quick,
    )
    made = _make(sections, found.quick, found.seed, found.workers, directory)
    _write(directory, made, origin)
    if page is not None:
        _update(found.update, markdown.fill(page, markdown.blocks(made, origin)))
    _show(made, origin)
    print(f"wrote {directory}: tables.html, tables.md, tables.csv, tables.json")
    return 0


def _make(
    sections: Sequence[str], quick: bool, seed: int, workers: int, directory: Path
) -> list[Section]:
    scenarios = {name: load_scenario(name) for name in ("case1", "case2")}
    chunks = plan(sections, scenarios, QUICK if quick else FULL, seed)
    store = open_store(
        directory, chunks, {"sections": list(sections), "seed": seed, "quick": quick}
    )
    samples = run_watched(chunks, workers, store)
    return build(sections, scenarios, samples, seed)


def _write(directory: Path, sections: Sequence[Section], origin: Origin) -> None:
    """Every form; what is there already must be the same. Figures go with the whole set."""
    whole = len(sections) == len(SECTIONS)
    pictures = _pictures(origin.quick) if whole else []
    forms = {
        "tables.md": markdown.page(sections, origin),
        "tables.csv": data.to_csv(sections),
        "tables.json": data.to_json(sections, origin),
        "tables.html": html.page(sections, origin, pictures),
    }
    for name, content in forms.items():
        write_same(directory / name, content.encode())


def _pictures(quick: bool) -> list[html.Picture]:
    """What `mfba figures` draws; the quick form does without the one that takes longest."""
    return [
        html.Picture(title=f"{name}: {what}", svg=render(name, ("svg",))["svg"].decode())
        for name, what in FIGURES.items()
        if not (quick and name == "convergence")
    ]


def _page(path: Path, sections: Sequence[str]) -> str:
    """A page that has a place for every block; seen to before the minutes of running."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise InputError(
            f"{path}: cannot be read ({reason.lower()}); give a Markdown page"
        ) from None
    markdown.fill(text, dict.fromkeys(markdown.block_names(sections), ""))
    return text


def _update(path: Path, content: str) -> None:
    """Replace a page, whole."""
    new = path.with_name(f"{path.name}.new")
    try:
        write_new(new, content.encode())
        os.replace(new, path)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); give a writable page"
        ) from None
    finally:
        new.unlink(missing_ok=True)


def _show(sections: Sequence[Section], origin: Origin) -> None:
    from rich.console import Console

    from ..report.tables.terminal import show

    show(Console(), sections, origin)
