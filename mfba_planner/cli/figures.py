# SPDX-License-Identifier: Apache-2.0
"""`mfba figures`: reproduce the paper's figures, as SVG and PNG; needs no ROS."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import ConfigError
from ..core.option_specs import did_you_mean
from ..core.output_files import new_run_directory, refuse_existing, write_new
from ..launcher.run_directory import RunDirectory
from ..report.figures.paper_figures import FIGURES, FORMATS, render
from .support.progress_bar import progress_bar

_DESCRIPTION = "Reproduce the paper's figures; the same version writes the same bytes."


def main(args: list[str]) -> int:
    """Draw the figures into a new directory."""
    parser = Parser(prog="mfba figures", description=_DESCRIPTION, epilog=_epilog())
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", default=list(FIGURES), help="these figures only"
    )
    parser.add_argument(
        "--format",
        default=",".join(FORMATS),
        metavar="FORMATS",
        help="svg, png or both with a comma (default: %(default)s)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory to create (default: runs/figures-NNN)"
    )
    parsed = parser.parse(args)
    names = _known("figure", parsed.only, FIGURES)
    forms = _known("format", parsed.format.split(","), FORMATS)
    out = new_run_directory(stem="figures") if parsed.out is None else refuse_existing(parsed.out)
    files: dict[str, bytes] = {}
    with progress_bar("drawing") as show:
        for count, name in enumerate(names):
            show(count, len(names))
            files |= {f"{name}.{form}": data for form, data in render(name, forms).items()}
    directory = RunDirectory(out)
    with directory.discarded_on_error():
        for name, data in files.items():
            write_new(out / name, data)
    print(f"wrote {out}: {', '.join(files)}")
    return 0


def _known(kind: str, given: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    """The given names without repetition; ConfigError for an unknown name."""
    wanted = tuple(dict.fromkeys(given))
    for name in wanted:
        if name not in known:
            raise ConfigError(f"{name!r}: no such {kind}; {did_you_mean(name, list(known))}")
    return wanted


def _epilog() -> str:
    width = max(map(len, FIGURES))
    return "figures:\n" + "\n".join(f"  {name:<{width}}  {what}" for name, what in FIGURES.items())
