# SPDX-License-Identifier: Apache-2.0
"""`mfba report`: write runs as one HTML page, with playback; needs no ROS."""

from __future__ import annotations

from pathlib import Path

from ..core.argument_parser import Parser
from ..core.output_files import file_type, refuse_existing
from .support.load_episodes import add_paths, named_episodes

_DESCRIPTION = """Write runs as one HTML file; it needs no network and no ROS.

A bag is read. A result (`mfba sim --out`) is simulated again, and must have the digest that the
result names. A fleet's bag becomes one scene; the page shows the sensor of the robot selected in
it. With --robot NAME, or with other runs, the runs are shown side by side."""


def main(args: list[str]) -> int:
    """Write the page."""
    parser = Parser(prog="mfba report", description=_DESCRIPTION)
    add_paths(parser)
    parser.add_argument(
        "--out",
        type=file_type("page", ".html"),
        metavar="HTML",
        default=Path("report.html"),
        help="file to create (default: report.html)",
    )
    parsed = parser.parse(args)
    from ..report.html.page import check_size, write_page

    check_size(len(parsed.paths))
    refuse_existing(parsed.out)
    named = named_episodes(parsed.paths, parsed.robots)
    write_page(named.runs, parsed.out, named.fleet_names, named.maps, named.perceived)
    print(f"wrote {parsed.out}")
    return 0
