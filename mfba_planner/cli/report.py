# SPDX-License-Identifier: Apache-2.0
"""`mfba report`: runs as one page for a browser, to play and scrub; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from ..core.outputs import refuse_existing
from .named_episodes import add_paths, named_episodes

_DESCRIPTION = """Write runs as one HTML file that needs nothing else: no network, no ROS.

A bag is read. Of a result (`mfba sim --out`) the run is made again, and must take the decisions
that the result's digest stands for. A fleet's bag is one scene, seen with the eyes of
the robot that is chosen in it; with --robot NAME, and with other runs, they stand side by side."""


def main(args: list[str]) -> int:
    """Write the page."""
    parser = Parser(prog="mfba report", description=_DESCRIPTION)
    add_paths(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="HTML",
        default=Path("report.html"),
        help="file to create (default: report.html)",
    )
    found = parser.parse(args)
    from ..report.html.page import check_size, write_page

    check_size(len(found.paths))
    refuse_existing(found.out)
    named = named_episodes(found.paths, found.robots)
    write_page(named.runs, found.out, named.roster)
    print(f"wrote {found.out}")
    return 0
